//! What the fuzz targets share.

#![forbid(unsafe_code)]

use tercet::io::Format;
use tercet::{Limits, Mesh};

/// Little memory, so that an allocation out of proportion to the input is an error and not a slow run.
pub const LIMITS: Limits = Limits { max_memory: 256 << 20 };

/// Reads any bytes as a mesh file. What the reader accepts must be a mesh that the library takes.
pub fn read(bytes: &[u8], format: Format) {
    if let Ok(loaded) = tercet::io::read(bytes, format, &LIMITS) {
        loaded.mesh.check().expect("a reader hands out checked meshes");
    }
}

/// A mesh with coordinates and indices of every kind, most of them small enough to make a surface.
///
/// Faces draw on few vertices, so that neighbours, repeated and non-manifold edges are common.
pub fn mesh(positions: &[[i8; 3]], faces: &[[u8; 3]], exponent: i8) -> Mesh {
    if positions.is_empty() {
        return Mesh::default();
    }
    // Halved, so that the largest coordinate is finite.
    let unit = f32::from(exponent / 2).exp2();
    let index = |v: u8| u32::from(v) % positions.len() as u32;
    Mesh {
        positions: positions.iter().map(|p| p.map(|x| f32::from(x) * unit)).collect(),
        faces: faces.iter().map(|f| f.map(index)).collect(),
    }
}
