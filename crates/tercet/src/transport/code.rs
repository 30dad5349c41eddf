//! Erasure codes: a block's bytes as source symbols, and repair symbols that stand in for any of them.
//!
//! Which code a block has follows from its length alone, so that packets need not say and cannot
//! lie: one symbol is repeated; up to [`REED_SOLOMON_MAX`] source symbols are coded by Reed–Solomon,
//! of which any as many as there are source symbols suffice; larger blocks by RaptorQ (RFC 6330),
//! whose repair symbols never run out and which fails on exactly enough symbols in 1 of 100 blocks.

use std::collections::BTreeMap;

use raptorq::{
    EncodingPacket, ObjectTransmissionInformation, PayloadId, SourceBlockDecoder, SourceBlockEncoder,
};

/// Bytes of the largest symbol.
pub(super) const MAX_SYMBOL: usize = 1150;
/// Source symbols of the largest block.
const MAX_SYMBOLS: usize = 1024;
/// Bytes of the largest block.
pub(super) const MAX_BLOCK: usize = MAX_SYMBOL * MAX_SYMBOLS;
/// Source symbols of the largest block that Reed–Solomon codes.
const REED_SOLOMON_MAX: u32 = 128;
/// Source and repair symbols of a Reed–Solomon block together.
const REED_SOLOMON_TOTAL: u32 = 256;
/// Symbols that can be numbered in 24 bits.
const NUMBERED: u32 = 1 << 24;

/// How a block of a length is divided and coded.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Code {
    length: usize,
    /// Source symbols.
    pub(super) symbols: u32,
    /// Bytes of a symbol: even, as Reed–Solomon over 16 bits asks.
    pub(super) size: usize,
}

/// What keeps a symbol of a block from being lost.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Kind {
    Repetition,
    ReedSolomon,
    RaptorQ,
}

impl Code {
    /// The code of a block of `length` bytes; `None` if no block has that length.
    pub(super) fn of(length: usize) -> Option<Code> {
        if !(1..=MAX_BLOCK).contains(&length) {
            return None;
        }
        // At most 1024.
        let symbols = length.div_ceil(MAX_SYMBOL) as u32;
        let size = length.div_ceil(symbols as usize).next_multiple_of(2);
        Some(Code { length, symbols, size })
    }

    /// How many symbols there are; their numbers begin with 0, the source symbols'.
    pub(super) fn total(&self) -> u32 {
        match self.kind() {
            Kind::Repetition | Kind::ReedSolomon => REED_SOLOMON_TOTAL,
            Kind::RaptorQ => NUMBERED,
        }
    }

    /// Whether any symbols, as many as there are source symbols, restore the block for certain.
    pub(super) fn is_exact(&self) -> bool {
        self.kind() != Kind::RaptorQ
    }

    fn kind(&self) -> Kind {
        match self.symbols {
            1 => Kind::Repetition,
            2..=REED_SOLOMON_MAX => Kind::ReedSolomon,
            _ => Kind::RaptorQ,
        }
    }

    /// Bytes of all source symbols.
    fn padded(&self) -> usize {
        self.symbols as usize * self.size
    }

    /// Describes the block to the RaptorQ coder: one source block without sub-blocks.
    fn raptorq(&self) -> ObjectTransmissionInformation {
        // The casts keep the values: a block has at most MAX_BLOCK bytes, a symbol MAX_SYMBOL.
        ObjectTransmissionInformation::new(self.padded() as u64, self.size as u16, 1, 1, 1)
    }
}

/// Gives the symbols of a block, any of them.
pub(super) struct Encoder {
    code: Code,
    /// The block, padded with zeros to whole symbols.
    bytes: Vec<u8>,
    repair: Repair,
}

enum Repair {
    Repetition,
    ReedSolomon(Vec<Vec<u8>>),
    RaptorQ(SourceBlockEncoder),
}

impl Encoder {
    /// An encoder of a block of 1 to [`MAX_BLOCK`] bytes; `None` for any other.
    pub(super) fn new(block: &[u8]) -> Option<Encoder> {
        let code = Code::of(block.len())?;
        let mut bytes = block.to_vec();
        bytes.resize(code.padded(), 0);
        let repair = match code.kind() {
            Kind::Repetition => Repair::Repetition,
            Kind::ReedSolomon => {
                let source = code.symbols as usize;
                let repairs = REED_SOLOMON_TOTAL as usize - source;
                Repair::ReedSolomon(reed_solomon_simd::encode(source, repairs, bytes.chunks(code.size)).ok()?)
            }
            Kind::RaptorQ => Repair::RaptorQ(SourceBlockEncoder::new(0, &code.raptorq(), &bytes)),
        };
        Some(Encoder { code, bytes, repair })
    }

