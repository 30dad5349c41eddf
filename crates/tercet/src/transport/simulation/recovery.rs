//! The sender's side of an ordered stream: which packets are lost, and how many may be on their way.
//!
//! RFC 9002, "QUIC Loss Detection and Congestion Control": numbers in brackets are its sections. Windows
//! are counted in packets, which are equally long except for the last one.

use std::collections::BTreeMap;

use super::channel::Micros;

/// Packets of the first window [7.2].
const INITIAL_WINDOW: f64 = 10.0;
/// Packets of the least window [7.2].
const LEAST_WINDOW: f64 = 2.0;
/// What losses leave of the window [7.3.2].
const DECREASE: f64 = 0.5;
/// Later packets acknowledged before one counts as lost [6.1.1].
const PACKET_THRESHOLD: u64 = 3;
/// The least time that a timer measures [6.1.2].
const GRANULARITY: Micros = 1_000;
/// Probe timeouts within which nothing arrives, that make congestion persistent [7.6.1].
const PERSISTENT: Micros = 3;
/// How long a receiver may hold back an acknowledgement (RFC 9000, 18.2).
pub(super) const MAX_ACK_DELAY: Micros = 25_000;

/// A packet that is neither acknowledged nor lost.
#[derive(Clone, Copy)]
struct Flight {
    segment: usize,
    sent: Micros,
}

/// What a timer that has run out asks for.
#[derive(Debug, PartialEq, Eq)]
pub(super) enum Expiry {
    /// These segments are lost.
    Lost(Vec<usize>),
    /// Nothing was acknowledged for long: packets to be sent whatever the window, to learn why.
    Probe,
}

/// What an acknowledgement tells.
#[derive(Debug, Default, PartialEq, Eq)]
pub(super) struct News {
    /// Segments that have arrived.
    pub(super) arrived: Vec<usize>,
    /// Segments whose packets are lost.
    pub(super) lost: Vec<usize>,
}

/// What the sender knows of its packets.
pub(super) struct Recovery {
    flights: BTreeMap<u64, Flight>,
    largest_acknowledged: Option<u64>,
    last_sent: Micros,
    /// When the next packet counts as lost by its age.
    loss_time: Option<Micros>,
    /// Probes since the last acknowledgement.
    probes: u32,
    round_trip: RoundTrip,
    window: Window,
}

impl Recovery {
    /// Of a connection whose handshake has measured the round trip.
    pub(super) fn new(round_trip: Micros) -> Recovery {
        Recovery {
            flights: BTreeMap::new(),
            largest_acknowledged: None,
            last_sent: 0,
            loss_time: None,
            probes: 0,
            round_trip: RoundTrip::new(round_trip),
            window: Window { packets: INITIAL_WINDOW, threshold: f64::INFINITY, recovery: None },
        }
    }

    /// Whether the window has room for another packet.
    pub(super) fn has_room(&self) -> bool {
        (self.flights.len() + 1) as f64 <= self.window.packets
    }

    /// The segments on their way, the oldest packet's first.
    pub(super) fn under_way(&self) -> impl Iterator<Item = usize> {
        self.flights.values().map(|flight| flight.segment)
    }

    pub(super) fn sent(&mut self, number: u64, segment: usize, now: Micros) {
        self.flights.insert(number, Flight { segment, sent: now });
        self.last_sent = now;
    }

    /// Takes an acknowledgement of packets that was held back for `delay`.
    pub(super) fn acknowledge(&mut self, numbers: &[u64], delay: Micros, now: Micros) -> News {
        let mut arrived = Vec::new();
        // A window that is not used up has not been tried [7.8].
        let used_up = !self.has_room();
        let largest = numbers.iter().copied().max();
        for number in numbers {
            let Some(flight) = self.flights.remove(number) else { continue };
            if largest == Some(*number) && self.largest_acknowledged < largest {
                self.round_trip.sample(now - flight.sent, delay);
            }
            if used_up {
                self.window.acknowledge(flight.sent);
            }
            arrived.push(flight.segment);
        }
        self.largest_acknowledged = self.largest_acknowledged.max(largest);
        if !arrived.is_empty() {
            self.probes = 0;
        }
        News { arrived, lost: self.detect(now) }
    }

    /// When the timer runs out [6.2.1].
    pub(super) fn timer(&self) -> Option<Micros> {
        let probe = self.round_trip.probe_timeout().saturating_mul(1 << self.probes.min(16));
        self.loss_time.or((!self.flights.is_empty()).then_some(self.last_sent + probe))
    }

    pub(super) fn expire(&mut self, now: Micros) -> Expiry {
        if self.loss_time.is_some() {
            return Expiry::Lost(self.detect(now));
        }
        self.probes += 1;
        Expiry::Probe
    }

    /// The segments of packets that count as lost from now on [6.1].
    fn detect(&mut self, now: Micros) -> Vec<usize> {
        self.loss_time = None;
        let Some(largest) = self.largest_acknowledged else { return Vec::new() };
        let patience = self.round_trip.loss_delay();
        let is_lost = |number: u64, flight: &Flight| {
            number + PACKET_THRESHOLD <= largest || flight.sent + patience <= now
        };
        let lost: Vec<(u64, Flight)> =
            self.flights.range(..largest).map(|(n, flight)| (*n, *flight)).collect();
        let (lost, kept): (Vec<_>, Vec<_>) = lost.into_iter().partition(|(n, flight)| is_lost(*n, flight));
        self.loss_time = kept.first().map(|(_, flight)| flight.sent + patience);
        for (number, _) in &lost {
            self.flights.remove(number);
        }
        if let Some((_, last)) = lost.last() {
            self.window.lose(last.sent, now);
        }
        let longest = PERSISTENT * self.round_trip.probe_timeout();
        let is_long = |run: &[(u64, Flight)]| run[run.len() - 1].1.sent - run[0].1.sent > longest;
        if lost.chunk_by(|a, b| a.0 + 1 == b.0).any(is_long) {
            self.window.collapse();
        }
        lost.into_iter().map(|(_, flight)| flight.segment).collect()
    }
}

