//! Least squares that follow the data: what several numbers that are known tell of one that is not.
//!
//! The normal equations forget by a fixed share with every sample. Instead of solving them anew each time,
//! every sample lets each weight in turn take its best value, the others held (a sweep of Gauss and Seidel's
//! iteration, which converges for every positive definite matrix): N divisions instead of N³ operations.

/// Samples after which the oldest count for 1/e, a power of two.
const MEMORY_BITS: u32 = 10;

/// Features and targets, in 1/256, are held within ± this.
const MOST: i64 = 1 << 12;

/// Weights are in 1/65536 and at most 2, so that no product of theirs with a feature and a unit overflows.
const WEIGHT_BITS: u32 = 16;
const LARGEST: i64 = 2 << WEIGHT_BITS;

/// Counts against every weight as 16 samples of a feature of 1 do which tell nothing.
const RIDGE: i64 = 16 << 16;

/// No difference further than this is told from it.
const FAR: i64 = 1 << 37;

/// Weights of `N` features.
#[derive(Clone)]
pub(crate) struct Regression<const N: usize> {
    /// Fading sums of the products of two features, and of each with the target.
    moments: [[i64; N]; N],
    products: [i64; N],
    weights: [i64; N],
}

/// `difference` in units of `unit`, in 1/256.
#[inline(always)]
pub(crate) fn standardise(difference: i64, unit: u64) -> i64 {
    ((difference.clamp(-FAR, FAR) << 8) / unit.max(1) as i64).clamp(-MOST, MOST)
}

impl<const N: usize> Regression<N> {
    pub const NEW: Self = Regression { moments: [[0; N]; N], products: [0; N], weights: [0; N] };

    /// The target to be expected of features within ± 16 (in 1/256), in 1/65536.
    #[inline]
    pub fn predict(&self, features: &[i64; N]) -> i64 {
        let sum: i64 = features.iter().zip(self.weights).map(|(x, weight)| x * weight).sum();
        sum >> 8
    }

    /// Learns that features came with a target, all within ± 16, in 1/256. Time O(N²).
    pub fn learn(&mut self, features: &[i64; N], target: i64) {
        for ((row, product), x) in self.moments.iter_mut().zip(&mut self.products).zip(features) {
            for (moment, y) in row.iter_mut().zip(features) {
                *moment += x * y - (*moment >> MEMORY_BITS);
            }
            *product += x * target - (*product >> MEMORY_BITS);
        }
        for i in 0..N {
            let row = &self.moments[i];
            let explained: i64 = row.iter().zip(self.weights).map(|(moment, weight)| moment * weight).sum();
            let rest = (self.products[i] << WEIGHT_BITS) - explained + row[i] * self.weights[i];
            self.weights[i] = (rest / (row[i] + RIDGE)).clamp(-LARGEST, LARGEST);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_linear_rule_is_found_and_followed_when_it_changes() {
        let mut regression = Regression::<3>::NEW;
        let mut state = 1u32;
        for (a, b) in [(2, -1), (-1, 3)] {
            for _ in 0..6000 {
                let mut random = || {
                    state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
                    (state >> 23) as i64 - 256
                };
                let features = [random(), random(), random()];
                regression.learn(&features, (a * features[0] + b * features[1]) / 4);
            }
            let expected = (a * 200 - b * 100) * 256 / 4;
            let found = regression.predict(&[200, -100, 50]);
            assert!((found - expected).abs() < expected.abs() / 10, "{found} instead of {expected}");
        }
    }

    #[test]
    fn extreme_and_equal_features_do_not_overflow() {
        let mut regression = Regression::<12>::NEW;
        for i in 0..20_000i64 {
            let x = if i % 3 == 0 { MOST } else { -MOST };
            regression.learn(&[x; 12], if i % 5 == 0 { -MOST } else { x });
            let offset = regression.predict(&[x; 12]) * (1 << 36);
            assert!(offset.abs() < i64::MAX / 2);
        }
        assert_eq!(standardise(i64::MAX, 0), MOST);
        assert_eq!(standardise(-512, 256), -512);
    }
}
