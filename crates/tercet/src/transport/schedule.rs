//! Which symbol is sent when: hybrid ARQ under a plan. Knows blocks by number and size only.
//!
//! The plan says how many packets each block gets. First come those without which a block cannot be
//! decoded, in the order of the file. Before a deadline repairs come last, the blocks taking turns:
//! until then the order is free, and this one loses least, because a repair that a report makes
//! needless meanwhile is never sent; and where reports come early enough to be relied on, the plan goes as
//! deep as they allow and leaves repairs open. Where the viewer may look at any time, repairs follow their
//! block at a distance that outlasts most bursts, and a link that would be idle carries further ones.
//! Every symbol is a fresh one; none is sent twice while others are left.

use std::collections::VecDeque;
use std::time::Duration;

use super::code::Code;
use super::cover::{Cover, cover};
use super::loss::{GilbertElliott, Runs};
use super::pace::pace;
use super::packet::{MAX_DATAGRAM, OVERHEAD};
use super::plan::{Demand, Parts, STEPS, Strategy, expected, plan};
use super::pool::deepest;
use super::quality::{Objective, Quality};
use super::report::Report;
use super::sender::Source;

/// Round trips after which a packet that a report does not tell of was lost: one, the packet's own length, and
/// some for packets that overtake each other.
const REPORTED: f64 = 1.25;
/// Round trips after which it counts as lost if no report comes at all. A burst on the way back is no loss.
const UNREPORTED: f64 = 3.0;

/// Round trips after which a loss can be relied on to have been reported, even if a report was lost itself.
const RELIED: f64 = 1.5;

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
    /// What is gained by it, and by parts of it.
    gain: f64,
    parts: Option<Parts>,
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
    /// They may be sent once so many bytes have been sent.
    due: u64,
    /// Bytes between its repairs, if not those between the repairs of all.
    distance: Option<u64>,
}

impl Block {
    /// One of which nothing has been sent.
    fn new(code: Code, gain: f64, parts: Option<Parts>, base: bool) -> Self {
        Block {
            code,
            gain,
            parts,
            base,
            complete: false,
            received: 0,
            pending: 0,
            fresh: 0,
            needed: 0,
            repairs: 0,
            due: 0,
            distance: None,
        }
    }

    fn bytes(&self) -> u32 {
        // A symbol has at most MAX_SYMBOL bytes.
        (OVERHEAD + self.code.size) as u32
    }

    fn lacking(&self) -> u32 {
        if self.complete { 0 } else { self.code.symbols.saturating_sub(self.received).max(1) }
    }

