//! Unequal protection: how many packets each block gets out of a budget, so that the expected
//! value of what is shown is largest.
//!
//! Blocks help only together with all before them. With P the probability that a block can be
//! decoded from the packets that it got, and g the gain of showing it, the expected value is
//! g₁P₁ + g₂P₁P₂ + g₃P₁P₂P₃ + …, which splits after any block: the best use of a budget by blocks
//! k, k + 1, … does not depend on the blocks before. That makes dynamic programming over blocks
//! and what is left of the budget exact, up to the unit in which the budget is counted. P is exact
//! for the channel of Gilbert and Elliott ([`Runs`]), given that the packets before arrived, in whose wake
//! a block's own are sent. The model's simplification is that repairs lie far enough apart from these to
//! be lost independently of them.

use super::loss::Runs;

/// How redundancy is shared out. All but the best are there to compare it with.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Strategy {
    /// No redundancy: what is missing is sent once it has been reported.
    None,
    /// The same share of redundancy for every block, the best such share.
    Equal,
    /// One packet, or one block, after the other: each time what gains most for a byte.
    Greedy,
    /// The best number of packets for each block.
    #[default]
    Optimal,
}

/// A block that is not complete.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Demand {
    /// Symbols without which it cannot be decoded.
    pub(super) lacking: u32,
    /// Packets on their way.
    pub(super) pending: u32,
    /// Bytes of each packet.
    pub(super) bytes: u32,
    /// What is gained when it, and all before it, are complete.
    pub(super) gain: f64,
    /// What is gained as long as it is not complete itself, if anything is.
    pub(super) parts: Option<Parts>,
}

/// Steps in which [`Parts`] are known.
pub(super) const STEPS: usize = 8;

/// A block whose source symbols are of use one by one.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Parts {
    /// How many there are.
    pub(super) symbols: u32,
    /// What is gained by 0, 1/[`STEPS`], 2/[`STEPS`] … of them.
    pub(super) gains: [f64; STEPS + 1],
}

impl Parts {
    /// What is gained by so many symbols on average, not all of them.
    fn gain(&self, symbols: f64) -> f64 {
        let most = f64::from(self.symbols.max(1));
        let at = symbols.min(most - 1.0) / most * STEPS as f64;
        // The cast keeps the value: it is below STEPS.
        let step = at as usize;
        self.gains[step] + (at - step as f64) * (self.gains[step + 1] - self.gains[step])
    }
}

impl Demand {
    /// Packets that must be sent for it even if none is lost.
    pub(super) fn deficit(&self) -> u32 {
        self.lacking.saturating_sub(self.pending)
    }

    /// What so many further packets can be expected to gain besides, of which so many are lost, if the block has
    /// this chance to be complete.
    fn partial(&self, packets: u32, chance: f64, loss: f64) -> f64 {
        self.parts.map_or(0.0, |parts| {
            let received = parts.symbols.saturating_sub(self.lacking);
            let coming = f64::from(self.pending + packets) * (1.0 - loss);
            (1.0 - chance) * parts.gain(f64::from(received) + coming)
        })
    }
}

/// A probability of failure that is as good as none.
const CERTAIN: f64 = 1.0 - 1e-6;
/// Units in which the budget is counted, about: decides time and precision.
const UNITS: u64 = 2000;
/// Finest unit: parts of the largest packet.
const PARTS: u64 = 256;

/// A number of packets for a block, the probability that it can be decoded then, and what is gained on average by
/// the cases in which it cannot.
#[derive(Clone, Copy)]
pub(super) struct Choice {
    pub(super) packets: u32,
    pub(super) chance: f64,
    partial: f64,
}

/// Choices below the deficit of a block that is of use in part, about.
const PARTIAL_CHOICES: u32 = 16;

