//! Logistic mixing: many opinions, one probability.

use super::LOGIT_LIMIT;
use wide::i16x8;

/// Weights are in 1/8192.
const WEIGHT_BITS: u32 = 13;

/// How much faster the n-th outcome of a situation moves its weights.
const BOOSTED: usize = 256;
static BOOST: [u8; BOOSTED] = {
    let mut table = [0; BOOSTED];
    let mut n = 0;
    while n < BOOSTED {
        table[n] = 1 + (150 / (50 + n)) as u8;
        n += 1;
    }
    table
};

/// Eight opinions, logits in 1/256.
pub(crate) type Opinions = i16x8;

/// A weight for each of `V` times eight opinions, in one situation.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Weights<const V: usize = 1> {
    weights: [i16x8; V],
    /// How often it has learnt.
    uses: i16,
}

/// The weights of all situations.
#[derive(Clone, Debug)]
pub(crate) struct Mixer<const V: usize = 1>(Vec<Weights<V>>);

impl<const V: usize> Mixer<V> {
    /// `sets` situations; the i-th starts with the weights `initial(i)` (in 1/8192).
    pub fn new(sets: usize, initial: impl Fn(usize) -> [[i16; 8]; V]) -> Self {
        let weights = |i| Weights { weights: initial(i).map(i16x8::new), uses: 0 };
        Mixer((0..sets).map(weights).collect())
    }

    /// All weights, and how often each has learnt.
    #[cfg(all(test, feature = "max"))]
    pub fn weights(&self) -> impl Iterator<Item = ([[i16; 8]; V], i16)> {
        self.0.iter().map(|set| (set.weights.map(i16x8::to_array), set.uses))
    }

    /// The weights in situation `set`.
    #[inline(always)]
    pub fn set(&mut self, set: usize) -> &mut Weights<V> {
        &mut self.0[set]
    }
}

impl<const V: usize> Weights<V> {
    /// The weighted sum of the opinions.
    #[inline(always)]
    pub fn mix(&self, opinions: &[Opinions; V]) -> i32 {
        let mut sums = opinions[0].dot(self.weights[0]);
        for (opinions, weights) in opinions.iter().zip(self.weights).skip(1) {
            // 32 products of 2047 and 2¹⁵ fit.
            sums += opinions.dot(weights);
        }
        let logit = sums.reduce_add() >> WEIGHT_BITS;
        logit.clamp(-LOGIT_LIMIT, LOGIT_LIMIT)
    }

    /// Moves the weights down the gradient of the code length; early outcomes move them more.
    ///
    /// `error` is that of the probability that was coded with ([`error`]); `rate`/65536 how fast
    /// to learn. All in 16 bits, eight at once: the upper half of a product, rounded, added with saturation.
    #[inline(always)]
    pub fn learn(&mut self, opinions: &[Opinions; V], error: i32, rate: i32) {
        let rate = rate * BOOST[self.uses as usize & (BOOSTED - 1)] as i32;
        self.uses = (self.uses + 1).min(BOOSTED as i16 - 1);
        let step = ((error * rate) >> 12).clamp(i16::MIN as i32, i16::MAX as i32);
        let step = i16x8::splat(step as i16);
        for (weights, &opinions) in self.weights.iter_mut().zip(opinions) {
            let change = (opinions << 3_i32).mul_keep_high(step);
            *weights = weights.saturating_add((change + i16x8::splat(2)) >> 2_i32);
        }
    }
}

/// How far the probability `p`/65536 of a 1 was off.
#[inline(always)]
pub(crate) fn error(bit: bool, p: u16) -> i32 {
    if bit { 65535 - p as i32 } else { -(p as i32) }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::entropy::squash;

    #[test]
    fn the_mixer_learns_whom_to_trust() {
        let mut mixer = Mixer::new(1, |_| [[4096; 8]]);
        let mut state = 1u32;
        let mut cost = 0.0;
        for i in 0..20_000 {
            state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            let bit = state >> 30 & 1 == 1;
            let good = if bit { 300 } else { -300 };
            let noise = (state >> 20 & 511) as i16 - 256;
            let opinions = &[i16x8::new([good, noise, -noise / 2, 77, 0, 0, 0, 0])];
            let p = squash(mixer.set(0).mix(opinions));
            let cost_of = |p: f64| if bit { p } else { 1.0 - p }.log2();
            if i >= 10_000 {
                cost -= cost_of(p as f64 / 65536.0);
            }
            mixer.set(0).learn(opinions, error(bit, p), 400);
        }
        assert!(cost < 1000.0, "{cost} bits for 10 000 decisions that one opinion knows");
    }
}
