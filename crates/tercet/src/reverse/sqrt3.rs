//! Vertex division of surfaces with √3 subdivision connectivity.
//!
//! On a refined surface every real face has exactly one even vertex, except that the even
//! generation leaves two, and one odd vertex, on a face with a boundary edge. So one labelled
//! face fixes the labels of its whole component, and a component has at most three labellings;
//! any vertex whose faces no step could have made is even and leaves only one. A component
//! where all three are left (a torus without extraordinary vertices, say) takes the one with the
//! smallest details. Labels that pass the local checks of `facts` make a coarse surface that
//! refines to exactly the given one: `coarsen` carries the edges over one by one, from the edges
//! between odd vertices that the step flipped, and never searches for them by their ends.

mod coarsen;
mod facts;

#[cfg(test)]
mod tests;

use super::Reduction;
use super::label::label;
use crate::mesh::{Surface, next};
use crate::subdivide::StepKind;
use coarsen::coarsen;
use facts::Facts;

/// Divides `fine` if one √3 step of either generation made its connectivity, however its
/// vertices and faces are numbered; else `None`.
///
/// All components must divide, by the same generation; the even one is tried first, and is the
/// answer for a surface without boundary. Virtual faces fill boundary loops: one virtual corner
/// each, and a real face across from it. `positions` has one lattice point a vertex, those of
/// virtual vertices not read; they decide only between labellings that connectivity leaves open.
///
/// Coarse faces are in the order in which fine faces touch them, coarse vertices in fine order.
/// Refuses a coarse surface of fewer than four vertices or with a face that meets a vertex
/// twice. Linear time and memory; a surface that does not divide is usually rejected after a
/// few faces of the flood.
pub(crate) fn divide(fine: &Surface, positions: &[[i32; 3]]) -> Option<Reduction> {
    let kinds: &[StepKind] = match fine.virtuals {
        0 => &[StepKind::Sqrt3Even],
        _ => &[StepKind::Sqrt3Even, StepKind::Sqrt3Odd],
    };
    kinds.iter().find_map(|&kind| {
        let facts = Facts::gather(fine, kind)?;
        let even = label(fine, &facts)?.settle(fine, positions, |even| coarsen(fine, &facts, even))?;
        coarsen(fine, &facts, &even)
    })
}

/// The vertices of `fine` that `reduction` removes, in the order in which refinement inserts them.
pub(super) fn removed<'a>(fine: &'a Surface, reduction: &'a Reduction) -> impl Iterator<Item = u32> + 'a {
    let coarse = &reduction.coarse;
    (0..coarse.faces()).filter(|&f| reduction.split[f as usize]).flat_map(move |f| {
        let corner = reduction.anchor[f as usize];
        let cut = reduction.kind == StepKind::Sqrt3Odd
            && (3 * f..3 * f + 3).any(|c| coarse.is_virtual_face(coarse.across(c) / 3));
        [Some(fine.at(corner)), cut.then(|| fine.at(next(corner)))].into_iter().flatten()
    })
}
