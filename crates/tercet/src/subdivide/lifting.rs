//! The update step of the lifting scheme.
//!
//! Analysis of a level divides its vertices into even and odd ones, predicts and updates:
//! `e = odd − P(even)`, `even' = even + U(e)`. Synthesis undoes that in reverse:
//! `even = even' − U(e)`, `odd = e + P(even)`. As printed, the √3 lifting equations subtract
//! U(e) in both directions and so do not invert; of the two repairs, adding in the analysis is
//! the one that brings the coarse vertices nearer to the fine surface.

use super::stencil::COMMON_DENOMINATOR;
use super::{StepKind, for_each_stencil, predict_regular, round};
use crate::mesh::Surface;

/// How details move the vertices that a coarser level keeps.
///
/// The details are the same number of integers whichever rule is chosen; an update trades bits
/// for coarse levels that lie closer to the surface.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Update {
    /// Kept vertices stay where they are: coarse levels interpolate the fine one, at the fewest
    /// bits.
    #[default]
    None,
    /// U = Pᵀ/3. The columns of P sum to 2, so that a detail that is the same everywhere moves
    /// the kept vertices by 2/3 of it: the mean displacement of the fine vertices. At butterfly
    /// levels, where the columns sum to 3, it is Pᵀ/4 for the same reason.
    Third,
    /// U = Pᵀ, equation 9 of the paper as it stands: its gain of 2 (of butterfly levels, 3)
    /// overshoots about threefold (fourfold). For comparison.
    Paper,
}

/// U(e): how far each coarse vertex moves for the `details` of the new vertices.
///
/// `details` are in the order of new vertices. Exact arithmetic, rounded once per coordinate to
/// nearest with halves upwards and held within 32 bits; where many details meet, the caller adds
/// and subtracts with wrap-around. Linear time.
pub(crate) fn update(coarse: &Surface, kind: StepKind, details: &[[i32; 3]], rule: Update) -> Vec<[i32; 3]> {
    let shares = match (rule, kind) {
        (Update::None, _) => return vec![[0; 3]; coarse.vertices as usize],
        (Update::Third, StepKind::Butterfly) => 4,
        (Update::Third, _) => 3,
        (Update::Paper, _) => 1,
    };
    let mut sums = vec![[0i128; 3]; coarse.vertices as usize];
    for_each_stencil(coarse, kind, |i, stencil| {
        let unit = COMMON_DENOMINATOR / stencil.denominator;
        for &(v, weight) in &stencil.terms {
            let weight = i128::from(i64::from(weight) * unit);
            for (sum, &detail) in sums[v as usize].iter_mut().zip(&details[i]) {
                *sum += weight * i128::from(detail);
            }
        }
    });
    let one = i128::from(shares * COMMON_DENOMINATOR);
    let round =
        |sum: i128| (2 * sum + one).div_euclid(2 * one).clamp(i32::MIN.into(), i32::MAX.into()) as i32;
    sums.into_iter().map(|sum| sum.map(round)).collect()
}

/// The update of one analysis step, on lattice positions.
///
/// The details of the `odd` vertices (in the order of new vertices) move the `even` ones;
/// afterwards each odd entry is its detail beside the rounded prediction from the moved
/// vertices, which is what a decoder can place before it knows any detail.
pub(crate) fn lift_positions(
    coarse: &Surface,
    kind: StepKind,
    even: &mut [[i32; 3]],
    odd: &mut [[i32; 3]],
    rule: Update,
) {
    let details = shift_all(odd, &predict_regular(coarse, kind, even), i32::wrapping_sub);
    for (even, by) in even.iter_mut().zip(update(coarse, kind, &details, rule)) {
        *even = [0, 1, 2].map(|k| even[k].wrapping_add(by[k]));
    }
    odd.copy_from_slice(&shift_all(&details, &predict_regular(coarse, kind, even), i32::wrapping_add));
}

