//! Logistic mixing: many opinions, one probability.

use super::{LOGIT_LIMIT, squash};
use wide::{i16x8, i32x4};

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

/// A table of weight vectors for `8 N` opinions, one vector for each situation.
#[derive(Clone, Debug)]
pub(crate) struct Mixer<const N: usize> {
    weights: Vec<[i16x8; N]>,
    uses: Vec<u16>,
    rate: i32,
}

/// What a mixer said, kept until the outcome is known.
#[derive(Clone, Copy)]
pub(crate) struct Mix {
    /// Which weight vector spoke.
    pub set: usize,
    /// Its logit.
    pub logit: i32,
}

impl<const N: usize> Mixer<N> {
    /// `sets` vectors that all start as `initial` (in 1/8192) and learn with `rate`/65536 (below
    /// 2¹¹ / 4, so that a step fits 16 bits).
    pub fn new(sets: usize, initial: [[i16; 8]; N], rate: i32) -> Self {
        Mixer { weights: vec![initial.map(i16x8::new); sets], uses: vec![0; sets], rate }
    }

    /// The weighted sum of the opinions in situation `set`.
    #[inline(always)]
    pub fn mix(&self, set: usize, opinions: &[Opinions; N]) -> Mix {
        let weights = &self.weights[set];
        let mut sum = i32x4::ZERO;
        for i in 0..N {
            sum += opinions[i].dot(weights[i]);
        }
        let logit = sum.reduce_add() >> WEIGHT_BITS;
        Mix { set, logit: logit.clamp(-LOGIT_LIMIT, LOGIT_LIMIT) }
    }

    /// Moves the weights down the gradient of the code length; early outcomes move them more.
    ///
    /// All in 16 bits, eight at once: the upper half of a product, rounded, added with
    /// saturation.
    #[inline(always)]
    pub fn learn(&mut self, said: Mix, opinions: &[Opinions; N], bit: bool) {
        let uses = &mut self.uses[said.set];
        let rate = self.rate * BOOST[*uses as usize & (BOOSTED - 1)] as i32;
        *uses += ((*uses as usize) < BOOSTED - 1) as u16;
        let error = if bit { 65535 } else { 0 } - squash(said.logit) as i32;
        let step = i16x8::splat(((error * rate) >> 12) as i16);
        let weights = &mut self.weights[said.set];
        for i in 0..N {
            let change = (opinions[i] << 3_i32).mul_keep_high(step);
            weights[i] = weights[i].saturating_add((change + i16x8::splat(2)) >> 2_i32);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_mixer_learns_whom_to_trust() {
        let mut mixer = Mixer::<1>::new(1, [[4096; 8]], 400);
        let mut state = 1u32;
        let mut cost = 0.0;
        for i in 0..20_000 {
            state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            let bit = state >> 30 & 1 == 1;
            let good = if bit { 300 } else { -300 };
            let noise = (state >> 20 & 511) as i16 - 256;
            let opinions = [i16x8::new([good, noise, -noise / 2, 77, 0, 0, 0, 0])];
            let said = mixer.mix(0, &opinions);
            let p = squash(said.logit) as f64 / 65536.0;
            if i >= 10_000 {
                cost -= if bit { p } else { 1.0 - p }.log2();
            }
            mixer.learn(said, &opinions, bit);
        }
        assert!(cost < 1000.0, "{cost} bits for 10 000 decisions that one opinion knows");
    }
}
