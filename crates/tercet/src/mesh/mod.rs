//! Triangle meshes: what a user hands in and gets back, and the connectivity inside.
//!
//! [`Mesh`] is the public value: positions and faces, nothing assumed of them.
//! Everything from the reverse step on works on a [`Surface`]: a closed, oriented,
//! manifold corner table without positions.

mod curve;
mod cut;
mod lattice;
mod precision;
mod surface;

pub use precision::Precision;

pub(crate) use curve::cut_along_curve;
pub(crate) use cut::{Cut, cut};
pub(crate) use lattice::{
    Lattice, binary_origin, bounds, box_lattice, decimal_index, decimal_step, decimal_value, power_of_two,
    refined_grid, stretched,
};
pub(crate) use surface::{NONE, Surface, next, prev};

use crate::{Error, Result};

/// An indexed triangle mesh. Nothing is assumed of it: faces may repeat, degenerate,
/// overlap or disagree in orientation, and vertices may be unreferenced or coincide.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Mesh {
    /// Vertex positions.
    pub positions: Vec<[f32; 3]>,
    /// Indices into `positions`, three per face, counter-clockwise seen from outside.
    pub faces: Vec<[u32; 3]>,
}

impl Mesh {
    /// Checks that every coordinate is finite and every index is in range.
    ///
    /// # Errors
    /// [`Error::Mesh`] naming the first offending vertex or face.
    pub fn check(&self) -> Result<()> {
        for (i, p) in self.positions.iter().enumerate() {
            if let Some(axis) = p.iter().position(|x| !x.is_finite()) {
                return Err(Error::mesh(
                    format!("vertex {i}"),
                    format!("{} is {}, which is not a finite number", ["x", "y", "z"][axis], p[axis]),
                ));
            }
        }
        let n = self.positions.len();
        for (i, f) in self.faces.iter().enumerate() {
            if let Some(&v) = f.iter().find(|&&v| v as usize >= n) {
                return Err(Error::mesh(
                    format!("face {i}"),
                    format!("index {v} is out of range: the mesh has {n} vertices"),
                ));
            }
        }
        Ok(())
    }

    /// A number that tells meshes apart, as a lossy file names what it stands for: the CRC-64 (of the xz
    /// format) of the coordinates of all positions as little-endian `f32`, then of the indices of all
    /// faces as little-endian `u32`. It guards against mistakes, not against malice.
    pub fn digest(&self) -> u64 {
        const CRC: crc::Crc<u64> = crc::Crc::<u64>::new(&crc::CRC_64_XZ);
        let mut digest = CRC.digest();
        self.positions.iter().flatten().for_each(|x| digest.update(&x.to_le_bytes()));
        self.faces.iter().flatten().for_each(|v| digest.update(&v.to_le_bytes()));
        digest.finalize()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_digest_is_that_of_the_plain_arrays() {
        assert_eq!(Mesh::default().digest(), 0);
        // "12345678…" as coordinates: four characters each.
        let text = |at: &[u8; 4]| f32::from_le_bytes(*at);
        let mesh = Mesh { positions: vec![[text(b"1234"), text(b"5678"), text(b"9abc")]], faces: vec![] };
        assert_eq!(mesh.digest(), crc::Crc::<u64>::new(&crc::CRC_64_XZ).checksum(b"123456789abc"));
        let turned = |face| Mesh { faces: vec![face], ..mesh.clone() }.digest();
        assert_ne!(turned([0, 0, 1]), turned([0, 1, 0]));
    }
}
