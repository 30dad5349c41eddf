//! The baseline: one ordered, reliable stream with congestion control, as TCP and a QUIC stream are.
//!
//! Selective acknowledgements, one for each segment, which are never lost and come back in half a
//! round trip. An initial window of 10 segments (RFC 6928); slow start and congestion avoidance, the
//! window halved once in a round trip with losses (RFC 5681, RFC 6582). A segment counts as lost when
//! one sent three transmissions after it has been acknowledged (the packet threshold of RFC 9002; it
//! sees a lost retransmission too, as RFC 6675 does not). Retransmission timeout after RFC 6298 with
//! a minimum of 200 ms, known round trip at the start, doubled each time. Segments are as large as
//! the largest datagram. The link's queue has no end, so that only the channel loses segments; the
//! sender never sends again what has arrived, even if the acknowledgement is still on its way.
//! Where this departs from what is in use, it favours the baseline.

use std::cmp::Reverse;
use std::collections::{BTreeMap, BTreeSet, BinaryHeap};
use std::time::Duration;

use super::Run;
use super::channel::{Channel, Link, Micros, micros};
use crate::transport::code::MAX_SYMBOL;
use crate::transport::packet::OVERHEAD;
use crate::transport::sender::Source;

const INITIAL_WINDOW: f64 = 10.0;
/// Later transmissions acknowledged before one counts as lost.
const THRESHOLD: u64 = 3;
const LEAST_TIMEOUT: Micros = 200_000;
const LONGEST_TIMEOUT: Micros = 60_000_000;

#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
enum Event {
    Arrival {
        transmission: u64,
        segment: usize,
    },
    Acknowledged {
        transmission: u64,
    },
    /// The timer that was set last, if this is its count.
    Timeout(u64),
}

/// Simulates one session of ordered retransmission. It ends with the file's last byte, or at `until`.
pub fn ordered(source: &Source, channel: &Channel, seed: u64, until: Duration) -> Run {
    let mut session = Session {
        source,
        channel,
        link: Link::new(channel, seed),
        receiver: Prefix { arrived: BTreeSet::new(), next: 0 },
        window: Window::new(micros(channel.round_trip)),
        flights: BTreeMap::new(),
        lost: BTreeSet::new(),
        next: 0,
        transmissions: 0,
        timer: 0,
        events: BinaryHeap::new(),
        added: 0,
        run: Run::default(),
    };
    session.send(0);
    session.play(micros(until));
    session.run
}

struct Session<'a> {
    source: &'a Source,
    channel: &'a Channel,
    link: Link<'a>,
    receiver: Prefix,
    window: Window,
    /// Transmissions that are neither acknowledged nor lost: their segments and times.
    flights: BTreeMap<u64, (usize, Micros)>,
    /// Segments to be sent again.
    lost: BTreeSet<usize>,
    /// The first segment that was never sent.
    next: usize,
    transmissions: u64,
    timer: u64,
    events: BinaryHeap<Reverse<(Micros, u64, Event)>>,
    added: u64,
    run: Run,
}

/// The segments that arrived.
struct Prefix {
    arrived: BTreeSet<usize>,
    /// All before this one are there.
    next: usize,
}

