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

use super::model::number;
use super::scale::Scale;
use super::vector::COORDINATE_LIMIT;
use crate::entropy::{Coder, Counter, LOGIT_LIMIT, Mixer, Opinions, error, log_expm1, softplus, squash};

/// Number of experts.
pub(crate) const EXPERTS: usize = 3;
/// Number of counter contexts that hold for a whole coordinate.
pub(crate) const CONTEXTS: usize = 1;
/// Number of candidate lists, each a counter context that changes with every decision.
pub(crate) const LISTS: usize = 3;
const COUNTERS: usize = CONTEXTS + LISTS;
const INPUTS: usize = 8;
const _: () = assert!(EXPERTS + COUNTERS < INPUTS);

/// Sizes of the contexts; a caller's values lie below them.
pub(crate) const SIZES: [usize; CONTEXTS] = [243];
/// Numbers of values of the two set selectors.
pub(crate) const SETS: [usize; 2] = [24, 120];
/// Number of values of [`Situation::trust`].
pub(crate) const TRUSTS: usize = 24;

/// Ends of the bins in units of the bin width; beyond the last the rest is stored plainly.
const BINS: [i64; 18] = [1, 2, 3, 4, 5, 6, 8, 10, 12, 16, 20, 28, 40, 60, 100, 200, 500, 2000];

const SIGN: usize = 0;
const FIRST_BIN: usize = 1;
const BIN_NODES: usize = 12;
const FIRST_HALVING: usize = FIRST_BIN + BIN_NODES;
const HALVING_NODES: usize = 3;
const NODES: usize = FIRST_HALVING + HALVING_NODES;
const _: () = assert!(NODES.is_power_of_two());

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
    /// Values that the coordinate may well repeat.
    pub candidates: [Candidates; LISTS],
    /// How much a candidate is worth here.
    pub trust: usize,
}

/// A short list of values near a centre.
///
/// They are kept as their distance above the centre in 16 bits: those of 2¹⁵ and more are too far
/// to matter.
#[derive(Clone, Copy)]
pub(crate) struct Candidates {
    above: [i16; Candidates::MOST],
    count: usize,
}

impl Candidates {
    const MOST: usize = 8;
    const SPLITS: usize = 16;
    pub const EMPTY: Candidates = Candidates { above: [FAR; Candidates::MOST], count: 0 };

    /// Adds the value `above` the centre if there is room.
    #[inline(always)]
    pub fn push(&mut self, above: i64) {
        if self.count < Self::MOST {
            self.above[self.count] = near(above);
            self.count += 1;
        }
    }
}

/// Stands for magnitudes that are too far to matter.
const FAR: i16 = i16::MIN;

/// A magnitude in 16 bits.
#[inline(always)]
fn near(m: i64) -> i16 {
    m.clamp(FAR as i64, i16::MAX as i64) as i16
}

/// A boundary between magnitudes in 16 bits.
#[inline(always)]
fn bound(m: i64) -> i16 {
    near(m).max(FAR + 1)
}

/// Candidates as magnitudes on one side of the centre.
#[derive(Clone, Copy)]
struct Magnitudes(Opinions);

impl Magnitudes {
    /// How many lie below `bound`.
    #[inline(always)]
    fn below(self, bound: i16) -> u8 {
        let below = self.0.simd_lt(Opinions::splat(bound)).to_bitmask() & 255;
        // A table where the baseline instruction set counts bits slowly.
        if cfg!(target_arch = "wasm32") { below.count_ones() as u8 } else { COUNT[below as usize] }
    }
}

/// How many candidates of each list lie below a magnitude.
type Below = [u8; LISTS];

/// The number of ones in a byte.
static COUNT: [u8; 256] = {
    let mut table = [0; 256];
    let mut i = 0;
    while i < 256 {
        table[i] = (i as u8).count_ones() as u8;
        i += 1;
    }
    table
};

/// The models of coordinates; they live as long as the file.
pub(crate) struct ResidualModels {
    by_context: [Vec<[Counter; NODES]>; CONTEXTS],
    by_split: [Vec<[Counter; NODES]>; LISTS],
    mixers: [Mixer; 2],
}

