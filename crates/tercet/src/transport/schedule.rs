//! Which symbol is sent when: hybrid ARQ under a plan. Knows blocks by number and size only.
//!
//! The plan says how many packets each block gets. First come those without which a block cannot be
//! decoded, in the order of the file. Before a deadline repairs come last, the blocks taking turns:
//! until then the order is free, and this one loses least, because a repair that a report makes
//! needless meanwhile is never sent. Where the viewer may look at any time, repairs follow their
//! block at a distance that outlasts most bursts, and a link that would be idle carries further ones.
//! Every symbol is a fresh one; none is sent twice while others are left.

use std::collections::VecDeque;
use std::time::Duration;

use super::code::Code;
use super::loss::{GilbertElliott, Runs};
use super::pace::pace;
use super::packet::{MAX_DATAGRAM, OVERHEAD};
use super::plan::{Demand, Strategy, plan};
use super::quality::{Objective, Quality};
use super::report::Report;
use super::sender::Source;

/// The probability with which the base mesh arrives in the first round trip, where that can be had.
const BASE_FLOOR: f64 = 0.9998;

/// What a session is to reach.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub enum Goal {
    /// A good mesh at every time, the base mesh almost certainly before any report can help.
    #[default]
    Anytime,
    /// The best mesh at this time.
    Deadline(Duration),
    /// The best mesh from this many bytes of datagrams.
    Bytes(u64),
}

/// What the carrier knows of the channel.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Conditions {
    /// How packets are lost.
    pub loss: GilbertElliott,
    /// Bytes of datagrams in a second, as congestion control allows.
    pub rate: f64,
    /// From sending a packet to its report.
    pub round_trip: Duration,
}

/// How a session is planned.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Settings {
    /// How packets are shared out.
    pub strategy: Strategy,
    /// What is to be made best on average.
    pub objective: Objective,
    /// By when.
    pub goal: Goal,
    /// Over which channel.
    pub conditions: Conditions,
}

/// A symbol to send.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Turn {
    pub(super) number: u32,
    pub(super) block: usize,
    pub(super) symbol: u32,
    /// Bytes of the datagram.
    pub(super) bytes: u32,
}

/// A block as the sender sees it.
struct Block {
    code: Code,
    /// What is gained by it.
    gain: f64,
    /// Whether there is no mesh without it.
    base: bool,
    complete: bool,
    /// Symbols that the last report counted.
    received: u32,
    /// Packets whose fate is unknown.
    pending: u32,
    /// The first symbol that was never sent.
    fresh: u32,
    /// Packets to send that the block cannot do without.
    needed: u32,
    /// Packets to send besides those.
    repairs: u32,
    /// The number of the packet from which on they may be sent.
    due: u32,
}

impl Block {
    fn bytes(&self) -> u32 {
        // A symbol has at most MAX_SYMBOL bytes.
        (OVERHEAD + self.code.size) as u32
    }

    fn lacking(&self) -> u32 {
        if self.complete { 0 } else { self.code.symbols.saturating_sub(self.received).max(1) }
    }

    fn demand(&self, goal: Goal) -> Demand {
        let floor = if self.base && goal == Goal::Anytime { BASE_FLOOR } else { 0.0 };
        let (lacking, pending) = (self.lacking(), self.pending);
        Demand { lacking, pending, bytes: self.bytes(), gain: self.gain, floor }
    }
}

/// A packet whose fate is unknown.
struct Flight {
    number: u32,
    block: usize,
    sent: Duration,
}

/// The state of a session.
pub(super) struct Schedule {
    settings: Settings,
    blocks: Vec<Block>,
    runs: Runs,
    /// In the order of number and time.
    flights: VecDeque<Flight>,
    /// The number of the next packet.
    number: u32,
    /// Bytes sent so far.
    sent: u64,
    /// Whether something has happened since the plan was made.
    stale: bool,
    /// Whether nothing more is worth sending before something happens.
    idle: bool,
    /// The block that was repaired last.
    repaired: usize,
}

