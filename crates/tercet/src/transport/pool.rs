//! How far to go before a deadline that reports come before: repairs are not yet shared out among blocks.
//!
//! What is lost long enough before the deadline is reported, and repaired where it was lost: the packets
//! that are left over serve whichever block needs them. The blind plan ([`plan`](super::plan::plan)) does not know that and
//! stops too early. Here a depth J, the last block to be sent, is valued by chances that are pooled: with N packets
//! needed up to it and M that the budget has room for, J arrives if N of M do. A block j before it has to arrive in
//! parts: of what is sent before the last report, losses are made good by any later packet; of what is sent
//! after, nothing may be lost. That leaves out blind repairs of earlier blocks, which the
//! blind plan adds once everything has been sent.

use super::loss::Runs;
use super::plan::Demand;

/// Packets beyond those needed, and their number itself, from which on everything is certain.
const AMPLE: u32 = 100;

/// A depth and what it can be expected to gain.
pub(super) struct Depth {
    /// Blocks to be sent.
    pub(super) blocks: usize,
    pub(super) value: f64,
}

/// The best depth within `budget` bytes, if a report comes `lag` bytes after what it tells of.
///
/// `demands`: the incomplete blocks in the order of the file. Takes time O(n²) in them, and, once for each
/// `runs`, in their packets.
pub(super) fn deepest(demands: &[Demand], budget: u64, lag: u64, runs: &mut Runs) -> Depth {
    let mut best = Depth { blocks: 0, value: 0.0 };
    let mut cost = 0;
    for blocks in 1..=demands.len() {
        let last = &demands[blocks - 1];
        cost += u64::from(last.deficit()) * u64::from(last.bytes);
        if cost > budget {
            break;
        }
        let value = value(&demands[..blocks], budget - cost, lag, runs);
        if value > best.value {
            best = Depth { blocks, value };
        }
    }
    best
}

/// What can be expected of sending all of these, with some bytes to spare.
fn value(demands: &[Demand], spare: u64, lag: u64, runs: &mut Runs) -> f64 {
    // Most of what is left over goes to the last block.
    let each = demands.last().map_or(1, |last| last.bytes.max(1));
    let packets = |bytes: u64| u32::try_from(bytes / u64::from(each)).unwrap_or(u32::MAX);
    let needed: u32 = demands.iter().map(Demand::deficit).sum();
    let total = needed.saturating_add(packets(spare).min(3 * needed + AMPLE));
    let reported = total.saturating_sub(packets(lag));
    let (mut sent, mut pending, mut lacking, mut value, mut likely) = (0, 0, 0, 0.0, 1.0f64);
    for (i, demand) in demands.iter().enumerate() {
        sent += demand.deficit();
        pending += demand.pending;
        lacking += demand.lacking;
        let chance = if i + 1 == demands.len() {
            runs.anywhere.at_least(lacking as usize, (pending + total) as usize)
        } else {
            let early = sent.min(reported);
            let late = sent - early;
            let known = (lacking - late.min(lacking)) as usize;
            runs.anywhere.at_least(known, (pending + early + total - sent) as usize)
                * runs.following.at_least(late as usize, late as usize)
        };
        // No block is of use without those before it.
        likely = likely.min(chance);
        value += likely * demand.gain;
    }
    value
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::transport::GilbertElliott;

    fn demand(lacking: u32, gain: f64) -> Demand {
        Demand { lacking, pending: 0, bytes: 1000, gain, parts: None }
    }

    fn runs() -> Runs {
        Runs::new(GilbertElliott::independent(0.05).unwrap())
    }

    #[test]
    fn reports_in_time_lead_further() {
        let demands = [demand(2, 60.0), demand(30, 5.0), demand(30, 5.0)];
        let depth = |budget, lag| deepest(&demands, budget, lag, &mut runs()).blocks;
        assert_eq!(depth(70_000, 10_000), 3);
        // Without a report the base is at stake for little.
        assert_eq!(depth(70_000, 70_000), 1);
        assert_eq!(depth(31_000, 10_000), 1);
        assert_eq!(depth(1_000, 0), 0);
    }

    /// With one block there is nothing to pool: both plans value it alike.
    #[test]
    fn a_single_block_is_worth_its_chance() {
        let demands = [demand(10, 7.0)];
        let found = deepest(&demands, 12_000, 5_000, &mut runs());
        let chance = runs().anywhere.at_least(10, 12);
        assert_eq!((found.blocks, found.value), (1, 7.0 * chance));
    }
}
