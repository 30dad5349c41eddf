//! Logistic mixing: many opinions, one probability.

use super::{LOGIT_LIMIT, squash};

/// Weights are in 1/8192.
const WEIGHT_ONE: i32 = 1 << 13;

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
    /// `sets` vectors that all start as `initial` (in 1/8192) and learn with `rate`/65536.
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
        Mix { set, logit: (sum / WEIGHT_ONE).clamp(-LOGIT_LIMIT, LOGIT_LIMIT) }
    }

    /// Moves the weights down the gradient of the code length; early outcomes move them more.
    #[inline(always)]
    pub fn learn(&mut self, said: Mix, opinions: &[i16; N], bit: bool) {
        let uses = &mut self.uses[said.set];
        let boost = if *uses < 256 { 1 + 200 / (50 + *uses as i32) } else { 1 };
        *uses += (*uses < 256) as u16;
        let error = ((bit as i32) << 16) - (bit as i32) - squash(said.logit) as i32;
        let step = (error * (self.rate * boost)) >> 12;
        let weights = &mut self.weights[said.set];
        for i in 0..N {
            let change = (opinions[i] as i32 * step + (1 << 14)) >> 15;
            weights[i] = (weights[i] as i32 + change).clamp(i16::MIN as i32, i16::MAX as i32) as i16;
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
