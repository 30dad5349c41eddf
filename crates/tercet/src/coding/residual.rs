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
//! Counters under geometric contexts add what the distributions do not know, and mixers weigh
//! them all. How many of each there are is the profile's choice: `E` experts, `K` contexts that hold for
//! a whole coordinate, `L` lists of candidates and `G` histograms, each a context that changes with every
//! decision, `S` sets of weights, and `V` vectors of eight opinions for what these give and a bias. Where
//! there are histograms, what the mixers say is averaged with a secondary estimate of it.

use super::coordinate::{BIN_NODES, Expert, FIRST_BIN, FIRST_HALVING, HALVING_NODES, NODES, SIDE};
use super::histogram::Histogram;
use super::model::number;
use super::vector::COORDINATE_LIMIT;
use crate::entropy::{
    Coder, Counter, Knot, LOGIT_LIMIT, Mixer, Opinions, Secondary, error, log_expm1, softplus, squash,
};

/// Number of values of [`Situation::trust`].
pub(crate) const TRUSTS: usize = 24;

/// Ends of the bins in units of the bin width; beyond the last the rest is stored plainly.
const BINS: [i64; 18] = [1, 2, 3, 4, 5, 6, 8, 10, 12, 16, 20, 28, 40, 60, 100, 200, 500, 2000];

const COUNTER_LIMIT: u16 = 110;
const MIXER_RATE: i32 = 420;
const BIAS: i16 = 77;

