//! Integer lattices: what the integers of a file stand for, and which lattice suits a mesh.
//!
//! Encoder, decoder and `verify` share the arithmetic here. It uses only operations that
//! IEEE 754 defines to the last bit (`+ − · /` and conversions on `f64`) and truncation to
//! integers, so every platform gets the same lattice point and the same `f32`.

use super::{Mesh, Precision};

/// The lattice below the exact bits has at most 2^REFINED_BITS steps along its longest side.
const REFINED_BITS: i32 = 22;
/// Bits of the largest lattice index in the file.
const INDEX_BITS: i32 = 62;
/// Exponents of the least and greatest powers of two that an `f32` can hold.
const LEAST_EXPONENT: i32 = -149;
const GREATEST_EXPONENT: i32 = 127;
/// Powers of ten; each is exact.
const POWERS_OF_TEN: [f64; 10] = [1e0, 1e1, 1e2, 1e3, 1e4, 1e5, 1e6, 1e7, 1e8, 1e9];

/// A [`Precision`] made ready to convert many positions.
///
/// Nothing here panics or leaves the finite numbers, whatever the fields say: indices and
/// positions beyond their types are clamped.
#[derive(Clone, Debug)]
pub(crate) enum Lattice {
    /// Points `origin + q · step`, `0 ≤ q ≤ top`, of a box with longest side `side`.
    Box { origin: [f64; 3], side: f64, step: f64, top: f64 },
    /// Points `(origin + q · step) / 10^exponent`; a position belongs to the nearest one.
    Decimal { exponent: u8, step: i64, origin: [i64; 3] },
    /// Points `(origin + q) · step`; a position belongs to the greatest one that is not above it.
    Binary { step: f64, origin: [i64; 3] },
}

impl Lattice {
    /// The lattice that `precision` states.
    pub fn new(precision: &Precision) -> Self {
        match *precision {
            Precision::Lattice { bits, origin, side } => {
                let top = ((1u64 << bits.min(32)) - 1) as f64;
                Lattice::Box { origin: origin.map(f64::from), side, step: side / top, top }
            }
            Precision::Decimal { exponent, digits, origin } => {
                Lattice::Decimal { exponent, step: decimal_step(digits), origin }
            }
            Precision::Binary { exponent, origin } | Precision::Refined { exponent, origin } => {
                let exponent = i32::from(exponent).clamp(LEAST_EXPONENT, GREATEST_EXPONENT);
                Lattice::Binary { step: power_of_two(exponent), origin }
            }
        }
    }

    /// The lattice point of `position`: exact on a grid that the position lies on.
    pub fn quantise(&self, position: [f32; 3]) -> [i32; 3] {
        let clamped = |q: i64| q.clamp(i32::MIN.into(), i32::MAX.into()) as i32;
        std::array::from_fn(|axis| {
            let x = f64::from(position[axis]);
            match self {
                Lattice::Box { side, .. } if *side == 0.0 => 0,
                // From 0 to `top`, which an `i32` holds for a mesh: what is cut off is above the floor.
                Lattice::Box { origin, side, top, .. } => {
                    ((x - origin[axis]) * top / side + 0.5).clamp(0.0, *top) as i32
                }
                Lattice::Decimal { exponent, step, origin } => {
                    let index = decimal_index(position[axis], *exponent).saturating_add(step / 2);
                    clamped(index.saturating_sub(origin[axis]).div_euclid(*step))
                }
                Lattice::Binary { step, origin } => clamped(floor(x / step).saturating_sub(origin[axis])),
            }
        })
    }

    /// The position that the lattice point `q` stands for; finite and never −0.
    pub fn value(&self, q: [i32; 3]) -> [f32; 3] {
        std::array::from_fn(|axis| {
            let index = |origin: &[i64; 3], step: i64| origin[axis].saturating_add(i64::from(q[axis]) * step);
            match self {
                Lattice::Box { origin, step, .. } => finite(origin[axis] + f64::from(q[axis]) * step),
                Lattice::Decimal { exponent, step, origin } => decimal_value(index(origin, *step), *exponent),
                Lattice::Binary { step, origin } => finite(index(origin, 1) as f64 * step),
            }
        })
    }
}

