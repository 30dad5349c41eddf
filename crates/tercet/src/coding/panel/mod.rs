//! What the `max` profile asks of connectivity: a binary decision under many contexts, weighed in several
//! situations at once.

mod births;
mod flip;
mod split;

use super::model::LIMIT;
use super::priors::{self, Contexts};
use crate::entropy::{Coder, Counter, LOGIT_LIMIT, Mixer, Opinions, Secondary, error, squash};

use births::Births;
pub(super) use flip::FlipPanel;
pub(super) use split::SplitPanel;

/// Opinions of a panel, in vectors of eight.
const VECTORS: usize = 2;

/// The mixers' rate, in 1/65536.
const RATE: i32 = 400;

/// Predicts one kind of binary decision from `N` ≤ 16 contexts. Each of `S` further contexts, the *sets*,
/// selects weights of its own; the logits that they give are averaged, and all learn from the error of the
/// average. So a set with few values learns soon what holds in general, and those with many add what is
/// special.
pub(crate) struct Panel<const N: usize, const S: usize> {
    counters: Vec<Counter>,
    start: [usize; N],
    mixers: [Mixer<VECTORS>; S],
    /// What the average has turned out to mean, by the first set.
    secondary: Secondary,
}

impl<const N: usize, const S: usize> Panel<N, S> {
    const FITS: () = assert!(N <= 8 * VECTORS);

    /// `sizes` are the numbers of values of the contexts, of which something is expected of the `first`; `sets` are
    /// those of the sets.
    pub fn new(first: Contexts, sizes: [usize; N], sets: [usize; S]) -> Self {
        let () = Self::FITS;
        let mut total = 0;
        let start = sizes.map(|size| {
            total += size;
            total - size
        });
        let mut weights = [[0; 8]; VECTORS];
        weights.as_flattened_mut()[..N].fill((8192 * 3 / 2 / N as i32) as i16);
        let mixers = sets.map(|sets| Mixer::new(sets, |_| weights));
        let secondary = Secondary::new(sets[0]);
        let mut counters = priors::counters(&first);
        counters.resize(total, Counter::NEW);
        Panel { counters, start, mixers, secondary }
    }

    /// Codes `bit` and learns it. `contexts[i]` must be less than the i-th size, `sets[i]` than the
    /// i-th number of sets.
    pub fn code<C: Coder>(
        &mut self,
        coder: &mut C,
        bit: bool,
        sets: [usize; S],
        contexts: [usize; N],
    ) -> bool {
        let mut opinions = [[0i16; 8]; VECTORS];
        let mut at = self.start;
        for ((at, context), opinion) in at.iter_mut().zip(contexts).zip(opinions.as_flattened_mut()) {
            *at += context;
            *opinion = self.counters[*at].logit();
        }
        let opinions = &opinions.map(Opinions::new);
        let mut sum = 0;
        for (mixer, set) in self.mixers.iter_mut().zip(sets) {
            sum += mixer.set(set).mix(opinions);
        }
        let logit = sum.div_euclid(S as i32).clamp(-LOGIT_LIMIT, LOGIT_LIMIT);
        let p = squash(logit);
        let (refined, knot) = self.secondary.refine(sets[0], logit);
        let bit = coder.bit(bit, ((p as u32 + refined as u32) / 2) as u16);
        self.secondary.learn(knot, bit);
        let error = error(bit, p);
        for (mixer, set) in self.mixers.iter_mut().zip(sets) {
            mixer.set(set).learn(opinions, error, RATE);
        }
        for at in at {
            self.counters[at].learn(bit, LIMIT);
        }
        bit
    }
}
