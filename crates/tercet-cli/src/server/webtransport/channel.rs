//! What is known of the way to a client, and losses on purpose.

use std::time::Duration;

use tercet::transport::{Conditions, GilbertElliott};
use wtransport::Connection;

use crate::quic::REPORT_INTERVAL;

/// Packets of which one was lost, before anything is known.
const PRIOR: f64 = 64.0;
/// Steps of a loss rate; smaller changes do not make a new plan worth its time.
const STEPS: f64 = 128.0;
/// The greatest loss rate to plan for.
const WORST: f64 = 0.5;
/// The least round trip to reckon with.
const SHORTEST: Duration = Duration::from_millis(1);

/// Loses packets before they are sent, the same ones for the same seed: a bad link for tests.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct InjectedLoss {
    /// The part of packets that is lost, below 1.
    pub rate: f64,
    /// Which ones.
    pub seed: u64,
}

/// The injected losses of a session.
pub struct Sieve {
    rate: f64,
    state: u64,
    sent: u64,
    lost: u64,
}

impl Sieve {
    pub fn new(loss: Option<InjectedLoss>) -> Self {
        let InjectedLoss { rate, seed } = loss.unwrap_or(InjectedLoss { rate: 0.0, seed: 0 });
        Sieve { rate, state: seed, sent: 0, lost: 0 }
    }

    /// Whether the next packet gets through.
    pub fn passes(&mut self) -> bool {
        self.sent += 1;
        let passes = self.chance() >= self.rate;
        self.lost += u64::from(!passes);
        passes
    }

    /// A number in 0..1 by SplitMix64 (Steele, Lea and Flood, 2014).
    fn chance(&mut self) -> f64 {
        self.state = self.state.wrapping_add(0x9E37_79B9_7F4A_7C15);
        let mut bits = self.state;
        bits = (bits ^ (bits >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
        bits = (bits ^ (bits >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
        bits ^= bits >> 31;
        (bits >> 11) as f64 / (1u64 << 53) as f64
    }
}

/// What QUIC knows of the path. Losses on purpose count as the path's.
pub fn conditions(connection: &Connection, sieve: &Sieve) -> Conditions {
    let path = connection.quic_connection().stats().path;
    let round_trip = path.rtt.max(SHORTEST);
    Conditions {
        loss: loss(path.lost_packets + sieve.lost, path.sent_packets + sieve.lost),
        rate: path.cwnd as f64 / round_trip.as_secs_f64(),
        round_trip: round_trip + REPORT_INTERVAL,
    }
}

/// The loss rate, cautiously: rounded up to a step.
fn loss(lost: u64, sent: u64) -> GilbertElliott {
    let rate = (lost as f64 + 1.0) / (sent as f64 + PRIOR);
    let rate = ((rate * STEPS).ceil() / STEPS).min(WORST);
    GilbertElliott::independent(rate).expect("a rate between 0 and a half")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_sieve_loses_its_part_and_the_same_packets_again() {
        let run = |rate, seed| {
            let mut sieve = Sieve::new(Some(InjectedLoss { rate, seed }));
            let passed: Vec<bool> = (0..10_000).map(|_| sieve.passes()).collect();
            assert_eq!(
                (sieve.sent, sieve.lost),
                (10_000, passed.iter().filter(|passed| !**passed).count() as u64)
            );
            passed
        };
        let lost = run(0.1, 1).iter().filter(|passed| !**passed).count();
        assert!((900..1100).contains(&lost), "{lost}");
        assert_eq!(run(0.1, 1), run(0.1, 1));
        assert_ne!(run(0.1, 1), run(0.1, 2));
        assert!(run(0.0, 1).iter().all(|passed| *passed));
    }

    #[test]
    fn loss_rates_are_cautious_and_bounded() {
        assert_eq!(loss(0, 0).loss(), 2.0 / 128.0);
        assert!((0.10..0.11).contains(&loss(1000, 10_000).loss()));
        assert_eq!(loss(100, 100).loss(), 0.5);
        assert!(loss(0, u64::MAX).loss() > 0.0);
    }
}