/// The cubic lattice with 2^`bits` points along the longest side of `mesh`.
pub(crate) fn box_lattice(mesh: &Mesh, bits: u8) -> Precision {
    let (low, high) = bounds(mesh);
    let side = longest_side(low, high);
    // Adding 0 turns −0 into 0: which of the two came first must not show in the file.
    Precision::Lattice { bits, origin: low.map(|x| x + 0.0), side }
}

/// The same lattice over a cube whose side is `times` as long, at least 1; others stay as they are.
pub(crate) fn stretched(precision: Precision, times: f64) -> Precision {
    match precision {
        Precision::Lattice { bits, origin, side } => Precision::Lattice { bits, origin, side: side * times },
        other => other,
    }
}

/// The finest lattice of power-of-two step with at most 2^22 steps along the longest side whose
/// indices stay within 2^62.
pub(crate) fn refined_grid(mesh: &Mesh) -> Precision {
    let (low, high) = bounds(mesh);
    let side = longest_side(low, high);
    let exponent = (LEAST_EXPONENT..=GREATEST_EXPONENT)
        .find(|&e| side <= power_of_two(e + REFINED_BITS) && binary_origin(mesh, e).is_some())
        .unwrap_or(GREATEST_EXPONENT);
    let origin = binary_origin(mesh, exponent).unwrap_or([0; 3]);
    Precision::Refined { exponent: exponent as i16, origin }
}

/// The index on the lattice of step 2^`exponent` of the least coordinate on each axis, if
/// 2^`exponent` is an `f32` and the indices of all coordinates stay within 2^62.
pub(crate) fn binary_origin(mesh: &Mesh, exponent: i32) -> Option<[i64; 3]> {
    if !(LEAST_EXPONENT..=GREATEST_EXPONENT).contains(&exponent) {
        return None;
    }
    let (low, high) = bounds(mesh);
    let far = power_of_two(exponent + INDEX_BITS);
    let fit = low.iter().chain(&high).all(|&x| f64::from(x).abs() < far);
    fit.then(|| low.map(|x| floor(f64::from(x) / power_of_two(exponent))))
}

/// The integer nearest to `x` · 10^`exponent`, clamped to `i64`: the floor of the product, which is
/// exact below 2^52, and a half.
pub(crate) fn decimal_index(x: f32, exponent: u8) -> i64 {
    floor(f64::from(x) * power_of_ten(exponent) + 0.5)
}

/// `index` / 10^`exponent`, the quotient of two `f64` rounded to a finite `f32`; never −0.
pub(crate) fn decimal_value(index: i64, exponent: u8) -> f32 {
    finite(index as f64 / power_of_ten(exponent))
}

/// Units of the last digit in a step of a lattice that lacks `digits` digits.
pub(crate) fn decimal_step(digits: u8) -> i64 {
    10i64.pow(digits.min(9).into())
}

fn power_of_ten(exponent: u8) -> f64 {
    POWERS_OF_TEN[usize::from(exponent.min(9))]
}

/// The least and greatest coordinate on each axis; zeros for a mesh without vertices.
pub(crate) fn bounds(mesh: &Mesh) -> ([f32; 3], [f32; 3]) {
    let Some(&first) = mesh.positions.first() else {
        return ([0.0; 3], [0.0; 3]);
    };
    mesh.positions.iter().fold((first, first), |(mut low, mut high), p| {
        for axis in 0..3 {
            low[axis] = if p[axis] < low[axis] { p[axis] } else { low[axis] };
            high[axis] = if p[axis] > high[axis] { p[axis] } else { high[axis] };
        }
        (low, high)
    })
}

/// The longest side of a box; in `f64`, which two finite `f32` cannot overflow.
fn longest_side(low: [f32; 3], high: [f32; 3]) -> f64 {
    (0..3).map(|axis| f64::from(high[axis]) - f64::from(low[axis])).fold(0.0, f64::max)
}

/// The nearest `f32`, ties to even, of a value clamped to the finite range; 0 for −0.
fn finite(x: f64) -> f32 {
    x.clamp(f32::MIN.into(), f32::MAX.into()) as f32 + 0.0
}

/// The greatest integer that is not above `x`, clamped to `i64`.
fn floor(x: f64) -> i64 {
    let truncated = x as i64;
    truncated.saturating_sub(i64::from(truncated as f64 > x))
}

