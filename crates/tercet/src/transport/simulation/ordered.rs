//! The baseline: one ordered, reliable stream with congestion control, as QUIC has it.
//!
//! Loss recovery and congestion control are those of RFC 9002 ([`Recovery`]), and so are acknowledgements
//! (RFC 9000, 13.2): of every second packet, or at once where one is missing, after 25 ms at most; each
//! tells of all packets that have arrived, and may be lost on its way as a report of datagrams may. A
//! probe is two packets. Packets are as large as the largest datagram. What a real connection does
//! besides is left out, in favour of the baseline: the handshake, of which it takes over the round
//! trip; a queue that overflows, so that only the channel loses packets; acknowledgements cost nothing.

use std::cmp::Reverse;
use std::collections::{BTreeSet, BinaryHeap};
use std::time::Duration;

use super::Run;
use super::channel::{Channel, Link, Micros, micros};
use super::recovery::{Expiry, MAX_ACK_DELAY, Recovery};
use crate::transport::code::MAX_SYMBOL;
use crate::transport::packet::OVERHEAD;
use crate::transport::sender::Source;

/// Bytes of an acknowledgement, about: they decide how often a bit error hits it.
const ACK_BYTES: u32 = 64;
/// Packets of a probe.
const PROBE: usize = 2;
/// Packets that are acknowledged together.
const TOGETHER: usize = 2;

#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
enum Event {
    Arrival {
        number: u64,
        segment: usize,
    },
    /// What has arrived is acknowledged, unless another acknowledgement than this one has been sent meanwhile.
    Due(usize),
    /// The acknowledgement of the first packets that arrived, and how long it was held back.
    Acknowledged {
        arrivals: usize,
        delay: Micros,
    },
    /// The sender's timer, if this is the one that was set last.
    Timer(u64),
}

