//! Exactness: the bits of the coordinates that the lattice lacks.
//!
//! The finite floats in ascending order are −3.4·10³⁸ … −0, 0 … 3.4·10³⁸; they are numbered in
//! this order. On a grid that a mesh was made for, a coordinate is mostly the float that its lattice
//! point stands for, and now and then one a few numbers away: the other zero, or what a sum in
//! floats left of a decimal. What is coded is how many numbers away. On a lattice that means
//! nothing to the mesh, a coordinate is any of the floats in its cell; these are a run of numbers,
//! and what is coded is the place in the run. Everything here is integer arithmetic on the bits
//! of the floats.

use super::NumberModel;
use super::digits::Digits;
use crate::coding::Point;
use crate::coding::model::BitModel;
use crate::entropy::Coder;
use crate::mesh::Lattice;
use crate::{Error, Precision, Result};

/// Bits of a place that are learnt, from the highest; below they are equally likely.
const LEARNT: u32 = 8;
/// The number of the greatest finite float.
const LAST: i64 = 0x7f7f_ffff;

/// Codes the positions of the vertices at `points`. When encoding, `known` holds them.
///
/// # Errors
/// [`Error::Format`] if the precision leaves nothing open, or for a cell that no float lies in.
pub(super) fn code<C: Coder>(
    coder: &mut C,
    precision: &Precision,
    points: &[Point],
    known: &[[f32; 3]],
) -> Result<Vec<[f32; 3]>> {
    match *precision {
        Precision::Lattice { .. } => Err(damaged("the precision is that of a lattice")),
        Precision::Decimal { exponent, digits, origin } => {
            let mut digits = Digits::new(exponent, digits, origin, points.len());
            let expected = |coder: &mut C, v: usize, axis: usize| {
                digits.code(coder, axis, points[v][axis], known.get(v).map(|p| p[axis]))
            };
            code_offsets(coder, points.len(), known, expected)
        }
        Precision::Binary { .. } => {
            let lattice = Lattice::new(precision);
            code_offsets(coder, points.len(), known, |_, v, axis| lattice.value(points[v])[axis])
        }
        Precision::Refined { exponent, origin } => {
            let mut places = Places::new();
            let mut positions = Vec::with_capacity(points.len());
            for (v, point) in points.iter().enumerate() {
                if coder.exhausted() {
                    return Err(damaged("it ends early"));
                }
                let mut position = [0.0; 3];
                for axis in 0..3 {
                    let index = origin[axis].saturating_add(point[axis].into());
                    let number = known.get(v).map_or(0, |p| number_of(p[axis]));
                    let cell = cell(index, exponent.into()).ok_or_else(|| damaged("an empty cell"))?;
                    position[axis] = float_of(places.code(coder, axis, cell, number));
                }
                positions.push(position);
            }
            Ok(positions)
        }
    }
}

fn damaged(cause: &str) -> Error {
    Error::format("exactness section", cause)
}

/// Values of the bits of an exponent.
pub(super) const EXPONENTS: usize = 256;

/// Codes how far the coordinates of `count` vertices are from what is `expected` of a vertex on an
/// axis.
fn code_offsets<C: Coder>(
    coder: &mut C,
    count: usize,
    known: &[[f32; 3]],
    mut expected: impl FnMut(&mut C, usize, usize) -> f32,
) -> Result<Vec<[f32; 3]>> {
    let mut differs = BitModel::new([48, 2 * EXPONENTS], 1, 300);
    let mut offsets = NumberModel::new(EXPONENTS);
    let mut history = [0; 3];
    let mut last = 0;
    let mut positions = Vec::with_capacity(count);
    for v in 0..count {
        if coder.exhausted() {
            return Err(damaged("it ends early"));
        }
        let mut position = [0.0; 3];
        for axis in 0..3 {
            position[axis] = expected(coder, v, axis);
            let number = number_of(position[axis]);
            let offset = known.get(v).map_or(0, |p| number_of(p[axis]) - number);
            let exponent = exponent_bits(position[axis]);
            let zero = (position[axis] == 0.0) as usize;
            let contexts = [(axis * 2 + zero) * 8 + history[axis], exponent * 2 + last];
            last = differs.code(coder, offset != 0, 0, contexts) as usize;
            history[axis] = (history[axis] << 1 | last) & 7;
            if last == 1 {
                let number = number + offsets.code_signed(coder, offset, exponent);
                if !(-LAST - 1..=LAST).contains(&number) {
                    return Err(damaged("a coordinate that is not finite"));
                }
                position[axis] = float_of(number);
            }
        }
        positions.push(position);
    }
    Ok(positions)
}