    /// The symbol of a number; numbers beyond the last begin again with the first.
    pub(super) fn symbol(&self, number: u32) -> Vec<u8> {
        let Code { symbols, size, .. } = self.code;
        let number = number % self.code.total();
        let Some(repair) = number.checked_sub(symbols) else {
            let start = number as usize * size;
            return self.bytes[start..start + size].to_vec();
        };
        match &self.repair {
            Repair::Repetition => self.bytes.clone(),
            Repair::ReedSolomon(repairs) => repairs[repair as usize].clone(),
            Repair::RaptorQ(encoder) => encoder.repair_packets(repair, 1).swap_remove(0).data().to_vec(),
        }
    }
}

/// The block of some of its symbols, by number; `None` if they do not suffice.
///
/// Every number is below the code's total and every symbol of the code's size. Takes time
/// O(n log n) in the symbols under Reed–Solomon, somewhat above linear under RaptorQ.
pub(super) fn decode(code: Code, symbols: &BTreeMap<u32, Vec<u8>>) -> Option<Vec<u8>> {
    if symbols.len() < code.symbols as usize {
        return None;
    }
    let mut bytes = match code.kind() {
        Kind::Repetition => symbols.values().next()?.clone(),
        Kind::ReedSolomon => reed_solomon(code, symbols)?,
        Kind::RaptorQ => {
            let packets =
                symbols.iter().map(|(&id, data)| EncodingPacket::new(PayloadId::new(0, id), data.clone()));
            SourceBlockDecoder::new(0, &code.raptorq(), code.padded() as u64).decode(packets)?
        }
    };
    bytes.truncate(code.length);
    Some(bytes)
}

fn reed_solomon(code: Code, symbols: &BTreeMap<u32, Vec<u8>>) -> Option<Vec<u8>> {
    let source = code.symbols as usize;
    let repairs = REED_SOLOMON_TOTAL as usize - source;
    let present = symbols.range(..code.symbols).map(|(&id, data)| (id as usize, data));
    let repair = symbols.range(code.symbols..).map(|(&id, data)| (id as usize - source, data));
    let restored = reed_solomon_simd::decode(source, repairs, present, repair).ok()?;
    let mut bytes = Vec::with_capacity(code.padded());
    for id in 0..source {
        let symbol = symbols.get(&(id as u32)).or_else(|| restored.get(&id))?;
        bytes.extend_from_slice(symbol);
    }
    Some(bytes)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::shapes::Random;

    fn block(length: usize) -> Vec<u8> {
        let mut random = Random::new(length as u64);
        (0..length).map(|_| random.below(256) as u8).collect()
    }

    #[test]
    fn symbols_are_even_and_few() {
        for length in (1..=MAX_BLOCK).step_by(977).chain([1, 2, 1150, 1151, MAX_BLOCK]) {
            let code = Code::of(length).unwrap();
            assert!(code.size <= MAX_SYMBOL && code.size.is_multiple_of(2));
            assert!(code.padded() >= length && code.symbols as usize <= MAX_SYMBOLS);
            assert!((code.symbols as usize - 1) * code.size < length, "no symbol is all padding: {length}");
        }
        assert_eq!(Code::of(0), None);
        assert_eq!(Code::of(MAX_BLOCK + 1), None);
    }

    /// Any subset of a little more than the block gives the block, whatever is missing.
    #[test]
    fn enough_symbols_give_the_block() {
        let mut random = Random::new(1);
        for length in [1, 7, 1150, 1151, 5000, 60_001, 128 * 1150, 128 * 1150 + 1, 300_000] {
            let bytes = block(length);
            let (encoder, code) = (Encoder::new(&bytes).unwrap(), Code::of(length).unwrap());
            let mut ids: Vec<u32> = (0..2 * code.symbols).collect();
            random.shuffle(&mut ids);
            let mut symbols = BTreeMap::new();
            let spare = if code.kind() == Kind::RaptorQ { 4 } else { 0 };
            for &id in &ids[..code.symbols as usize - 1] {
                symbols.insert(id, encoder.symbol(id));
            }
            assert_eq!(decode(code, &symbols), None);
            for &id in ids[code.symbols as usize - 1..].iter().take(1 + spare) {
                symbols.insert(id, encoder.symbol(id));
            }
            assert_eq!(decode(code, &symbols), Some(bytes), "{length} bytes");
        }
    }

    #[test]
    fn numbers_begin_again() {
        let encoder = Encoder::new(&block(3000)).unwrap();
        assert_eq!(encoder.symbol(5), encoder.symbol(5 + REED_SOLOMON_TOTAL));
    }
}
