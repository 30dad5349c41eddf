//! A binary decision under several contexts.

use super::priors;
#[cfg(all(test, feature = "max"))]
use super::training::{Table, note, note_counters};
use crate::entropy::{Coder, Counter, Mixer, Opinions, error, squash};

/// Memory of the counters: after this many outcomes the oldest begin to fade.
pub(super) const LIMIT: u16 = 250;

/// Predicts one kind of binary decision from `N` ≤ 8 contexts, mixed by weights that a further
/// context, the *set*, selects.
pub(crate) struct BitModel<const N: usize> {
    counters: Vec<Counter>,
    start: [usize; N],
    mixer: Mixer,
    rate: i32,
}

impl<const N: usize> BitModel<N> {
    /// `sizes` are the numbers of values of the contexts; `rate`/65536 is the mixer's.
    pub fn new(sizes: [usize; N], sets: usize, rate: i32) -> Self {
        let mut start = [0; N];
        let mut total = 0;
        for (start, size) in start.iter_mut().zip(sizes) {
            *start = total;
            total += size;
        }
        let mut weights = [0; 8];
        weights[..N].fill((8192 * 3 / 2 / N as i32) as i16);
        BitModel { counters: vec![Counter::NEW; total], start, mixer: Mixer::new(sets, |_| [weights]), rate }
    }

    /// Codes `bit` and learns it. `contexts[i]` must be less than the i-th size.
    #[inline]
    pub fn code<C: Coder>(&mut self, coder: &mut C, bit: bool, set: usize, contexts: [usize; N]) -> bool {
        let mut opinions = [0i16; 8];
        let mut at = [0usize; N];
        for (i, at) in at.iter_mut().enumerate() {
            *at = self.start[i] + contexts[i];
            opinions[i] = self.counters[*at].logit();
        }
        let opinions = &[Opinions::new(opinions)];
        let weights = self.mixer.set(set);
        let p = squash(weights.mix(opinions));
        let bit = coder.bit(bit, p);
        weights.learn(opinions, error(bit, p), self.rate);
        for at in at {
            self.counters[at].learn(bit, LIMIT);
        }
        bit
    }
}

/// Predicts one kind of decision from two contexts, for speed: where the first is sure, by that alone, and elsewhere
/// by both, mixed by weights that a set selects.
pub(crate) struct PairModel {
    first: Vec<Counter>,
    second: Vec<Counter>,
    mixer: Mixer,
}

/// The first context is sure where either outcome has a probability below this, in 1/65536.
const SURE: u16 = 1 << 12;
const PAIR_RATE: i32 = 400;

impl PairModel {
    /// Begins with what the digits of contexts say, and with these weights (in 1/8192).
    pub fn expecting(contexts: [&[&[i16]]; 2], weights: [i16; 2], sets: usize) -> Self {
        let [first, second] = contexts.map(|context| priors::counters(&[context]));
        let [a, b] = weights;
        PairModel { first, second, mixer: Mixer::new(sets, |_| [[a, b, 0, 0, 0, 0, 0, 0]]) }
    }

    /// Notes what it has learnt: counters as the tables of their contexts, and the weights of those.
    #[cfg(all(test, feature = "max"))]
    pub fn note(&self, tables: [Table; 2], weights_table: Table) {
        note_counters(tables[0], &self.first);
        note_counters(tables[1], &self.second);
        for (weights, uses) in self.mixer.weights() {
            note(weights_table, 0, &weights[0], uses);
        }
    }

    /// Codes `bit` and learns it. `further` are the second context and the set, if they are asked for.
    #[inline(always)]
    pub fn code<C: Coder>(
        &mut self,
        coder: &mut C,
        bit: bool,
        first: usize,
        further: impl FnOnce() -> (usize, usize),
    ) -> bool {
        let first = &mut self.first[first];
        if first.p().wrapping_add(SURE) < 2 * SURE {
            return first.code(coder, bit, LIMIT);
        }
        let (second, set) = further();
        let second = &mut self.second[second];
        let opinions = &[Opinions::new([first.logit(), second.logit(), 0, 0, 0, 0, 0, 0])];
        let weights = self.mixer.set(set);
        let p = squash(weights.mix(opinions));
        let bit = coder.bit(bit, p);
        weights.learn(opinions, error(bit, p), PAIR_RATE);
        first.learn(bit, LIMIT);
        second.learn(bit, LIMIT);
        bit
    }
}

/// Codes a number below 2³² − 1 of which nothing is known: its length in bits, then the bits
/// (Elias gamma).
pub(crate) fn number<C: Coder>(coder: &mut C, value: u32) -> u32 {
    let wanted = 31 - (value.min(u32::MAX - 1) + 1).leading_zeros();
    let mut bits = 0;
    while bits < 31 && coder.bit(bits < wanted, 1 << 15) {
        bits += 1;
    }
    let rest = coder.raw_wide((value + 1) & ((1 << bits) - 1), bits);
    (((1u64 << bits) | rest as u64) - 1) as u32
}
