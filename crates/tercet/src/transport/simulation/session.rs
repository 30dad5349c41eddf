//! A session of [`Sender`](crate::transport::Sender) and receiver, symbols counted.

use std::cmp::Reverse;
use std::collections::{BTreeSet, BinaryHeap};
use std::time::Duration;

use super::channel::{Channel, Link, Micros, micros};
use super::{Quality, Run};
use crate::shapes::Random;
use crate::transport::code::Code;
use crate::transport::report::{Progress, Report};
use crate::transport::schedule::{Schedule, Settings, Turn};
use crate::transport::sender::Source;

/// Bytes of a report, about: they decide how often a bit error hits it.
const REPORT_BYTES: u32 = 64;
/// How long a sender that has nothing to send waits before it asks again.
const PAUSE: Micros = 2_000;

#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
enum Event {
    /// The link takes the next datagram.
    Free,
    /// A datagram arrives.
    Arrival { number: u32, block: usize, symbol: u32 },
    /// The receiver reports.
    Tick,
    /// A report arrives: its index.
    Report(usize),
}

/// Simulates one session: a receiver that reports four times in a round trip, over a way back that
/// loses reports as the way there loses packets. It ends with the file's last byte, or at `until`.
///
/// The sender is told the rate of the present; `settings.conditions` holds what else it believes.
pub fn session(source: &Source, settings: Settings, channel: &Channel, seed: u64, until: Duration) -> Run {
    let mut session = Session {
        source,
        settings,
        channel,
        schedule: Schedule::new(source, settings),
        there: Link::new(channel, seed),
        back: Link::new(channel, !seed),
        receiver: Tally::new(source, seed),
        reports: Vec::new(),
        events: BinaryHeap::new(),
        added: 0,
        run: Run::default(),
    };
    session.add(0, Event::Free);
    session.add(session.channel.one_way(), Event::Tick);
    session.play(micros(until));
    session.run
}

struct Session<'a> {
    source: &'a Source,
    settings: Settings,
    channel: &'a Channel,
    schedule: Schedule,
    there: Link<'a>,
    back: Link<'a>,
    receiver: Tally,
    reports: Vec<Report>,
    /// By time, and by age among those of one time.
    events: BinaryHeap<Reverse<(Micros, u64, Event)>>,
    added: u64,
    run: Run,
}

impl Session<'_> {
    fn add(&mut self, at: Micros, event: Event) {
        self.added += 1;
        self.events.push(Reverse((at, self.added, event)));
    }

    fn play(&mut self, until: Micros) {
        while let Some(Reverse((now, _, event))) = self.events.pop() {
            if now > until || self.schedule.is_done() {
                return;
            }
            match event {
                Event::Free => self.send(now),
                Event::Arrival { number, block, symbol } => {
                    self.receiver.take(number, block, symbol);
                    let shown = self.receiver.done.checked_sub(1);
                    let quality = shown.map_or(Quality::NOTHING, |block| self.source.blocks.quality(block));
                    self.run.saw(now, quality);
                    if let Some(quality) = self.receiver.in_part(self.source) {
                        self.run.saw(now, quality);
                    }
                }
                Event::Tick => self.report(now),
                Event::Report(index) => {
                    self.schedule.report(&self.reports[index], Duration::from_micros(now))
                }
            }
        }
    }

    fn send(&mut self, now: Micros) {
        let rate = self.channel.at(now).rate;
        self.settings.conditions.rate = rate;
        self.schedule.set_conditions(self.settings.conditions);
        let Some(turn) = self.schedule.next_turn(Duration::from_micros(now)) else {
            return self.add(now + PAUSE, Event::Free);
        };
        let Turn { number, block, symbol, bytes } = turn;
        let passage = self.there.send(now, bytes);
        self.run.count(now, bytes);
        for at in passage.arrivals.into_iter().flatten() {
            self.add(at, Event::Arrival { number, block, symbol });
        }
        self.add(passage.sent, Event::Free);
    }

    fn report(&mut self, now: Micros) {
        if !self.back.loses(now, REPORT_BYTES, self.channel.at(now).loss) {
            self.reports.push(self.receiver.report());
            self.add(now + self.channel.one_way(), Event::Report(self.reports.len() - 1));
        }
        self.add(now + (micros(self.channel.round_trip) / 4).max(PAUSE), Event::Tick);
    }
}

/// A receiver that counts symbols.
struct Tally {
    blocks: Vec<TallyBlock>,
    heard: u32,
    /// The blocks before this one are complete.
    done: usize,
}

struct TallyBlock {
    /// Source symbols.
    source: u32,
    /// Symbols that restore it.
    needed: usize,
    received: BTreeSet<u32>,
}

impl TallyBlock {
    fn is_complete(&self) -> bool {
        self.received.len() >= self.needed
    }
}

impl Tally {
    fn new(source: &Source, seed: u64) -> Tally {
        let mut random = Random::new(seed.rotate_left(32));
        let lengths = (0..source.blocks.count()).map(|i| source.blocks.bytes(source.file(), i).len());
        let blocks = lengths.filter_map(Code::of).map(|code| {
            let mut needed = code.symbols as usize;
            while !code.is_exact() && random.below(100) == 0 {
                needed += 1;
            }
            TallyBlock { source: code.symbols, needed, received: BTreeSet::new() }
        });
        Tally { blocks: blocks.collect(), heard: 0, done: 0 }
    }

    fn take(&mut self, number: u32, block: usize, symbol: u32) {
        self.heard = self.heard.max(number + 1);
        self.blocks[block].received.insert(symbol);
        while self.blocks.get(self.done).is_some_and(TallyBlock::is_complete) {
            self.done += 1;
        }
    }

    /// What the source symbols of the first incomplete block show.
    fn in_part(&self, source: &Source) -> Option<Quality> {
        let block = self.blocks.get(self.done)?;
        source.blocks.in_part(self.done, block.received.range(..block.source).count())
    }

    fn report(&self) -> Report {
        let progress =
            self.blocks.iter().enumerate().skip(self.done).filter(|(_, block)| !block.received.is_empty());
        let progress = progress.map(|(i, block)| Progress {
            block: i as u16,
            received: (!block.is_complete()).then_some(block.received.len() as u16),
        });
        Report {
            heard: self.heard,
            done: self.done as u16,
            progress: progress.collect(),
            ..Report::default()
        }
    }
}
