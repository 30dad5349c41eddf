//! Which way up a mesh stands and from where it is seen best, where nobody says. Mesh files do not tell.
//!
//! The viewer has the same rules, in `web/viewer/stance.ts`: a mesh looks the same there and here.

use tercet::Mesh;

use super::Up;
use super::camera::axes_of;
use super::normals::{area, dot};

/// What a mesh stands on lies in the lowest part of its height.
const SOLE: f64 = 0.05;
/// A mesh that stands is not flatter than this part of its diagonal.
const LEAST_HEIGHT: f64 = 0.02;
/// What it stands on spans at least this part of the ground below it …
const LEAST_SUPPORT: f64 = 0.3;
/// … and so many times the part that it would span on its other side.
const ADVANTAGE: f64 = 2.0;
/// Where the top of a mesh leans to, there is a head rather than a tail: the highest part of its height.
const TOP: f64 = 0.2;
/// It leans to the back, or to the left, if its middle is so far from that of the whole, as a part of the
/// extent in that direction. A head's crown lies somewhat behind a face, which must not turn it away.
const LEANS_BACK: f64 = 0.22;
const LEANS_LEFT: f64 = 0.15;
/// The camera stands so far beside the front or the back, in degrees.
const BESIDE: f64 = 30.0;

/// Which axis points up: y, as in most files, unless the mesh would stand well with z up and not with y
/// up. O(n).
pub fn upward(mesh: &Mesh) -> Up {
    let [y, z] = [1, 2].map(|axis| Up { axis, negative: false });
    let [on_y, on_z] = [y, z].map(|up| Space::new(mesh, up).support());
    if on_z >= LEAST_SUPPORT && on_z > ADVANTAGE * on_y { z } else { y }
}

/// The azimuth of a three-quarter view, in degrees: from the front, or from the side that the mesh's top
/// leans to. O(n).
pub fn azimuth(mesh: &Mesh, up: Up) -> f64 {
    let [right, forward] = Space::new(mesh, up).lean();
    let beside = if right < -LEANS_LEFT { -BESIDE } else { BESIDE };
    if forward < -LEANS_BACK { 180.0 - beside } else { beside }
}

/// The faces of a mesh in coordinates to the right, up and forward, and their bounding box.
struct Space {
    faces: Vec<[[f64; 3]; 3]>,
    low: [f64; 3],
    extent: [f64; 3],
}

impl Space {
    fn new(mesh: &Mesh, up: Up) -> Self {
        let axes = axes_of(up);
        let place = |v: u32| axes.map(|axis| dot(axis, mesh.positions[v as usize].map(f64::from)));
        let faces: Vec<_> = mesh.faces.iter().map(|face| face.map(place)).collect();
        let (mut low, mut high) = ([f64::INFINITY; 3], [f64::NEG_INFINITY; 3]);
        for corner in faces.iter().flatten() {
            low = std::array::from_fn(|k| low[k].min(corner[k]));
            high = std::array::from_fn(|k| high[k].max(corner[k]));
        }
        Space { faces, low, extent: std::array::from_fn(|k| high[k] - low[k]) }
    }

    /// The part of the ground, as rectangles, that the vertices near it span; 0 if the surface's
    /// middle is not above them: it would fall over.
    fn support(&self) -> f64 {
        let [width, height, depth] = self.extent;
        if height <= LEAST_HEIGHT * width.hypot(height).hypot(depth) {
            return 0.0;
        }
        let Some(middle) = self.middle(f64::NEG_INFINITY) else { return 0.0 };
        let (mut low, mut high) = ([f64::INFINITY; 3], [f64::NEG_INFINITY; 3]);
        for corner in self.faces.iter().flatten().filter(|corner| corner[1] < self.low[1] + SOLE * height) {
            low = std::array::from_fn(|k| low[k].min(corner[k]));
            high = std::array::from_fn(|k| high[k].max(corner[k]));
        }
        let part = |k: usize| {
            let stands = low[k] <= middle[k] && middle[k] <= high[k] && self.extent[k] > 0.0;
            if stands { (high[k] - low[k]) / self.extent[k] } else { 0.0 }
        };
        part(0) * part(2)
    }

    /// How far the middle of the top is from the box's, to the right and forward, as parts of its extent.
    fn lean(&self) -> [f64; 2] {
        let top = self.low[1] + (1.0 - TOP) * self.extent[1];
        let Some(middle) = self.middle(top) else { return [0.0; 2] };
        [0, 2].map(
            |k| if self.extent[k] > 0.0 { (middle[k] - self.low[k]) / self.extent[k] - 0.5 } else { 0.0 },
        )
    }