/// 2^`exponent`, for −1022 ≤ `exponent` ≤ 1023.
pub(crate) fn power_of_two(exponent: i32) -> f64 {
    f64::from_bits(((1023 + exponent) as u64) << 52)
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    const TINY: f32 = f32::from_bits(1);

    fn points(positions: &[[f32; 3]]) -> Mesh {
        Mesh { positions: positions.to_vec(), faces: Vec::new() }
    }

    fn assert_exact(mesh: &Mesh, precision: &Precision) {
        let lattice = Lattice::new(precision);
        for &p in &mesh.positions {
            let q = lattice.quantise(p);
            assert!(q.iter().all(|&q| (0..=1 << 24).contains(&q)), "{q:?}");
            assert_eq!(lattice.value(q), p, "{precision:?}");
        }
    }

    #[test]
    fn helpers_agree_with_the_standard_library() {
        for e in [-1022, -149, -1, 0, 1, 62, 127, 1023] {
            assert_eq!(power_of_two(e), 2f64.powi(e));
        }
        for x in [0.0, -0.0, 0.5, -0.5, 1.0, -1.0, 2.999, -2.999, 1e18, -1e18] {
            assert_eq!(floor(x) as f64, x.floor());
        }
        assert_eq!((floor(f64::INFINITY), floor(f64::NEG_INFINITY)), (i64::MAX, i64::MIN));
    }

    #[test]
    fn a_box_lattice_hits_its_corners_and_stays_within_half_a_step() {
        let mesh = points(&[[-1.0, 2.0, 0.25], [3.0, 2.5, 0.5], [0.1, 2.2, 0.3]]);
        for bits in 4..=24 {
            let precision = box_lattice(&mesh, bits);
            let Precision::Lattice { side, .. } = precision else { panic!() };
            assert_eq!(side, 4.0);
            let lattice = Lattice::new(&precision);
            assert_eq!(lattice.quantise([-1.0, 2.0, 0.25]), [0; 3]);
            assert_eq!(lattice.quantise([3.0, 2.0, 0.25]), [(1 << bits) - 1, 0, 0]);
            assert_eq!(lattice.value([(1 << bits) - 1, 0, 0]), [3.0, 2.0, 0.25]);
            let half = side / f64::from((1u32 << bits) - 1) / 2.0;
            for &p in &mesh.positions {
                let image = lattice.value(lattice.quantise(p));
                for axis in 0..3 {
                    let distance = (f64::from(image[axis]) - f64::from(p[axis])).abs();
                    assert!(distance <= half + 2e-7, "{bits} bits: {p:?} became {image:?}");
                }
            }
        }
    }

    #[test]
    fn a_box_lattice_of_no_extent_or_of_the_greatest_is_finite() {
        for mesh in [points(&[]), points(&[[-0.0; 3]]), points(&[[7.0, -7.0, TINY]; 2])] {
            let precision = box_lattice(&mesh, 12);
            let lattice = Lattice::new(&precision);
            for &p in &mesh.positions {
                assert_eq!(lattice.quantise(p), [0; 3]);
                assert_eq!(lattice.value([0; 3]), p);
            }
        }
        let mesh = points(&[[f32::MIN, 0.0, -TINY], [f32::MAX, 0.0, TINY]]);
        for bits in [4, 24] {
            let lattice = Lattice::new(&box_lattice(&mesh, bits));
            let top = (1 << bits) - 1;
            assert_eq!(mesh.positions.iter().map(|&p| lattice.quantise(p)[0]).collect::<Vec<_>>(), [0, top]);
            assert_eq!([lattice.value([0; 3])[0], lattice.value([top, 0, 0])[0]], [f32::MIN, f32::MAX]);
        }
    }

    #[test]
    fn a_box_lattice_does_not_show_which_zero_came_first() {
        let sign = |mesh: Mesh| match box_lattice(&mesh, 8) {
            Precision::Lattice { origin, .. } => origin.map(f32::to_bits),
            other => panic!("{other:?}"),
        };
        assert_eq!(sign(points(&[[-0.0; 3], [0.0; 3]])), sign(points(&[[0.0; 3], [-0.0; 3]])));
    }

    #[test]
    fn decimal_numbers_return_from_their_indices() {
        for exponent in 0..=9u8 {
            for index in [0i64, 1, -1, 5, 123_456, -7_999_999] {
                assert_eq!(decimal_index(decimal_value(index, exponent), exponent), index);
            }
        }
        assert_eq!(decimal_value(123_456, 6), 0.123_456);
        assert_eq!((decimal_index(-0.0, 3), decimal_value(0, 3).to_bits()), (0, 0));
        assert_eq!((decimal_index(f32::MAX, 9), decimal_index(f32::MIN, 9)), (i64::MAX, i64::MIN));
    }

    #[test]
    fn a_decimal_lattice_without_its_last_digits_has_the_nearest_point() {
        let precision = Precision::Decimal { exponent: 3, digits: 2, origin: [-1000, 0, 5] };
        let lattice = Lattice::new(&precision);
        assert_eq!(lattice.quantise([0.049, 0.05, 0.054]), [10, 1, 0]);
        assert_eq!(lattice.quantise([-0.051, -0.05, 0.055]), [9, 0, 1]);
        assert_eq!(lattice.value([10, 1, 1]), [0.0, 0.1, 0.105]);
    }

    #[test]
    fn a_refined_grid_is_fine_and_its_indices_fit() {
        for values in [
            &[1.0 / 3.0, 1e-9, 100.0][..],
            &[f32::MAX, f32::MIN, TINY],
            &[f32::MAX; 2],
            &[TINY, -TINY],
            &[0.0],
            &[],
        ] {
            let mut mesh = points(&values.iter().map(|&v| [v; 3]).collect::<Vec<_>>());
            mesh.positions.extend(values.first().map(|&v| [v, TINY, -TINY]));
            let precision = refined_grid(&mesh);
            let Precision::Refined { exponent, origin } = precision else { panic!() };
            assert!((-149..=127).contains(&exponent));
            assert!(origin.iter().all(|x| x.unsigned_abs() <= 1 << 62));
            let lattice = Lattice::new(&precision);
            let step = power_of_two(exponent.into());
            for &p in &mesh.positions {
                let q = lattice.quantise(p);
                assert!(q.iter().all(|&q| (0..=1 << 22).contains(&q)), "{q:?}");
                for axis in 0..3 {
                    let n = (origin[axis] + i64::from(q[axis])) as f64;
                    let x = f64::from(p[axis]);
                    assert!(n * step <= x && x < (n + 1.0) * step, "{x} in cell {n} of {step}");
                }
            }
        }
    }

    #[test]
    fn any_index_of_any_lattice_is_a_finite_position() {
        let far = 1i64 << 62;
        for precision in [
            Precision::Lattice {
                bits: 24,
                origin: [f32::MAX, f32::MIN, 0.0],
                side: 2.0 * f64::from(f32::MAX),
            },
            Precision::Decimal { exponent: 0, digits: 3, origin: [far, -far, 0] },
            Precision::Binary { exponent: 127, origin: [far, -far, 0] },
            Precision::Binary { exponent: -149, origin: [far, -far, 0] },
            Precision::Refined { exponent: 127, origin: [i64::MAX, i64::MIN, 0] },
        ] {
            let lattice = Lattice::new(&precision);
            for q in [i32::MIN, -1, 0, 1, i32::MAX] {
                assert!(lattice.value([q; 3]).iter().all(|x| x.is_finite()), "{precision:?}");
            }
            for x in [f32::MIN, -TINY, 0.0, f32::MAX] {
                lattice.quantise([x; 3]);
            }
        }
    }

    proptest! {
        #[test]
        fn values_of_a_box_lattice_return_to_their_points(
            bits in 4u8..=16, low in -1e3f32..1e3, side in 1e-1f32..1e6, q in 0i32..16
        ) {
            let mesh = points(&[[low; 3], [low + side, low, low]]);
            let lattice = Lattice::new(&box_lattice(&mesh, bits));
            let top = (1 << bits) - 1;
            // 16 bits and less are coarse against the 24 of an f32 of this box, unless it is far away.
            prop_assume!(side >= low.abs() / 64.0);
            let q = [q, top - q, top];
            prop_assert_eq!(lattice.quantise(lattice.value(q)), q);
        }

        #[test]
        fn numbers_with_few_digits_are_on_a_grid(
            n in prop::collection::vec(-8_000_000i32..8_000_000, 3..30), k in 0usize..=9
        ) {
            let values: Vec<f32> = n.iter().map(|&n| (f64::from(n) / POWERS_OF_TEN[k]) as f32).collect();
            let low = i64::from(*n.iter().min().unwrap());
            let precision = Precision::Decimal { exponent: k as u8, digits: 0, origin: [low; 3] };
            assert_exact(&points(&values.iter().map(|&v| [v; 3]).collect::<Vec<_>>()), &precision);
        }
    }
}
