//! Exact division by small numbers: a multiplication instead of the slowest instruction that there is.

/// The largest divisor: one more than the neighbours that a vertex looks at.
pub(super) const LARGEST: usize = 33;

/// ⌊2⁶³ / n⌋ + 1.
static RECIPROCAL: [u64; LARGEST + 1] = {
    let mut table = [0; LARGEST + 1];
    let mut n = 1;
    while n < table.len() {
        table[n] = (1 << 63) / n as u64 + 1;
        n += 1;
    }
    table
};

/// ⌊a / n⌋ for a < 2⁵⁷ and 0 < n ≤ [`LARGEST`]: what the reciprocal is too large by adds less than 1/n.
#[inline(always)]
pub(super) fn divide(a: u64, n: usize) -> u64 {
    if cfg!(target_family = "wasm") {
        // It has no product of 128 bits, and a page loads what stands in for one.
        return a / n as u64;
    }
    ((a as u128 * RECIPROCAL[n] as u128) >> 63) as u64
}

/// a / n, rounded towards 0, for |a| < 2⁵⁷ and 0 < n ≤ [`LARGEST`].
#[inline(always)]
pub(super) fn divide_signed(a: i64, n: usize) -> i64 {
    // 0 or −1: a processor could not guess which.
    let sign = a >> 63;
    (divide(((a ^ sign) - sign) as u64, n) as i64 ^ sign) - sign
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn quotients_are_exact_up_to_the_largest() {
        for n in 1..=LARGEST {
            let most = (1 << 57) - 1;
            for a in [most, most / n as u64 * n as u64].into_iter().chain((0..57).map(|bit| 1 << bit)) {
                for a in [a.saturating_sub(1), a] {
                    assert_eq!(divide(a, n), a / n as u64, "{a} / {n}");
                    assert_eq!(divide_signed(-(a as i64), n), -(a as i64) / n as i64, "-{a} / {n}");
                }
            }
        }
    }
}
