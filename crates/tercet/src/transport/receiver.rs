//! From datagrams to the verified bytes of a file.

use std::collections::{BTreeMap, BTreeSet, VecDeque};

use super::blocks::{FileId, Manifest};
use super::code::{Code, decode};
use super::packet::{Packet, Tag};
use super::report::{MAX_ENTRIES, Progress, Report};
use crate::Limits;

/// Lengths that packets may claim for one block before the manifest tells the true one.
const MAX_CLAIMS: usize = 4;
/// Symbols beyond the necessary that are gathered before a block counts as forged: a RaptorQ block
/// needs another one with probability 1/100, 1/10 000, …
const MAX_SPARE: usize = 16;
/// Memory that a symbol takes besides its bytes, about.
const SYMBOL_NOTES: u64 = 64;

/// What became of a datagram.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Received {
    /// It was damaged or never was a packet, or contradicts itself or the manifest.
    Mangled,
    /// A packet of another file.
    Foreign,
    /// Its symbol, or its whole block, is there already.
    Late,
    /// It would need more memory than the limits allow; it may come again.
    Refused,
    /// Its symbol was new.
    Kept,
    /// It completed its block, whose bytes are the original's.
    Completed,
    /// It completed its block, but some symbol was forged: the block is gathered anew.
    Refuted,
}

/// Gathers the symbols of a file in any order, and gives out its bytes in theirs.
///
/// No byte is given out that the [`FileId`] does not vouch for, except for looking ([`glimpse`](Receiver::glimpse)).
/// Memory is bounded by the [`Limits`]: symbols of incomplete blocks, and complete blocks that wait for one before them.
pub struct Receiver {
    id: FileId,
    tag: Tag,
    limits: Limits,
    heard: u32,
    manifest: Option<Manifest>,
    /// Blocks from `next` on of which something has arrived.
    blocks: BTreeMap<usize, Block>,
    /// The first block that has not been given out.
    next: usize,
    ready: VecDeque<Vec<u8>>,
    /// Where that block begins in the file, and which of its symbols have been shown.
    place: u64,
    shown: BTreeSet<u32>,
    /// Bytes of memory that symbols and complete blocks take.
    held: u64,
}

enum Block {
    /// One for each length that was claimed.
    Incomplete(Vec<Collection>),
    Complete(Vec<u8>),
}

/// The symbols of a block, if it has the length that their packets claim.
struct Collection {
    length: usize,
    code: Code,
    symbols: BTreeMap<u32, Vec<u8>>,
}

impl Collection {
    fn memory(&self) -> u64 {
        self.symbols.len() as u64 * symbol_memory(&self.code)
    }
}

fn symbol_memory(code: &Code) -> u64 {
    code.size as u64 + SYMBOL_NOTES
}

impl Receiver {
    /// A receiver of the file that `id` stands for.
    pub fn new(id: FileId, limits: Limits) -> Receiver {
        Receiver {
            id,
            tag: id.tag(),
            limits,
            heard: 0,
            manifest: None,
            blocks: BTreeMap::new(),
            next: 0,
            ready: VecDeque::new(),
            place: 0,
            shown: BTreeSet::new(),
            held: 0,
        }
    }

    /// Takes a datagram, whatever it is.
    ///
    /// Takes time linear in it, except where it completes a block: then in the block, about.
    pub fn push(&mut self, datagram: &[u8]) -> Received {
        let Some(packet) = Packet::read(datagram) else { return Received::Mangled };
        if packet.tag != self.tag {
            return Received::Foreign;
        }
        let (block, length) = (usize::from(packet.block), packet.length as usize);
        let fitting = Code::of(length).filter(|code| code.size == packet.payload.len());
        let Some(code) = fitting.filter(|code| packet.symbol < code.total()) else {
            return Received::Mangled;
        };
        if !self.is_possible(block, length) {
            return Received::Mangled;
        }
        self.heard = self.heard.max(packet.number.saturating_add(1));
        if block < self.next || matches!(self.blocks.get(&block), Some(Block::Complete(_))) {
            return Received::Late;
        }
        if !self.make_room(block, symbol_memory(&code)) {
            return Received::Refused;
        }
        if !self.keep(block, length, code, &packet) {
            return Received::Late;
        }
        self.settle(block)
    }

