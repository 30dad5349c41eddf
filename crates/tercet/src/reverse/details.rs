//! How well a reverse step predicts what it removes.

use super::Reduction;
use crate::mesh::Surface;
use crate::subdivide::{FRACTION_BITS, predict_regular};

/// Each odd vertex, in the order in which refinement inserts them, with the sum of its detail's
/// absolute values in 1/256 of the lattice step. `reduction` is a regular step; positions of virtual
/// vertices are not read.
pub(super) fn details<'a>(
    fine: &'a Surface,
    positions: &'a [[i32; 3]],
    reduction: &'a Reduction,
) -> impl Iterator<Item = (u32, u64)> + 'a {
    let kept: Vec<[i32; 3]> = reduction.kept.iter().map(|&v| positions[v as usize]).collect();
    let predicted = predict_regular(&reduction.coarse, reduction.kind, &kept);
    reduction.removed(fine).into_iter().zip(predicted).map(|(v, q)| {
        let p = positions[v as usize];
        let detail = |k: usize| ((i64::from(p[k]) << FRACTION_BITS) - q[k]).unsigned_abs();
        (v, detail(0) + detail(1) + detail(2))
    })
}
