//! A section in pieces that can be verified one by one.
//!
//! The bytes of a section are its payload with a check after every [`PIECE`] bytes that are not its
//! last: the CRC-32 of the payload from its start to there. So a reader may use what has arrived of a
//! long section. The checksum of the whole payload stands in the section table.

use super::CRC_BYTES;
use super::checksum::Checksum;
use crate::{Error, Result};

/// Bytes of a payload between two checks: 33 ms at 1 Mbit/s, and checks make a thousandth of them.
pub(crate) const PIECE: usize = 1 << 12;

/// Bytes of a piece and the check behind it.
const STORED_PIECE: u32 = (PIECE + CRC_BYTES) as u32;

/// Bytes of the section that holds a payload.
pub(super) fn stored_length(payload: usize) -> usize {
    payload + payload.saturating_sub(1) / PIECE * CRC_BYTES
}

/// Bytes of the payload that a section holds; `None` if no payload makes a section of that length.
pub(super) fn payload_length(stored: u32) -> Option<u32> {
    let checks = stored.saturating_sub(1) / STORED_PIECE;
    (stored - checks * STORED_PIECE <= PIECE as u32).then(|| stored - checks * CRC_BYTES as u32)
}

/// Appends the section that holds `payload`. Time O(n).
pub(super) fn write(payload: &[u8], out: &mut Vec<u8>) {
    let mut checksum = Checksum::default();
    let mut pieces = payload.chunks(PIECE).peekable();
    while let Some(piece) = pieces.next() {
        out.extend_from_slice(piece);
        checksum.update(piece);
        if pieces.peek().is_some() {
            out.extend(checksum.value().to_le_bytes());
        }
    }
}

/// A section that is arriving.
#[derive(Default)]
pub(super) struct Arrival {
    /// Verified pieces, then the one that is arriving; stays empty if bytes are not kept.
    payload: Vec<u8>,
    /// Bytes of the section received, checks included.
    received: u32,
    /// Bytes of the payload received, and verified.
    length: u32,
    verified: u32,
    /// Of what was received, and of what was verified.
    checksum: Checksum,
    checksum_verified: Checksum,
    /// The check that is arriving.
    check: [u8; CRC_BYTES],
}

impl Arrival {
    /// Takes what belongs to a section of `stored` bytes, whose payload has the checksum `crc`, from the
    /// front of `bytes`; returns the rest. Keeps what it takes if `keeps`. There are checks between pieces if
    /// `pieces`.
    ///
    /// # Errors
    /// If a check does not match: the one stored and the one computed.
    pub fn take<'a>(
        &mut self,
        stored: u32,
        crc: u32,
        [keeps, pieces]: [bool; 2],
        mut bytes: &'a [u8],
    ) -> std::result::Result<&'a [u8], [u32; 2]> {
        while self.received < stored && !bytes.is_empty() {
            let in_piece = self.received % STORED_PIECE;
            let (room, in_check) = match (PIECE as u32).checked_sub(in_piece) {
                _ if !pieces => (stored, None),
                Some(room @ 1..) => (room, None),
                _ => (STORED_PIECE - in_piece, Some(in_piece as usize - PIECE)),
            };
            let room = room.min(stored - self.received);
            let (taken, rest) = bytes.split_at(bytes.len().min(room as usize));
            let count = taken.len() as u32;
            self.received += count;
            bytes = rest;
            match in_check {
                None => {
                    self.checksum.update(taken);
                    self.length += count;
                    if keeps {
                        self.reserve(taken.len(), stored);
                        self.payload.extend_from_slice(taken);
                    }
                }
                Some(at) => {
                    self.check[at..at + taken.len()].copy_from_slice(taken);
                    if at + taken.len() == CRC_BYTES {
                        self.verify(u32::from_le_bytes(self.check))?;
                    }
                }
            }
        }
        if self.received == stored {
            self.verify(crc)?;
        }
        Ok(bytes)
    }

    /// Makes room for `more` bytes by doubling, but never for more than the section has.
    fn reserve(&mut self, more: usize, stored: u32) {
        let (held, room) = (self.payload.len(), self.payload.capacity());
        if room - held < more {
            let wanted = room.saturating_mul(2).max(held + more).min(stored as usize);
            self.payload.reserve_exact(wanted - held);
        }
    }

    fn verify(&mut self, stored: u32) -> std::result::Result<(), [u32; 2]> {
        let computed = self.checksum.value();
        if stored != computed {
            return Err([stored, computed]);
        }
        self.verified = self.length;
        self.checksum_verified = self.checksum.clone();
        Ok(())
    }

    /// Forgets what has not been verified.
    pub fn retreat(&mut self) {
        self.payload.truncate(self.verified as usize);
        self.length = self.verified;
        self.checksum = self.checksum_verified.clone();
        self.received = stored_length(self.verified as usize) as u32;
        if self.verified > 0 {
            // Whole pieces are verified by the checks behind them.
            self.received += CRC_BYTES as u32;
        }
    }

    /// Bytes of the section received so far, checks included.
    pub fn received(&self) -> u32 {
        self.received
    }

    /// What is there of the payload, verified or not.
    pub fn payload(&self) -> &[u8] {
        &self.payload
    }

    /// What is verified of it.
    pub fn verified(&self) -> &[u8] {
        &self.payload[..self.payload.len().min(self.verified as usize)]
    }

    /// The payload of a section that is there.
    pub fn into_payload(self) -> Vec<u8> {
        self.payload
    }

    /// Bytes reserved.
    #[cfg(test)]
    pub fn memory(&self) -> usize {
        self.payload.capacity()
    }
}