impl Schedule {
    pub(super) fn new(source: &Source, settings: Settings) -> Schedule {
        let mut blocks: Vec<Block> = Vec::new();
        let mut before = Quality::NOTHING;
        for i in 0..source.blocks.count() {
            // Blocks are never empty nor too large: Blocks::cut sees to that.
            let Some(code) = Code::of(source.blocks.bytes(source.file(), i).len()) else { continue };
            let quality = source.blocks.quality(i);
            let gain = settings.objective.value(quality) - settings.objective.value(before);
            let base = before == Quality::NOTHING;
            blocks.push(Block {
                code,
                gain: gain.max(0.0),
                base,
                complete: false,
                received: 0,
                pending: 0,
                fresh: 0,
                needed: 0,
                repairs: 0,
                due: 0,
            });
            before = quality;
        }
        Schedule {
            settings,
            blocks,
            runs: Runs::new(settings.conditions.loss),
            flights: VecDeque::new(),
            number: 0,
            sent: 0,
            stale: true,
            idle: false,
            repaired: 0,
        }
    }

    pub(super) fn set_conditions(&mut self, conditions: Conditions) {
        if conditions.loss != self.settings.conditions.loss {
            self.runs = Runs::new(conditions.loss);
        }
        self.stale |= conditions != self.settings.conditions;
        self.settings.conditions = conditions;
    }

    pub(super) fn is_complete(&self, block: usize) -> bool {
        self.blocks[block].complete
    }

    pub(super) fn is_done(&self) -> bool {
        self.blocks.iter().all(|block| block.complete)
    }

    /// Takes a report. One that is older than another does no harm: the next one mends it.
    pub(super) fn report(&mut self, report: &Report) {
        while let Some(flight) = self.flights.pop_front_if(|flight| flight.number < report.heard) {
            self.blocks[flight.block].pending -= 1;
            self.stale = true;
        }
        self.runs.heard = report.heard > 0;
        let done = usize::from(report.done).min(self.blocks.len());
        for block in &mut self.blocks[..done] {
            self.stale |= !block.complete;
            block.complete = true;
        }
        for entry in &report.progress {
            let Some(block) = self.blocks.get_mut(usize::from(entry.block)) else { continue };
            match entry.received {
                None => block.complete = true,
                // Fewer than before: the receiver found a forged symbol and starts anew.
                Some(received) => block.received = received.into(),
            }
            self.stale = true;
        }
    }

    /// The symbol to send at `now`, if any.
    pub(super) fn next_turn(&mut self, now: Duration) -> Option<Turn> {
        self.give_up_old(now);
        if self.is_done() || self.number == u32::MAX {
            return None;
        }
        if self.stale {
            self.renew(now);
        }
        let mut chosen = self.choose();
        if chosen.is_none() && !self.idle && self.fills() {
            let certain = plan(Strategy::Optimal, &self.demands(), self.cap(), &mut self.runs);
            self.adopt(&certain);
            self.idle = true;
            chosen = self.choose();
        }
        chosen.map(|block| self.send(block, now))
    }

    /// Whether a link that would be idle carries further repairs.
    fn fills(&self) -> bool {
        let protects = matches!(self.settings.strategy, Strategy::Greedy | Strategy::Optimal);
        self.settings.goal == Goal::Anytime && protects
    }

    /// Packets that must have been reported by now, had they arrived, are taken for lost.
    fn give_up_old(&mut self, now: Duration) {
        let patience = self.settings.conditions.round_trip.mul_f64(1.5);
        while let Some(flight) = self.flights.pop_front_if(|flight| flight.sent + patience < now) {
            self.blocks[flight.block].pending -= 1;
            self.stale = true;
            // So long after the last arrival nothing is known of the channel.
            self.runs.heard = false;
        }
    }

    /// Bytes beyond which nothing is gained.
    fn cap(&self) -> u64 {
        let lacking = self.blocks.iter().map(|block| u64::from(block.lacking()) * u64::from(block.bytes()));
        // The cast saturates.
        (16.0 * lacking.sum::<u64>() as f64 / (1.0 - self.settings.conditions.loss.loss())) as u64
    }