    /// Takes the whole opening, [`Source::opening`](super::Source::opening), as a way without losses brings
    /// it. It need not be one that is trusted: the digest is verified here too.
    pub fn open(&mut self, opening: &[u8]) -> Received {
        if self.manifest.is_some() {
            return Received::Late;
        }
        if !is_genuine(self.id, None, 0, opening) {
            return Received::Refuted;
        }
        if !self.make_room(0, opening.len() as u64) {
            return Received::Refused;
        }
        if let Some(Block::Incomplete(claims)) = self.blocks.remove(&0) {
            self.held -= claims.iter().map(Collection::memory).sum::<u64>();
        }
        self.complete(0, opening.to_vec());
        self.judge_waiting();
        self.release();
        Received::Completed
    }

    /// The next bytes of the file, if they have arrived. Its blocks come one at a time.
    pub fn take(&mut self) -> Option<Vec<u8>> {
        let bytes = self.ready.pop_front()?;
        self.held = self.held.saturating_sub(bytes.len() as u64);
        Some(bytes)
    }

    /// Bytes of the block that comes next, as a source symbol has brought them, and where in the file they lie; each
    /// only once. [`Decoder::glimpse`](crate::Decoder::glimpse) shows what it can of them. The digest does **not**
    /// vouch for them yet: they are for looking only, and come again by [`take`](Receiver::take).
    pub fn glimpse(&mut self) -> Option<(u64, Vec<u8>)> {
        let length = self.manifest.as_ref()?.length(self.next)?;
        let Block::Incomplete(claims) = self.blocks.get(&self.next)? else { return None };
        let claim = claims.iter().find(|claim| claim.length == length)?;
        let sources = claim.symbols.range(..claim.code.symbols);
        let (&number, bytes) = sources.into_iter().find(|(number, _)| !self.shown.contains(number))?;
        self.shown.insert(number);
        let start = number as usize * claim.code.size;
        let bytes = &bytes[..bytes.len().min(length.saturating_sub(start))];
        Some((self.place + start as u64, bytes.to_vec()))
    }

    /// Whether every byte of the file has arrived.
    pub fn is_complete(&self) -> bool {
        self.manifest.as_ref().is_some_and(|manifest| manifest.count() == self.next)
    }

    /// What the sender should know. Sent again and again, it keeps the sender going.
    pub fn report(&self) -> Report {
        let progress = self.blocks.iter().map(|(&block, state)| {
            let received = match state {
                Block::Complete(_) => None,
                Block::Incomplete(claims) => claims.iter().map(|claim| claim.symbols.len()).max(),
            };
            let complete = matches!(state, Block::Complete(_));
            // The casts keep the values: blocks are numbered by 16 bits and have few symbols.
            let received = (!complete).then_some(received.unwrap_or(0) as u16);
            Progress { block: block as u16, received }
        });
        Report {
            tag: self.tag,
            heard: self.heard,
            done: self.next as u16,
            progress: progress.take(MAX_ENTRIES).collect(),
        }
    }

    /// Whether the file may have this block, as far as is known.
    fn is_possible(&self, block: usize, length: usize) -> bool {
        match &self.manifest {
            Some(manifest) if block > 0 => manifest.length(block) == Some(length),
            _ => true,
        }
    }

    /// Makes room for a symbol of a block at the cost of later blocks: those are of no use without
    /// it, and a forger cannot fill the memory with blocks that do not exist.
    fn make_room(&mut self, block: usize, memory: u64) -> bool {
        while self.held + memory > self.limits.max_memory {
            match self.blocks.last_entry() {
                Some(last) if *last.key() > block => {
                    self.held -= match last.remove() {
                        Block::Incomplete(claims) => claims.iter().map(Collection::memory).sum(),
                        Block::Complete(bytes) => bytes.len() as u64,
                    };
                }
                _ => return false,
            }
        }
        true
    }