/// Fails unless a section of `stored` bytes holds a payload; its bytes.
pub(super) fn check_length(stored: u32, place: impl Fn() -> String) -> Result<u32> {
    payload_length(stored)
        .ok_or_else(|| Error::format(place(), format!("{stored} bytes end inside of a check between pieces")))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::container::checksum::checksum;

    fn payload(length: usize) -> Vec<u8> {
        (0..length).map(|i| ((i * i) >> 7) as u8).collect()
    }

    #[test]
    fn lengths_and_their_inverse_agree() {
        for length in (0..10).chain(4090..4100).chain(8190..8200).chain(100_000..100_010) {
            let mut section = Vec::new();
            write(&payload(length), &mut section);
            assert_eq!(section.len(), stored_length(length));
            assert_eq!(payload_length(section.len() as u32), Some(length as u32));
        }
        let impossible: Vec<u32> = (0..9000).filter(|&stored| payload_length(stored).is_none()).collect();
        assert_eq!(impossible, [4097, 4098, 4099, 4100, 8197, 8198, 8199, 8200]);
    }

    #[test]
    fn any_portions_give_the_payload_and_verify_it_piece_by_piece() {
        let payload = payload(3 * PIECE + 100);
        let crc = checksum(&payload);
        let mut section = Vec::new();
        write(&payload, &mut section);
        for size in [1, 3, 1000, PIECE, PIECE + 4, section.len()] {
            let mut arrival = Arrival::default();
            for portion in section.chunks(size) {
                assert!(arrival.take(section.len() as u32, crc, [true; 2], portion).unwrap().is_empty());
                let whole = arrival.received() / STORED_PIECE * PIECE as u32;
                let verified =
                    if arrival.received() == section.len() as u32 { payload.len() } else { whole as usize };
                assert_eq!(arrival.verified(), &payload[..verified]);
            }
            assert_eq!(arrival.into_payload(), payload);
        }
    }

    #[test]
    fn a_damaged_piece_is_found_and_may_be_sent_again() {
        let payload = payload(2 * PIECE + 100);
        let crc = checksum(&payload);
        let mut section = Vec::new();
        write(&payload, &mut section);
        for at in (0..section.len()).step_by(97).chain(PIECE - 2..PIECE + 6) {
            let mut harmed = section.clone();
            harmed[at] ^= 0x10;
            let mut arrival = Arrival::default();
            arrival.take(section.len() as u32, crc, [true; 2], &harmed).unwrap_err();
            arrival.retreat();
            let from = arrival.received() as usize;
            assert_eq!(from, at / (PIECE + 4) * (PIECE + 4));
            arrival.take(section.len() as u32, crc, [true; 2], &section[from..]).unwrap();
            assert_eq!(arrival.into_payload(), payload);
        }
    }
}
