//! Lengths, areas and directions of faces, to two digits.
//!
//! Everything here serves contexts or a guess, so that two digits are enough: reciprocal lengths
//! come from a table, logarithms are linear between powers of two.

use super::vector::{Vector, cross, dot, shrink};

/// In place of the area of a virtual face.
pub(crate) const VIRTUAL: i16 = i16::MIN;

/// A face; 6 bytes.
#[derive(Clone, Copy)]
pub(crate) struct FaceShape {
    /// Logarithm of double the area in 1/32 octaves, or [`VIRTUAL`].
    pub area: i16,
    /// 1 / double the area.
    pub inverse: Inverse,
}

/// The reciprocal of a length: `mantissa` / 2^`exponent`.
#[derive(Clone, Copy, Default)]
pub(crate) struct Inverse {
    mantissa: u16,
    exponent: u8,
}

/// 2¹⁸ / √(m + ½) for the mantissa m of a square, 64..256.
static INVERSE_ROOT: [u16; 256] = {
    let mut table = [0; 256];
    let mut m = 64u64;
    while m < 256 {
        table[m as usize] = ((1u64 << 37) / (2 * m + 1)).isqrt() as u16;
        m += 1;
    }
    table
};

impl Inverse {
    /// Of the length of `a`, to one part in 128; also log₂(|a|² + 1) / 2 in 1/32.
    #[inline(always)]
    fn of_length(a: Vector) -> (Inverse, i32) {
        let (a, shrunk) = shrink(a);
        let square = dot(a, a) as u64 + 1;
        let zeros = square.leading_zeros();
        let highest = square << zeros;
        // What is left after an even shift has seven or eight bits.
        let odd = !zeros & 1;
        let shift = 57 - (zeros + odd) as i32;
        let inverse = Inverse {
            mantissa: INVERSE_ROOT[(highest >> (57 - odd)) as usize & 255],
            exponent: (18 + shift / 2 + shrunk as i32) as u8,
        };
        // As `log2_fixed`, which would count the zeros again.
        let log = ((62 - zeros as i32) << 5) + (highest >> 58) as i32;
        (inverse, log / 2 + 32 * shrunk as i32)
    }

    /// Half of each of the `squares` (below 2⁶¹) over the length, in 1/256, at most `most`.
    #[inline(always)]
    pub fn halves(self, squares: [i64; 3], most: i16) -> [i16; 3] {
        let all = squares[0] | squares[1] | squares[2];
        let (mantissa, exponent) = (self.mantissa as i64, self.exponent - 7);
        let halves = if all < 1 << 46 {
            squares.map(|x| (x * mantissa) >> exponent)
        } else {
            squares.map(|x| ((x >> 20) * mantissa) >> exponent.saturating_sub(20))
        };
        halves.map(|x| x.min(most.into()) as i16)
    }

    /// `x` (below 2⁶²) over the length, with `bits` ≤ 14 bits behind the point.
    #[inline(always)]
    fn times(self, x: i64, bits: u8) -> i64 {
        let (mantissa, exponent) = (self.mantissa as i64, self.exponent - bits);
        if x.unsigned_abs() < 1 << 46 {
            (x * mantissa) >> exponent
        } else {
            ((x >> 20) * mantissa) >> exponent.saturating_sub(20)
        }
    }
}

/// a / |a| in 1/2¹⁴, to one part in 128; zero stays zero.
#[inline(always)]
pub(super) fn direction(a: Vector) -> [i16; 3] {
    let (inverse, _) = Inverse::of_length(a);
    let all = a.iter().fold(0, |all, x| all | x.unsigned_abs());
    if all < 1 << 46 {
        let (mantissa, exponent) = (inverse.mantissa as i64, inverse.exponent - 14);
        a.map(|x| ((x * mantissa) >> exponent) as i16)
    } else {
        a.map(|x| inverse.times(x, 14) as i16)
    }
}

impl FaceShape {
    /// Of two edges that start at one corner; also the normal, as long as double the area.
    #[inline(always)]
    pub fn new([first, second]: [Vector; 2]) -> (Self, Vector) {
        let normal = cross(first, second);
        let (inverse, area) = Inverse::of_length(normal);
        (FaceShape { area: area as i16, inverse }, normal)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::entropy::log2_fixed;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn lengths_have_the_logarithm_and_the_inverse_of_their_squares(
            a in prop::array::uniform3(any::<i64>()),
            shift in 4u32..64,
        ) {
            let a = a.map(|x| x >> shift);
            let (small, shrunk) = shrink(a);
            let square = dot(small, small) as u64 + 1;
            let even = ((63 - square.leading_zeros()) & !1) as i32 - 6;
            let mantissa = if even < 0 { square << -even } else { square >> even };
            let (inverse, log) = Inverse::of_length(a);
            prop_assert_eq!(log, log2_fixed(square, 5) / 2 + 32 * shrunk as i32);
            prop_assert_eq!(inverse.mantissa, INVERSE_ROOT[mantissa as usize]);
            prop_assert_eq!(inverse.exponent as i32, 18 + even / 2 + shrunk as i32);
        }
    }

    #[test]
    fn a_face_without_area_has_the_logarithm_0() {
        assert_eq!(FaceShape::new([[0; 3]; 2]).0.area, 0);
    }
}
