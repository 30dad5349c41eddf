//! Vertex division of surfaces with √3 subdivision connectivity.
//!
//! On a refined surface every real face has exactly one even vertex, except that the even
//! generation leaves two, and one odd vertex, on a face with a boundary edge. So one labelled
//! face fixes the labels of its whole component, and a component has at most three labellings;
//! any vertex whose faces no step could have made is even and leaves only one. A component
//! where all three are left (a torus without extraordinary vertices, say) takes the one with the
//! smallest details. Labels that pass the local checks of `label` make a coarse surface that
//! refines to exactly the given one: `coarsen` carries the edges over one by one, from the edges
//! between odd vertices that the step flipped, and never searches for them by their ends.

mod coarsen;
mod label;

#[cfg(test)]
mod tests;

use super::Reduction;
use crate::mesh::{Surface, next};
use crate::subdivide::{FRACTION_BITS, StepKind, predict_sqrt3};
use coarsen::coarsen;
use label::{Facts, Labels, label};

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
        let labels = label(fine, &facts)?;
        let even = choose(fine, positions, &facts, labels)?;
        coarsen(fine, &facts, &even)
    })
}

/// Which vertices are even: for each component that several labellings fit, the one with the
/// smallest details, the first of equal ones.
fn choose(fine: &Surface, positions: &[[i32; 3]], facts: &Facts, labels: Labels) -> Option<Vec<bool>> {
    let Labels { mut even, open } = labels;
    if open.is_empty() {
        return Some(even);
    }
    const NO_COMPONENT: u32 = u32::MAX;
    let mut component = vec![NO_COMPONENT; even.len()];
    for (i, choice) in open.iter().enumerate() {
        for &v in &choice.vertices {
            component[v as usize] = i as u32;
        }
    }
    // The labellings of different components do not interact: three rounds judge them all.
    let mut best = vec![None; open.len()];
    for round in 0..3 {
        open.iter().for_each(|choice| choice.apply(round, &mut even));
        let Some(reduction) = coarsen(fine, facts, &even) else { continue };
        let mut sums = vec![0u128; open.len()];
        for (v, detail) in details(fine, positions, &reduction) {
            if component[v as usize] != NO_COMPONENT {
                sums[component[v as usize] as usize] += u128::from(detail);
            }
        }
        for ((best, choice), sum) in best.iter_mut().zip(&open).zip(sums) {
            if choice.is_valid(round) && best.is_none_or(|(least, _)| sum < least) {
                *best = Some((sum, round));
            }
        }
    }
    for (choice, best) in open.iter().zip(best) {
        choice.apply(best?.1, &mut even);
    }
    Some(even)
}

/// Each odd vertex, in the order in which refinement inserts them, with the sum of its detail's
/// absolute values in 1/256 of the lattice step.
fn details<'a>(
    fine: &'a Surface,
    positions: &'a [[i32; 3]],
    reduction: &'a Reduction,
) -> impl Iterator<Item = (u32, u64)> + 'a {
    let kept: Vec<[i32; 3]> = reduction.kept.iter().map(|&v| positions[v as usize]).collect();
    let predicted = predict_sqrt3(&reduction.coarse, reduction.kind, &kept);
    removed(fine, reduction).zip(predicted).map(|(v, q)| {
        let p = positions[v as usize];
        let detail = |k: usize| ((i64::from(p[k]) << FRACTION_BITS) - q[k]).unsigned_abs();
        (v, detail(0) + detail(1) + detail(2))
    })
}

/// The vertices of `fine` that `reduction` removes, in the order in which refinement inserts them.
pub(crate) fn removed<'a>(fine: &'a Surface, reduction: &'a Reduction) -> impl Iterator<Item = u32> + 'a {
    let coarse = &reduction.coarse;
    (0..coarse.faces()).filter(|&f| reduction.split[f as usize]).flat_map(move |f| {
        let corner = reduction.anchor[f as usize];
        let cut = reduction.kind == StepKind::Sqrt3Odd
            && (3 * f..3 * f + 3).any(|c| coarse.is_virtual_face(coarse.across(c) / 3));
        [Some(fine.at(corner)), cut.then(|| fine.at(next(corner)))].into_iter().flatten()
    })
}