    fn demand(&self) -> Demand {
        let (lacking, pending) = (self.lacking(), self.pending);
        Demand { lacking, pending, bytes: self.bytes(), gain: self.gain, parts: self.parts }
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

/// The blocks of a file, of which nothing has been sent.
fn blocks(source: &Source, objective: Objective) -> Vec<Block> {
    let mut blocks: Vec<Block> = Vec::new();
    let mut before = Quality::NOTHING;
    for i in 0..source.blocks.count() {
        // Blocks are never empty nor too large: Blocks::cut sees to that.
        let Some(code) = Code::of(source.blocks.bytes(source.file(), i).len()) else { continue };
        let mut quality = source.blocks.quality(i);
        if let Some(next) = source.blocks.in_part(i + 1, 1).filter(|_| quality == before) {
            // Shows nothing itself, but a packet after it does.
            quality = next;
        }
        let gain = |quality| (objective.value(quality) - objective.value(before)).max(0.0);
        let symbols = code.symbols as usize;
        let in_part = |step: usize| source.blocks.in_part(i, symbols * step / STEPS);
        let parts = in_part(0).map(|least| Parts {
            symbols: code.symbols,
            gains: std::array::from_fn(|step| gain(in_part(step).unwrap_or(least))),
        });
        let gain = gain(quality);
        let base = before == Quality::NOTHING;
        blocks.push(Block::new(code, gain, parts, base));
        before = quality;
    }
    blocks
}

impl Schedule {
    pub(super) fn new(source: &Source, settings: Settings) -> Schedule {
        Schedule {
            settings,
            blocks: blocks(source, settings.objective),
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
    pub(super) fn report(&mut self, report: &Report, now: Duration) {
        while let Some(flight) = self.flights.pop_front_if(|flight| flight.number < report.heard) {
            self.blocks[flight.block].pending -= 1;
            self.stale = true;
        }
        self.runs.heard = report.heard > 0;
        // Reports do come back: what was sent long enough before this one, and is not in it, was lost.
        self.give_up(now, self.settings.conditions.round_trip.mul_f64(REPORTED));
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
        self.give_up(now, self.settings.conditions.round_trip.mul_f64(UNREPORTED));
        if self.is_done() || self.number == u32::MAX {
            return None;
        }
        if self.stale {
            self.renew(now);
        }
        let mut chosen = self.choose();
        if chosen.is_none() && !self.idle && self.fills() {
            let budget = self.budget(now).unwrap_or(self.cap());
            let further = plan(Strategy::Optimal, &self.demands(), budget, &mut self.runs);
            self.adopt(&further);
            self.idle = true;
            chosen = self.choose();
        }
        chosen.map(|block| self.send(block, now))
    }

    /// Whether a link that would be idle carries further repairs.
    fn fills(&self) -> bool {
        self.protects_at_any_time() || self.settings.strategy == Strategy::Optimal
    }

    /// Whether the base is protected most.
    fn protects_at_any_time(&self) -> bool {
        let protects = matches!(self.settings.strategy, Strategy::Greedy | Strategy::Optimal);
        self.settings.goal == Goal::Anytime && protects
    }

    /// Packets that were sent so long ago are taken for lost.
    fn give_up(&mut self, now: Duration, patience: Duration) {
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

    /// The incomplete blocks. What is gained by a complete one waits for the last incomplete one before it.
    fn demands(&self) -> Vec<Demand> {
        let mut demands: Vec<Demand> = Vec::new();
        for block in &self.blocks {
            match (block.complete, demands.last_mut()) {
                (false, _) => demands.push(block.demand()),
                (true, Some(before)) => before.gain += block.gain,
                (true, None) => {}
            }
        }
        demands
    }

    /// Plans anew with what is known at `now`.
    fn renew(&mut self, now: Duration) {
        let demands = self.demands();
        let packets = match self.budget(now) {
            Some(budget) => {
                let blind = plan(self.settings.strategy, &demands, budget, &mut self.runs);
                self.deep(&demands, budget, &blind).unwrap_or(blind)
            }
            None => {
                let window = self.carried(self.settings.conditions.round_trip);
                let repairs = pace(self.settings.strategy, &demands, window, &mut self.runs);
                demands.iter().zip(repairs).map(|(demand, repairs)| demand.deficit() + repairs).collect()
            }
        };
        self.adopt(&packets);
        self.cover_base();
        (self.stale, self.idle) = (false, false);
    }

    /// Bytes that may be sent from `now` on, if the goal sets a limit.
    fn budget(&self, now: Duration) -> Option<u64> {
        let budget = match self.settings.goal {
            Goal::Anytime => return None,
            Goal::Bytes(bytes) => bytes.saturating_sub(self.sent),
            Goal::Deadline(deadline) => {
                let way = self.settings.conditions.round_trip / 2;
                self.carried(deadline.saturating_sub(now).saturating_sub(way))
            }
        };
        Some(budget.min(self.cap()))
    }

    /// The packets of a plan that relies on reports, where that is worth more than the blind one.
    fn deep(&mut self, demands: &[Demand], budget: u64, blind: &[u32]) -> Option<Vec<u32>> {
        if self.settings.strategy != Strategy::Optimal {
            return None;
        }
        let lag = self.carried(self.settings.conditions.round_trip.mul_f64(RELIED));
        let depth = deepest(demands, budget, lag, &mut self.runs);
        let deficits = demands.iter().take(depth.blocks).map(Demand::deficit);
        let packets = deficits.chain(std::iter::repeat(0)).take(demands.len()).collect();
        (depth.value > expected(demands, blind, &mut self.runs)).then_some(packets)
    }

    /// Takes over how many packets the incomplete blocks get.
    fn adopt(&mut self, packets: &[u32]) {
        let open = self.blocks.iter_mut().filter(|block| !block.complete);
        for (block, &packets) in open.zip(packets) {
            block.needed = packets.min(block.lacking().saturating_sub(block.pending));
            block.repairs = packets - block.needed;
        }
    }

    /// Before any report can help, the blocks of the base are repaired by a rule of their own.
    fn cover_base(&mut self) {
        let window = self.carried(self.settings.conditions.round_trip);
        if !self.protects_at_any_time() || self.sent >= window {
            return;
        }
        let mut first = 0;
        for block in self.blocks.iter_mut().filter(|block| block.base && !block.complete) {
            let symbols = block.code.symbols;
            let room = window.saturating_sub(first) as f64 / MAX_DATAGRAM as f64;
            let Cover { repairs, distance } = cover(symbols, room, &self.settings.conditions.loss);
            block.repairs = (symbols + repairs).saturating_sub(block.fresh.max(symbols));
            // The cast saturates.
            block.distance = Some((distance * MAX_DATAGRAM as f64) as u64);
            first += u64::from(symbols) * u64::from(block.bytes());
        }
    }

    /// The block whose turn it is.
    fn choose(&mut self) -> Option<usize> {
        let sent = self.sent;
        let is_due = |block: &Block| block.repairs > 0 && block.needed == 0 && block.due <= sent;
        let due = self.blocks.iter().position(|block| !block.complete && is_due(block));
        let needed = self.blocks.iter().position(|block| !block.complete && block.needed > 0);
        match (due.filter(|_| self.settings.goal == Goal::Anytime), needed) {
            (Some(block), _) => return Some(self.repair(block)),
            (None, Some(block)) => {
                self.blocks[block].needed -= 1;
                self.put_off(block, self.distance());
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
        self.put_off(block, self.distance().min(4 * MAX_DATAGRAM as u64));
        self.repaired = block;
        block
    }

    /// A packet of the block is sent: when a repair is due, at this distance unless the block has its own.
    fn put_off(&mut self, block: usize, distance: u64) {
        let block = &mut self.blocks[block];
        block.due = match block.distance {
            // No later than at its distance, although it has to wait for the end of another packet.
            Some(own) if block.fresh < block.code.symbols => {
                (self.sent + own).saturating_sub(MAX_DATAGRAM as u64 - 1)
            }
            Some(own) => block.due + own,
            None => self.sent + distance,
        };
    }

    /// Bytes between a block's first packets and its repairs: twice the length of a burst, but at most
    /// a third of a round trip, because a report comes after a whole one.
    fn distance(&self) -> u64 {
        let Conditions { loss, round_trip, .. } = self.settings.conditions;
        // The cast saturates.
        let bursts = (2.0 * (loss.burst() - 1.0) * MAX_DATAGRAM as f64) as u64;
        bursts.min(self.carried(round_trip / 3))
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::transport::report::Progress;
    use crate::{EncodeOptions, encode, shapes};

    /// Also where the one before shows nothing new by itself: then it would never be sent.
    #[test]
    fn what_a_complete_block_is_worth_waits_for_the_one_before() {
        let file = encode(&shapes::scan(3000, 1), &EncodeOptions::default()).unwrap().bytes;
        let conditions = Conditions {
            loss: GilbertElliott::independent(0.1).unwrap(),
            rate: 125_000.0,
            round_trip: Duration::from_millis(100),
        };
        let goal = Goal::Deadline(Duration::from_secs(5));
        let settings = Settings { strategy: Strategy::Optimal, objective: Objective::Psnr, goal, conditions };
        let mut schedule = Schedule::new(&Source::new(file).unwrap(), settings);
        let all: f64 = schedule.blocks.iter().map(|block| block.gain).sum();
        let last = schedule.blocks.len() as u16 - 1;
        let progress = vec![Progress { block: last, received: None }];
        let report = Report { heard: 1, done: last - 1, progress, ..Report::default() };
        schedule.report(&report, Duration::from_secs(1));
        let shown: f64 = schedule.blocks[..usize::from(last) - 1].iter().map(|block| block.gain).sum();
        let [demand] = schedule.demands()[..] else { panic!("one block is missing") };
        assert!((demand.gain - (all - shown)).abs() < 1e-9);
        let turn = schedule.next_turn(Duration::from_secs(1)).expect("it is sent");
        assert_eq!(turn.block, usize::from(last) - 1);
    }
}