    /// The middle of the faces whose middles are above a height, weighted by their areas.
    fn middle(&self, above: f64) -> Option<[f64; 3]> {
        let (mut sum, mut weight) = ([0.0; 3], 0.0);
        for &corners in &self.faces {
            let middle: [f64; 3] =
                std::array::from_fn(|k| corners.iter().map(|corner| corner[k] / 3.0).sum());
            if middle[1] >= above {
                let normal = area(corners);
                let size = dot(normal, normal).sqrt();
                sum = std::array::from_fn(|k| sum[k] + size * middle[k]);
                weight += size;
            }
        }
        (weight > 0.0).then(|| sum.map(|x| x / weight))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const Y: Up = Up { axis: 1, negative: false };
    const Z: Up = Up { axis: 2, negative: false };

    /// A box between two opposite corners.
    fn add_box(mesh: &mut Mesh, low: [f32; 3], high: [f32; 3]) {
        let first = mesh.positions.len() as u32;
        for v in 0..8 {
            mesh.positions.push(std::array::from_fn(|k| if v >> k & 1 == 1 { high[k] } else { low[k] }));
        }
        let quads = [[0, 1, 3, 2], [4, 6, 7, 5], [0, 4, 5, 1], [2, 3, 7, 6], [0, 2, 6, 4], [1, 5, 7, 3]];
        for [a, b, c, d] in quads.map(|quad| quad.map(|v| first + v)) {
            mesh.faces.extend([[a, c, b], [a, d, c]]);
        }
    }

    /// An animal of boxes with y up, as long as it is high, its head forward or backward.
    fn animal(forward: f32) -> Mesh {
        let mut mesh = Mesh::default();
        for (x, z) in [(-1.0, -2.0), (-1.0, 2.0), (1.0, -2.0), (1.0, 2.0)] {
            add_box(&mut mesh, [x - 0.2, 0.0, z - 0.2], [x + 0.2, 2.0, z + 0.2]);
        }
        add_box(&mut mesh, [-1.2, 2.0, -2.2], [1.2, 4.0, 2.2]);
        add_box(&mut mesh, [-0.6, 4.0, 1.8 * forward - 1.0], [0.6, 6.0, 1.8 * forward + 1.0]);
        // A tail, without which it could sit.
        add_box(&mut mesh, [-0.1, 3.0, -2.4 * forward - 0.3], [0.1, 3.2, -2.4 * forward + 0.3]);
        mesh
    }

    /// The same with z up: what was in front is at −y.
    fn upright(mesh: &Mesh) -> Mesh {
        Mesh { positions: mesh.positions.iter().map(|&[x, y, z]| [x, -z, y]).collect(), ..mesh.clone() }
    }

    #[test]
    fn what_stands_on_four_legs_is_put_on_them() {
        for forward in [-1.0, 1.0] {
            assert_eq!(upward(&animal(forward)), Y);
            assert_eq!(upward(&upright(&animal(forward))), Z);
        }
    }

    #[test]
    fn where_nothing_tells_y_is_up() {
        let flat = Mesh {
            positions: vec![[0.0; 3], [1.0, 0.0, 0.0], [1.0, 1.0, 0.0], [0.0, 1.0, 0.0]],
            faces: vec![[0, 1, 2], [0, 2, 3]],
        };
        let point = Mesh { positions: vec![[1.0; 3]; 3], faces: vec![[0, 1, 2]] };
        let huge = Mesh { positions: vec![[f32::MAX; 3], [-f32::MAX; 3], [0.0; 3]], faces: vec![[0, 1, 2]] };
        let mut cube = Mesh::default();
        add_box(&mut cube, [0.0; 3], [1.0; 3]);
        for mesh in [flat, point, huge, cube, Mesh::default(), tercet::shapes::sphere(3)] {
            assert_eq!((upward(&mesh), azimuth(&mesh, Y)), (Y, BESIDE));
        }
    }

    #[test]
    fn the_side_with_the_head_is_seen() {
        for (forward, seen) in [(1.0, BESIDE), (-1.0, 180.0 - BESIDE)] {
            let mesh = animal(forward);
            assert_eq!(azimuth(&mesh, Y), seen);
            assert_eq!(azimuth(&upright(&mesh), Z), seen);
        }
        // With x in place of z the head is to the right or to the left.
        for (forward, seen) in [(1.0, BESIDE), (-1.0, -BESIDE)] {
            let mesh = animal(forward);
            let turned = mesh.positions.iter().map(|&[x, y, z]| [z, y, -x]).collect();
            assert_eq!(azimuth(&Mesh { positions: turned, ..mesh }, Y), seen);
        }
    }
}