/// The choices for a block: none, then its deficit and more, up to certainty or the budget's end; if it is of use in
/// part, some in between.
///
/// `follows`: whether its packets are sent right after others that arrive.
/// The packets before the repairs are convolved once; each number of repairs takes linear time.
pub(super) fn choices(demand: &Demand, budget: u64, follows: bool, runs: &mut Runs) -> Vec<Choice> {
    let deficit = demand.deficit();
    let loss = runs.loss();
    let of = |packets: u32, chance: f64| Choice {
        packets,
        chance,
        partial: demand.partial(packets, chance, loss),
    };
    let mut choices = Vec::new();
    let affordable = u32::try_from(budget / u64::from(demand.bytes.max(1))).unwrap_or(u32::MAX);
    if deficit > 0 {
        let some = demand.parts.map_or(1, |_| deficit.min(affordable.saturating_add(1)));
        let step = deficit.div_ceil(PARTIAL_CHOICES) as usize;
        let partial = (0..some).step_by(step).map(|packets| of(packets, 0.0));
        // What gains no more than nothing does would stop who looks at the next choice only.
        choices.extend(partial.filter(|choice| choice.packets == 0 || choice.partial > of(0, 0.0).partial));
    }
    if deficit > affordable {
        return choices;
    }
    let before = convolved(demand.pending as usize, deficit as usize, follows, runs);
    let lacking = demand.lacking as usize;
    for repairs in 0..=affordable - deficit {
        let chance = before.iter().enumerate().map(|(received, p)| match lacking.checked_sub(received) {
            Some(missing) => p * runs.anywhere.at_least(missing, repairs as usize),
            None => *p,
        });
        let chance = chance.sum::<f64>().min(1.0);
        choices.push(of(deficit + repairs, chance));
        if chance > CERTAIN {
            break;
        }
    }
    choices
}

/// The probabilities that 0, 1, … packets arrive of those pending and of new ones together.
fn convolved(pending: usize, new: usize, follows: bool, runs: &mut Runs) -> Vec<f64> {
    let mut sum = vec![0.0; pending + new + 1];
    let table = if follows { &mut runs.following } else { &mut runs.anywhere };
    let first = table.received(pending).to_vec();
    for (j, p) in table.received(new).iter().enumerate() {
        // What hardly ever happens need not be followed up.
        if *p > 1e-12 {
            first.iter().enumerate().for_each(|(i, q)| sum[i + j] += p * q);
        }
    }
    sum
}

/// The expected value of `packets` new packets for each of `demands`.
///
/// Takes time O(n²) in a block's packets, once for each `runs`.
pub(super) fn expected(demands: &[Demand], packets: &[u32], runs: &mut Runs) -> f64 {
    let (mut value, mut chance, mut follows) = (0.0, 1.0, runs.heard);
    for (demand, &packets) in demands.iter().zip(packets) {
        let known = choices(demand, u64::from(packets) * u64::from(demand.bytes), follows, runs);
        follows |= demand.deficit() + demand.pending > 0;
        let choice = known.last().copied().unwrap_or(Choice { packets: 0, chance: 0.0, partial: 0.0 });
        value += chance * (choice.chance * demand.gain + choice.partial);
        chance *= choice.chance;
    }
    value
}

/// New packets for each of `demands`, the incomplete blocks in the order of the file, that cost at
/// most `budget` bytes. Blocks after one that gets too few are given none.
///
/// Takes time O(blocks · budget · choices), the budget counted in some 2 000 units.
pub(super) fn plan(strategy: Strategy, demands: &[Demand], budget: u64, runs: &mut Runs) -> Vec<u32> {
    match strategy {
        Strategy::None => shared(demands, budget, 0.0),
        Strategy::Equal => equal(demands, budget, runs),
        Strategy::Greedy => greedy(demands, budget, runs),
        Strategy::Optimal => optimal(demands, budget, runs),
    }
}

/// As many blocks as the budget allows, each with the same share of redundancy, rounded up.
fn shared(demands: &[Demand], budget: u64, share: f64) -> Vec<u32> {
    let mut packets = vec![0; demands.len()];
    let mut left = budget;
    for (demand, packets) in demands.iter().zip(&mut packets) {
        // The cast keeps the value: a share is at most 1, and blocks have few symbols.
        let redundancy = (share * f64::from(demand.lacking)).ceil() as u32;
        *packets = (demand.lacking + redundancy).saturating_sub(demand.pending);
        let cost = u64::from(*packets) * u64::from(demand.bytes);
        if cost > left {
            // The cast keeps the value: it is less than the packets that cost more.
            *packets = demand.parts.map_or(0, |_| (left / u64::from(demand.bytes.max(1))) as u32);
            break;
        }
        left -= cost;
    }
    packets
}

fn equal(demands: &[Demand], budget: u64, runs: &mut Runs) -> Vec<u32> {
    let shares = (0..=20).map(|step| shared(demands, budget, f64::from(step) / 20.0));
    let valued = shares.map(|packets| (expected(demands, &packets, runs), packets));
    let best = valued.reduce(|best, next| if next.0 > best.0 { next } else { best });
    best.map_or_else(Vec::new, |(_, packets)| packets)
}

