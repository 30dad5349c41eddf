//! A binary decision under several contexts.

use super::priors;
#[cfg(all(test, feature = "max"))]
use super::training::{Table, note};
use crate::entropy::{Coder, Counter, Mixer, Opinions, error, squash};

/// Memory of the counters: after this many outcomes the oldest begin to fade.
pub(super) const LIMIT: u16 = 250;

/// Predicts one kind of binary decision from `N` ≤ 8 contexts, mixed by weights that a further
/// context, the *set*, selects.
#[derive(Clone)]
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

    /// Begins with what the digits of contexts say, and with these weights (in 1/8192).
    pub fn expecting(contexts: [&[&[i16]]; N], first: [i16; N], sets: usize, rate: i32) -> Self {
        let mut model = Self::new(contexts.map(priors::size), sets, rate);
        model.counters = priors::counters(&contexts);
        let mut weights = [0; 8];
        weights[..N].copy_from_slice(&first);
        model.mixer = Mixer::new(sets, |_| [weights]);
        model
    }

    /// Notes what it has learnt: counters as the table of their context, and the weights of those.
    #[cfg(all(test, feature = "max"))]
    pub fn note(&self, table_of: impl Fn(usize) -> Table, weights_table: Table) {
        for (i, start) in self.start.into_iter().enumerate() {
            let end = self.start.get(i + 1).copied().unwrap_or(self.counters.len());
            for (value, counter) in self.counters[start..end].iter().enumerate() {
                let (p, seen) = counter.state();
                note(table_of(i), value, &[(p >> 1) as i16], seen);
            }
        }
        for (weights, uses) in self.mixer.weights() {
            note(weights_table, 0, &weights[0], uses);
        }
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
