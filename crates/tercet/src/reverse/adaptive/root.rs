//! Roots to a few parts in ten thousand, and logarithms, which is as near as scores need them: an exact root takes
//! longer than all else that is asked of a fan.

/// Bits of a number that decide its root; of the first two at least one is set.
const INDEX_BITS: u32 = 13;
const LEAST_INDEX: usize = 1 << (INDEX_BITS - 2);
const INDICES: usize = (1 << INDEX_BITS) - LEAST_INDEX;

/// 2^16 √x for x from 1/4 up to 1 by its first bits, at the middle of those that share them.
static ROOT: [u16; INDICES] = {
    let mut table = [0; INDICES];
    let mut i = 0;
    while i < INDICES {
        let twice = (2 * (i + LEAST_INDEX) + 1) as u64;
        table[i] = (twice << (31 - INDEX_BITS)).isqrt() as u16;
        i += 1;
    }
    table
};

/// Bits behind the point of 1/√x.
const INVERSE_BITS: u32 = 12;

/// 2^12 / √x for the same x.
static INVERSE: [u16; INDICES] = {
    let mut table = [0; INDICES];
    let mut i = 0;
    while i < INDICES {
        table[i] = ((1 << (16 + INVERSE_BITS)) / ROOT[i] as u32) as u16;
        i += 1;
    }
    table
};

/// The index of positive x · 4^h / 2^64, which lies from 1/4 up to 1, and h.
fn normalised(x: u64) -> (usize, u32) {
    let half = x.leading_zeros() / 2;
    ((x << (2 * half) >> (u64::BITS - INDEX_BITS)) as usize - LEAST_INDEX, half)
}

/// √x, 0 where that is not real.
pub(super) fn root(x: i64) -> i64 {
    if x <= 0 {
        return 0;
    }
    let (index, half) = normalised(x as u64);
    i64::from(ROOT[index]) << 16 >> half
}

/// x / √square for |x| < 2^50; `square` 0 counts as 1.
pub(super) fn over_root(x: i64, square: u64) -> i64 {
    let (index, half) = normalised(square.max(1));
    (x * i64::from(INVERSE[index])) >> (INVERSE_BITS + 32 - half)
}

/// The logarithm to base 2 of a positive number in units of 1/256; between powers of two it
/// is linear, which is at most 0.09 too low.
pub(super) fn log2(x: u64) -> i32 {
    let zeros = x.leading_zeros();
    let mantissa = (x << zeros) >> 55 & 0xff;
    ((63 - zeros as i32) << 8) + mantissa as i32
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn roots_are_right_to_a_thousandth() {
        let numbers = (0..59).flat_map(|bit| [1, 3, 7, 5, 11].map(|x: i64| x << bit));
        for x in numbers {
            let exact = (x as f64).sqrt();
            assert!((root(x) as f64 - exact).abs() < exact / 1000.0 + 1.0, "√{x} is not {}", root(x));
            for part in [1 << 20, -12_345, 3] {
                let (found, exact) = (over_root(part, x as u64) as f64, part as f64 / exact);
                assert!((found - exact).abs() < exact.abs() / 500.0 + 1.0, "{part}/√{x} is not {found}");
            }
        }
        assert_eq!((root(0), root(-9), over_root(7, 0)), (0, 0, 6));
    }

    #[test]
    fn the_logarithm_is_exact_at_powers_of_two_and_never_falls() {
        for k in 0..64 {
            assert_eq!(log2(1 << k), 256 * k);
        }
        assert!((1..5000).all(|x| log2(x) <= log2(x + 1)));
    }
}