/// Simulates one session of ordered retransmission. It ends with the file's last byte, or at `until`.
pub fn ordered(source: &Source, channel: &Channel, seed: u64, until: Duration) -> Run {
    let segments = source.file().len().div_ceil(MAX_SYMBOL);
    let mut session = Session {
        source,
        channel,
        there: Link::new(channel, seed),
        back: Link::new(channel, !seed),
        receiver: Receiver::default(),
        recovery: Recovery::new(micros(channel.round_trip)),
        known: 0,
        arrived: vec![false; segments],
        lost: BTreeSet::new(),
        next: 0,
        numbers: 0,
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
    there: Link<'a>,
    back: Link<'a>,
    receiver: Receiver,
    recovery: Recovery,
    /// How many arrivals the sender knows of.
    known: usize,
    /// The segments that the sender knows to have arrived.
    arrived: Vec<bool>,
    /// Segments to be sent again.
    lost: BTreeSet<usize>,
    /// The first segment that was never sent.
    next: usize,
    numbers: u64,
    timer: u64,
    events: BinaryHeap<Reverse<(Micros, u64, Event)>>,
    added: u64,
    run: Run,
}

/// What has arrived.
#[derive(Default)]
struct Receiver {
    /// Segments after the first one that is missing.
    ahead: BTreeSet<usize>,
    /// All before this one are there.
    next: usize,
    /// Packets in the order of their arrival.
    log: Vec<u64>,
    /// How many of them have been acknowledged, and since when one has not.
    acknowledged: usize,
    waiting: Micros,
}

impl Receiver {
    /// Takes a packet; whether it must be acknowledged at once.
    fn take(&mut self, now: Micros, number: u64, segment: usize) -> bool {
        if segment >= self.next {
            self.ahead.insert(segment);
        }
        while self.ahead.remove(&self.next) {
            self.next += 1;
        }
        if self.log.len() == self.acknowledged {
            self.waiting = now;
        }
        let follows = self.log.last().map_or(0, |last| last + 1) == number;
        self.log.push(number);
        !follows || self.log.len() >= self.acknowledged + TOGETHER
    }
}

impl Session<'_> {
    fn segments(&self) -> usize {
        self.arrived.len()
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
                Event::Arrival { number, segment } => self.arrive(now, number, segment),
                Event::Due(acknowledged) if acknowledged == self.receiver.acknowledged => self.answer(now),
                Event::Acknowledged { arrivals, delay } => self.acknowledge(now, arrivals, delay),
                Event::Timer(timer) if timer == self.timer => match self.recovery.expire(now) {
                    Expiry::Lost(lost) => {
                        self.lose(lost);
                        self.send(now);
                    }
                    Expiry::Probe => self.probe(now),
                },
                Event::Due(_) | Event::Timer(_) => {}
            }
        }
    }

    fn lose(&mut self, segments: Vec<usize>) {
        let arrived = &self.arrived;
        self.lost.extend(segments.into_iter().filter(|&segment| !arrived[segment]));
    }

    /// The segment to be sent next: one that is lost, or else a fresh one.
    fn due(&mut self) -> Option<usize> {
        while let Some(segment) = self.lost.pop_first() {
            // It may have arrived by a probe.
            if !self.arrived[segment] {
                return Some(segment);
            }
        }
        let fresh = (self.next < self.segments()).then_some(self.next);
        self.next += usize::from(fresh.is_some());
        fresh
    }

    fn send(&mut self, now: Micros) {
        while self.recovery.has_room() {
            let Some(segment) = self.due() else { break };
            self.transmit(now, segment);
        }
        self.set_timer();
    }

    /// Sends what is due, or else what has waited longest for its acknowledgement.
    fn probe(&mut self, now: Micros) {
        let oldest: Vec<usize> = self.recovery.under_way().take(PROBE).collect();
        let due: Vec<usize> = (0..PROBE).map_while(|_| self.due()).collect();
        for segment in due.into_iter().chain(oldest).take(PROBE) {
            self.transmit(now, segment);
        }
        self.set_timer();
    }

    fn transmit(&mut self, now: Micros, segment: usize) {
        let payload = (self.source.file().len() - segment * MAX_SYMBOL).min(MAX_SYMBOL);
        let bytes = (payload + OVERHEAD) as u32;
        let passage = self.there.send(now, bytes);
        self.run.count(now, bytes);
        let number = self.numbers;
        self.numbers += 1;
        self.recovery.sent(number, segment, now);
        if let Some(at) = passage.arrivals[0] {
            self.add(at, Event::Arrival { number, segment });
        }
    }

    fn arrive(&mut self, now: Micros, number: u64, segment: usize) {
        let at_once = self.receiver.take(now, number, segment);
        let bytes = (self.receiver.next * MAX_SYMBOL) as u64;
        let last = self.receiver.next == self.segments();
        let stages = self.source.blocks.stages();
        if let Some(&(_, quality)) = stages.iter().rev().find(|stage| last || stage.0 <= bytes) {
            self.run.saw(now, quality);
        }
        if at_once {
            self.answer(now);
        } else {
            self.add(now + MAX_ACK_DELAY, Event::Due(self.receiver.acknowledged));
        }
    }

    /// The receiver acknowledges all that has arrived.
    fn answer(&mut self, now: Micros) {
        let arrivals = self.receiver.log.len();
        let delay = now - self.receiver.waiting;
        self.receiver.acknowledged = arrivals;
        if !self.back.loses(now, ACK_BYTES, self.channel.at(now).loss) {
            self.add(now + self.channel.one_way(), Event::Acknowledged { arrivals, delay });
        }
    }

    fn acknowledge(&mut self, now: Micros, arrivals: usize, delay: Micros) {
        if arrivals <= self.known {
            return;
        }
        let news = self.recovery.acknowledge(&self.receiver.log[self.known..arrivals], delay, now);
        self.known = arrivals;
        for segment in news.arrived {
            self.arrived[segment] = true;
        }
        self.lose(news.lost);
        self.send(now);
    }

    fn set_timer(&mut self) {
        self.timer += 1;
        if let Some(at) = self.recovery.timer() {
            self.add(at, Event::Timer(self.timer));
        }
    }
}
