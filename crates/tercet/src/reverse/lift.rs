//! The correspondence of two isomorphic surfaces, carried from one level to the next.

use super::{Reduction, StepKind};
use crate::mesh::{NONE, Surface, next, prev};
use crate::subdivide::Refined;

/// Offset of the corner at the new vertex whose next vertex is the split face's corner 0.
const AT_NEW_VERTEX: u32 = 8;

/// Carries the correspondence of the decoder's surface with the encoder's one level up.
///
/// `coarse_map` gives for each face of the decoder's coarse surface the corner of
/// `reduction.coarse` that corresponds to its corner 0; `refined` is the decoder's next surface
/// and `fine` the encoder's. The result is the same map between those two, for every face.
///
/// Each coarse face ties one corner of the finer surfaces together and the rest follows across
/// edges; vertex numbers are never compared, so it holds on complexes that are not simple. For
/// `Sqrt3Odd` it relies on corner `3 * refined.first[f] + 3` of a split face f on the boundary
/// being the one at p whose next vertex is q, as in [`Reduction::anchor`], for `Butterfly` on the
/// middle face being the last of the four. Linear time.
pub(crate) fn lift(refined: &Refined, reduction: &Reduction, fine: &Surface, coarse_map: &[u32]) -> Vec<u32> {
    let surface = &refined.surface;
    let mut map = vec![NONE; surface.faces() as usize];
    let seeds = refined.first.iter().zip(coarse_map).filter_map(|(&first, &corner)| {
        let (offset, d) = seed(reduction, fine, corner)?;
        Some((first, offset, d))
    });
    if matches!(reduction.kind, StepKind::Adaptive | StepKind::Sqrt3Even) {
        // A face is as it was or has a new vertex, and each of those is in a seed: no other edge need be crossed.
        for (first, offset, d) in seeds {
            match offset {
                AT_NEW_VERTEX => tie_fan(&mut map, surface, 3 * first + offset, fine, d),
                _ => map[first as usize] = d,
            }
        }
        return map;
    }
    let mut reached = Vec::with_capacity(map.len());
    for (first, offset, d) in seeds {
        tie(&mut map, &mut reached, 3 * first + offset, d);
    }
    while let Some(f) = reached.pop() {
        let mut d = map[f as usize];
        for c in 3 * f..3 * f + 3 {
            tie(&mut map, &mut reached, surface.across(c), fine.across(d));
            d = next(d);
        }
    }
    map
}

/// Notes that `d` corresponds to `c`, unless the face of `c` has been reached before.
fn tie(map: &mut [u32], reached: &mut Vec<u32>, c: u32, d: u32) {
    let f = c / 3;
    if map[f as usize] == NONE {
        map[f as usize] = corner_zero(c, d);
        reached.push(f);
    }
}

/// Notes that the faces around the vertex of `d` correspond to those around the vertex of `c`.
fn tie_fan(map: &mut [u32], surface: &Surface, c: u32, fine: &Surface, mut d: u32) {
    for c in surface.fan(c) {
        map[(c / 3) as usize] = corner_zero(c, d);
        d = fine.swing(d);
    }
}

/// What corresponds to corner 0 of the face of `c` if `d` corresponds to `c`.
fn corner_zero(c: u32, d: u32) -> u32 {
    match c % 3 {
        0 => d,
        1 => prev(d),
        _ => next(d),
    }
}

/// A pair of corresponding corners on the finer surfaces, if the coarse face ties one: the
/// decoder's as an offset from the first corner that its face became, and the encoder's.
/// `corner` is the encoder's coarse corner corresponding to the decoder's corner 0.
fn seed(reduction: &Reduction, fine: &Surface, corner: u32) -> Option<(u32, u32)> {
    /// Offset of the corner at the first new vertex of a cut boundary edge, the second one next.
    const AT_CUT: u32 = 3;
    /// Offset of the middle face's corner across from the quartered face's corner 0.
    const IN_MIDDLE: u32 = 9;
    let face = corner / 3;
    let turn = corner % 3;
    let anchor = reduction.anchor[face as usize];
    if reduction.kind == StepKind::Butterfly {
        let real = !fine.is_virtual(fine.at(anchor));
        return real.then(|| (IN_MIDDLE, (0..turn).fold(anchor, |d, _| next(d))));
    }
    if reduction.split[face as usize] {
        if reduction.kind == StepKind::Sqrt3Odd && on_boundary(&reduction.coarse, face) {
            // Which edge is cut orients the face already.
            return Some((AT_CUT, anchor));
        }
        // Around the new vertex, a flipped edge puts one more face between two corners.
        let steps: u32 =
            (0..turn).map(|k| 1 + reduction.flip[(3 * face + (k + 2) % 3) as usize] as u32).sum();
        return Some((AT_NEW_VERTEX, (0..steps).fold(anchor, |d, _| fine.swing(d))));
    }
    let plain = anchor != NONE && reduction.kind != StepKind::Sqrt3Odd;
    plain.then(|| (0, (0..turn).fold(anchor, |d, _| next(d))))
}

/// Whether face `f` is real and has a boundary edge.
fn on_boundary(surface: &Surface, f: u32) -> bool {
    !surface.is_virtual_face(f) && (3 * f..3 * f + 3).any(|c| surface.is_virtual_face(surface.across(c) / 3))
}
