//! One coordinate of the default profile: an integer near what two experts expect.
//!
//! As in [`residual`](super::residual), but with less to ask: each expert is a logistic distribution, and a
//! coordinate is coded as a few binary decisions around the first one's centre: which side, how many bins
//! away, where in the bin. A bin is a power of two wide. Where in it the coordinate lies is only modelled
//! where a value that it may repeat lies there too, by how many do in either half, and follows as plain bits where none does.
//!
//! With z the standardised distance and S(z) = 1/(1 + e^z) the logistic survival function, an expert's
//! logits are
//!
//! - below the centre: z;
//! - at least b, given at least a: ln(1 + e^−z(a)) − ln(e^(z(b)−z(a)) − 1).
//!
//! Two lists of values that may repeat give counters' opinions beside those of the experts, and one mixer
//! weighs the four.

use super::axes::KINDS;
use super::model::number;
use super::opinions::{MIXED, REPEATED, row};
use super::scale::Scale;
use super::vector::COORDINATE_LIMIT;
use crate::entropy::{Coder, Counter, LOGIT_LIMIT, Mixer, error, log_expm1, softplus, squash};
use wide::{i8x16, i16x8, i16x16, i32x8};

pub(super) const EXPERTS: usize = 2;
const LISTS: usize = 2;

/// Ends of the bins in units; each is a power of two wide. Beyond the last the rest is stored plainly.
const BINS: [i64; 18] = [1, 2, 3, 4, 5, 6, 8, 10, 12, 16, 20, 28, 44, 76, 140, 268, 524, 2572];

/// Nodes, which tell decisions apart: the side, the first bins, of which the last stands for all after it, and
/// the first halvings.
pub(super) const SIDE: usize = 0;
pub(super) const FIRST_BIN: usize = 1;
pub(super) const BIN_NODES: usize = 12;
pub(super) const FIRST_HALVING: usize = FIRST_BIN + BIN_NODES;
pub(super) const HALVING_NODES: usize = 3;
pub(super) const NODES: usize = FIRST_HALVING + HALVING_NODES;
const _: () = assert!(NODES.is_power_of_two());

/// Units, by their logarithm, and kinds of axes.
const SETTINGS: usize = 4 * KINDS;
/// Settings, and none, one, two or more candidates in each part of a decision, up to a power of two.
const SPLITS: usize = (SETTINGS * 4 * 4).next_power_of_two();

/// None, one, two, more candidates of either list in the lower half of a bin, and in the upper half.
const CROWDS: usize = 4 * 4 * 4 * 4;

/// The counters' memory.
const LIMIT: u16 = 110;
/// The mixer's rate, in 1/65536.
const RATE: i32 = 720;
const BIAS: i32 = 77;

/// A distribution of the coordinate.
#[derive(Clone, Copy)]
pub(super) struct Expert {
    /// Its centre, in 1/256 of a step.
    pub centre: i64,
    pub scale: Scale,
}

/// What is known of one coordinate.
pub(super) struct Situation {
    pub experts: [Expert; EXPERTS],
    pub kind: usize,
    /// Values that it may repeat.
    pub candidates: [Candidates; LISTS],
}

/// Up to eight values that a coordinate may repeat.
#[derive(Clone, Copy)]
pub(super) struct Candidates {
    values: i32x8,
    /// −1 where there is no value.
    absent: i16x8,
}

impl Candidates {
    /// The first `count` of the values.
    #[inline(always)]
    pub fn new(values: [i32; 8], count: usize) -> Self {
        Candidates { values: i32x8::new(values), absent: i16x8::new(ABSENT[count.min(8)]) }
    }

    /// How far they lie above the centre, in 16 bits: what does not fit is too far to matter. Those that are
    /// absent lie furthest below it.
    #[inline(always)]
    fn above(self, centre: i64) -> i16x8 {
        let above = i16x8::from_i32x8_saturate(self.values - i32x8::splat(centre as i32));
        (above & !self.absent) | (self.absent & i16x8::splat(i16::MIN))
    }
}

/// For each number of values the places without one.
static ABSENT: [[i16; 8]; 9] = {
    let mut table = [[0; 8]; 9];
    let mut i = 0;
    while i < 9 * 8 {
        if i % 8 >= i / 8 {
            table[i / 8][i % 8] = -1;
        }
        i += 1;
    }
    table
};

