//! How a channel loses packets, and what that does to a run of them.

use crate::{Error, Result};

/// The channel of Gilbert and Elliott: two states, each with a probability of losing a packet.
///
/// E. N. Gilbert, "Capacity of a burst-noise channel", 1960; E. O. Elliott, "Estimates of error rates
/// for codes on burst-noise channels", 1963. Independent loss is the special case in which the next
/// state does not depend on the present one.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct GilbertElliott {
    /// Probability of a step from the good state to the bad one.
    to_bad: f64,
    /// Probability of a step from the bad state to the good one.
    to_good: f64,
    /// Probability that a packet is lost, in the good and in the bad state.
    lost: [f64; 2],
}

/// The states' indices.
const GOOD: usize = 0;
const BAD: usize = 1;

impl GilbertElliott {
    /// Every packet is lost with probability `loss`, whatever became of others.
    ///
    /// # Errors
    /// [`Error::Parameter`] unless 0 ≤ `loss` < 1.
    pub fn independent(loss: f64) -> Result<Self> {
        if !(0.0..1.0).contains(&loss) {
            return Err(Error::Parameter(format!("loss {loss}: it is a number from 0 to below 1")));
        }
        Ok(GilbertElliott { to_bad: loss, to_good: 1.0 - loss, lost: [0.0, 1.0] })
    }

    /// Packets are lost in runs of `burst` on average, a part `loss` of all.
    ///
    /// # Errors
    /// [`Error::Parameter`] unless 0 ≤ `loss` < 1 and `burst` ≥ 1, and long enough for the loss.
    pub fn bursts(loss: f64, burst: f64) -> Result<Self> {
        GilbertElliott::independent(loss)?;
        let to_good = 1.0 / burst;
        let to_bad = to_good * loss / (1.0 - loss);
        if !(burst >= 1.0 && burst.is_finite() && to_bad <= 1.0) {
            return Err(Error::Parameter(format!(
                "no channel loses {loss} of its packets in runs of {burst}"
            )));
        }
        Ok(GilbertElliott { to_bad, to_good, lost: [0.0, 1.0] })
    }

    /// The same states, losing packets with other probabilities than 0 and 1.
    ///
    /// # Errors
    /// [`Error::Parameter`] unless both are from 0 to 1 and some packet comes through.
    pub fn with_losses(self, good: f64, bad: f64) -> Result<Self> {
        let changed = GilbertElliott { lost: [good, bad], ..self };
        if ![good, bad].iter().all(|p| (0.0..=1.0).contains(p)) || changed.loss() >= 1.0 {
            return Err(Error::Parameter(format!("losses {good} and {bad} of the two states")));
        }
        Ok(changed)
    }

    /// The part of all packets that is lost.
    pub fn loss(&self) -> f64 {
        let [good, bad] = self.stationary();
        good * self.lost[GOOD] + bad * self.lost[BAD]
    }

    /// Where the chain is at a time about which nothing is known.
    fn stationary(&self) -> [f64; 2] {
        match self.to_bad + self.to_good {
            0.0 => [1.0, 0.0],
            sum => [self.to_good / sum, self.to_bad / sum],
        }
    }

    /// The mean length of the bad state, in packets.
    pub(super) fn burst(&self) -> f64 {
        1.0 / self.to_good.max(1e-6)
    }

    /// The states' probabilities after a step.
    fn stepped(&self, [good, bad]: [f64; 2]) -> [f64; 2] {
        [good * (1.0 - self.to_bad) + bad * self.to_good, good * self.to_bad + bad * (1.0 - self.to_good)]
    }

    /// The chain as it is seen at a distance of packets.
    fn every(&self, distance: f64) -> GilbertElliott {
        let [good, bad] = self.stationary();
        let memory = (1.0 - self.to_bad - self.to_good).powf(distance);
        GilbertElliott { to_bad: bad * (1.0 - memory), to_good: good * (1.0 - memory), ..*self }
    }