/// The round trip as it is measured [5.3].
struct RoundTrip {
    latest: Micros,
    least: Micros,
    smoothed: Micros,
    variation: Micros,
}

impl RoundTrip {
    fn new(sample: Micros) -> RoundTrip {
        RoundTrip { latest: sample, least: sample, smoothed: sample, variation: sample / 2 }
    }

    fn sample(&mut self, latest: Micros, delay: Micros) {
        self.latest = latest;
        self.least = self.least.min(latest);
        let adjusted = if latest >= self.least + delay { latest - delay } else { latest };
        self.variation = (3 * self.variation + self.smoothed.abs_diff(adjusted)) / 4;
        self.smoothed = (7 * self.smoothed + adjusted) / 8;
    }

    /// The age at which a packet before one that was acknowledged is lost [6.1.2].
    fn loss_delay(&self) -> Micros {
        (9 * self.latest.max(self.smoothed) / 8).max(GRANULARITY)
    }

    /// How long an acknowledgement may take [6.2.1].
    fn probe_timeout(&self) -> Micros {
        self.smoothed + (4 * self.variation).max(GRANULARITY) + MAX_ACK_DELAY
    }
}

/// The congestion window [7.3].
struct Window {
    packets: f64,
    /// Below it, slow start.
    threshold: f64,
    /// When the last recovery began: losses of packets sent before are no new ones.
    recovery: Option<Micros>,
}

impl Window {
    fn acknowledge(&mut self, sent: Micros) {
        if self.recovery.is_none_or(|began| sent > began) {
            self.packets += if self.packets < self.threshold { 1.0 } else { 1.0 / self.packets };
        }
    }

    fn lose(&mut self, sent: Micros, now: Micros) {
        if self.recovery.is_none_or(|began| sent > began) {
            self.recovery = Some(now);
            self.threshold = (self.packets * DECREASE).max(LEAST_WINDOW);
            self.packets = self.threshold;
        }
    }

    /// What persistent congestion leaves [7.6.2].
    fn collapse(&mut self) {
        self.packets = LEAST_WINDOW;
        self.recovery = None;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Ten packets, sent every 10 ms.
    fn ten() -> Recovery {
        let mut recovery = Recovery::new(100_000);
        (0..10).for_each(|n| recovery.sent(n, n as usize, 10_000 * n));
        recovery
    }

    #[test]
    fn a_packet_is_lost_three_packets_later_or_by_its_age() {
        let mut recovery = ten();
        assert!(!recovery.has_room());
        assert_eq!(recovery.acknowledge(&[1], 0, 110_000), News { arrived: vec![1], lost: vec![] });
        // 9/8 of the round trip after packet 0 was sent.
        assert_eq!(recovery.timer(), Some(112_500));
        assert_eq!(recovery.expire(112_500), Expiry::Lost(vec![0]));
        let news = recovery.acknowledge(&[6], 0, 160_000);
        assert_eq!(
            news,
            News { arrived: vec![6], lost: vec![2, 3, 4] },
            "4 by its age, and 5 may still come"
        );
    }

    #[test]
    fn losses_of_one_window_halve_it_once() {
        let mut recovery = ten();
        recovery.acknowledge(&[4], 0, 140_000);
        assert_eq!(recovery.window.packets, 11.0 * DECREASE);
        recovery.acknowledge(&[9], 0, 190_000);
        assert_eq!(recovery.window.packets, 11.0 * DECREASE);
        recovery.sent(10, 10, 195_000);
        recovery.sent(14, 14, 200_000);
        recovery.acknowledge(&[14], 0, 300_000);
        assert!(recovery.window.packets < 3.0);
    }

    #[test]
    fn silence_is_probed_less_and_less_often() {
        let mut recovery = ten();
        // A round trip, four times half of it, and what an acknowledgement may be held back.
        let timeout = 100_000 + 200_000 + 25_000;
        assert_eq!(recovery.timer(), Some(90_000 + timeout));
        assert_eq!(recovery.expire(90_000 + timeout), Expiry::Probe);
        assert_eq!(recovery.timer(), Some(90_000 + 2 * timeout));
        recovery.sent(10, 0, 500_000);
        let news = recovery.acknowledge(&[10], 0, 2_000_000);
        assert_eq!(news.lost, (0..10).collect::<Vec<_>>());
        assert_eq!(recovery.window.packets, 11.0 * DECREASE, "90 ms of losses are not yet persistent");
    }

    #[test]
    fn losses_for_long_leave_the_least_window() {
        let mut recovery = Recovery::new(100_000);
        (0..10).for_each(|n| recovery.sent(n, n as usize, 200_000 * n));
        recovery.acknowledge(&[9], 0, 1_900_000);
        assert_eq!(recovery.window.packets, LEAST_WINDOW);
    }
}
