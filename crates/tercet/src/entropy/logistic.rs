//! The logistic function and its relatives as fixed-point tables.
//!
//! Arguments and results are in 1/256. The tables are computed in integer arithmetic from the one
//! constant e^(−1/256), whose Taylor series is summed exactly.

use super::table::table;

/// Logits are kept within ± this: odds of e^8 to 1.
pub(crate) const LOGIT_LIMIT: i32 = 2047;

const ONE: u128 = 1 << 60;
const RANGE: usize = 2048;

table!(
    /// P(1) in 1/65536 for logits 0..2048; it is one minus that for their negatives.
    SQUASH: [u16; RANGE] = squashes
);
table!(
    /// The logit for probabilities in 1/4096, at the middle of each cell.
    STRETCH: [i16; 4096] = stretches
);
table!(
    /// ln(1 + e^(−k/256)).
    SOFTPLUS: [u8; RANGE] = softpluses
);
table!(
    /// ln(1 − e^(−k/256)); the entry for 0 stands for −∞.
    LOG1MEXP: [i16; RANGE] = log1mexps
);

/// e^(−k/256) in 1/2⁶⁰.
const fn exponentials() -> [u64; RANGE] {
    let mut step = ONE;
    let mut term = ONE;
    let mut n = 1u128;
    while term > 0 {
        term /= 256 * n;
        step = if n % 2 == 1 { step - term } else { step + term };
        n += 1;
    }
    let mut table = [0u64; RANGE];
    let mut value = ONE;
    let mut k = 0;
    while k < RANGE {
        table[k] = value as u64;
        value = (value * step + ONE / 2) >> 60;
        k += 1;
    }
    table
}

/// Natural logarithm of x/2⁶⁰ in 1/256, rounded; x must be positive.
///
/// Bit by bit: squaring doubles the logarithm.
const fn ln_fixed(x: u64) -> i32 {
    let mut integer = 63 - x.leading_zeros() as i32;
    let mut m = (x as u128) << (63 - integer); // in [1, 2) · 2⁶³
    integer -= 60;
    let mut log2 = (integer as i64) << 32;
    let mut bit = 31;
    while bit >= 8 {
        m = (m * m) >> 63;
        if m >> 64 != 0 {
            m >>= 1;
            log2 += 1 << bit;
        }
        bit -= 1;
    }
    const LN2: i128 = 2_977_044_472; // ln 2 in 1/2³²
    ((log2 as i128 * LN2 + (1 << 55)) >> 56) as i32
}

const fn squashes() -> [u16; RANGE] {
    let exp = exponentials();
    let mut table = [0u16; RANGE];
    let mut k = 0;
    while k < RANGE {
        table[k] = (((ONE << 16) + (ONE + exp[k] as u128) / 2) / (ONE + exp[k] as u128)) as u16;
        k += 1;
    }
    table
}

const fn stretches() -> [i16; 4096] {
    let squashes = squashes();
    let mut table = [0i16; 4096];
    let mut logit = -LOGIT_LIMIT;
    let mut i = 0;
    while i < 4096 {
        let p = 16 * i as u32 + 8;
        while logit < LOGIT_LIMIT && (squash_by(&squashes, logit) as u32) < p {
            logit += 1;
        }
        table[i] = logit as i16;
        i += 1;
    }
    table
}

const fn softpluses() -> [u8; RANGE] {
    let exp = exponentials();
    let mut table = [0u8; RANGE];
    let mut k = 0;
    while k < RANGE {
        table[k] = ln_fixed((ONE as u64) + exp[k]) as u8;
        k += 1;
    }
    table
}

const fn log1mexps() -> [i16; RANGE] {
    let exp = exponentials();
    let mut table = [0i16; RANGE];
    table[0] = -2048;
    let mut k = 1;
    while k < RANGE {
        table[k] = ln_fixed((ONE as u64) - exp[k]) as i16;
        k += 1;
    }
    table
}

/// 1 / (1 + e^(−x)), in 1/65536.
#[inline(always)]
pub(crate) fn squash(x: i32) -> u16 {
    squash_by(&SQUASH, x)
}

#[inline(always)]
const fn squash_by(table: &[u16; RANGE], x: i32) -> u16 {
    let magnitude = x.unsigned_abs() as usize;
    let p = table[if magnitude < RANGE { magnitude } else { RANGE - 1 }];
    // 65536 − p, which is never 65536.
    if x < 0 { p.wrapping_neg() } else { p }
}

/// ln(p / (1 − p)) of a probability in 1/65536.
#[inline(always)]
pub(crate) fn stretch(p: u16) -> i16 {
    STRETCH[(p >> 4) as usize]
}

/// ln(1 + eˣ).
#[inline(always)]
pub(crate) fn softplus(x: i32) -> i32 {
    let magnitude = x.unsigned_abs().min(RANGE as u32 - 1) as usize;
    x.max(0) + SOFTPLUS[magnitude] as i32
}

/// ln(eˣ − 1) for x ≥ 0; −8 in place of −∞.
#[inline(always)]
pub(crate) fn log_expm1(x: i32) -> i32 {
    x + LOG1MEXP[(x as u32).min(RANGE as u32 - 1) as usize] as i32
}

/// log₂ x with `bits` fractional bits, linear between powers of two; 0 for x = 0.
#[inline(always)]
pub(crate) fn log2_fixed(x: u64, bits: u32) -> i32 {
    let x = x.max(1);
    let zeros = x.leading_zeros();
    // 1 in the highest bit: the mantissa's bits follow.
    let mantissa = (x << zeros) >> (63 - bits);
    ((62 - zeros as i32) << bits) + mantissa as i32
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn tables_agree_with_the_functions_they_tabulate() {
        for x in -2047..=2047 {
            let t = x as f64 / 256.0;
            let p = 65536.0 / (1.0 + (-t).exp());
            assert!((squash(x) as f64 - p).abs() <= 0.51, "squash {x}");
            assert!((softplus(x) as f64 - 256.0 * (1.0 + t.exp()).ln()).abs() <= 0.75, "softplus {x}");
            if x > 0 {
                assert!((log_expm1(x) as f64 - 256.0 * t.exp_m1().ln()).abs() <= 0.75, "log_expm1 {x}");
            }
        }
        for p in (8..65536u32).step_by(16) {
            let t = (p as f64 / (65536.0 - p as f64)).ln() * 256.0;
            assert!((stretch(p as u16) as f64 - t.clamp(-2047.0, 2047.0)).abs() <= 0.12 * t.abs().max(8.0));
        }
    }

    #[test]
    fn the_tables_are_the_ones_the_format_was_made_with() {
        let mut hash = crc32fast::Hasher::new();
        for x in -2048..=2048 {
            hash.update(&squash(x).to_le_bytes());
            hash.update(&softplus(x).to_le_bytes());
            hash.update(&log_expm1(x.max(0)).to_le_bytes());
        }
        for p in 0..=u16::MAX {
            hash.update(&stretch(p).to_le_bytes());
        }
        assert_eq!(hash.finalize(), GOLDEN, "a change here is a change of format");
    }

    const GOLDEN: u32 = 2_049_258_012;

    #[test]
    fn logarithms_are_exact_at_powers_of_two_and_monotone() {
        for e in 0..63 {
            assert_eq!(log2_fixed(1 << e, 5), e * 32);
        }
        assert!((1..5000).all(|x| log2_fixed(x, 5) <= log2_fixed(x + 1, 5)));
    }
}
