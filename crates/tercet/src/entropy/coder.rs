//! A binary arithmetic coder whose two directions share one interface.

use super::symbol::{Cumulative, TOTAL_BITS};

/// Codes decisions in one direction.
///
/// A model calls [`bit`](Coder::bit) with the decision it wants written and goes on with the
/// decision it gets back: an encoder returns what it was given, a decoder ignores it and
/// returns what it reads. So one function describes both directions and they cannot differ.
pub(crate) trait Coder {
    /// Whether the values passed in are meaningful.
    const ENCODES: bool;

    /// Codes one decision whose probability of being true is `p`/65536, 0 < p.
    fn bit(&mut self, bit: bool, p: u16) -> bool;

    /// Codes the low `bits` (≤ 16) bits of `value`, all equally likely.
    fn raw(&mut self, value: u32, bits: u32) -> u32;

    /// Codes one of sixteen symbols.
    fn symbol(&mut self, symbol: usize, frequencies: Cumulative) -> usize;

    /// Codes the low `bits` (≤ 32) bits of `value`, all equally likely.
    fn raw_wide(&mut self, value: u32, bits: u32) -> u32 {
        if bits <= 16 {
            return self.raw(value, bits);
        }
        let high = self.raw(value >> 16, bits - 16);
        high << 16 | self.raw(value & 0xffff, 16)
    }

    /// Whether more was read than any encoder can have left out: the data are damaged or
    /// announce more than they hold. Loops over announced counts check it.
    fn exhausted(&self) -> bool {
        false
    }

    /// Whether no bytes are missing, now or later.
    fn is_whole(&self) -> bool {
        true
    }

    /// Whether [`AHEAD`] more bytes can be read, or all that there are. A loop that can be resumed pauses
    /// where they cannot.
    fn is_ready(&self) -> bool {
        true
    }
}

/// Bytes that have to be there before a vertex is read: a multiple of what its three coordinates take,
/// each fewer than 80 decisions of 16 bits at most.
const AHEAD: usize = 1 << 10;

/// No encoder leaves out more zero bytes than this, and no decoder has to supply more.
const SUPPLIED: usize = 16;

/// The interval is renormalised by whole words, of so many bytes, when it falls below this.
const LOW_RANGE: u64 = 1 << 32;
const WORD: usize = 4;

/// Keeps coders of several threads, which lie side by side, apart: two in one cache line, or in the pair of lines that a
/// processor fetches together, would take it from each other with each decision. An alignment would do so too, but
/// blocks that must be aligned cut up an allocator's large ones. It stands last, in the order of C.
type Apart = [u64; 16];

/// Writes decisions.
#[repr(C)]
pub(crate) struct Encoder {
    low: u64,
    range: u64,
    out: Vec<u8>,
    _apart: Apart,
}

impl Encoder {
    pub fn new() -> Self {
        Encoder { low: 0, range: u64::MAX, out: Vec::new(), _apart: Apart::default() }
    }

    /// Bits written so far, rounded.
    pub fn bits(&self) -> u64 {
        8 * self.out.len() as u64 + self.range.leading_zeros() as u64
    }

    /// The bytes that a decoder has read when it has decoded what was coded so far.
    pub fn reach(&self) -> usize {
        self.out.len() + 2 * WORD
    }

    /// The bytes written, without up to [`SUPPLIED`] trailing zero bytes: a decoder adds them.
    pub fn finish(mut self) -> Vec<u8> {
        // The shortest number in [low, low + range): the fewer low bits it needs the better.
        for kept in 0..=8 {
            let mask = if kept == 8 { 0 } else { u64::MAX >> (8 * kept) };
            let (rounded, overflow) = self.low.overflowing_add(mask);
            let value = rounded & !mask;
            if value.wrapping_sub(self.low) < self.range {
                if overflow {
                    self.carry();
                }
                self.out.extend_from_slice(&value.to_be_bytes());
                break;
            }
        }
        for _ in 0..SUPPLIED {
            if self.out.last() == Some(&0) {
                self.out.pop();
            }
        }
        self.out
    }

    fn carry(&mut self) {
        for byte in self.out.iter_mut().rev() {
            *byte = byte.wrapping_add(1);
            if *byte != 0 {
                break;
            }
        }
    }

    #[inline(always)]
    fn narrow(&mut self, offset: u64, range: u64) {
        let (low, overflow) = self.low.overflowing_add(offset);
        self.low = low;
        self.range = range;
        if overflow {
            self.carry();
        }
        if self.range < LOW_RANGE {
            self.out.extend_from_slice(&((self.low >> 32) as u32).to_be_bytes());
            self.low <<= 32;
            self.range <<= 32;
        }
    }
}

