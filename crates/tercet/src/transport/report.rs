//! What a receiver tells the sender: `spec/datagrams.md`, section 5.

use super::packet::{MAX_DATAGRAM, Tag, seal, unseal};

const MAGIC: [u8; 3] = [0x8A, b'R', 1];
/// Bytes besides the entries.
const FIXED: usize = 3 + 8 + 4 + 2 + 4;
/// Entries of the largest report.
pub(super) const MAX_ENTRIES: usize = (MAX_DATAGRAM - FIXED) / 4;
/// Stands for "all that are needed" in an entry.
const COMPLETE: u16 = u16::MAX;

/// How much of one block has arrived.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Progress {
    /// Which block; 0 is the opening.
    pub block: u16,
    /// Different symbols that arrived; `None` once the block is complete.
    pub received: Option<u16>,
}

/// What has arrived. Each report replaces the ones before it, so that any may be lost.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Report {
    pub(super) tag: Tag,
    /// One more than the highest number of a packet that arrived, 0 before the first.
    pub heard: u32,
    /// The blocks before this one are complete.
    pub done: u16,
    /// Blocks from `done` on of which something has arrived, in their order.
    pub progress: Vec<Progress>,
}

impl Report {
    /// The report as a datagram.
    pub fn write(&self) -> Vec<u8> {
        let mut out = MAGIC.to_vec();
        out.extend(self.tag);
        out.extend(self.heard.to_le_bytes());
        out.extend(self.done.to_le_bytes());
        for entry in self.progress.iter().take(MAX_ENTRIES) {
            out.extend(entry.block.to_le_bytes());
            out.extend(entry.received.unwrap_or(COMPLETE).to_le_bytes());
        }
        seal(out)
    }

    /// Takes a datagram apart; `None` if it is no report of this version, or was damaged.
    pub fn read(datagram: &[u8]) -> Option<Report> {
        let fields = unseal(datagram, MAX_DATAGRAM)?;
        let (magic, fields) = fields.split_first_chunk::<3>()?;
        let (tag, fields) = fields.split_first_chunk()?;
        let (heard, fields) = fields.split_first_chunk()?;
        let (done, entries) = fields.split_first_chunk()?;
        if *magic != MAGIC || !entries.len().is_multiple_of(4) {
            return None;
        }
        let entry = |&[a, b, c, d]: &[u8; 4]| {
            let received = u16::from_le_bytes([c, d]);
            let received = (received != COMPLETE).then_some(received);
            Progress { block: u16::from_le_bytes([a, b]), received }
        };
        Some(Report {
            tag: *tag,
            heard: u32::from_le_bytes(*heard),
            done: u16::from_le_bytes(*done),
            progress: entries.as_chunks().0.iter().map(entry).collect(),
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_layout_is_the_documents() {
        let report = Report {
            tag: *b"tag-----",
            heard: 0x0403_0201,
            done: 2,
            progress: vec![Progress { block: 2, received: Some(7) }, Progress { block: 5, received: None }],
        };
        let bytes = report.write();
        let expected = b"\x8AR\x01tag-----\x01\x02\x03\x04\x02\x00\x02\x00\x07\x00\x05\x00\xFF\xFF";
        assert_eq!(bytes[..bytes.len() - 4], expected[..]);
        assert_eq!(Report::read(&bytes), Some(report));
        for end in 0..bytes.len() {
            assert_eq!(Report::read(&bytes[..end]), None);
        }
    }
}
