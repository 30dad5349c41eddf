//! Logistic mixing: many opinions, one probability.

use super::{LOGIT_LIMIT, squash};

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

/// A table of weight vectors for `N` opinions, one vector for each situation.
#[derive(Clone, Debug)]
pub(crate) struct Mixer<const N: usize> {
    weights: Vec<[i16; N]>,
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
    pub fn new(sets: usize, initial: [i16; N], rate: i32) -> Self {
        Mixer { weights: vec![initial; sets], uses: vec![0; sets], rate }
    }

    /// The weighted sum of the opinions (logits in 1/256) in situation `set`.
    #[inline(always)]
    pub fn mix(&self, set: usize, opinions: &[i16; N]) -> Mix {
        let weights = &self.weights[set];
        let mut sum = 0i32;
        for i in 0..N {
            sum += opinions[i] as i32 * weights[i] as i32;
        }
        Mix { set, logit: (sum >> WEIGHT_BITS).clamp(-LOGIT_LIMIT, LOGIT_LIMIT) }
    }

    /// Moves the weights down the gradient of the code length; early outcomes move them more.
    ///
    /// All in 16 bits, so that the loop becomes a handful of vector instructions: a product's
    /// upper half, rounded, added with saturation.
    #[inline(always)]
    pub fn learn(&mut self, said: Mix, opinions: &[i16; N], bit: bool) {
        let uses = &mut self.uses[said.set];
        let rate = self.rate * BOOST[*uses as usize & (BOOSTED - 1)] as i32;
        *uses += ((*uses as usize) < BOOSTED - 1) as u16;
        let error = if bit { 65535 } else { 0 } - squash(said.logit) as i32;
        let step = ((error * rate) >> 12) as i16;
        let weights = &mut self.weights[said.set];
        for i in 0..N {
            let change = (((opinions[i] << 3) as i32 * step as i32) >> 16) as i16;
            weights[i] = weights[i].saturating_add((change + 2) >> 2);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_mixer_learns_whom_to_trust() {
        let mut mixer = Mixer::<4>::new(1, [4096; 4], 400);
        let mut state = 1u32;
        let mut cost = 0.0;
        for i in 0..20_000 {
            state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            let bit = state >> 30 & 1 == 1;
            let good = if bit { 300 } else { -300 };
            let noise = (state >> 20 & 511) as i16 - 256;
            let opinions = [good, noise, -noise / 2, 77];
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
