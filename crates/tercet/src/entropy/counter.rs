//! A probability that learns.

use super::{Coder, stretch};

/// An adaptive probability of a 1: the first outcomes move it far, later ones less.
///
/// After n outcomes an outcome moves it by 1/(n + 1.6) of the distance, with n held at a limit
/// so that it goes on following a source that changes.
/// The probability lies in the upper half of the word, the number of outcomes in the lower.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Counter(u32);

const SEEN: usize = 256;

/// How many outcomes an expectation counts for.
const EXPECTED: u32 = 2;

/// 65536 / (n + 1.6).
static STEP: [u16; SEEN] = {
    let mut table = [0; SEEN];
    let mut n = 0;
    while n < SEEN {
        table[n] = (655_360 / (10 * n + 16)) as u16;
        n += 1;
    }
    table
};

impl Counter {
    pub const NEW: Counter = Counter(1 << 31);

    /// What to begin with where a 1 has the probability `p`/256, 0 < p: as after [`EXPECTED`] outcomes.
    pub const fn expecting(p: u8) -> Counter {
        Counter((p as u32) << 24 | EXPECTED)
    }

    /// The probability of a 1, in 1/65536, and how many outcomes it remembers beyond those that it was
    /// [expecting](Counter::expecting).
    #[cfg(all(test, feature = "max"))]
    pub fn state(self) -> (u16, i16) {
        (self.p(), (self.0 & 255).saturating_sub(EXPECTED) as i16)
    }

    /// The probability of a 1, in 1/65536; never 0.
    #[inline(always)]
    pub fn p(self) -> u16 {
        (self.0 >> 16) as u16
    }

    /// Its logit, in 1/256.
    #[inline(always)]
    pub fn logit(self) -> i16 {
        stretch(self.p())
    }

    /// Codes a decision with this probability alone, and learns it; `limit` as in [`learn`](Counter::learn).
    #[inline(always)]
    pub fn code<C: Coder>(&mut self, coder: &mut C, bit: bool, limit: u16) -> bool {
        let bit = coder.bit(bit, self.p());
        self.learn(bit, limit);
        bit
    }

    /// Learns an outcome; `limit` (< 256) bounds its memory.
    #[inline(always)]
    pub fn learn(&mut self, bit: bool, limit: u16) {
        let target = if bit { 65503 } else { 32 };
        let step = STEP[(self.0 & 255) as usize] as i32;
        let p = self.p() as i32;
        let p = p + (((target - p) * step) >> 16);
        let n = self.0 & 255;
        self.0 = (p as u32) << 16 | (n + (n < limit as u32) as u32);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_counter_finds_the_frequency_and_stays_within_bounds() {
        let mut counter = Counter::NEW;
        for i in 0..3000u32 {
            counter.learn(i % 4 == 0, 250);
        }
        assert!((counter.p() as i32 - 16384).abs() < 300);
        for _ in 0..10_000 {
            counter.learn(true, 250);
        }
        assert!(counter.p() > 65_000);
        for _ in 0..20_000 {
            counter.learn(false, 250);
        }
        assert!(counter.p() > 0 && counter.p() < 600);
    }
}