impl Coder for Encoder {
    const ENCODES: bool = true;

    #[inline(always)]
    fn bit(&mut self, bit: bool, p: u16) -> bool {
        let ones = (self.range >> 16) * p as u64;
        if bit {
            self.narrow(0, ones)
        } else {
            self.narrow(ones, self.range - ones)
        }
        bit
    }

    #[inline]
    fn raw(&mut self, value: u32, bits: u32) -> u32 {
        let unit = self.range >> bits;
        self.narrow(unit * value as u64, unit);
        value
    }

    #[inline(always)]
    fn symbol(&mut self, symbol: usize, frequencies: Cumulative) -> usize {
        let unit = self.range >> TOTAL_BITS;
        let [low, high] = frequencies.interval(symbol);
        self.narrow(unit * low as u64, unit * (high - low) as u64);
        symbol
    }
}

/// Where a decoder stands: enough to go on when more bytes are there.
#[derive(Clone, Copy)]
pub(crate) struct Cursor {
    code: u64,
    range: u64,
    at: usize,
}

/// Reads decisions; past the end of the bytes it reads zeros.
#[repr(C)]
pub(crate) struct Decoder<'a> {
    code: u64,
    range: u64,
    bytes: &'a [u8],
    at: usize,
    /// Whether no more bytes will come.
    whole: bool,
    _apart: Apart,
}

impl<'a> Decoder<'a> {
    /// Reads all that was written.
    pub fn new(bytes: &'a [u8]) -> Self {
        let mut decoder =
            Decoder { code: 0, range: u64::MAX, bytes, at: 0, whole: true, _apart: Apart::default() };
        decoder.code = (decoder.word() as u64) << 32;
        decoder.code |= decoder.word() as u64;
        decoder
    }

    /// Reads from the start of what was written, all of which is there if `whole`; `None` if it is too little
    /// to begin with.
    pub fn start(bytes: &'a [u8], whole: bool) -> Option<Self> {
        (whole || bytes.len() >= 2 * WORD).then(|| Decoder { whole, ..Decoder::new(bytes) })
    }

    /// Goes on where another decoder stood; `bytes` begins with those that it had.
    pub fn resume(Cursor { code, range, at }: Cursor, bytes: &'a [u8], whole: bool) -> Self {
        Decoder { code, range, bytes, at, whole, _apart: Apart::default() }
    }

    /// Where it stands.
    pub fn cursor(&self) -> Cursor {
        Cursor { code: self.code, range: self.range, at: self.at }
    }

    /// Bytes read so far.
    pub fn reach(&self) -> usize {
        self.at
    }

    #[inline(always)]
    fn word(&mut self) -> u32 {
        let at = self.at;
        self.at += WORD;
        match self.bytes.get(at..at + WORD) {
            Some(word) => u32::from_be_bytes([word[0], word[1], word[2], word[3]]),
            None => self.tail(at),
        }
    }

    #[cold]
    fn tail(&self, at: usize) -> u32 {
        (0..WORD).fold(0, |w, i| w << 8 | self.bytes.get(at + i).copied().unwrap_or(0) as u32)
    }

    #[inline(always)]
    fn renormalise(&mut self) {
        if self.range < LOW_RANGE {
            self.code = self.code << 32 | self.word() as u64;
            self.range <<= 32;
        }
    }
}