    /// Keeps a symbol; false if there is no use for it.
    fn keep(&mut self, block: usize, length: usize, code: Code, packet: &Packet) -> bool {
        let state = self.blocks.entry(block).or_insert_with(|| Block::Incomplete(Vec::new()));
        let Block::Incomplete(claims) = state else { return false };
        let place = match claims.iter().position(|claim| claim.length == length) {
            Some(place) => place,
            None => {
                if claims.len() == MAX_CLAIMS {
                    // The true one grows; a forger has to keep up with it.
                    let least = (0..claims.len()).min_by_key(|&i| claims[i].symbols.len()).unwrap_or(0);
                    self.held -= claims.swap_remove(least).memory();
                }
                claims.push(Collection { length, code, symbols: BTreeMap::new() });
                claims.len() - 1
            }
        };
        let symbols = &mut claims[place].symbols;
        if symbols.contains_key(&packet.symbol) || symbols.len() >= code.symbols as usize + MAX_SPARE {
            return false;
        }
        symbols.insert(packet.symbol, packet.payload.to_vec());
        self.held += symbol_memory(&code);
        true
    }

    /// Decodes a block if it can be, and gives out what has become complete in order.
    fn settle(&mut self, block: usize) -> Received {
        let result = self.restore(block);
        if result == Received::Refuted && block == self.next {
            self.shown.clear();
        }
        if result == Received::Completed && block == 0 {
            self.judge_waiting();
        }
        self.release();
        result
    }

    /// Decodes what came before the manifest and can be judged now.
    fn judge_waiting(&mut self) {
        let waiting: Vec<usize> = self.blocks.keys().copied().collect();
        for block in waiting {
            self.restore(block);
        }
    }

    /// Gives out what is complete, as far as nothing before it is missing.
    fn release(&mut self) {
        while let Some(Block::Complete(_)) = self.blocks.get(&self.next) {
            if let Some(Block::Complete(bytes)) = self.blocks.remove(&self.next) {
                self.place += bytes.len() as u64;
                self.ready.push_back(bytes);
            }
            self.shown.clear();
            self.next += 1;
        }
    }

    fn restore(&mut self, block: usize) -> Received {
        let Some(Block::Incomplete(claims)) = self.blocks.get_mut(&block) else { return Received::Late };
        if let Some(manifest) = self.manifest.as_ref().filter(|_| block > 0) {
            let length = manifest.length(block);
            claims.retain(|claim| {
                let right = Some(claim.length) == length;
                self.held -= if right { 0 } else { claim.memory() };
                right
            });
        } else if block > 0 {
            return Received::Kept;
        }
        let mut result = Received::Kept;
        let mut i = 0;
        while i < claims.len() {
            match decode(claims[i].code, &claims[i].symbols) {
                None if claims[i].symbols.len() < claims[i].code.symbols as usize + MAX_SPARE => {
                    i += 1;
                    continue;
                }
                Some(bytes) if is_genuine(self.id, self.manifest.as_ref(), block, &bytes) => {
                    self.held -= claims.iter().map(Collection::memory).sum::<u64>();
                    self.complete(block, bytes);
                    return Received::Completed;
                }
                _ => {
                    self.held -= claims.swap_remove(i).memory();
                    result = Received::Refuted;
                }
            }
        }
        if claims.is_empty() {
            self.blocks.remove(&block);
        }
        result
    }

    /// Stores a block that was vouched for.
    fn complete(&mut self, block: usize, mut bytes: Vec<u8>) {
        if block == 0
            && let Some((manifest, head)) = Manifest::read(&bytes)
        {
            let head = head.to_vec();
            self.manifest = Some(manifest);
            bytes = head;
        }
        self.held += bytes.len() as u64;
        self.blocks.insert(block, Block::Complete(bytes));
    }
}

/// Whether these are the bytes of the block.
fn is_genuine(id: FileId, manifest: Option<&Manifest>, block: usize, bytes: &[u8]) -> bool {
    match manifest {
        Some(manifest) => manifest.vouches(block, bytes),
        None => FileId::of(bytes) == id && Manifest::read(bytes).is_some(),
    }
}

#[cfg(test)]
mod tests;