    /// The probability that of `run` packets one after the other and `more` ones at a distance from
    /// each other and from these, at least `run` arrive. Takes time O((`run` + `more`)²).
    pub(super) fn spread(&self, run: u32, more: u32, distance: f64) -> f64 {
        let apart = self.every(distance);
        let mut states = vec![self.stationary()];
        for i in 0..run + more {
            let chain = if i < run { self } else { &apart };
            if i > 0 {
                states.iter_mut().for_each(|state| *state = chain.stepped(*state));
            }
            states = self.observed(&states);
        }
        states[run as usize..].iter().map(|[good, bad]| good + bad).sum()
    }

    /// One packet more: from the probabilities that 0, 1, … arrived, with the state in which it is sent.
    fn observed(&self, states: &[[f64; 2]]) -> Vec<[f64; 2]> {
        let mut longer = vec![[0.0; 2]; states.len() + 1];
        for (j, state) in states.iter().enumerate() {
            for s in [GOOD, BAD] {
                longer[j][s] += state[s] * self.lost[s];
                longer[j + 1][s] += state[s] * (1.0 - self.lost[s]);
            }
        }
        longer
    }

    /// The state after a step from `bad`, for a number drawn from 0 to 1.
    pub(super) fn step(&self, bad: bool, drawn: f64) -> bool {
        if bad { drawn >= self.to_good } else { drawn < self.to_bad }
    }

    /// The state at a time about which nothing is known, for a number drawn from 0 to 1.
    pub(super) fn start(&self, drawn: f64) -> bool {
        drawn < self.stationary()[BAD]
    }

    /// Whether a packet sent in a state is lost, for a number drawn from 0 to 1.
    pub(super) fn loses(&self, bad: bool, drawn: f64) -> bool {
        drawn < self.lost[usize::from(bad)]
    }
}

/// How many packets of a run arrive: exact probabilities, computed once for each length.
pub(super) struct Runs {
    channel: GilbertElliott,
    /// Of runs that begin at a time about which nothing is known.
    pub(super) anywhere: Table,
    /// Of runs that follow a packet that arrived.
    pub(super) following: Table,
    /// Whether the oldest packet in flight, or else the next one, follows a packet that is known to
    /// have arrived: the highest that a report has heard of.
    pub(super) heard: bool,
}

impl Runs {
    pub(super) fn new(channel: GilbertElliott) -> Runs {
        let begin = channel.stationary();
        let arrived = [0, 1].map(|state| begin[state] * (1.0 - channel.lost[state]));
        let sum = arrived[GOOD] + arrived[BAD];
        let after = channel.stepped(arrived.map(|p| p / sum));
        Runs {
            channel,
            anywhere: Table::new(channel, begin),
            following: Table::new(channel, after),
            heard: false,
        }
    }

    /// The part of all packets that is lost.
    pub(super) fn loss(&self) -> f64 {
        self.channel.loss()
    }
}

/// The probabilities of runs with one beginning. The chain makes a step with each packet.
pub(super) struct Table {
    channel: GilbertElliott,
    /// `states[j]`: the probability that j of the longest run so far arrived, with the state after it.
    states: Vec<[f64; 2]>,
    /// `received[m][j]`: the probability that exactly j of m packets arrive.
    received: Vec<Vec<f64>>,
    /// `tails[m][j]`: the probability that at least j of m packets arrive.
    tails: Vec<Vec<f64>>,
}

impl Table {
    fn new(channel: GilbertElliott, begin: [f64; 2]) -> Table {
        Table { channel, states: vec![begin], received: vec![vec![1.0]], tails: vec![vec![1.0]] }
    }

    /// The probabilities that 0, 1, … of `packets` arrive. Takes time O(`packets`²), once.
    pub(super) fn received(&mut self, packets: usize) -> &[f64] {
        self.extend(packets);
        &self.received[packets]
    }

    /// The probability that at least `enough` of `packets` arrive. Takes time O(`packets`²), once.
    pub(super) fn at_least(&mut self, enough: usize, packets: usize) -> f64 {
        self.extend(packets);
        self.tails[packets].get(enough).copied().unwrap_or(0.0)
    }

    fn extend(&mut self, packets: usize) {
        while self.received.len() <= packets {
            self.lengthen();
            let received: Vec<f64> = self.states.iter().map(|[good, bad]| good + bad).collect();
            let mut tail = received.clone();
            for j in (1..tail.len()).rev() {
                tail[j - 1] += tail[j];
            }
            self.received.push(received);
            self.tails.push(tail);
        }
    }

