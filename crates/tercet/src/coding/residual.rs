//! One coordinate: an integer near what several experts expect.
//!
//! Each expert is a logistic distribution. A coordinate is coded as a few binary decisions
//! around the first expert's centre — which side, how many bins away, where in the bin — and for
//! each decision every expert states its probability, exactly and without a division:
//! with z the standardised distance and S(z) = 1/(1 + e^z) the logistic survival function,
//!
//! - below the centre: logit = z;
//! - at least b, given at least a: logit = ln(1 + e^−z(a)) − ln(e^(z(b)−z(a)) − 1);
//! - upper part [m, h) of [l, h): logit = (m−l) + ln(e^(h−m) − 1) − ln(e^(m−l) − 1)
//!   + ln(1 + e^l) − ln(1 + e^h), all standardised.
//!
//! Counters under geometric contexts add what the distributions do not know, and a mixer weighs
//! them all.

use super::scale::Scale;
use super::vector::COORDINATE_LIMIT;
use crate::entropy::{Coder, Counter, LOGIT_LIMIT, Mixer, log_expm1, softplus, squash};

/// Number of experts.
pub(crate) const EXPERTS: usize = 6;
/// Number of counter contexts.
pub(crate) const CONTEXTS: usize = 9;
const INPUTS: usize = EXPERTS + CONTEXTS + 1;

/// Sizes of the contexts; a caller's values lie below them.
pub(crate) const SIZES: [usize; CONTEXTS] = [24, 576, 288, 192, 231, 243, 576, 576, 192];
/// Numbers of values of the two set selectors.
pub(crate) const SETS: [usize; 2] = [24, 80];

/// Ends of the bins in units of the bin width; beyond the last the rest is stored plainly.
const BINS: [i64; 18] = [1, 2, 3, 4, 5, 6, 8, 10, 12, 16, 20, 28, 40, 60, 100, 200, 500, 2000];

const SIGN: usize = 0;
const FIRST_BIN: usize = 1;
const BIN_NODES: usize = 12;
const FIRST_HALVING: usize = FIRST_BIN + BIN_NODES;
const HALVING_NODES: usize = 3;
const NODES: usize = FIRST_HALVING + HALVING_NODES;

const COUNTER_LIMIT: u16 = 110;
const MIXER_RATE: i32 = 420;
const BIAS: i16 = 77;

/// A distribution of the coordinate.
#[derive(Clone, Copy)]
pub(crate) struct Expert {
    /// Its centre, in 1/256 of a step.
    pub centre: i64,
    pub scale: Scale,
}

/// The contexts of one coordinate.
pub(crate) struct Situation {
    /// Context values for the sign and for magnitudes above the centre.
    pub above: [usize; CONTEXTS],
    /// The same, seen in the mirror, for magnitudes below the centre.
    pub below: [usize; CONTEXTS],
    /// The selectors of the mixer's weights.
    pub sets: [usize; 2],
}

/// The models of coordinates; they live as long as the file.
pub(crate) struct ResidualModels {
    counters: Vec<Counter>,
    start: [usize; CONTEXTS],
    mixers: [Mixer<INPUTS>; 2],
}

impl ResidualModels {
    pub fn new() -> Self {
        let mut start = [0; CONTEXTS];
        let mut total = 0;
        for (start, size) in start.iter_mut().zip(SIZES) {
            *start = total;
            total += size * NODES;
        }
        let mut weights = [512i16; INPUTS];
        weights[..EXPERTS].fill((8192 / EXPERTS) as i16);
        weights[INPUTS - 1] = 0;
        let mixer = |sets: usize| Mixer::new(sets * NODES, weights, MIXER_RATE);
        ResidualModels { counters: vec![Counter::NEW; total], start, mixers: SETS.map(mixer) }
    }

    /// Codes a coordinate. `value` matters only when encoding.
    pub fn code<C: Coder>(
        &mut self,
        coder: &mut C,
        value: i32,
        experts: &[Expert; EXPERTS],
        situation: &Situation,
    ) -> i32 {
        let centre = (experts[0].centre + 128) >> 8;
        let mut inputs = [0i16; INPUTS];
        inputs[INPUTS - 1] = BIAS;
        // Standardised distance of the boundary below the centre, as seen from below.
        let mut z = experts.map(|e| e.scale.standardise(((centre as i64) << 8) - 128 - e.centre));
        for (input, z) in inputs.iter_mut().zip(z) {
            *input = clamp(z);
        }
        let negative = self.decide(coder, (value as i64) < centre, SIGN, situation, &situation.above, &mut inputs);
        if negative {
            z = z.map(|z| -z);
        }
        let contexts = if negative { &situation.below } else { &situation.above };
        let magnitude = if negative { centre - 1 - value as i64 } else { value as i64 - centre };
        let magnitude = self.magnitude(coder, magnitude, experts, z, situation, contexts, &mut inputs);
        let value = if negative { centre - 1 - magnitude } else { centre + magnitude };
        value.clamp(-(COORDINATE_LIMIT as i64), COORDINATE_LIMIT as i64) as i32
    }

    #[expect(clippy::too_many_arguments, reason = "one coordinate's state, split off for length")]
    fn magnitude<C: Coder>(
        &mut self,
        coder: &mut C,
        magnitude: i64,
        experts: &[Expert; EXPERTS],
        z: [i32; EXPERTS],
        situation: &Situation,
        contexts: &[usize; CONTEXTS],
        inputs: &mut [i16; INPUTS],
    ) -> i64 {
        let unit = experts[0].scale.unit();
        let step = experts.map(|e| e.scale.standardise(unit << 8));
        let mut low = 0;
        for (k, &high) in BINS.iter().enumerate() {
            for j in 0..EXPERTS {
                let at = z[j] + low as i32 * step[j];
                inputs[j] = clamp(softplus(-at) - log_expm1((high - low) as i32 * step[j]));
            }
            let node = FIRST_BIN + k.min(BIN_NODES - 1);
            if !self.decide(coder, magnitude >= high * unit, node, situation, contexts, inputs) {
                return self.within(coder, magnitude, [low * unit, high * unit], experts, z, situation, contexts, inputs);
            }
            low = high;
        }
        low * unit + far(coder, magnitude - low * unit)
    }

