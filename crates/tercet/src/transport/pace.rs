//! Repairs for a viewer who may look at any time: how many go along with a block's first packets.
//!
//! A repair that turns out to be needed costs nothing: it would have to be sent a round trip later
//! anyway. One that is not needed holds up everything after it by its own length. What is at stake
//! is a round trip of waiting for the block and for all that arrives meanwhile and cannot be shown
//! without it. That is a newsvendor's problem for each block: with r repairs, C(r) the probability
//! that they suffice, W the bytes sent in a round trip, b the bytes of a packet, the best r makes
//!
//! C(r) · W · (gains that wait) − b · (C(0) + … + C(r − 1)) · (gains that come later)
//!
//! largest: the r-th packet is wasted if the ones before it sufficed.

use super::loss::Runs;
use super::plan::{Demand, Strategy, choices};

/// Blocks beyond this many round trips are looked at later, when more is known.
const AHEAD: u64 = 4;

/// Repairs for each of `demands`, the incomplete blocks in the order of the file, if `window` bytes
/// are sent in a round trip. Takes time O(n²) in the packets of the next few round trips.
pub(super) fn pace(strategy: Strategy, demands: &[Demand], window: u64, runs: &mut Runs) -> Vec<u32> {
    let mut repairs = vec![0; demands.len()];
    let mut later: f64 = demands.iter().map(|demand| demand.gain).sum();
    let mut ahead = 0;
    for (i, demand) in demands.iter().enumerate() {
        later -= demand.gain;
        ahead += needed_bytes(demand);
        if ahead > window.saturating_mul(AHEAD) && i > 0 {
            break;
        }
        repairs[i] = match strategy {
            Strategy::None => 0,
            Strategy::Equal => {
                // As many as will be lost on average; the cast keeps the value, blocks are small.
                let total = (f64::from(demand.lacking) / (1.0 - runs.loss())).ceil() as u32;
                total.saturating_sub(demand.pending.max(demand.lacking))
            }
            Strategy::Greedy => best(demand, demand.gain, later, window, runs),
            Strategy::Optimal => best(demand, waiting(&demands[i..], window), later, window, runs),
        };
    }
    repairs
}

fn needed_bytes(demand: &Demand) -> u64 {
    u64::from(demand.deficit()) * u64::from(demand.bytes)
}

/// The gains of the first block and of those that are sent within a round trip after it.
fn waiting(demands: &[Demand], window: u64) -> f64 {
    let mut bytes = 0;
    let within = demands.iter().enumerate().take_while(|(i, demand)| {
        bytes += if *i > 0 { needed_bytes(demand) } else { 0 };
        bytes <= window
    });
    within.map(|(_, demand)| demand.gain).sum()
}

/// The best number of repairs for a block.
fn best(demand: &Demand, waiting: f64, later: f64, window: u64, runs: &mut Runs) -> u32 {
    let affordable = needed_bytes(demand) + window;
    let (mut wasted, mut best, mut most) = (0.0, 0, f64::NEG_INFINITY);
    for choice in choices(demand, affordable, runs.heard, runs) {
        let Some(repairs) = choice.packets.checked_sub(demand.deficit()) else { continue };
        let worth = choice.chance * window as f64 * waiting - f64::from(demand.bytes) * wasted * later;
        if worth > most {
            (best, most) = (repairs, worth);
        }
        wasted += choice.chance;
    }
    best
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::transport::GilbertElliott;

    fn demand(lacking: u32, gain: f64) -> Demand {
        Demand { lacking, pending: 0, bytes: 1000, gain, parts: None }
    }

    fn runs() -> Runs {
        Runs::new(GilbertElliott::independent(0.1).unwrap())
    }

    #[test]
    fn what_many_wait_for_is_protected_more() {
        let demands = [demand(4, 30.0), demand(4, 6.0), demand(4, 6.0)];
        let near = pace(Strategy::Optimal, &demands, 10_000, &mut runs());
        let far = pace(Strategy::Optimal, &demands, 100_000, &mut runs());
        assert!(near[0] >= 1 && far[0] > near[0], "{near:?} {far:?}");
        assert!(far[0] >= far[1]);
        // Nothing is held up by the last block's repairs.
        assert!(near[2] > near[1], "{near:?}");
    }

    #[test]
    fn no_redundancy_is_none_and_no_loss_needs_none() {
        let demands = [demand(4, 30.0), demand(40, 6.0)];
        assert_eq!(pace(Strategy::None, &demands, 100_000, &mut runs()), [0, 0]);
        let mut perfect = Runs::new(GilbertElliott::independent(0.0).unwrap());
        for strategy in [Strategy::Equal, Strategy::Greedy, Strategy::Optimal] {
            assert_eq!(pace(strategy, &demands, 100_000, &mut perfect), [0, 0]);
        }
    }
}