    /// Bytes that are sent in a time.
    fn carried(&self, time: Duration) -> u64 {
        // The cast saturates.
        (time.as_secs_f64() * self.settings.conditions.rate) as u64
    }

    fn demands(&self) -> Vec<Demand> {
        let goal = self.settings.goal;
        self.blocks.iter().filter(|block| !block.complete).map(|block| block.demand(goal)).collect()
    }

    /// Plans anew with what is known at `now`.
    fn renew(&mut self, now: Duration) {
        let (demands, round_trip) = (self.demands(), self.settings.conditions.round_trip);
        let budget = match self.settings.goal {
            Goal::Anytime => None,
            Goal::Bytes(bytes) => Some(bytes.saturating_sub(self.sent)),
            Goal::Deadline(deadline) => {
                Some(self.carried(deadline.saturating_sub(now).saturating_sub(round_trip / 2)))
            }
        };
        let packets = match budget {
            Some(budget) => plan(self.settings.strategy, &demands, budget.min(self.cap()), &mut self.runs),
            None => {
                let window = self.carried(round_trip);
                let repairs = pace(self.settings.strategy, &demands, window, &mut self.runs);
                demands.iter().zip(repairs).map(|(demand, repairs)| demand.deficit() + repairs).collect()
            }
        };
        self.adopt(&packets);
        (self.stale, self.idle) = (false, false);
    }

    /// Takes over how many packets the incomplete blocks get.
    fn adopt(&mut self, packets: &[u32]) {
        let open = self.blocks.iter_mut().filter(|block| !block.complete);
        for (block, &packets) in open.zip(packets) {
            block.needed = packets.min(block.lacking().saturating_sub(block.pending));
            block.repairs = packets - block.needed;
        }
    }

    /// The block whose turn it is.
    fn choose(&mut self) -> Option<usize> {
        let number = self.number;
        let is_due = |block: &Block| block.repairs > 0 && block.needed == 0 && block.due <= number;
        let due = self.blocks.iter().position(|block| !block.complete && is_due(block));
        let needed = self.blocks.iter().position(|block| !block.complete && block.needed > 0);
        match (due.filter(|_| self.settings.goal == Goal::Anytime), needed) {
            (Some(block), _) => return Some(self.repair(block)),
            (None, Some(block)) => {
                self.blocks[block].needed -= 1;
                self.blocks[block].due = number.saturating_add(self.distance());
                return Some(block);
            }
            (None, None) => {}
        }
        let count = self.blocks.len();
        let mut turns = (self.repaired + 1..self.repaired + 1 + count).map(|i| i % count);
        let block = turns.find(|&i| !self.blocks[i].complete && self.blocks[i].repairs > 0)?;
        Some(self.repair(block))
    }

    fn repair(&mut self, block: usize) -> usize {
        self.blocks[block].repairs -= 1;
        // The next one may meet another burst.
        self.blocks[block].due = self.number.saturating_add(self.distance().min(4));
        self.repaired = block;
        block
    }

    /// Packets between a block's first packets and its repairs: twice the length of a burst, but at most
    /// a third of a round trip, because a report comes after a whole one.
    fn distance(&self) -> u32 {
        let Conditions { loss, round_trip, .. } = self.settings.conditions;
        let third = self.carried(round_trip / 3) / MAX_DATAGRAM as u64;
        // The casts keep the values or saturate.
        (2.0 * (loss.burst() - 1.0).round()).min(third as f64) as u32
    }

    fn send(&mut self, index: usize, now: Duration) -> Turn {
        let block = &mut self.blocks[index];
        let symbol = block.fresh;
        block.fresh = (symbol + 1) % block.code.total();
        block.pending += 1;
        let turn = Turn { number: self.number, block: index, symbol, bytes: block.bytes() };
        self.flights.push_back(Flight { number: self.number, block: index, sent: now });
        self.number += 1;
        self.sent += u64::from(turn.bytes);
        turn
    }
}