impl Session<'_> {
    fn segments(&self) -> usize {
        self.source.file().len().div_ceil(MAX_SYMBOL)
    }

    fn add(&mut self, at: Micros, event: Event) {
        self.added += 1;
        self.events.push(Reverse((at, self.added, event)));
    }

    fn play(&mut self, until: Micros) {
        while let Some(Reverse((now, _, event))) = self.events.pop() {
            if now > until || self.receiver.next == self.segments() {
                return;
            }
            match event {
                Event::Arrival { transmission, segment } => {
                    self.arrive(now, segment);
                    self.add(now + self.channel.one_way(), Event::Acknowledged { transmission });
                }
                Event::Acknowledged { transmission } => self.acknowledge(now, transmission),
                Event::Timeout(timer) if timer == self.timer => {
                    self.window.time_out(self.transmissions);
                    self.lost.extend(self.flights.values().map(|flight| flight.0));
                    self.flights.clear();
                    self.send(now);
                    self.set_timer(now);
                }
                Event::Timeout(_) => {}
            }
        }
    }

    fn send(&mut self, now: Micros) {
        while (self.flights.len() as f64) < self.window.segments.floor() {
            let segment = match self.lost.pop_first() {
                Some(segment) => segment,
                None if self.next < self.segments() => {
                    self.next += 1;
                    self.next - 1
                }
                None => break,
            };
            let payload = (self.source.file().len() - segment * MAX_SYMBOL).min(MAX_SYMBOL);
            let bytes = (payload + OVERHEAD) as u32;
            let passage = self.link.send(now, bytes);
            self.run.count(now, bytes);
            let transmission = self.transmissions;
            self.transmissions += 1;
            self.flights.insert(transmission, (segment, now));
            if self.flights.len() == 1 {
                self.set_timer(now);
            }
            if let Some(at) = passage.arrivals[0] {
                self.add(at, Event::Arrival { transmission, segment });
            }
        }
    }

    fn arrive(&mut self, now: Micros, segment: usize) {
        self.receiver.arrived.insert(segment);
        while self.receiver.arrived.remove(&self.receiver.next) {
            self.receiver.next += 1;
        }
        let bytes = (self.receiver.next * MAX_SYMBOL) as u64;
        let last = self.receiver.next == self.segments();
        let stages = self.source.blocks.stages();
        if let Some(&(_, quality)) = stages.iter().rev().find(|stage| last || stage.0 <= bytes) {
            self.run.saw(now, quality);
        }
    }

    fn acknowledge(&mut self, now: Micros, transmission: u64) {
        if let Some((_, sent)) = self.flights.remove(&transmission) {
            self.window.acknowledge(transmission, now - sent);
            self.set_timer(now);
        }
        while let Some(entry) = self.flights.first_entry() {
            let earlier = *entry.key();
            if earlier + THRESHOLD > transmission {
                break;
            }
            let (segment, _) = entry.remove();
            if segment >= self.receiver.next && !self.receiver.arrived.contains(&segment) {
                self.lost.insert(segment);
                self.window.lose(earlier, self.transmissions);
            }
        }
        self.send(now);
    }

    fn set_timer(&mut self, now: Micros) {
        self.timer += 1;
        if !self.flights.is_empty() {
            self.add(now + self.window.timeout(), Event::Timeout(self.timer));
        }
    }
}

/// How much may be on its way, and how long to wait for it.
struct Window {
    segments: f64,
    threshold: f64,
    /// The transmission from which on a loss is a new one.
    recovered: u64,
    smoothed: f64,
    variation: f64,
    backoff: u32,
}

impl Window {
    fn new(round_trip: Micros) -> Window {
        let smoothed = round_trip as f64;
        let (threshold, variation) = (f64::INFINITY, smoothed / 2.0);
        Window { segments: INITIAL_WINDOW, threshold, recovered: 0, smoothed, variation, backoff: 0 }
    }

    fn acknowledge(&mut self, transmission: u64, sample: Micros) {
        self.backoff = 0;
        self.variation += ((sample as f64 - self.smoothed).abs() - self.variation) / 4.0;
        self.smoothed += (sample as f64 - self.smoothed) / 8.0;
        if self.segments < self.threshold {
            self.segments += 1.0;
        } else if transmission >= self.recovered {
            self.segments += 1.0 / self.segments;
        }
    }

    fn lose(&mut self, transmission: u64, next: u64) {
        if transmission >= self.recovered {
            self.threshold = (self.segments / 2.0).max(2.0);
            self.segments = self.threshold;
            self.recovered = next;
        }
    }

    fn time_out(&mut self, next: u64) {
        self.threshold = (self.segments / 2.0).max(2.0);
        self.segments = 1.0;
        self.recovered = next;
        self.backoff += 1;
    }

    fn timeout(&self) -> Micros {
        let timeout = (self.smoothed + 4.0 * self.variation) as Micros;
        timeout.max(LEAST_TIMEOUT).saturating_mul(1 << self.backoff.min(16)).min(LONGEST_TIMEOUT)
    }
}
