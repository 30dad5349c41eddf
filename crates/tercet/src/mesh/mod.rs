//! Triangle meshes: what a user hands in and gets back, and the connectivity inside.
//!
//! [`Mesh`] is the public value: positions and faces, nothing assumed of them.
//! Everything from the reverse step on works on a [`Surface`]: a closed, oriented,
//! manifold corner table without positions.

mod cut;
mod lattice;
mod precision;
mod surface;

pub use precision::Precision;

pub(crate) use cut::{Cut, cut};
pub(crate) use lattice::{
    Lattice, binary_origin, bounds, box_lattice, decimal_index, decimal_step, decimal_value, power_of_two,
    refined_grid,
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
}
