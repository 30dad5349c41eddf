//! Where a picture is taken from.

use anyhow::{Result, bail};
use tercet::Mesh;

use super::normals::{dot, unit};
use super::{SUPERSAMPLING, Size};

/// Half of the angle of view, as a tangent: a long lens, which does not distort.
const HALF_VIEW: f64 = 0.25;
/// The part of the picture that the surface fills.
const FILLED: f64 = 0.92;

/// Which axis points up, and whether its negative end does.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Up {
    /// 0, 1 or 2.
    pub axis: usize,
    pub negative: bool,
}

impl Up {
    /// Reads "x", "y", "z", "-x", "-y" or "-z".
    pub fn parse(text: &str) -> Option<Self> {
        let axis = ["x", "y", "z"].into_iter().position(|name| name == text.trim_start_matches('-'))?;
        let negative = text.starts_with('-');
        (text.len() <= 2).then_some(Up { axis, negative })
    }
}

/// What is to the right, up and forward, out of the front, in a mesh's own coordinates.
///
/// With y up the front is z, with z up it is −y: as programs expect that have the one or the other. A
/// negative end turns all but the front by half a turn.
pub fn axes_of(Up { axis, negative }: Up) -> [[f64; 3]; 3] {
    let [right, up, forward] = match axis {
        0 => [[0.0, 0.0, 1.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]],
        1 => [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]],
        _ => [[1.0, 0.0, 0.0], [0.0, 0.0, 1.0], [0.0, -1.0, 0.0]],
    };
    let sign = if negative { -1.0 } else { 1.0 };
    [right.map(|x| sign * x), up.map(|x| sign * x), forward]
}

/// The direction of sight, in degrees.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct View {
    /// To the right around the upward axis.
    pub azimuth: f64,
    /// Above the horizon.
    pub elevation: f64,
    pub up: Up,
}

/// A perspective camera that sees the whole of the mesh it was fitted to.
///
/// View space: x to the right, y up, z towards the camera, which stands on the z-axis.
#[derive(Clone, Debug)]
pub struct Camera {
    /// The axes of view space.
    axes: [[f64; 3]; 3],
    centre: [f64; 3],
    /// From the camera to the centre.
    distance: f64,
    /// Samples for a tangent of 1.
    focal: f64,
    /// The centre of the picture, in samples.
    middle: [f64; 2],
}

impl Camera {
    /// A camera for pictures whose surface takes up `size`; the picture itself may be wider to the
    /// right.
    ///
    /// # Errors
    /// If the mesh has no faces to be seen.
    pub fn fit(mesh: &Mesh, view: &View, size: Size) -> Result<Self> {
        if mesh.faces.is_empty() {
            bail!("it has no faces to draw");
        }
        let mut camera = Camera::towards(view, size);
        let referenced = || mesh.faces.iter().flatten().map(|&v| mesh.positions[v as usize]);
        for axis in 0..3 {
            let along = || referenced().map(|p| dot(camera.axes[axis], p.map(f64::from)));
            let (low, high) =
                along().fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), x| (l.min(x), h.max(x)));
            camera.centre[axis] = 0.5 * (low + high);
        }
        // Seen from the distance that the farthest reaching vertex asks for, the picture's middle is
        // not the box's: once more, with the middle of what is seen.
        camera.step_back(referenced(), size);
        let seen = |camera: &Camera, k: usize| {
            let sides = referenced().map(|p| camera.to_view(p)).map(|p| p[k] / (camera.distance - p[2]));
            sides.fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), x| (l.min(x), h.max(x)))
        };
        let shift = [0, 1].map(|k| {
            let (low, high) = seen(&camera, k);
            0.5 * (low + high) * camera.distance
        });
        camera.centre[0] += shift[0];
        camera.centre[1] += shift[1];
        camera.step_back(referenced(), size);
        Ok(camera)
    }

    /// The axes for a view; nothing is fitted yet.
    pub fn towards(view: &View, size: Size) -> Self {
        let (sin_a, cos_a) = view.azimuth.to_radians().sin_cos();
        let (sin_e, cos_e) = view.elevation.to_radians().sin_cos();
        // To the right, up and forward.
        let axes = [
            [cos_a, 0.0, -sin_a],
            [-sin_a * sin_e, cos_e, -cos_a * sin_e],
            [sin_a * cos_e, sin_e, cos_a * cos_e],
        ];
        let world = axes_of(view.up);
        let axes = axes.map(|axis: [f64; 3]| {
            std::array::from_fn(|k| (0..3).map(|direction| axis[direction] * world[direction][k]).sum())
        });
        let samples = |pixels: usize| (pixels * SUPERSAMPLING) as f64;
        let (width, height) = (samples(size.width), samples(size.height));
        Camera {
            axes,
            centre: [0.0; 3],
            distance: 1.0,
            focal: 0.5 * width.min(height) / HALF_VIEW,
            middle: [0.5 * width, 0.5 * height],
        }
    }

    /// Moves away until every position is in the picture.
    fn step_back(&mut self, positions: impl Iterator<Item = [f32; 3]>, size: Size) {
        let shorter = size.width.min(size.height) as f64;
        let reach = [size.width, size.height].map(|side| FILLED * HALF_VIEW * side as f64 / shorter);
        let (mut distance, mut extent) = (0.0f64, 0.0f64);
        for p in positions {
            let [x, y, z] = self.to_view(p);
            distance = distance.max(z + x.abs() / reach[0]).max(z + y.abs() / reach[1]);
            extent = extent.max(x.abs()).max(y.abs()).max(z.abs());
        }
        // A point has no extent, and is seen from anywhere.
        self.distance = if extent > 0.0 { distance } else { 1.0 };
    }

    /// A position in view space.
    pub fn to_view(&self, p: [f32; 3]) -> [f64; 3] {
        let p = p.map(f64::from);
        std::array::from_fn(|k| dot(self.axes[k], p) - self.centre[k])
    }

    /// Where a position of view space is in the picture, in samples from its upper left corner, and the
    /// inverse of its distance along the line of sight, which is linear over the picture. `None` behind
    /// the camera.
    pub fn project(&self, [x, y, z]: [f64; 3]) -> Option<[f64; 3]> {
        let depth = self.distance - z;
        let inverse = 1.0 / depth;
        (depth > 1e-6 * self.distance).then(|| {
            [self.middle[0] + self.focal * x * inverse, self.middle[1] - self.focal * y * inverse, inverse]
        })
    }

    /// The direction from a position of view space to the camera, of length 1.
    pub fn towards_camera(&self, [x, y, z]: [f64; 3]) -> [f64; 3] {
        unit([-x, -y, self.distance - z])
    }
}