/// The contexts of one coordinate.
pub(crate) struct Situation<'a, const K: usize, const L: usize, const S: usize, const G: usize> {
    /// Context values for the sign and for magnitudes above the centre.
    pub above: [usize; K],
    /// The same, seen in the mirror, for magnitudes below the centre.
    pub below: [usize; K],
    /// The selectors of the mixers' weights.
    pub sets: [usize; S],
    /// Values that the coordinate may well repeat.
    pub candidates: [Candidates; L],
    /// How much a candidate is worth here.
    pub trust: usize,
    /// How often coordinates have had which values.
    pub histograms: [&'a Histogram; G],
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
type Below<const L: usize> = [u8; L];

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

/// Bins of a number of earlier coordinates: 0, 1, 2 to 3, 4 to 7 …
const FREQUENCY_BINS: usize = 8;

/// The initial weights of the opinions, by node.
pub(crate) type InitialWeights<const V: usize> = fn(usize) -> [[i16; 8]; V];

/// The models of coordinates; they live as long as the file.
#[derive(Clone)]
pub(crate) struct ResidualModels<
    const E: usize,
    const K: usize,
    const L: usize,
    const S: usize,
    const G: usize,
    const V: usize,
> {
    by_context: [Vec<[Counter; NODES]>; K],
    by_split: [Vec<[Counter; NODES]>; L],
    by_frequency: [Vec<[Counter; NODES]>; G],
    mixers: [Mixer<V>; S],
    /// By the first list's candidates in the parts of the decision.
    secondary: [Secondary; G],
}

/// One coordinate being coded.
struct Walk<
    'a,
    const E: usize,
    const K: usize,
    const L: usize,
    const S: usize,
    const G: usize,
    const V: usize,
> {
    situation: &'a Situation<'a, K, L, S, G>,
    experts: &'a [Expert; E],
    /// Standardised distance of each expert's centre from the boundary at magnitude 0.
    z: [i32; E],
    candidates: [Magnitudes; L],
    /// The value of each context.
    contexts: &'a [usize; K],
    inputs: [[i16; 8]; V],
    /// Candidates below the bounds of the next decision's two parts.
    low: Below<L>,
    middle: Below<L>,
    high: Below<L>,
    /// The values at those bounds, if histograms ask for them.
    bounds: [i64; 3],
    centre: i64,
    negative: bool,
}

impl<const E: usize, const K: usize, const L: usize, const S: usize, const G: usize, const V: usize>
    Walk<'_, E, K, L, S, G, V>
{
    #[inline(always)]
    fn below(&self, magnitude: i64) -> Below<L> {
        self.candidates.map(|list| list.below(bound(magnitude)))
    }

    /// Notes the magnitudes that bound the next decision's parts as values.
    #[inline(always)]
    fn bound_by(&mut self, magnitudes: [i64; 3]) {
        if G > 0 {
            let sign = if self.negative { -1 } else { 1 };
            self.bounds = magnitudes.map(|m| self.centre + sign * m);
        }
    }

    /// Whether a candidate of the first two lists lies between the low and the high bound.
    #[inline(always)]
    fn any_candidate(&self) -> bool {
        self.low[..2] != self.high[..2]
    }
}

impl<const E: usize, const K: usize, const L: usize, const S: usize, const G: usize, const V: usize>
    ResidualModels<E, K, L, S, G, V>
{
    const FITS: () = assert!(E + K + L + G < 8 * V);

    /// `sizes` are the numbers of values of the contexts, `sets` those of the selectors.
    pub fn new(sizes: [usize; K], sets: [usize; S], weights: InitialWeights<V>) -> Self {
        let () = Self::FITS;
        let table = |contexts: usize| vec![[Counter::NEW; NODES]; contexts];
        ResidualModels {
            by_context: sizes.map(table),
            by_split: [Candidates::SPLITS * TRUSTS; L].map(table),
            by_frequency: [FREQUENCY_BINS * FREQUENCY_BINS * TRUSTS; G].map(table),
            mixers: sets.map(|sets| Mixer::new(sets * NODES, |i| weights(i % NODES))),
            secondary: [Candidates::SPLITS * NODES; G].map(Secondary::new),
        }
    }

    /// Shows the weights of every set: their node, and how often they have learnt.
    #[cfg(all(test, feature = "max"))]
    pub fn each_weight(&self, mut show: impl FnMut(usize, [[i16; 8]; V], i16)) {
        for mixer in &self.mixers {
            for (i, (weights, uses)) in mixer.weights().enumerate() {
                show(i % NODES, weights, uses);
            }
        }
    }

    /// Codes a coordinate. `value` matters only when encoding.
    pub fn code<C: Coder>(
        &mut self,
        coder: &mut C,
        value: i32,
        experts: &[Expert; E],
        situation: &Situation<'_, K, L, S, G>,
    ) -> i32 {
        let centre = (experts[0].centre + 128) >> 8;
        let value = value as i64;
        let mut z = [0; E];
        for j in 0..E {
            z[j] = experts[j].scale.standardise((centre << 8) - 128 - experts[j].centre);
        }
        let mut inputs = [[0i16; 8]; V];
        inputs[V - 1][7] = BIAS;
        for (input, z) in inputs.as_flattened_mut().iter_mut().zip(z) {
            *input = clamp(z);
        }
        let candidates = situation.candidates.map(|c| Magnitudes(Opinions::new(c.above)));
        let none = [0; L];
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
            bounds: [0; 3],
            centre,
            negative: false,
        };
        let window = 4 * experts[0].scale.unit() + 1;
        [walk.low, walk.middle, walk.high] = [-window, 0, window].map(|bound| walk.below(bound));
        walk.bound_by([-window, 0, window]);
        let negative = self.decide(coder, value < centre, SIDE, &walk);
        if negative {
            walk.contexts = &situation.below;
            walk.negative = true;
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

    fn magnitude<C: Coder>(
        &mut self,
        coder: &mut C,
        magnitude: i64,
        walk: &mut Walk<E, K, L, S, G, V>,
    ) -> i64 {
        let unit = walk.experts[0].scale.unit();
        let (mut step, mut one) = ([0; E], [0; E]);
        for j in 0..E {
            step[j] = walk.experts[j].scale.length(unit);
            one[j] = log_expm1(step[j]);
        }
        let mut low = 0;
        for (k, &high) in BINS.iter().enumerate() {
            for j in 0..E {
                let at = walk.z[j] + low as i32 * step[j];
                let mass = if high - low == 1 { one[j] } else { log_expm1((high - low) as i32 * step[j]) };
                walk.inputs[j / 8][j % 8] = clamp(softplus(-at) - mass);
            }
            let node = FIRST_BIN + k.min(BIN_NODES - 1);
            walk.low = walk.middle;
            [walk.middle, walk.high] = [high, high + 4].map(|bound| walk.below(bound * unit));
            walk.bound_by([low * unit, high * unit, (high + 4) * unit]);
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
    fn within<C: Coder>(
        &mut self,
        coder: &mut C,
        magnitude: i64,
        bin: [i64; 2],
        walk: &mut Walk<E, K, L, S, G, V>,
    ) -> i64 {
        let [mut low, mut high] = bin;
        let mut depth = 0;
        while high - low > 1 {
            let middle = (low + high) / 2;
            let upper = if depth == 0 || depth < HALVING_NODES && walk.any_candidate() {
                for j in 0..E {
                    let z = |steps: i64| walk.experts[j].scale.length(steps);
                    let (l, h) = (walk.z[j] + z(low), walk.z[j] + z(high));
                    let (lower, upper) = (z(middle - low), z(high - middle));
                    let logit = lower + log_expm1(upper) - log_expm1(lower) + softplus(l) - softplus(h);
                    walk.inputs[j / 8][j % 8] = clamp(logit);
                }
                walk.middle = walk.below(middle);
                walk.bound_by([low, middle, high]);
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
    fn decide<C: Coder>(
        &mut self,
        coder: &mut C,
        bit: bool,
        node: usize,
        walk: &Walk<E, K, L, S, G, V>,
    ) -> bool {
        let node = node & (NODES - 1);
        let mut inputs = walk.inputs;
        let flat = inputs.as_flattened_mut();
        for i in 0..K {
            flat[E + i] = self.by_context[i][walk.contexts[i]][node].logit();
        }
        let mut rows = [0; L];
        for i in 0..L {
            let parts =
                [walk.middle[i] - walk.low[i], walk.high[i] - walk.middle[i]].map(|n| n.min(3) as usize);
            rows[i] = (4 * parts[0] + parts[1]) * TRUSTS + walk.situation.trust;
            flat[E + K + i] = self.by_split[i][rows[i]][node].logit();
        }
        let mut frequencies = [0; G];
        for i in 0..G {
            let [low, middle, high] = walk.bounds;
            let parts = [[low, middle], [middle, high]].map(|part| {
                let earlier = walk.situation.histograms[i].between(part);
                (u32::BITS - earlier.leading_zeros()).min(FREQUENCY_BINS as u32 - 1) as usize
            });
            frequencies[i] = (FREQUENCY_BINS * parts[0] + parts[1]) * TRUSTS + walk.situation.trust;
            flat[E + K + L + i] = self.by_frequency[i][frequencies[i]][node].logit();
        }
        let opinions = &inputs.map(Opinions::new);
        let mut sum = 0;
        for (mixer, set) in self.mixers.iter_mut().zip(walk.situation.sets) {
            sum += mixer.set(set * NODES + node).mix(opinions);
        }
        let logit = sum.div_euclid(S as i32);
        let mixed = squash(logit);
        let mut p = mixed;
        let mut knots = [Knot::default(); G];
        for (secondary, knot) in self.secondary.iter().zip(&mut knots) {
            let refined;
            (refined, *knot) = secondary.refine(rows[0] / TRUSTS * NODES + node, logit);
            p = mixed.midpoint(refined);
        }
        let bit = coder.bit(bit, p);
        for (secondary, knot) in self.secondary.iter_mut().zip(knots) {
            secondary.learn(knot, bit);
        }
        let error = error(bit, mixed);
        for (mixer, set) in self.mixers.iter_mut().zip(walk.situation.sets) {
            mixer.set(set * NODES + node).learn(opinions, error, MIXER_RATE);
        }
        for i in 0..K {
            self.by_context[i][walk.contexts[i]][node].learn(bit, COUNTER_LIMIT);
        }
        for (counters, row) in self.by_split.iter_mut().zip(rows) {
            counters[row][node].learn(bit, COUNTER_LIMIT);
        }
        for (counters, row) in self.by_frequency.iter_mut().zip(frequencies) {
            counters[row][node].learn(bit, COUNTER_LIMIT);
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
    use super::super::scale::Scale;
    use super::*;
    use crate::entropy::{Decoder, Encoder};
    use proptest::prelude::*;

    const EXPERTS: usize = 3;

    fn situation(histogram: &Histogram) -> Situation<'_, 1, 2, 2, 1> {
        let candidates = [Candidates::EMPTY; 2];
        Situation { above: [0], below: [1], sets: [0, 0], candidates, trust: 0, histograms: [histogram] }
    }

    fn fresh() -> ResidualModels<EXPERTS, 1, 2, 2, 1, 1> {
        ResidualModels::new([2], [1, 1], |_| [[2730, 2730, 2730, 512, 512, 512, 512, 0]])
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
            let histogram = Histogram::new();
            let experts = |e: &[(i64, u64); EXPERTS], near: bool, v: i32| {
                let mut experts = e.map(|(centre, mean)| Expert { centre, scale: Scale::new(mean) });
                if near {
                    experts[0].centre = ((v as i64) << 8) + (experts[0].centre & 1023);
                }
                experts
            };
            let (mut models, mut encoder) = (fresh(), Encoder::new());
            for (v, e, near) in &cases {
                models.code(&mut encoder, *v, &experts(e, *near, *v), &situation(&histogram));
            }
            let bytes = encoder.finish();
            let (mut models, mut decoder) = (fresh(), Decoder::new(&bytes));
            for (v, e, near) in &cases {
                prop_assert_eq!(models.code(&mut decoder, 0, &experts(e, *near, *v), &situation(&histogram)), *v);
            }
        }
    }

    #[test]
    fn a_value_that_an_expert_knows_costs_little() {
        let histogram = Histogram::new();
        let (mut models, mut encoder) = (fresh(), Encoder::new());
        for i in 0..2000i64 {
            let value = (i * i * 31 % 1000) as i32;
            let wrong = Expert { centre: 500 << 8, scale: Scale::new(200 << 8) };
            let mut experts = [wrong; EXPERTS];
            experts[0] = Expert { centre: (value as i64) << 8, scale: Scale::new(64) };
            models.code(&mut encoder, value, &experts, &situation(&histogram));
        }
        let bytes = encoder.finish().len();
        assert!(bytes < 500, "{bytes} bytes for 2000 known values");
    }
}
