//! The estimates of √3 steps on the lattice by sums over rings, not stencil by stencil.
//!
//! They are the integers that the [stencils](super::stencil) give. A stencil gathers twelve points, or a ring
//! for each extraordinary corner, from all over the surface; most of that the faces around share:
//!
//! - The ring of an ordinary corner holds the two other corners, two wings and two of the six further
//!   vertices. So with *S*, *W*, *F* the sums of corners, wings and further vertices, and *R* the sum of the
//!   corners' rings, *R* = 2*S* + 2*W* + *F*, and the regular rule 32*S* − *W* − 2*F* is 36*S* + 3*W* − 2*R*.
//! - The ring of an extraordinary vertex is gathered once for all its faces, which see it turned.
//!
//! Faces with a plain corner are rare and are left to their stencils.

use super::stencil::{PLAIN, Stencil, inner_valence, mark_boundary, of_face};
use super::weights::{MAX_VALENCE, ROWS};
use super::{FRACTION_BITS, StepKind};
use crate::mesh::{Surface, next};

/// A vertex and what is around it.
#[derive(Clone, Copy, Default)]
struct Fan {
    /// The sum of the ring.
    ring: [i64; 3],
    /// A corner of the vertex.
    corner: u32,
    /// Its valence if it is ordinary or extraordinary, else [`PLAIN`].
    valence: u32,
}

const ORDINARY: u32 = 6;

/// As [`predict_regular`](super::predict_regular) for a √3 step. Time O(n).
pub(super) fn predict(coarse: &Surface, kind: StepKind, positions: &[[i32; 3]]) -> Vec<[i64; 3]> {
    let fans = fans(coarse, kind, positions);
    let mut sums = extraordinary(coarse, &fans, positions);
    if coarse.virtuals == 0 {
        for f in 0..coarse.faces() {
            let sum = &mut sums[f as usize];
            each(coarse, kind, f, &fans, positions, *sum, |estimate| *sum = estimate);
        }
        return sums;
    }
    let mut predicted = Vec::with_capacity(sums.len());
    for f in (0..coarse.faces()).filter(|&f| !coarse.is_virtual_face(f)) {
        each(coarse, kind, f, &fans, positions, sums[f as usize], |estimate| predicted.push(estimate));
    }
    predicted
}

/// Gives the estimates of the new vertices of real face `f`, whose extraordinary corners' rules have this sum.
#[inline(always)]
fn each(
    coarse: &Surface,
    kind: StepKind,
    f: u32,
    fans: &[Fan],
    positions: &[[i32; 3]],
    sum: [i64; 3],
    mut give: impl FnMut([i64; 3]),
) {
    let valences = coarse.face(f).map(|v| fans[v as usize].valence);
    if valences == [ORDINARY; 3] {
        give(regular(coarse, f, fans, positions));
    } else if valences.contains(&PLAIN.into()) {
        by_stencil(coarse, kind, f, valences.map(|n| n as u8), positions, &mut give);
    } else {
        give(mean(sum, valences.iter().filter(|&&n| n != ORDINARY).count()));
    }
}

#[cold]
fn by_stencil(
    coarse: &Surface,
    kind: StepKind,
    f: u32,
    valences: [u8; 3],
    positions: &[[i32; 3]],
    give: &mut dyn FnMut([i64; 3]),
) {
    of_face(&mut Stencil::default(), coarse, kind, f, valences, |s| give(s.fixed(positions, FRACTION_BITS)));
}

fn fans(coarse: &Surface, kind: StepKind, positions: &[[i32; 3]]) -> Vec<Fan> {
    let mut fans = vec![Fan::default(); coarse.vertices as usize];
    for (f, t) in (0..).zip(coarse.vertex.chunks_exact(3)) {
        for (k, v, after) in [(0, t[0], t[1]), (1, t[1], t[2]), (2, t[2], t[0])] {
            let fan = &mut fans[v as usize];
            let point = positions[after as usize];
            (0..3).for_each(|axis| fan.ring[axis] += i64::from(point[axis]));
            fan.corner = 3 * f + k;
            fan.valence += 1;
        }
    }
    for fan in &mut fans {
        fan.valence = inner_valence(fan.valence).into();
    }
    mark_boundary(coarse, kind, |v| fans[v as usize].valence = PLAIN.into());
    fans
}