/// The candidates of both lists as magnitudes on one side of the centre.
#[derive(Clone, Copy)]
struct Magnitudes(i16x16);

/// Subset of them, a bit each.
type Subset = u32;

/// All of both lists.
const LISTED: Subset = 0xffff;

impl Magnitudes {
    fn of(lists: [i16x8; LISTS]) -> Self {
        let [neighbours, parallelograms] = lists.map(i16x8::to_array);
        Magnitudes(i16x16::new(std::array::from_fn(|i| {
            if i < 8 { neighbours[i] } else { parallelograms[i - 8] }
        })))
    }

    /// Those below a magnitude; what is absent lies below all or above all of them.
    #[inline(always)]
    fn below(self, magnitude: i64) -> Subset {
        let bound = magnitude.clamp(i16::MIN as i64 + 1, i16::MAX as i64) as i16;
        let below = self.0.simd_lt(i16x16::splat(bound));
        i8x16::from_i16x16_saturate(below).to_bitmask()
    }
}

/// Three, or as many ones as a byte has if there are fewer.
static FEW: [u8; 256] = {
    let mut table = [0; 256];
    let mut i = 0;
    while i < 256 {
        let ones = (i as u8).count_ones() as u8;
        table[i] = if ones < 3 { ones } else { 3 };
        i += 1;
    }
    table
};

/// The models of coordinates; they live as long as the file.
#[derive(Clone)]
pub(super) struct CoordinateModels {
    by_split: [Box<[[Counter; NODES]; SPLITS]>; LISTS],
    mixer: Mixer,
    /// Of halvings, by how many candidates lie in the lower and the upper half: those of list 1, then of list 2.
    halvings: Box<[[Counter; CROWDS]; HALVING_NODES]>,
}

/// One coordinate being coded.
struct Walk {
    /// Standardised distance of each expert's centre from the boundary at magnitude 0.
    z: [i32; EXPERTS],
    candidates: Magnitudes,
    setting: usize,
    /// Candidates below the bounds of the next decision's two parts.
    low: Subset,
    middle: Subset,
    high: Subset,
}

impl Walk {
    /// Turns to the magnitudes below the centre, if `sign` is −1 and not 0: which of them a processor could not guess.
    #[inline(always)]
    fn mirror(&mut self, sign: i32) {
        self.z = self.z.map(|z| (z ^ sign) - sign);
        // centre − 1 − v is −1 − (v − centre); what was too far above is too far below.
        self.candidates.0 ^= i16x16::splat(sign as i16);
        // Those that were not below 0 are now.
        self.middle ^= sign as Subset;
    }

    /// How many candidates of a list lie in either part, as digits of base 4.
    #[inline(always)]
    fn split(&self, list: usize) -> usize {
        let few = |some: Subset| FEW[(some >> (8 * list) & 255) as usize] as usize;
        4 * few(self.middle & !self.low) + few(self.high & !self.middle)
    }
}

impl CoordinateModels {
    pub fn new() -> Self {
        CoordinateModels {
            by_split: [0, 1].map(|list: usize| {
                let start = |split: usize, node: usize| match REPEATED[list].get(row(node)) {
                    Some(says) => Counter::expecting(says[split % 16]),
                    None => Counter::NEW,
                };
                Box::new(std::array::from_fn(|split| std::array::from_fn(|node| start(split, node))))
            }),
            mixer: Mixer::new(SETTINGS * NODES, |set| {
                [MIXED.get(row(set % NODES)).copied().unwrap_or_default()]
            }),
            halvings: Box::new([std::array::from_fn(expected_halving); HALVING_NODES]),
        }
    }

