//! From a file and a receiver's reports to datagrams.

use std::collections::BTreeMap;
use std::sync::Arc;
use std::time::Duration;

use super::blocks::{Blocks, FileId};
use super::code::Encoder;
use super::packet::Packet;
use super::report::Report;
use super::schedule::{Conditions, Schedule, Settings};
use crate::Result;

/// A file, ready to be sent to any number of receivers.
pub struct Source {
    file: Arc<[u8]>,
    pub(super) blocks: Blocks,
    id: FileId,
}

impl Source {
    /// Divides a `.tct` file into blocks and computes their digests. Takes time linear in the file.
    ///
    /// # Errors
    /// What is wrong with the file's header, [`Error::Truncated`](crate::Error::Truncated) if the
    /// file is not whole, [`Error::Unsupported`](crate::Error::Unsupported) if it is too large.
    pub fn new(file: impl Into<Arc<[u8]>>) -> Result<Source> {
        let file = file.into();
        let blocks = Blocks::cut(&file)?;
        let id = blocks.id();
        Ok(Source { file, blocks, id })
    }

    /// What a [`Receiver`](super::Receiver) must be told by somebody it trusts.
    pub fn id(&self) -> FileId {
        self.id
    }

    /// The opening, block 0: the manifest and the first bytes of the file. Where some way without losses
    /// leads to a receiver it may be sent there as well: [`Receiver::open`](super::Receiver::open) takes it.
    pub fn opening(&self) -> &[u8] {
        self.blocks.bytes(&self.file, 0)
    }

    /// The file's bytes.
    pub fn file(&self) -> &[u8] {
        &self.file
    }
}

/// Sends a file to one receiver: whenever there is room for a datagram, it says which.
///
/// It has no clock: times are those since the session began, and must not decrease.
pub struct Sender {
    source: Arc<Source>,
    schedule: Schedule,
    /// Of the blocks that were begun and are not complete.
    encoders: BTreeMap<usize, Encoder>,
}

impl Sender {
    /// A sender at the beginning of its session.
    pub fn new(source: Arc<Source>, settings: Settings) -> Sender {
        let schedule = Schedule::new(&source, settings);
        Sender { source, schedule, encoders: BTreeMap::new() }
    }

    /// The datagram to send at `now`; `None` if there is nothing to send before another report
    /// comes or packets have been given up: ask again after some milliseconds.
    pub fn next_packet(&mut self, now: Duration) -> Option<Vec<u8>> {
        let turn = self.schedule.next_turn(now)?;
        let bytes = self.source.blocks.bytes(&self.source.file, turn.block);
        let encoder = match self.encoders.entry(turn.block) {
            std::collections::btree_map::Entry::Occupied(entry) => entry.into_mut(),
            std::collections::btree_map::Entry::Vacant(entry) => entry.insert(Encoder::new(bytes)?),
        };
        let packet = Packet {
            tag: self.source.id.tag(),
            number: turn.number,
            // The casts keep the values: a manifest counts blocks in 16 bits, lengths in 32.
            block: turn.block as u16,
            length: bytes.len() as u32,
            symbol: turn.symbol,
            payload: &encoder.symbol(turn.symbol),
        };
        Some(packet.write())
    }

    /// Takes a receiver's report that came at `now`; false if the datagram is none, or of another file.
    pub fn report(&mut self, datagram: &[u8], now: Duration) -> bool {
        let report = Report::read(datagram).filter(|report| report.tag == self.source.id.tag());
        if let Some(report) = &report {
            self.schedule.report(report, now);
            let schedule = &self.schedule;
            self.encoders.retain(|&block, _| !schedule.is_complete(block));
        }
        report.is_some()
    }

    /// Says how the channel is now.
    pub fn set_conditions(&mut self, conditions: Conditions) {
        self.schedule.set_conditions(conditions);
    }

    /// Whether the receiver has reported every block as complete.
    pub fn is_done(&self) -> bool {
        self.schedule.is_done()
    }
}
