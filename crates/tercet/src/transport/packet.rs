//! The datagram that carries one symbol: `spec/datagrams.md`, section 3.

use super::code::MAX_SYMBOL;
use crate::container::checksum;

const MAGIC: [u8; 3] = [0x8A, b'D', 1];
/// Bytes before the symbol.
const HEADER: usize = 24;
/// Bytes after the symbol.
const CRC: usize = 4;

/// Bytes that a datagram has besides its symbol.
pub(super) const OVERHEAD: usize = HEADER + CRC;
/// Bytes of the largest datagram: fits a QUIC datagram on a path of 1 280 bytes.
pub const MAX_DATAGRAM: usize = OVERHEAD + MAX_SYMBOL;

/// The first bytes of a file's identity, in every packet.
pub(super) type Tag = [u8; 8];

/// A symbol and what it is a symbol of.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Packet<'a> {
    pub(super) tag: Tag,
    /// Counts the packets of a session, in the order of their sending.
    pub(super) number: u32,
    pub(super) block: u16,
    /// Bytes of the block.
    pub(super) length: u32,
    /// Which symbol of the block; below 2^24.
    pub(super) symbol: u32,
    pub(super) payload: &'a [u8],
}

impl<'a> Packet<'a> {
    /// The datagram's bytes.
    pub(super) fn write(&self) -> Vec<u8> {
        let mut out = Vec::with_capacity(OVERHEAD + self.payload.len());
        out.extend(MAGIC);
        out.extend(self.tag);
        out.extend(self.number.to_le_bytes());
        out.extend(self.block.to_le_bytes());
        out.extend(self.length.to_le_bytes());
        out.extend(&self.symbol.to_le_bytes()[..3]);
        out.extend(self.payload);
        seal(out)
    }

    /// Takes a datagram apart; `None` if it is none of this version, or was damaged.
    pub(super) fn read(datagram: &'a [u8]) -> Option<Packet<'a>> {
        let fields = unseal(datagram, MAX_DATAGRAM)?;
        let (magic, fields) = fields.split_first_chunk::<3>()?;
        let (tag, fields) = fields.split_first_chunk()?;
        let (number, fields) = fields.split_first_chunk()?;
        let (block, fields) = fields.split_first_chunk()?;
        let (length, fields) = fields.split_first_chunk()?;
        let (&[a, b, c], payload) = fields.split_first_chunk()?;
        (*magic == MAGIC).then_some(Packet {
            tag: *tag,
            number: u32::from_le_bytes(*number),
            block: u16::from_le_bytes(*block),
            length: u32::from_le_bytes(*length),
            symbol: u32::from_le_bytes([a, b, c, 0]),
            payload,
        })
    }
}

/// Appends the CRC-32 of the bytes.
pub(super) fn seal(mut bytes: Vec<u8>) -> Vec<u8> {
    bytes.extend(checksum(&bytes).to_le_bytes());
    bytes
}

/// The bytes before a CRC-32 that matches them, in a datagram of at most `max` bytes.
pub(super) fn unseal(datagram: &[u8], max: usize) -> Option<&[u8]> {
    let (bytes, &crc) = datagram.split_last_chunk()?;
    (datagram.len() <= max && checksum(bytes) == u32::from_le_bytes(crc)).then_some(bytes)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_layout_is_the_documents() {
        let packet = Packet {
            tag: *b"tag-----",
            number: 0x0403_0201,
            block: 0x0605,
            length: 9,
            symbol: 0x09_0807,
            payload: b"123456789",
        };
        let bytes = packet.write();
        let expected = b"\x8AD\x01tag-----\x01\x02\x03\x04\x05\x06\x09\x00\x00\x00\x07\x08\x09123456789";
        assert_eq!(bytes[..bytes.len() - CRC], expected[..]);
        assert_eq!(Packet::read(&bytes), Some(packet));
    }

    #[test]
    fn whatever_is_cut_or_changed_is_no_packet() {
        let bytes =
            Packet { tag: [7; 8], number: 1, block: 2, length: 40, symbol: 3, payload: &[5; 40] }.write();
        for end in 0..bytes.len() {
            assert_eq!(Packet::read(&bytes[..end]), None);
        }
        for bit in 0..8 * bytes.len() {
            let mut harmed = bytes.clone();
            harmed[bit / 8] ^= 1 << (bit % 8);
            assert_eq!(Packet::read(&harmed), None);
        }
        assert_eq!(Packet::read(&seal(vec![0x8A; MAX_DATAGRAM + 1])), None);
    }
}