    /// Codes a coordinate. `value` matters only when encoding.
    #[inline]
    pub fn code<C: Coder>(&mut self, coder: &mut C, value: i32, situation: &Situation) -> i32 {
        let experts = &situation.experts;
        let centre = (experts[0].centre + 128) >> 8;
        let unit = experts[0].scale.unit_bits();
        let mut walk = Walk {
            z: experts.map(|e| e.scale.standardise((centre << 8) - 128 - e.centre)),
            candidates: Magnitudes::of(situation.candidates.map(|list| list.above(centre))),
            setting: unit.min(3) as usize * KINDS + situation.kind,
            low: 0,
            middle: 0,
            high: 0,
        };
        let value = value as i64;
        let window = (4 << unit) + 1;
        [walk.low, walk.middle, walk.high] = [-window, 0, window].map(|bound| walk.candidates.below(bound));
        let negative = self.decide(coder, value < centre, SIDE, &walk, walk.z);
        let sign = -(negative as i64);
        walk.mirror(sign as i32);
        let magnitude = self.magnitude(coder, (value - centre) ^ sign, unit, experts, &mut walk);
        let value = centre + (magnitude ^ sign);
        value.clamp(-(COORDINATE_LIMIT as i64), COORDINATE_LIMIT as i64) as i32
    }

    #[inline(always)]
    fn magnitude<C: Coder>(
        &mut self,
        coder: &mut C,
        magnitude: i64,
        unit: u32,
        experts: &[Expert; EXPERTS],
        walk: &mut Walk,
    ) -> i64 {
        let step = experts.map(|e| e.scale.length(1 << unit));
        let one = step.map(log_expm1);
        walk.high = walk.candidates.below(i64::MAX);
        let mut low = 0;
        for (k, &high) in BINS.iter().enumerate() {
            let wide = (high - low) as i32;
            let logits = std::array::from_fn(|j| {
                let mass = if wide == 1 { one[j] } else { log_expm1(wide * step[j]) };
                softplus(-(walk.z[j] + low as i32 * step[j])) - mass
            });
            let node = FIRST_BIN + k.min(BIN_NODES - 1);
            walk.low = walk.middle;
            walk.middle = walk.candidates.below(high << unit);
            if !self.decide(coder, magnitude >= high << unit, node, walk, logits) {
                walk.high = walk.middle;
                let bits = unit + wide.ilog2();
                return self.within(coder, magnitude, low << unit, bits, walk);
            }
            low = high;
        }
        let rest = (magnitude - (low << unit)).clamp(0, u32::MAX as i64 - 2) as u32;
        (low << unit) + number(coder, rest) as i64
    }

    /// Codes where in the bin of 2^`bits` integers from `low` on the magnitude lies: experts have nothing to say
    /// of that but what candidates do.
    #[inline(always)]
    fn within<C: Coder>(
        &mut self,
        coder: &mut C,
        magnitude: i64,
        mut low: i64,
        mut bits: u32,
        walk: &mut Walk,
    ) -> i64 {
        for counters in self.halvings.iter_mut() {
            if bits == 0 || walk.high & !walk.low & LISTED == 0 {
                break;
            }
            bits -= 1;
            let middle = low + (1 << bits);
            walk.middle = walk.candidates.below(middle);
            let counter = &mut counters[walk.split(0) * 16 + walk.split(1)];
            if counter.code(coder, magnitude >= middle, LIMIT) {
                walk.low = walk.middle;
                low = middle;
            } else {
                walk.high = walk.middle;
            }
        }
        // The encoder's magnitude lies in what is left.
        low + if bits > 0 { coder.raw_wide((magnitude - low) as u32, bits) as i64 } else { 0 }
    }

    /// One binary decision: whether the value lies in the upper of the walk's two parts, of which the
    /// experts say `logits`. A page has one copy of it: the three that are inlined elsewhere take longer to fetch.
    #[cfg_attr(not(target_family = "wasm"), inline(always))]
    #[cfg_attr(target_family = "wasm", inline(never))]
    fn decide<C: Coder>(
        &mut self,
        coder: &mut C,
        bit: bool,
        node: usize,
        walk: &Walk,
        logits: [i32; EXPERTS],
    ) -> bool {
        let node = node & (NODES - 1);
        let [neighbours, parallelograms] = &mut self.by_split;
        let row = |list: usize| (walk.setting * 16 + walk.split(list)) & (SPLITS - 1);
        let counters = [&mut neighbours[row(0)][node], &mut parallelograms[row(1)][node]];
        let [first, second] = logits;
        let [neighbour, parallelogram] = counters.each_ref().map(|counter| counter.logit() as i32);
        let opinions = [first, second, neighbour, parallelogram, 0, 0, 0, BIAS];
        let limit = i16x8::splat(LOGIT_LIMIT as i16);
        let opinions = &[i16x8::from_i32x8_saturate(i32x8::new(opinions)).min(limit).max(-limit)];
        let weights = self.mixer.set(walk.setting * NODES + node);
        let p = squash(weights.mix(opinions));
        let bit = coder.bit(bit, p);
        weights.learn(opinions, error(bit, p), RATE);
        for counter in counters {
            counter.learn(bit, LIMIT);
        }
        bit
    }
}

