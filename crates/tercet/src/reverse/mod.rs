//! Reverse steps: from a fine surface to the coarse one that refines to it.
//!
//! *Vertex division* separates the vertices of a surface into *even* ones, which the coarse
//! surface keeps, and *odd* ones, which the refinement step inserts. A surface of √3
//! or of 1-to-4 subdivision connectivity divides in one way only (`sqrt3`, `butterfly`); on any
//! other the encoder chooses the odd vertices (`adaptive`).

mod adaptive;
mod butterfly;
mod details;
mod hierarchy;
mod label;
mod lift;
mod scheme;
mod sqrt3;

use crate::mesh::Surface;

pub(crate) use crate::subdivide::StepKind;
pub(crate) use adaptive::{BLOCK, reduce};
pub(crate) use hierarchy::Hierarchy;
pub(crate) use lift::lift;
pub use scheme::LevelScheme;

/// One reverse step, as the encoder found it.
#[derive(Clone, Debug)]
pub(crate) struct Reduction {
    /// How `coarse` refines to the fine surface.
    pub kind: StepKind,
    /// The coarse surface. Its virtual vertices are those of the fine one, in the same order.
    pub coarse: Surface,
    /// For each coarse vertex, its number on the fine surface; ascending. Empty in a hierarchy, which has the
    /// positions.
    pub kept: Vec<u32>,
    /// For each coarse face, whether refinement inserts a vertex in it. For `Sqrt3Odd` also
    /// true of faces on the boundary, which receive two on their boundary edge. Empty for
    /// `Butterfly`.
    pub split: Vec<bool>,
    /// For each coarse corner, whether refinement flips the edge opposite to it; equal on both
    /// sides of an edge. Empty for `Butterfly`.
    pub flip: Vec<bool>,
    /// For each coarse face (t0, t1, t2), a fine corner that ties the two surfaces together.
    ///
    /// Split with odd vertex v: the corner at v whose next vertex is t0. Unsplit and without a
    /// flipped edge: the corner at t0 of the same face. Unsplit with a flipped edge: `NONE`.
    /// `Sqrt3Odd` on the boundary, with boundary half-edge a→b cut at p (near a) and q (near b):
    /// the corner at p whose next vertex is q; the virtual face behind it: the corner at q whose
    /// next vertex is p. `Butterfly`: the corner of the middle face at the odd vertex across from t0;
    /// of a virtual face, the virtual corner of that of its halves whose next vertex is even.
    pub anchor: Vec<u32>,
}

impl Reduction {
    /// The vertices of `fine` that this regular step removes, in the order in which refinement
    /// inserts them.
    pub fn removed(&self, fine: &Surface) -> Vec<u32> {
        match self.kind {
            StepKind::Butterfly => butterfly::removed(fine, self).collect(),
            _ => sqrt3::removed(fine, self).collect(),
        }
    }
}
