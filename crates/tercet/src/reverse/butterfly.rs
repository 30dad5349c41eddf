//! Vertex division of surfaces with 1-to-4 subdivision connectivity.
//!
//! A butterfly step leaves every real face with one even vertex, a *corner* face, or with none, a
//! *middle* face. The middle ones are the coarse faces. One face, labelled, fixes the labels of its
//! component: a middle face has corner faces across its edges, a corner face has the middle one across
//! the edge between its odd vertices and another face of its even vertex across the others. So a
//! component has at most four labellings, and one where some vertex must be even has one.
//!
//! Labels that pass the local checks make a coarse surface that refines to exactly the given one:
//! around an odd vertex inside, of six faces, they are corner, middle, corner, twice; around one on a
//! boundary, of three, once; every boundary edge has an even end and an odd one. Coarse edges are
//! carried over around the odd vertex in their middle, and never searched for by their ends.

mod coarsen;
mod facts;

#[cfg(test)]
mod tests;

use super::Reduction;
use super::label::label;
use crate::mesh::{Surface, next, prev};
use crate::subdivide::cut_edges;
use coarsen::coarsen;
use facts::Facts;

/// Divides `fine` if one butterfly step made its connectivity, however its vertices and faces are
/// numbered; else `None`.
///
/// All components must divide. Virtual faces fill boundary loops: one virtual corner each, and a real
/// face across from it. `positions` has one lattice point a vertex, those of virtual vertices not
/// read; they decide only between labellings that connectivity leaves open.
///
/// Coarse faces are in the order of the middle faces, coarse vertices in fine order. Refuses a coarse
/// surface of fewer than four vertices or with a face that meets a vertex twice. Linear time and
/// memory; a surface that does not divide is usually rejected after a few faces of the flood.
pub(super) fn divide(fine: &Surface, positions: &[[i32; 3]]) -> Option<Reduction> {
    let facts = Facts::gather(fine)?;
    let even = label(fine, &facts)?.settle(fine, positions, |even| coarsen(fine, even))?;
    coarsen(fine, &even)
}

/// The vertices of `fine` that `reduction` removes, in the order in which refinement inserts them.
pub(super) fn removed<'a>(fine: &'a Surface, reduction: &'a Reduction) -> impl Iterator<Item = u32> + 'a {
    let coarse = &reduction.coarse;
    cut_edges(coarse).map(move |c| {
        let c = if coarse.is_virtual_face(c / 3) { coarse.across(c) } else { c };
        let anchor = reduction.anchor[(c / 3) as usize];
        fine.at(match c % 3 {
            0 => anchor,
            1 => next(anchor),
            _ => prev(anchor),
        })
    })
}