/// The place of a float among those of its cell.
struct Places(BitModel<2>);

/// Numbers of bits that a place can have: a cell may hold half of all floats and more.
const SIZES: usize = 33;

impl Places {
    fn new() -> Self {
        Places(BitModel::new([SIZES << LEARNT, (3 * SIZES) << LEARNT], SIZES, 200))
    }

    /// Codes `number`, which lies in `first ..= last`.
    fn code<C: Coder>(&mut self, coder: &mut C, axis: usize, [first, last]: [i64; 2], number: i64) -> i64 {
        let (greatest, wanted) = ((last - first) as u64, (number - first) as u64);
        let size = 64 - greatest.leading_zeros();
        let (mut place, mut node) = (0, 1);
        for k in (0..size).rev() {
            let upper = place | 1 << k;
            if upper > greatest {
                continue;
            }
            let bit = wanted >> k & 1 == 1;
            let bit = if node >> LEARNT == 0 {
                let size = size as usize;
                let contexts = [size, axis * SIZES + size].map(|c| c << LEARNT | node);
                let bit = self.0.code(coder, bit, size, contexts);
                node = node << 1 | bit as usize;
                bit
            } else {
                coder.raw(bit as u32, 1) == 1
            };
            if bit {
                place = upper;
            }
        }
        first + place as i64
    }
}

/// The number of a finite float: ascending, −1 for −0, 0 for 0.
pub(super) fn number_of(x: f32) -> i64 {
    let magnitude = (x.to_bits() & 0x7fff_ffff) as i64;
    if x.is_sign_negative() { -magnitude - 1 } else { magnitude }
}

/// The bits of the exponent of a float.
pub(super) fn exponent_bits(x: f32) -> usize {
    (x.to_bits() >> 23 & 0xff) as usize
}

/// The float of a number.
fn float_of(number: i64) -> f32 {
    f32::from_bits(if number < 0 { (-number - 1) as u32 | 1 << 31 } else { number as u32 })
}

/// The numbers of the first and last float x with `index` · 2^`exponent` ≤ x <
/// (`index` + 1) · 2^`exponent`, if there is one.
pub(super) fn cell(index: i64, exponent: i32) -> Option<[i64; 2]> {
    let first = ceiling(index, exponent).max(-LAST - 1);
    let last = (ceiling(index.saturating_add(1), exponent) - 1).min(LAST);
    (first <= last).then_some([first, last])
}

/// The number of the first float that is not below `index` · 2^`exponent`; both zeros count as 0.
fn ceiling(index: i64, exponent: i32) -> i64 {
    match index {
        0 => -1,
        1.. => magnitude(index as u64, exponent, true),
        _ => -magnitude(index.unsigned_abs(), exponent, false) - 1,
    }
}