impl Coder for Decoder<'_> {
    const ENCODES: bool = false;

    #[inline(always)]
    fn bit(&mut self, _: bool, p: u16) -> bool {
        let ones = (self.range >> 16) * p as u64;
        let bit = self.code < ones;
        // A processor could not guess it, and often nothing depends on it but numbers.
        let zero = (bit as u64).wrapping_sub(1);
        self.code -= ones & zero;
        self.range = ones ^ ((ones ^ (self.range - ones)) & zero);
        self.renormalise();
        bit
    }

    #[inline]
    fn raw(&mut self, _: u32, bits: u32) -> u32 {
        let unit = self.range >> bits;
        // A valid stream never exceeds the last value; a damaged one must not either.
        let value = (self.code / unit).min((1u64 << bits) - 1);
        self.code = (self.code - value * unit).min(unit - 1);
        self.range = unit;
        self.renormalise();
        value as u32
    }

    #[inline(always)]
    fn symbol(&mut self, _: usize, frequencies: Cumulative) -> usize {
        let unit = self.range >> TOTAL_BITS;
        let slot = (self.code / unit).min(i16::MAX as u64);
        let symbol = frequencies.find(slot as i16);
        let [low, high] = frequencies.interval(symbol);
        self.range = unit * (high - low) as u64;
        // As for raw bits, a damaged stream may be beyond the last slot.
        self.code = (self.code - unit * low as u64).min(self.range - 1);
        self.renormalise();
        symbol
    }

    fn exhausted(&self) -> bool {
        self.whole && self.at > self.bytes.len() + SUPPLIED
    }

    fn is_whole(&self) -> bool {
        self.whole
    }

    fn is_ready(&self) -> bool {
        self.whole || self.at + AHEAD <= self.bytes.len()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn what_is_written_is_read(
            events in prop::collection::vec((any::<bool>(), 1u16.., 0u32..=16, any::<u32>()), 0..400)
        ) {
            let mut encoder = Encoder::new();
            for &(bit, p, bits, value) in &events {
                encoder.bit(bit, p);
                encoder.raw(value & ((1 << bits) - 1), bits);
                encoder.raw_wide(value >> 3, 29);
            }
            let bytes = encoder.finish();
            let mut decoder = Decoder::new(&bytes);
            for &(bit, p, bits, value) in &events {
                prop_assert_eq!(decoder.bit(false, p), bit);
                prop_assert_eq!(decoder.raw(0, bits), value & ((1 << bits) - 1));
                prop_assert_eq!(decoder.raw_wide(0, 29), value >> 3);
            }
            prop_assert!(!decoder.exhausted());
        }

        #[test]
        fn carries_reach_as_far_back_as_they_must(n in 0usize..3000, bit: bool) {
            let mut encoder = Encoder::new();
            for i in 0..n {
                encoder.bit(i + 1 == n && bit, 1);
            }
            let bytes = encoder.finish();
            let mut decoder = Decoder::new(&bytes);
            for i in 0..n {
                prop_assert_eq!(decoder.bit(false, 1), i + 1 == n && bit);
            }
        }

        #[test]
        fn any_bytes_can_be_read(bytes in prop::collection::vec(any::<u8>(), 0..40)) {
            let mut decoder = Decoder::new(&bytes);
            for i in 0..400u32 {
                decoder.bit(false, (i * 163 + 1) as u16);
                let bits = i % 17;
                prop_assert!(decoder.raw(0, bits) < 1 << bits);
            }
        }
    }

    #[test]
    fn a_long_tail_of_zeros_is_not_taken_for_damage() {
        let mut encoder = Encoder::new();
        for _ in 0..100 {
            encoder.raw(0, 16);
        }
        let bytes = encoder.finish();
        let mut decoder = Decoder::new(&bytes);
        for _ in 0..100 {
            assert_eq!(decoder.raw(0, 16), 0);
        }
        assert!(!decoder.exhausted());
        (0..100).for_each(|_| assert_eq!(decoder.raw(0, 16), 0));
        assert!(decoder.exhausted());
    }

    #[test]
    fn a_decoder_pauses_where_bytes_are_missing_and_goes_on_from_there() {
        let mut encoder = Encoder::new();
        let mut reaches = Vec::new();
        for i in 0..20_000u32 {
            encoder.raw((i * i) & 0xffff, 16);
            reaches.push(encoder.reach());
        }
        let bytes = encoder.finish();
        assert!(Decoder::start(&bytes[..7], false).is_none());
        let mut cursor = Decoder::start(&bytes[..8], false).unwrap().cursor();
        let mut read = 0;
        for have in (8..bytes.len()).step_by(777).chain([bytes.len()]) {
            let mut decoder = Decoder::resume(cursor, &bytes[..have], have == bytes.len());
            while read < reaches.len() && decoder.is_ready() {
                assert_eq!(decoder.raw(0, 16), ((read * read) & 0xffff) as u32);
                assert_eq!(decoder.reach(), reaches[read]);
                assert!(decoder.reach() <= have || have == bytes.len());
                read += 1;
            }
            cursor = decoder.cursor();
        }
        assert_eq!(read, reaches.len());
    }

    #[test]
    fn likely_decisions_cost_little_and_an_empty_stream_nothing() {
        assert!(Encoder::new().finish().is_empty());
        let mut encoder = Encoder::new();
        for _ in 0..10_000 {
            encoder.bit(true, 65_000);
        }
        // 10 000 · log2(65536 / 65000) bits = 14.8 bytes.
        assert!(encoder.finish().len() <= 17);
    }
}