/// One coordinate being coded.
struct Walk<'a> {
    situation: &'a Situation,
    experts: &'a [Expert; EXPERTS],
    /// Standardised distance of each expert's centre from the boundary at magnitude 0.
    z: [i32; EXPERTS],
    candidates: [Magnitudes; LISTS],
    /// The value of each context.
    contexts: &'a [usize; CONTEXTS],
    inputs: [i16; INPUTS],
    /// Candidates below the bounds of the next decision's two parts.
    low: Below,
    middle: Below,
    high: Below,
}

impl Walk<'_> {
    #[inline(always)]
    fn below(&self, magnitude: i64) -> Below {
        self.candidates.map(|list| list.below(bound(magnitude)))
    }

    /// Whether a candidate of the first two lists lies between the low and the high bound.
    #[inline(always)]
    fn any_candidate(&self) -> bool {
        self.low[..2] != self.high[..2]
    }
}

impl ResidualModels {
    pub fn new() -> Self {
        let table = |contexts: usize| vec![[Counter::NEW; NODES]; contexts];
        let mut weights = [512i16; INPUTS];
        weights[..EXPERTS].fill((8192 / EXPERTS) as i16);
        weights[INPUTS - 1] = 0;
        ResidualModels {
            by_context: SIZES.map(table),
            by_split: [Candidates::SPLITS * TRUSTS; LISTS].map(table),
            mixers: SETS.map(|sets| Mixer::new(sets * NODES, weights)),
        }
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
        let value = value as i64;
        let mut z = [0; EXPERTS];
        for j in 0..EXPERTS {
            z[j] = experts[j].scale.standardise((centre << 8) - 128 - experts[j].centre);
        }
        let mut inputs = [0i16; INPUTS];
        inputs[INPUTS - 1] = BIAS;
        for (input, z) in inputs.iter_mut().zip(z) {
            *input = clamp(z);
        }
        let candidates = situation.candidates.map(|c| Magnitudes(Opinions::new(c.above)));
        let none = [0; LISTS];
        let mut walk = Walk {
            situation,
            experts,
            z,
            candidates,
            contexts: &situation.above,
            inputs,
            low: none,
            middle: none,
            high: none,
        };
        let window = 4 * experts[0].scale.unit() + 1;
        [walk.low, walk.middle, walk.high] = [-window, 0, window].map(|bound| walk.below(bound));
        let negative = self.decide(coder, value < centre, SIGN, &walk);
        if negative {
            walk.contexts = &situation.below;
            for z in &mut walk.z {
                *z = -*z;
            }
            for list in &mut walk.candidates {
                // centre − 1 − v is −1 − (v − centre); what was too far above is too far below.
                list.0 = !list.0;
            }
            // Those that were not below 0 are now.
            walk.middle = walk.middle.map(|below| Candidates::MOST as u8 - below);
        }
        let turn = |v: i64| if negative { centre - 1 - v } else { v - centre };
        let magnitude = self.magnitude(coder, turn(value), &mut walk);
        let value = if negative { centre - 1 - magnitude } else { centre + magnitude };
        value.clamp(-(COORDINATE_LIMIT as i64), COORDINATE_LIMIT as i64) as i32
    }

    fn magnitude<C: Coder>(&mut self, coder: &mut C, magnitude: i64, walk: &mut Walk) -> i64 {
        let unit = walk.experts[0].scale.unit();
        let (mut step, mut one) = ([0; EXPERTS], [0; EXPERTS]);
        for j in 0..EXPERTS {
            step[j] = walk.experts[j].scale.length(unit);
            one[j] = log_expm1(step[j]);
        }
        let mut low = 0;
        for (k, &high) in BINS.iter().enumerate() {
            for j in 0..EXPERTS {
                let at = walk.z[j] + low as i32 * step[j];
                let mass = if high - low == 1 { one[j] } else { log_expm1((high - low) as i32 * step[j]) };
                walk.inputs[j] = clamp(softplus(-at) - mass);
            }
            let node = FIRST_BIN + k.min(BIN_NODES - 1);
            walk.low = walk.middle;
            [walk.middle, walk.high] = [high, high + 4].map(|bound| walk.below(bound * unit));
            if !self.decide(coder, magnitude >= high * unit, node, walk) {
                walk.high = walk.middle;
                return self.within(coder, magnitude, [low * unit, high * unit], walk);
            }
            low = high;
        }
        let rest = (magnitude - low * unit).clamp(0, u32::MAX as i64 - 2) as u32;
        low * unit + number(coder, rest) as i64
    }