/// The bits of the float `index` · 2^`exponent`, rounded up or down to one; `index` > 0,
/// `exponent` ≥ −149. Beyond the finite floats, the bits of the infinity.
fn magnitude(index: u64, exponent: i32, up: bool) -> i64 {
    let top = index.ilog2() as i32;
    if top + exponent < -126 {
        // Subnormal: the bits count units of 2^−149.
        return (index << (exponent + 149)) as i64;
    }
    if top + exponent > 127 {
        return LAST + 1;
    }
    // 24 bits, the implicit leading one among them; rounding up may carry into the exponent.
    let mantissa = match top - 23 {
        shift @ 1.. => (index >> shift) + (up && index & ((1 << shift) - 1) != 0) as u64,
        shift => index << -shift,
    };
    (((top + exponent + 126) as i64) << 23) + mantissa as i64
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::entropy::{Decoder, Encoder};
    use proptest::prelude::*;

    #[test]
    fn numbers_ascend_with_the_floats_and_lead_back() {
        let tiny = f32::from_bits(1);
        let floats = [f32::MIN, -1.0, -f32::MIN_POSITIVE, -tiny, -0.0, 0.0, tiny, 0.1, 1.0, f32::MAX];
        assert!(floats.windows(2).all(|w| number_of(w[0]) < number_of(w[1])));
        assert!(floats.iter().all(|x| float_of(number_of(*x)).to_bits() == x.to_bits()));
    }

    #[test]
    fn coordinates_near_a_decimal_grid_cost_little_and_others_come_back_too() {
        let precision = Precision::Decimal { exponent: 6, digits: 0, origin: [-1_000_000; 3] };
        let lattice = Lattice::new(&precision);
        let coordinate = |i: usize| match i % 500 {
            0 => -0.0,
            1 => -1e-42,
            2 => 0.123_456_79,
            _ => (i * 7919 % 1_000_000) as f32 * 1e-6,
        };
        let known: Vec<_> = (0..3000).map(|i| [3 * i, 3 * i + 1, 3 * i + 2].map(coordinate)).collect();
        let points: Vec<Point> = known.iter().map(|&p| lattice.quantise(p)).collect();
        let mut encoder = Encoder::new();
        code(&mut encoder, &precision, &points, &known).unwrap();
        let bytes = encoder.finish();
        let decoded = code(&mut Decoder::new(&bytes), &precision, &points, &[]).unwrap();
        let same = |(a, b): (&f32, &f32)| a.to_bits() == b.to_bits();
        assert!(decoded.as_flattened().iter().zip(known.as_flattened()).all(same));
        // A product of floats is within one of the nearest to the decimal: 1.58 bits at most.
        assert!(bytes.len() < 9000 * 17 / 80, "{} bytes", bytes.len());
    }

    #[test]
    fn the_cells_of_a_lattice_share_out_the_floats() {
        // Quarters: around zero, at a power of two and where floats are rarer than cells.
        assert_eq!(cell(0, -2), Some([-1, number_of(0.25) - 1]));
        assert_eq!(cell(-1, -2), Some([number_of(-0.25), -2]));
        assert_eq!(cell(4, -2), Some([number_of(1.0), number_of(1.25) - 1]));
        assert_eq!(cell(1 << 26, -2), Some([number_of(16_777_216.0); 2]));
        assert_eq!(cell((1 << 26) + 1, -2), None);
        assert_eq!(cell(1, -149), Some([1, 1]));
        assert_eq!(cell(-1, 127), Some([number_of(-(2f32.powi(127))), -2]));
        assert_eq!(cell(1, 127), Some([number_of(2f32.powi(127)), LAST]));
        assert_eq!(cell(i64::MAX, 127), None);
    }

    proptest! {
        #[test]
        fn any_float_lies_in_the_cell_of_its_floor(bits: u32, exponent in -149i32..=127) {
            let x = f32::from_bits(bits);
            let index = f64::from(x) / 2f64.powi(exponent);
            prop_assume!(x.is_finite() && index.abs() < 2f64.powi(62));
            let [first, last] = cell(index.floor() as i64, exponent).unwrap();
            prop_assert!((first..=last).contains(&number_of(x)));
            prop_assert!(f64::from(float_of(first)) / 2f64.powi(exponent) >= index.floor());
        }

        #[test]
        fn any_coordinates_come_back(bits in prop::collection::vec(any::<[u32; 3]>(), 0..60), exponent in 66i16..=127) {
            let known: Vec<[f32; 3]> = bits
                .iter()
                .map(|p| p.map(f32::from_bits).map(|x| if x.is_finite() { x } else { -0.0 }))
                .collect();
            let precision = Precision::Refined { exponent, origin: [0; 3] };
            let lattice = Lattice::new(&precision);
            let known: Vec<_> = known.into_iter().filter(|p| {
                p.iter().all(|x| f64::from(*x).abs() < 2f64.powi(30 + i32::from(exponent)))
            }).collect();
            let points: Vec<Point> = known.iter().map(|&p| lattice.quantise(p)).collect();
            let mut encoder = Encoder::new();
            code(&mut encoder, &precision, &points, &known).unwrap();
            let bytes = encoder.finish();
            let decoded = code(&mut Decoder::new(&bytes), &precision, &points, &[]).unwrap();
            let bits = |p: &[[f32; 3]]| p.iter().map(|p| p.map(f32::to_bits)).collect::<Vec<_>>();
            prop_assert_eq!(bits(&decoded), bits(&known));
        }
    }
}