fn greedy(demands: &[Demand], budget: u64, runs: &mut Runs) -> Vec<u32> {
    let choices = affordable_choices(demands, budget, runs);
    let mut taken = vec![0; demands.len()];
    let value = |taken: &[usize]| {
        let (mut value, mut chance) = (0.0, 1.0);
        for ((choices, &i), demand) in choices.iter().zip(taken).zip(demands) {
            value += chance * (choices[i].chance * demand.gain + choices[i].partial);
            chance *= choices[i].chance;
        }
        value
    };
    let cost =
        |block: usize, i: usize| u64::from(choices[block][i].packets) * u64::from(demands[block].bytes);
    let (mut left, mut now) = (budget, value(&taken));
    loop {
        let mut best: Option<(f64, usize, f64)> = None;
        for block in 0..demands.len() {
            let next = taken[block] + 1;
            if next >= choices[block].len() {
                continue;
            }
            let more = cost(block, next) - cost(block, taken[block]);
            taken[block] += 1;
            let then = value(&taken);
            taken[block] -= 1;
            let rate = (then - now) / more.max(1) as f64;
            if more <= left && rate > 0.0 && best.is_none_or(|(other, ..)| rate > other) {
                best = Some((rate, block, then));
            }
        }
        let Some((_, block, then)) = best else { break };
        left -= cost(block, taken[block] + 1) - cost(block, taken[block]);
        taken[block] += 1;
        now = then;
    }
    taken.iter().zip(&choices).map(|(&i, choices)| choices[i].packets).collect()
}

fn optimal(demands: &[Demand], budget: u64, runs: &mut Runs) -> Vec<u32> {
    let choices = affordable_choices(demands, budget, runs);
    if let Some(packets) = all_certain(demands, &choices, budget) {
        return packets;
    }
    let (units, costs) = in_units(demands, budget);

    // best[b]: what this block and those after it can be expected to gain with b units.
    let mut best = vec![0.0; units + 1];
    let mut chosen: Vec<Vec<u32>> = Vec::new();
    for ((demand, choices), &cost) in demands.iter().zip(&choices).zip(&costs).rev() {
        let mut better = vec![0.0; units + 1];
        let mut indices = vec![0; units + 1];
        for (i, choice) in choices.iter().enumerate() {
            let spent = choice.packets as usize * cost;
            for b in spent..=units {
                let value = choice.chance * (demand.gain + best[b - spent]) + choice.partial;
                if value > better[b] {
                    (better[b], indices[b]) = (value, i as u32);
                }
            }
        }
        best = better;
        chosen.push(indices);
    }

    let mut left = units;
    let mut packets = vec![0; demands.len()];
    for (block, indices) in chosen.iter().rev().enumerate() {
        let choice = choices[block][indices[left] as usize];
        packets[block] = choice.packets;
        if choice.chance == 0.0 {
            break;
        }
        left -= choice.packets as usize * costs[block];
    }
    packets
}

/// The budget, and what a packet of each block costs, in units of which the budget has some 2 000.
fn in_units(demands: &[Demand], budget: u64) -> (usize, Vec<usize>) {
    let largest = demands.iter().map(|demand| u64::from(demand.bytes)).max().unwrap_or(1).max(1);
    // A unit divides the largest packet, of which nearly all are, without a rest.
    let parts = (UNITS * largest / budget.max(1)).clamp(1, PARTS);
    let units = usize::try_from(budget * parts / largest).unwrap_or(usize::MAX);
    let costs = demands.iter().map(|demand| (u64::from(demand.bytes) * parts).div_ceil(largest) as usize);
    (units, costs.collect())
}

/// The choices of each block as far as the budget reaches when none is lost; beyond, only "none".
fn affordable_choices(demands: &[Demand], budget: u64, runs: &mut Runs) -> Vec<Vec<Choice>> {
    let (mut left, mut follows) = (budget, runs.heard);
    let choices = demands.iter().map(|demand| {
        let choices = choices(demand, left, follows, runs);
        follows |= demand.deficit() + demand.pending > 0;
        left = left.saturating_sub(u64::from(demand.deficit()) * u64::from(demand.bytes));
        choices
    });
    choices.collect()
}

/// The packets with which every block is as good as certain, if the budget allows.
fn all_certain(demands: &[Demand], choices: &[Vec<Choice>], budget: u64) -> Option<Vec<u32>> {
    let last = choices.iter().map(|choices| choices.last().filter(|choice| choice.chance > CERTAIN));
    let packets = last.map(|choice| choice.map(|choice| choice.packets)).collect::<Option<Vec<_>>>()?;
    let cost: u64 =
        packets.iter().zip(demands).map(|(&n, demand)| u64::from(n) * u64::from(demand.bytes)).sum();
    (cost <= budget).then_some(packets)
}

#[cfg(test)]
mod tests;
