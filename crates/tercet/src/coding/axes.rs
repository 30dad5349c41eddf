//! The three coordinates of a vertex: in which order they come, and what one tells of the next.

use super::vector::Vector;

/// Which coordinate comes first, and with it in what order vertices are visited: see
/// [`Traversal`](super::traversal::Traversal).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum AxisOrder {
    /// The one along the normal: where details are normal ones.
    NormalFirst,
    /// The one along the normal comes last: where the surface is known better than the place.
    NormalLast,
}

/// Kinds of axes: in the surface, across it, and either at a boundary.
pub(super) const TANGENTIAL: usize = 0;
pub(super) const NORMAL: usize = 1;
pub(super) const BOUNDARY: usize = 2;
pub(super) const KINDS: usize = 3;

/// The kind of the axis that comes `step`th.
pub(super) fn kind(step: usize, order: AxisOrder, at_boundary: bool) -> usize {
    match (at_boundary, is_across(step, order)) {
        (true, _) => BOUNDARY,
        (_, true) => NORMAL,
        _ => TANGENTIAL,
    }
}

/// The axes by size, by the bits of y < x, z < y and z < x; two of the eight cannot be.
const ASCENDING: [[usize; 3]; 8] =
    [[0, 1, 2], [1, 0, 2], [0, 2, 1], [0, 1, 2], [0, 1, 2], [1, 2, 0], [2, 0, 1], [2, 1, 0]];

/// The axes in the order of coding: by the size of the normal's component, then by number.
pub(super) fn axes(normal: Vector, order: AxisOrder) -> [usize; 3] {
    let [x, y, z] = normal.map(i64::unsigned_abs);
    // Which way a comparison goes is hard to guess for a processor, so that nothing branches on one.
    let axes = ASCENDING[(y < x) as usize | ((z < y) as usize) << 1 | ((z < x) as usize) << 2];
    match order {
        AxisOrder::NormalLast => axes,
        AxisOrder::NormalFirst => [axes[2], axes[0], axes[1]],
    }
}

/// Whether the axis that comes `step`th is the one along the normal.
pub(super) fn is_across(step: usize, order: AxisOrder) -> bool {
    step == if order == AxisOrder::NormalLast { 2 } else { 0 }
}

/// Moves the expectations of the later axes by what the coded one was off, so that the point
/// stays in the tangent plane (normal last) or on the normal line (normal first).
#[inline(always)]
pub(super) fn shift<const E: usize>(
    centres: &mut [Vector; E],
    off: [i64; E],
    normal: Vector,
    axes: [usize; 3],
    step: usize,
    order: AxisOrder,
) {
    let ratio = |a: usize, b: usize| match (i32::try_from(normal[a] << 14), i32::try_from(normal[b])) {
        (_, Ok(0)) => 0,
        // A short division takes half the time of a long one.
        (Ok(a), Ok(b)) => a.wrapping_div(b).into(),
        _ => (normal[a] << 14) / normal[b],
    };
    match (order, step) {
        (AxisOrder::NormalLast, 0 | 1) => {
            let slope = ratio(axes[step], axes[2]);
            for (centre, off) in centres.iter_mut().zip(off) {
                centre[axes[2]] -= (off.clamp(-FAR, FAR) * slope) >> 14;
            }
        }
        (AxisOrder::NormalFirst, 0) => {
            for later in [1, 2] {
                let slope = ratio(axes[later], axes[0]);
                for (centre, off) in centres.iter_mut().zip(off) {
                    centre[axes[later]] += (off.clamp(-FAR, FAR) * slope) >> 14;
                }
            }
        }
        _ => {}
    }
}

/// No expectation is moved by more than this.
const FAR: i64 = 1 << 37;