    /// Halves the bin until one integer is left.
    #[expect(clippy::too_many_arguments, reason = "one coordinate's state, split off for length")]
    fn within<C: Coder>(
        &mut self,
        coder: &mut C,
        magnitude: i64,
        [mut low, mut high]: [i64; 2],
        experts: &[Expert; EXPERTS],
        z: [i32; EXPERTS],
        situation: &Situation,
        contexts: &[usize; CONTEXTS],
        inputs: &mut [i16; INPUTS],
    ) -> i64 {
        let mut depth = 0;
        while high - low > 1 {
            let middle = (low + high) / 2;
            let upper = if depth < HALVING_NODES {
                for j in 0..EXPERTS {
                    let scale = experts[j].scale;
                    let (l, h) = (z[j] + scale.standardise(low << 8), z[j] + scale.standardise(high << 8));
                    let (ml, hm) = (scale.standardise((middle - low) << 8), scale.standardise((high - middle) << 8));
                    inputs[j] = clamp(ml + log_expm1(hm) - log_expm1(ml) + softplus(l) - softplus(h));
                }
                self.decide(coder, magnitude >= middle, FIRST_HALVING + depth, situation, contexts, inputs)
            } else {
                coder.bit(magnitude >= middle, (((high - middle) << 16) / (high - low)) as u16)
            };
            depth += 1;
            if upper { low = middle } else { high = middle }
        }
        low
    }

    #[inline(always)]
    fn decide<C: Coder>(
        &mut self,
        coder: &mut C,
        bit: bool,
        node: usize,
        situation: &Situation,
        contexts: &[usize; CONTEXTS],
        inputs: &mut [i16; INPUTS],
    ) -> bool {
        let mut at = [0; CONTEXTS];
        for i in 0..CONTEXTS {
            at[i] = self.start[i] + contexts[i] * NODES + node;
            inputs[EXPERTS + i] = self.counters[at[i]].logit();
        }
        let said = [0, 1].map(|m| self.mixers[m].mix(situation.sets[m] * NODES + node, inputs));
        let bit = coder.bit(bit, squash((said[0].logit + said[1].logit) / 2));
        for m in 0..2 {
            self.mixers[m].learn(said[m], inputs, bit);
        }
        for at in at {
            self.counters[at].learn(bit, COUNTER_LIMIT);
        }
        bit
    }
}

/// A magnitude beyond every bin: its length in bits, then the bits (Elias gamma).
fn far<C: Coder>(coder: &mut C, excess: i64) -> i64 {
    let wanted = if C::ENCODES { 63 - (excess as u64 + 1).leading_zeros() } else { 0 };
    let mut bits = 0;
    while bits < 31 && coder.bit(bits < wanted, 1 << 15) {
        bits += 1;
    }
    let rest = coder.raw_wide(((excess + 1) as u64 & ((1u64 << bits) - 1)) as u32, bits);
    ((1i64 << bits) | rest as i64) - 1
}

#[inline(always)]
fn clamp(logit: i32) -> i16 {
    logit.clamp(-LOGIT_LIMIT, LOGIT_LIMIT) as i16
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::entropy::{Decoder, Encoder};
    use proptest::prelude::*;

    fn situation() -> Situation {
        Situation { above: [0; CONTEXTS], below: [1; CONTEXTS], sets: [0, 0] }
    }

    proptest! {
        #[test]
        fn any_value_comes_back_whatever_is_expected(
            cases in prop::collection::vec((
                -COORDINATE_LIMIT..=COORDINATE_LIMIT,
                prop::array::uniform6((-(1i64 << 37)..1 << 37, 1u64..1 << 36)),
                any::<bool>(),
            ), 1..50)
        ) {
            let experts = |e: &[(i64, u64); EXPERTS], near: bool, v: i32| {
                let mut experts = e.map(|(centre, mean)| Expert { centre, scale: Scale::new(mean) });
                if near {
                    experts[0].centre = ((v as i64) << 8) + (experts[0].centre & 1023);
                }
                experts
            };
            let (mut models, mut encoder) = (ResidualModels::new(), Encoder::new());
            for (v, e, near) in &cases {
                models.code(&mut encoder, *v, &experts(e, *near, *v), &situation());
            }
            let bytes = encoder.finish();
            let (mut models, mut decoder) = (ResidualModels::new(), Decoder::new(&bytes));
            for (v, e, near) in &cases {
                prop_assert_eq!(models.code(&mut decoder, 0, &experts(e, *near, *v), &situation()), *v);
            }
        }
    }

    #[test]
    fn a_value_that_an_expert_knows_costs_little() {
        let (mut models, mut encoder) = (ResidualModels::new(), Encoder::new());
        for i in 0..2000i64 {
            let value = (i * i * 31 % 1000) as i32;
            let wrong = Expert { centre: 500 << 8, scale: Scale::new(200 << 8) };
            let mut experts = [wrong; EXPERTS];
            experts[0] = Expert { centre: (value as i64) << 8, scale: Scale::new(64) };
            models.code(&mut encoder, value, &experts, &situation());
        }
        let bytes = encoder.finish().len();
        assert!(bytes < 500, "{bytes} bytes for 2000 known values");
    }
}