/// Undoes [`lift_positions`] exactly; `positions` holds the even vertices, then the odd ones.
pub(crate) fn unlift_positions(coarse: &Surface, kind: StepKind, positions: &mut [[i32; 3]], rule: Update) {
    let (even, odd) = positions.split_at_mut(coarse.vertices as usize);
    let details = shift_all(odd, &predict_regular(coarse, kind, even), i32::wrapping_sub);
    for (even, by) in even.iter_mut().zip(update(coarse, kind, &details, rule)) {
        *even = [0, 1, 2].map(|k| even[k].wrapping_sub(by[k]));
    }
    odd.copy_from_slice(&shift_all(&details, &predict_regular(coarse, kind, even), i32::wrapping_add));
}

/// Adds or subtracts the rounded predictions.
fn shift_all(points: &[[i32; 3]], predicted: &[[i64; 3]], by: fn(i32, i32) -> i32) -> Vec<[i32; 3]> {
    let rounded = predicted.iter().map(|&q| round(q));
    points.iter().zip(rounded).map(|(p, q)| [0, 1, 2].map(|k| by(p[k], q[k]))).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::subdivide::predict_regular;
    use crate::subdivide::shapes::{self, Random, regular_steps};

    type Points = Vec<[i32; 3]>;

    fn combine(a: &[[i32; 3]], b: &[[i32; 3]], op: fn(i32, i32) -> i32) -> Points {
        a.iter().zip(b).map(|(a, b)| [0, 1, 2].map(|k| op(a[k], b[k]))).collect()
    }

    fn predict(coarse: &Surface, kind: StepKind, even: &[[i32; 3]]) -> Points {
        let nearest = |q: i64| ((q + 128) >> 8) as i32;
        predict_regular(coarse, kind, even).into_iter().map(|q| q.map(nearest)).collect()
    }

    #[test]
    fn as_printed_the_two_directions_do_not_invert_and_corrected_they_do() {
        let mut random = Random::new(5);
        for (name, coarse, kind) in regular_steps() {
            let even = random.points(coarse.vertices, 10_000);
            let predicted = predict(&coarse, kind, &even);
            let odd = random.points(predicted.len() as u32, 10_000);
            let details = combine(&odd, &predicted, i32::wrapping_sub);
            for rule in [Update::None, Update::Third, Update::Paper] {
                let u = update(&coarse, kind, &details, rule);
                let synthesise = |sent: &[[i32; 3]]| {
                    let even = combine(sent, &u, i32::wrapping_sub);
                    let odd = combine(&details, &predict(&coarse, kind, &even), i32::wrapping_add);
                    (even, odd)
                };
                let corrected = combine(&even, &u, i32::wrapping_add);
                assert_eq!(synthesise(&corrected), (even.clone(), odd.clone()), "{name}");
                let printed = combine(&even, &u, i32::wrapping_sub);
                let same = synthesise(&printed) == (even.clone(), odd.clone());
                assert_eq!(same, rule == Update::None, "{name}");
            }
        }
    }

    #[test]
    fn what_lifting_moves_unlifting_brings_back() {
        let mut random = Random::new(6);
        for (name, coarse, kind) in regular_steps() {
            let even = random.points(coarse.vertices, 10_000);
            let odd = random.points(predict(&coarse, kind, &even).len() as u32, 10_000);
            let original = [even.clone(), odd.clone()].concat();
            for rule in [Update::Third, Update::Paper] {
                let (mut even, mut odd) = (even.clone(), odd.clone());
                lift_positions(&coarse, kind, &mut even, &mut odd, rule);
                let mut lifted = [even, odd].concat();
                assert!(lifted != original, "{name}");
                unlift_positions(&coarse, kind, &mut lifted, rule);
                assert_eq!(lifted, original, "{name}");
            }
        }
    }

    /// The mean square of kept vertices on a surface of nothing but noise, after `by` U(e).
    fn noise_left(kind: StepKind, rule: Update, by: fn(i32, i32) -> i32) -> f64 {
        let torus = shapes::torus(18, 18);
        let mut random = Random::new(8);
        let mut noise = |n: u32| random.points(n, 1000);
        let even = noise(torus.vertices);
        let odd = noise(predict(&torus, kind, &even).len() as u32);
        let details = combine(&odd, &predict(&torus, kind, &even), i32::wrapping_sub);
        let moved = combine(&even, &update(&torus, kind, &details, rule), by);
        let square = |p: &[i32; 3]| p.iter().map(|&x| f64::from(x).powi(2)).sum::<f64>();
        moved.iter().map(square).sum::<f64>() / moved.len() as f64
    }

    /// Noise is what a coarse surface should average away: the erratum of the sign makes it worse,
    /// that of the normalisation overshoots.
    #[test]
    fn the_normalised_update_with_the_corrected_sign_is_the_best_and_the_printed_ones_are_worse_than_none() {
        for kind in [StepKind::Sqrt3Even, StepKind::Butterfly] {
            let none = noise_left(kind, Update::None, i32::wrapping_add);
            let corrected = noise_left(kind, Update::Third, i32::wrapping_add);
            assert!(corrected < 0.7 * none, "{kind:?}: {corrected} of {none}");
            let printed_sign = noise_left(kind, Update::Third, i32::wrapping_sub);
            assert!(printed_sign > 1.5 * none, "{kind:?}: {printed_sign} of {none}");
            let printed_gain = noise_left(kind, Update::Paper, i32::wrapping_add);
            assert!(printed_gain > 1.5 * corrected, "{kind:?}: {printed_gain} of {none}");
            let as_printed = noise_left(kind, Update::Paper, i32::wrapping_sub);
            assert!(as_printed > 3.0 * none, "{kind:?}: {as_printed} of {none}");
        }
    }

    #[test]
    fn a_constant_detail_moves_vertices_of_butterfly_levels_by_three_quarters_or_thrice() {
        let torus = shapes::torus(6, 6);
        let details = vec![[400, -4, 0]; 3 * torus.vertices as usize];
        let third = update(&torus, StepKind::Butterfly, &details, Update::Third);
        assert!(third.iter().all(|&u| u == [300, -3, 0]));
        let paper = update(&torus, StepKind::Butterfly, &details, Update::Paper);
        assert!(paper.iter().all(|&u| u == [1200, -12, 0]));
    }

    #[test]
    fn a_constant_detail_moves_kept_vertices_by_two_thirds_or_twice() {
        let torus = shapes::torus(6, 6);
        let details = vec![[300, -3, 0]; torus.faces() as usize];
        let third = update(&torus, StepKind::Sqrt3Even, &details, Update::Third);
        assert!(third.iter().all(|&u| u == [200, -2, 0]));
        let paper = update(&torus, StepKind::Sqrt3Even, &details, Update::Paper);
        assert!(paper.iter().all(|&u| u == [600, -6, 0]));
    }

    #[test]
    fn a_single_detail_spreads_by_its_stencil_rounded_once() {
        let torus = shapes::torus(6, 6);
        let mut details = vec![[0; 3]; torus.faces() as usize];
        details[0] = [81, 8, -8];
        let moved = update(&torus, StepKind::Sqrt3Even, &details, Update::Paper);
        // 32·8/81 = 3.16 and −2·8/81 = −0.2.
        assert_eq!(moved[0], [32, 3, -3]);
        assert_eq!(moved.iter().filter(|u| **u == [-2, 0, 0]).count(), 6);
        assert_eq!(moved.iter().filter(|u| **u == [-1, 0, 0]).count(), 3);
        details[0] = [i32::MAX, i32::MIN, 0];
        update(&torus, StepKind::Sqrt3Even, &details, Update::Paper);
    }
}