/// What a halving is expected to be: the crowd in either half draws it.
fn expected_halving(crowds: usize) -> Counter {
    let [first, second] = [crowds / 16, crowds % 16].map(|split| (split % 4) as i32 - (split / 4) as i32);
    Counter::expecting((squash(128 * (first + second)) >> 8) as u8)
}

/// What they are at the end is what training is for.
#[cfg(all(test, feature = "max"))]
impl Drop for CoordinateModels {
    fn drop(&mut self) {
        use super::training::{Table, note};
        for (set, (weights, uses)) in self.mixer.weights().enumerate() {
            note(Table::Mixed, row(set % NODES), &weights[0], uses);
        }
        for (list, counters) in self.by_split.iter().enumerate() {
            for (split, row_of) in counters.iter().enumerate() {
                for (node, counter) in row_of.iter().enumerate() {
                    let (p, seen) = counter.state();
                    let row = row(node) * 16 + split % 16;
                    note(Table::Repeated(list), row, &[(p >> 8) as i16], seen);
                }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::entropy::{Decoder, Encoder};
    use proptest::prelude::*;

    fn situation(experts: [Expert; EXPERTS], values: [i32; 8], count: usize) -> Situation {
        let candidates = [Candidates::new(values, count), Candidates::new(values, count / 2)];
        Situation { experts, kind: 0, candidates }
    }

    /// A value, centres and mean errors of experts, candidates, how many of them, and whether they know it.
    type Case = (i32, [(i64, u64); EXPERTS], [i32; 8], usize, bool);

    proptest! {
        #[test]
        fn any_value_comes_back_whatever_is_expected(
            cases in prop::collection::vec((
                -COORDINATE_LIMIT..=COORDINATE_LIMIT,
                prop::array::uniform2((-(1i64 << 38)..1 << 38, 1u64..1 << 36)),
                prop::array::uniform8(-COORDINATE_LIMIT..=COORDINATE_LIMIT),
                0usize..9,
                any::<bool>(),
            ), 1..50)
        ) {
            // Half of the time something is known.
            let known = |&(v, experts, mut values, count, near): &Case| {
                let mut experts = experts.map(|(centre, mean)| Expert { centre, scale: Scale::new(mean) });
                if near {
                    experts[0].centre = ((v as i64) << 8) + (experts[0].centre & 1023);
                    values[0] = v;
                }
                situation(experts, values, count)
            };
            let (mut models, mut encoder) = (CoordinateModels::new(), Encoder::new());
            for case in &cases {
                models.code(&mut encoder, case.0, &known(case));
            }
            let bytes = encoder.finish();
            let (mut models, mut decoder) = (CoordinateModels::new(), Decoder::new(&bytes));
            for case in &cases {
                prop_assert_eq!(models.code(&mut decoder, 0, &known(case)), case.0);
            }
        }
    }

    /// Bytes that two thousand values below 1000 take.
    fn bytes(known: impl Fn(i32) -> Situation) -> usize {
        let (mut models, mut encoder) = (CoordinateModels::new(), Encoder::new());
        for i in 0..2000i64 {
            let value = (i * i * 31 % 1000) as i32;
            models.code(&mut encoder, value, &known(value));
        }
        encoder.finish().len()
    }

    #[test]
    fn a_value_that_an_expert_or_a_list_knows_costs_little() {
        let wrong = Expert { centre: 500 << 8, scale: Scale::new(200 << 8) };
        let unknown = bytes(|_| situation([wrong; EXPERTS], [0; 8], 0));
        let by_expert = bytes(|value| {
            let right = Expert { centre: (value as i64) << 8, scale: Scale::new(64) };
            situation([right, wrong], [0; 8], 0)
        });
        let by_list = bytes(|value| situation([wrong; EXPERTS], [value; 8], 1));
        assert!(unknown > 2200, "{unknown}");
        assert!(by_expert < 500, "{by_expert}");
        assert!(by_list < unknown * 2 / 3, "{by_list} of {unknown}");
    }
}