    /// One packet more: it arrives or not, then the chain makes a step.
    fn lengthen(&mut self) {
        let observed = self.channel.observed(&self.states);
        self.states = observed.into_iter().map(|states| self.channel.stepped(states)).collect();
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::shapes::Random;

    #[test]
    fn independent_losses_are_binomial() {
        let mut runs = Runs::new(GilbertElliott::independent(0.2).unwrap());
        let mut binomial = 1.0;
        for j in 0..=7 {
            let p = binomial * 0.8f64.powi(j) * 0.2f64.powi(7 - j);
            assert!((runs.anywhere.received(7)[j as usize] - p).abs() < 1e-12);
            binomial *= f64::from(7 - j) / f64::from(j + 1);
        }
        assert!((runs.anywhere.at_least(1, 3) - (1.0 - 0.008)).abs() < 1e-12);
        assert_eq!(runs.anywhere.at_least(4, 3), 0.0);
    }

    /// Every sequence of states of a short run, one by one.
    #[test]
    fn bursts_agree_with_enumeration() {
        let channel = GilbertElliott::bursts(0.1, 8.0).unwrap().with_losses(0.01, 0.7).unwrap();
        let mut expected = [0.0; 6];
        for states in 0..32u32 {
            for losses in 0..32u32 {
                let (bad, lost) = (|i: u32| states >> i & 1 == 1, |i: u32| losses >> i & 1 == 1);
                let mut p = channel.stationary()[usize::from(bad(0))];
                for i in 0..5 {
                    let q = channel.lost[usize::from(bad(i))];
                    p *= if lost(i) { q } else { 1.0 - q };
                    if i > 0 {
                        let leave = if bad(i - 1) { channel.to_good } else { channel.to_bad };
                        p *= if bad(i) == bad(i - 1) { 1.0 - leave } else { leave };
                    }
                }
                expected[5 - losses.count_ones() as usize] += p;
            }
        }
        let mut runs = Runs::new(channel);
        for (p, q) in runs.anywhere.received(5).iter().zip(expected) {
            assert!((p - q).abs() < 1e-12);
        }
    }

    /// In parts, each conditional on the one before, a run arrives whole as often as at once.
    #[test]
    fn runs_that_follow_each_other_are_one_run() {
        let mut runs = Runs::new(GilbertElliott::bursts(0.1, 8.0).unwrap());
        let whole = runs.anywhere.at_least(12, 12);
        let parts =
            runs.anywhere.at_least(3, 3) * runs.following.at_least(4, 4) * runs.following.at_least(5, 5);
        assert!((whole - parts).abs() < 1e-12);
    }

    #[test]
    fn a_drawn_channel_has_its_loss_and_bursts() {
        let channel = GilbertElliott::bursts(0.1, 8.0).unwrap();
        assert!((channel.loss() - 0.1).abs() < 1e-12);
        let mut random = Random::new(3);
        let mut bad = channel.start(random.unit());
        let (mut lost, mut bursts, steps) = (0, 0, 400_000);
        for _ in 0..steps {
            let next = channel.step(bad, random.unit());
            bursts += u32::from(bad && !next);
            bad = next;
            lost += u32::from(channel.loses(bad, random.unit()));
        }
        let (loss, burst) = (f64::from(lost) / f64::from(steps), f64::from(lost) / f64::from(bursts));
        assert!((loss - 0.1).abs() < 0.005 && (burst - 8.0).abs() < 0.3, "{loss} {burst}");
    }

    #[test]
    fn impossible_channels_are_refused() {
        for (loss, burst) in
            [(-0.1, 8.0), (1.0, 8.0), (0.1, 0.5), (0.9, 2.0), (f64::NAN, 8.0), (0.1, f64::NAN)]
        {
            assert!(GilbertElliott::bursts(loss, burst).is_err(), "{loss} {burst}");
        }
        assert!(GilbertElliott::independent(0.0).unwrap().with_losses(1.0, 1.0).is_err());
    }
}
