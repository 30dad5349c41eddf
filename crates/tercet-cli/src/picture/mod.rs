//! Pictures of meshes, by a small rasteriser: no display and no graphics card needed.
//!
//! A [`Camera`] turns positions to view space; `raster` finds which face is seen at each sample, four
//! samples to a pixel; `shade` gives each a colour; the mean of a pixel's samples is its colour, the
//! part of them that see a face its opacity. The same input gives the same picture.

mod camera;
mod colour;
mod image;
mod legend;
mod normals;
mod raster;
mod shade;
pub mod stance;

pub use camera::{Camera, Up, View};
pub use colour::Colour;
pub use image::Image;

use tercet::Mesh;
use tercet::metrics::TriangleTree;

/// Samples along each side of a pixel.
const SUPERSAMPLING: usize = 2;

/// Width and height in pixels.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Size {
    pub width: usize,
    pub height: usize,
}

/// What a picture shows of a surface.
pub enum Style<'a> {
    Shaded,
    /// With its edges.
    Wireframe,
    /// The vertices: the first `kept` are even, the further ones odd.
    Division {
        kept: u32,
    },
    /// The distance from another surface, as a part of `diagonal`, in colours up to `scale`; without
    /// one, up to what nearly all of the picture is below.
    Error {
        reference: &'a TriangleTree,
        diagonal: f64,
        scale: Option<f64>,
    },
}

/// A surface and how it is to be seen.
pub struct Picture<'a> {
    pub mesh: &'a Mesh,
    pub style: Style<'a>,
    /// One normal for each face; otherwise edges look sharp only where they are.
    pub flat: bool,
    /// Behind the surface; none is transparent.
    pub background: Option<Colour>,
}

impl Picture<'_> {
    /// Draws it as `camera` sees it. O(faces + covered samples), times O(log n) for distances.
    pub fn draw(&self, camera: &Camera, size: Size) -> Image {
        let positions: Vec<[f64; 3]> = self.mesh.positions.iter().map(|&p| camera.to_view(p)).collect();
        let samples = Size { width: size.width * SUPERSAMPLING, height: size.height * SUPERSAMPLING };
        let seen = raster::visible(&positions, &self.mesh.faces, camera, samples);
        let mut image = Image::new(size, self.background);
        let legend = shade::shade(self, camera, &positions, &seen, &mut image);
        if let Some(scale) = legend {
            legend::draw(&mut image, scale);
        }
        image
    }
}

/// The width that a picture of this style leaves for the surface, of `width` pixels.
pub fn width_for_surface(style: &Style, width: usize) -> usize {
    match style {
        Style::Error { .. } => width.saturating_sub(legend::WIDTH).max(width / 2),
        _ => width,
    }
}

#[cfg(test)]
mod tests;
