//! Adaptive frequencies of a small alphabet.

use wide::i16x8;

/// Number of symbols.
pub(crate) const SYMBOLS: usize = 16;

/// Bits of the sum of all frequencies.
pub(crate) const TOTAL_BITS: u32 = 15;

/// Cumulative frequencies for a coder: for each symbol the sum of those before it.
#[derive(Clone, Copy)]
pub(crate) struct Cumulative([i16x8; 2]);

impl Cumulative {
    /// The symbol whose interval holds `slot`, below 2¹⁵.
    #[inline(always)]
    pub fn find(self, slot: i16) -> usize {
        let above = |i: usize| self.0[i].simd_gt(i16x8::splat(slot)).to_bitmask() & 255;
        let above = above(0) | above(1) << 8 | 1 << SYMBOLS;
        above.trailing_zeros() as usize - 1
    }

    /// Where the interval of `symbol` begins and ends.
    #[inline(always)]
    pub fn interval(self, symbol: usize) -> [u32; 2] {
        let mut bounds = [1i16 << 14; SYMBOLS + 8];
        bounds[..8].copy_from_slice(&self.0[0].to_array());
        bounds[8..16].copy_from_slice(&self.0[1].to_array());
        let end = if symbol + 1 < SYMBOLS { bounds[symbol + 1] as u32 } else { 1 << TOTAL_BITS };
        [bounds[symbol & (SYMBOLS - 1)] as u32, end]
    }
}

/// A distribution that moves towards each symbol that comes, the first ones more.
///
/// It keeps cumulative frequencies in 1/2¹⁴, of the symbols before each. There is none before the first one:
/// in its place is how often the distribution was used, so that two of them fill a line of a cache.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Frequencies([i16x8; 2]);

/// The largest cumulative frequency; twice as much still fits 16 bits.
const FULL: i16 = (1 << 14) - 1;

/// The first step is 2^−this; it is halved after every [`STAGE`] uses down to 2^−[`SLOWEST`].
const FASTEST: i16 = 4;
const SLOWEST: i16 = 7;
const STAGE: i16 = 8;

/// For each symbol −1 in the places after it.
static AFTER: [[i16; SYMBOLS]; SYMBOLS] = {
    let mut table = [[0; SYMBOLS]; SYMBOLS];
    let mut i = 0;
    while i < SYMBOLS * SYMBOLS {
        if i % SYMBOLS > i / SYMBOLS {
            table[i / SYMBOLS][i % SYMBOLS] = -1;
        }
        i += 1;
    }
    table
};

/// The floor of 8 for each symbol, times its index.
const FLOORS: [[i16; 8]; 2] = [[0, 8, 16, 24, 32, 40, 48, 56], [64, 72, 80, 88, 96, 104, 112, 120]];

/// All ones but in the place of the uses, and 1 in that place.
const REST: [i16; 8] = [0, -1, -1, -1, -1, -1, -1, -1];
const USE: [i16; 8] = [1, 0, 0, 0, 0, 0, 0, 0];

impl Frequencies {
    /// With the cumulative frequencies `before` in 1/2¹⁴, ascending from 0.
    pub fn new(before: [i16; SYMBOLS]) -> Self {
        let half = |i: usize| i16x8::new(std::array::from_fn(|j| before[8 * i + j]));
        Frequencies([half(0), half(1)])
    }

    /// The distribution, with a floor for every symbol.
    #[inline(always)]
    pub fn cumulative(&self) -> Cumulative {
        let half = |i: usize| {
            let twice = self.0[i] + self.0[i];
            twice - (twice >> 7_i32) + i16x8::new(FLOORS[i])
        };
        Cumulative([half(0) & i16x8::new(REST), half(1)])
    }

    /// Learns a symbol.
    #[inline(always)]
    pub fn learn(&mut self, symbol: usize) {
        // Never negative: a shift of what has no sign is one instruction.
        let uses = self.0[0].to_array()[0];
        let rate = FASTEST + (uses as u16 / STAGE as u16).min((SLOWEST - FASTEST) as u16) as i16;
        // Rounding down then reaches both ends.
        let target = i16x8::splat(FULL + (1 << rate) - 1);
        let after = &AFTER[symbol & (SYMBOLS - 1)];
        let step = |i: usize| {
            let after = i16x8::new(std::array::from_fn(|j| after[8 * i + j]));
            ((after & target) - self.0[i]) >> rate
        };
        let once = if uses < STAGE * (SLOWEST - FASTEST) { i16x8::new(USE) } else { i16x8::ZERO };
        self.0 = [self.0[0] + (step(0) & i16x8::new(REST)) + once, self.0[1] + step(1)];
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::entropy::{Coder, Decoder, Encoder};

    /// Triangular numbers make some symbols rare and others never come.
    fn sequence() -> impl Iterator<Item = usize> {
        (0..5000usize).map(|i| (i * (i + 1) / 2 % 61 % 23).min(12))
    }

    #[test]
    fn what_is_written_is_read_and_frequent_symbols_cost_little() {
        let even = Frequencies::new(std::array::from_fn(|i| 1024 * i as i16));
        let mut frequencies = even;
        let mut encoder = Encoder::new();
        for s in sequence() {
            encoder.symbol(s, frequencies.cumulative());
            frequencies.learn(s);
        }
        let bytes = encoder.finish();
        let mut frequencies = even;
        let mut decoder = Decoder::new(&bytes);
        for s in sequence() {
            assert_eq!(decoder.symbol(0, frequencies.cumulative()), s);
            frequencies.learn(s);
        }
        let mut certain = even;
        (0..2000).for_each(|_| certain.learn(15));
        assert_eq!(certain.cumulative().interval(15), [120, 1 << TOTAL_BITS]);
        (0..2000).for_each(|_| certain.learn(0));
        assert_eq!(certain.cumulative().interval(0)[1], (1 << TOTAL_BITS) - 2 - 255 + 8);
    }

    #[test]
    fn every_slot_belongs_to_the_symbol_whose_interval_holds_it() {
        let mut frequencies = Frequencies::new(std::array::from_fn(|i| 1024 * i as i16));
        sequence().for_each(|s| frequencies.learn(s));
        let cumulative = frequencies.cumulative();
        for slot in 0..=i16::MAX {
            let [low, high] = cumulative.interval(cumulative.find(slot));
            assert!((low..high).contains(&(slot as u32)), "{slot}");
        }
    }
}