    /// Halves the bin until one integer is left.
    fn within<C: Coder>(&mut self, coder: &mut C, magnitude: i64, bin: [i64; 2], walk: &mut Walk) -> i64 {
        let [mut low, mut high] = bin;
        let mut depth = 0;
        while high - low > 1 {
            let middle = (low + high) / 2;
            let upper = if depth == 0 || depth < HALVING_NODES && walk.any_candidate() {
                for j in 0..EXPERTS {
                    let z = |steps: i64| walk.experts[j].scale.length(steps);
                    let (l, h) = (walk.z[j] + z(low), walk.z[j] + z(high));
                    let (lower, upper) = (z(middle - low), z(high - middle));
                    let logit = lower + log_expm1(upper) - log_expm1(lower) + softplus(l) - softplus(h);
                    walk.inputs[j] = clamp(logit);
                }
                walk.middle = walk.below(middle);
                let upper = self.decide(coder, magnitude >= middle, FIRST_HALVING + depth, walk);
                if upper {
                    walk.low = walk.middle;
                } else {
                    walk.high = walk.middle;
                }
                upper
            } else {
                // No further one can be modelled.
                coder.bit(magnitude >= middle, (((high - middle) << 16) / (high - low)) as u16)
            };
            depth += 1;
            if upper {
                low = middle;
            } else {
                high = middle;
            }
        }
        low
    }

    /// One binary decision: whether the value lies in the upper of the walk's two parts.
    #[inline(never)]
    fn decide<C: Coder>(&mut self, coder: &mut C, bit: bool, node: usize, walk: &Walk) -> bool {
        let node = node & (NODES - 1);
        let [by_context] = &mut self.by_context;
        let context = &mut by_context[walk.contexts[0]][node];
        let [a, b, c] = &mut self.by_split;
        let row = |i: usize| {
            let parts =
                [walk.middle[i] - walk.low[i], walk.high[i] - walk.middle[i]].map(|n| n.min(3) as usize);
            (4 * parts[0] + parts[1]) * TRUSTS + walk.situation.trust
        };
        let counters = [context, &mut a[row(0)][node], &mut b[row(1)][node], &mut c[row(2)][node]];
        let mut inputs = walk.inputs;
        for (input, counter) in inputs[EXPERTS..].iter_mut().zip(&counters) {
            *input = counter.logit();
        }
        let opinions = Opinions::new(inputs);
        let [first, second] = &mut self.mixers;
        let first = first.set(walk.situation.sets[0] * NODES + node);
        let second = second.set(walk.situation.sets[1] * NODES + node);
        let p = squash((first.mix(opinions) + second.mix(opinions)) >> 1);
        let bit = coder.bit(bit, p);
        let error = error(bit, p);
        first.learn(opinions, error, MIXER_RATE);
        second.learn(opinions, error, MIXER_RATE);
        for counter in counters {
            counter.learn(bit, COUNTER_LIMIT);
        }
        bit
    }
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
        let candidates = [Candidates::EMPTY; LISTS];
        Situation { above: [0; CONTEXTS], below: [1; CONTEXTS], sets: [0, 0], candidates, trust: 0 }
    }

    proptest! {
        #[test]
        fn any_value_comes_back_whatever_is_expected(
            cases in prop::collection::vec((
                -COORDINATE_LIMIT..=COORDINATE_LIMIT,
                prop::array::uniform3((-(1i64 << 37)..1 << 37, 1u64..1 << 36)),
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