/// For each face the sum of its extraordinary corners' own rules, at the scale of [`ROWS`].
fn extraordinary(coarse: &Surface, fans: &[Fan], positions: &[[i32; 3]]) -> Vec<[i64; 3]> {
    let mut sums = vec![[0; 3]; coarse.faces() as usize];
    let rows = &*ROWS;
    // The ring twice over: then a face sees the members in a row, wherever it begins.
    let mut ring = [[0i64; 3]; 2 * MAX_VALENCE];
    let mut faces = [0; MAX_VALENCE];
    let is_extraordinary = |fan: &&Fan| ![ORDINARY, PLAIN.into()].contains(&fan.valence);
    for fan in fans.iter().filter(is_extraordinary) {
        let n = fan.valence as usize;
        let (centre, weights) = (i64::from(rows[n][0]), &rows[n][1..=n]);
        for (j, c) in coarse.fan(fan.corner).take(n).enumerate() {
            faces[j] = c / 3;
            ring[j] = positions[coarse.at(next(c)) as usize].map(i64::from);
            ring[j + n] = ring[j];
        }
        let middle = positions[coarse.at(fan.corner) as usize].map(|x| centre * i64::from(x));
        for (j, &f) in faces[..n].iter().enumerate() {
            let mut sum = middle;
            for (&weight, member) in weights.iter().zip(&ring[j..j + n]) {
                (0..3).for_each(|axis| sum[axis] += i64::from(weight) * member[axis]);
            }
            let of_face = &mut sums[f as usize];
            (0..3).for_each(|axis| of_face[axis] += sum[axis]);
        }
    }
    sums
}

/// The mean of `count` rules, one to three, from their sum at the scale of [`ROWS`], 2²⁴.
#[inline(always)]
fn mean(sum: [i64; 3], count: usize) -> [i64; 3] {
    const SPARE: u32 = 24 - FRACTION_BITS;
    match count {
        1 => sum.map(|s| (s + (1 << (SPARE - 1))) >> SPARE),
        2 => sum.map(|s| (s + (1 << SPARE)) >> (SPARE + 1)),
        _ => sum.map(|s| (s + (3 << (SPARE - 1))).div_euclid(3 << SPARE)),
    }
}

/// The regular rule for face `f`.
#[inline(always)]
fn regular(coarse: &Surface, f: u32, fans: &[Fan], positions: &[[i32; 3]]) -> [i64; 3] {
    let mut sum = [0; 3];
    for c in 3 * f..3 * f + 3 {
        let v = coarse.at(c) as usize;
        let (corner, wing) = (positions[v], positions[coarse.at(coarse.across(c)) as usize]);
        for axis in 0..3 {
            sum[axis] += 36 * i64::from(corner[axis]) + 3 * i64::from(wing[axis]) - 2 * fans[v].ring[axis];
        }
    }
    // Rounded to nearest with halves upwards.
    sum.map(|s| ((s << (FRACTION_BITS + 1)) + 81).div_euclid(2 * 81))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::subdivide::for_each_stencil;
    use crate::subdivide::shapes::{Random, regular_steps};

    #[test]
    fn sums_over_rings_give_what_the_stencils_do() {
        let mut random = Random::new(9);
        for (name, coarse, kind) in regular_steps() {
            if kind == StepKind::Butterfly {
                continue;
            }
            for size in [50, 1 << 28, i32::MAX as u32 / 2] {
                let at = random.points(coarse.vertices, size);
                let mut expected = Vec::new();
                for_each_stencil(&coarse, kind, |_, s| expected.push(s.fixed(&at, FRACTION_BITS)));
                assert_eq!(predict(&coarse, kind, &at), expected, "{name}");
            }
        }
    }
}
