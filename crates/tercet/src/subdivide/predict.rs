//! Positions of a regular step's new vertices: predicted on the lattice, or subdivided in floats.

use super::{Refined, StepKind, for_each_stencil, refine_regular, rings};
use crate::mesh::Surface;

/// Fraction bits of a prediction.
pub(crate) const FRACTION_BITS: u32 = 8;

/// The lattice point nearest to a prediction, halves upwards.
#[inline]
pub(crate) fn round(prediction: [i64; 3]) -> [i32; 3] {
    prediction.map(|x| ((x + (1 << (FRACTION_BITS - 1))) >> FRACTION_BITS) as i32)
}

/// Predicts each new vertex of a regular step from the positions of the coarse vertices.
///
/// `positions` has one lattice point a vertex; those of virtual vertices are not read. The
/// answer, in the order of new vertices, is the stencil's value in 1/256 of the lattice step,
/// rounded once to nearest with halves upwards: the same integers on every machine. Moving the
/// positions by a lattice vector moves the answer by exactly as much. Linear time.
pub(crate) fn predict_regular(coarse: &Surface, kind: StepKind, positions: &[[i32; 3]]) -> Vec<[i64; 3]> {
    if kind != StepKind::Butterfly {
        return rings::predict(coarse, kind, positions);
    }
    let mut predicted = Vec::with_capacity(coarse.vertex.len() / 2);
    for_each_stencil(coarse, kind, |_, stencil| predicted.push(stencil.fixed(positions, FRACTION_BITS)));
    predicted
}

/// Refines `surface` by one regular step and places the new vertices.
///
/// `positions` has one point a vertex, virtual ones included (their points are carried along
/// and not read); so has the answer. √3 steps in sequence alternate, starting with
/// `Sqrt3Even`; then an odd step always applies. `None` if `kind` does not apply to `surface`, as for
/// [`refine_regular`]. Linear time.
pub(crate) fn subdivide_surface(
    surface: &Surface,
    positions: &[[f64; 3]],
    kind: StepKind,
) -> Option<(Surface, Vec<[f64; 3]>)> {
    let Refined { surface: fine, .. } = refine_regular(surface, kind)?;
    let mut placed = Vec::with_capacity(fine.vertices as usize);
    placed.extend_from_slice(positions);
    for_each_stencil(surface, kind, |_, stencil| placed.push(stencil.real(positions)));
    Some((fine, placed))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::subdivide::shapes::{Random, regular_steps};

    #[test]
    fn integer_prediction_commutes_with_integer_translation() {
        let mut random = Random::new(1);
        let shift = [7919, -104_729, 1];
        for (name, coarse, kind) in regular_steps() {
            let at = random.points(coarse.vertices, 1 << 20);
            let moved: Vec<_> = at.iter().map(|p| [0, 1, 2].map(|k| p[k] + shift[k])).collect();
            let predicted = predict_regular(&coarse, kind, &at);
            let expected: Vec<_> =
                predicted.iter().map(|q| [0, 1, 2].map(|k| q[k] + 256 * i64::from(shift[k]))).collect();
            assert_eq!(predict_regular(&coarse, kind, &moved), expected, "{name}");
        }
    }

    #[test]
    fn integer_and_real_positions_agree_to_half_a_unit() {
        let mut random = Random::new(2);
        for (name, coarse, kind) in regular_steps() {
            let at = random.points(coarse.vertices, 1 << 20);
            let real: Vec<_> = at.iter().map(|p| p.map(f64::from)).collect();
            let fixed = predict_regular(&coarse, kind, &at);
            let (fine, placed) = subdivide_surface(&coarse, &real, kind).unwrap();
            assert_eq!(placed.len(), fine.vertices as usize);
            assert_eq!(placed[..real.len()], real);
            for (q, x) in fixed.iter().zip(&placed[real.len()..]) {
                for k in 0..3 {
                    assert!((q[k] as f64 - 256.0 * x[k]).abs() < 0.5001, "{name}");
                }
            }
        }
    }

    #[test]
    fn subdivision_commutes_with_affine_maps() {
        let mut random = Random::new(4);
        let map =
            |p: &[f64; 3]| [2.0 * p[0] - p[1] + 0.5, p[0] + 3.0 * p[2] - 4.0, 0.25 * p[1] - p[2] + p[0]];
        for (name, coarse, kind) in regular_steps() {
            let at: Vec<_> = random.points(coarse.vertices, 1000).iter().map(|p| p.map(f64::from)).collect();
            let mapped: Vec<_> = at.iter().map(map).collect();
            let (_, first) = subdivide_surface(&coarse, &mapped, kind).unwrap();
            let (_, last) = subdivide_surface(&coarse, &at, kind).unwrap();
            for (x, y) in first.iter().zip(&last) {
                let y = map(y);
                assert!((0..3).all(|k| (x[k] - y[k]).abs() < 1e-8), "{name}");
            }
        }
    }
}
