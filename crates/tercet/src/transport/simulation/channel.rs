//! Models of channels, drawn from a seed: the same seed gives the same channel.

use std::time::Duration;

use crate::shapes::Random;
use crate::transport::{GilbertElliott, MAX_DATAGRAM};
use crate::{Error, Result};

/// A time in a simulation, in microseconds since the session began.
pub(super) type Micros = u64;

/// How packets are lost.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Loss {
    /// Each with this probability, whatever becomes of others.
    Independent(f64),
    /// By the state of a channel that makes a step in each of the times that the largest packet takes
    /// at the first rate, whether something is sent or not: a radio does not wait for packets.
    Bursts(GilbertElliott),
}

/// What a channel is like from some time on.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Step {
    /// The time, since the session began.
    pub from: Duration,
    /// Bytes in a second; above 0.
    pub rate: f64,
    /// The part of packets that is lost independently, besides what [`Channel::loss`] loses.
    pub loss: f64,
}

/// A channel from sender to receiver.
#[derive(Clone, Debug, PartialEq)]
pub struct Channel {
    /// Losses.
    pub loss: Loss,
    /// The probability of each bit to be flipped; a packet with a flipped bit is as good as lost.
    pub bit_errors: f64,
    /// Half of it each way.
    pub round_trip: Duration,
    /// Added to the way there: uniformly distributed from 0 to this, keeping the packets' order.
    pub jitter: Duration,
    /// The part of packets that are held up by a quarter of a round trip, so that others overtake them.
    pub reordered: f64,
    /// The part of packets that arrive twice.
    pub duplicated: f64,
    /// In the order of time; the first begins at 0.
    pub steps: Vec<Step>,
}

impl Channel {
    /// A channel of constant rate, in bytes in a second, without other faults than losses.
    ///
    /// # Errors
    /// [`Error::Parameter`] for a rate that is none.
    pub fn new(loss: Loss, rate: f64, round_trip: Duration) -> Result<Channel> {
        Channel::with_steps(loss, round_trip, vec![Step { from: Duration::ZERO, rate, loss: 0.0 }])
    }

    /// A channel whose rate changes.
    ///
    /// # Errors
    /// [`Error::Parameter`] unless the steps begin at 0, are in the order of time, and their rates
    /// are above 0 and their losses from 0 to below 1.
    pub fn with_steps(loss: Loss, round_trip: Duration, steps: Vec<Step>) -> Result<Channel> {
        let in_order = steps.first().is_some_and(|step| step.from == Duration::ZERO)
            && steps.is_sorted_by_key(|step| step.from);
        let possible = |step: &Step| step.rate >= 1.0 && step.rate <= 1e12 && (0.0..1.0).contains(&step.loss);
        if !in_order || !steps.iter().all(possible) {
            return Err(Error::Parameter(
                "a channel's steps begin at 0, follow each other, and have rates and losses".into(),
            ));
        }
        let none = Duration::ZERO;
        Ok(Channel {
            loss,
            bit_errors: 0.0,
            round_trip,
            jitter: none,
            reordered: 0.0,
            duplicated: 0.0,
            steps,
        })
    }

    /// The rates of a moving phone for a time: each second the full one, a half, a quarter or a tenth
    /// of it, neighbouring ones following each other.
    pub fn phone(rate: f64, time: Duration, seed: u64) -> Vec<Step> {
        let mut random = Random::new(seed);
        let parts = [1.0, 0.5, 0.25, 0.1];
        let mut part = 0usize;
        let steps = (0..time.as_secs().max(1)).map(|second| {
            let step = Step { from: Duration::from_secs(second), rate: rate * parts[part], loss: 0.0 };
            part = match random.below(3) {
                0 => part.saturating_sub(1),
                1 => part,
                _ => (part + 1).min(parts.len() - 1),
            };
            step
        });
        steps.collect()
    }

    /// A recorded channel: lines of seconds, bits in a second, and optionally the part of packets
    /// that is lost, separated by commas. Lines that begin with a letter or # are passed over.
    ///
    /// # Errors
    /// [`Error::Syntax`] naming the line; what [`Channel::with_steps`] refuses is not looked for.
    pub fn trace(csv: &str) -> Result<Vec<Step>> {
        let mut steps = Vec::new();
        for (i, line) in csv.lines().map(str::trim).enumerate() {
            if line.is_empty() || line.starts_with(|c: char| c == '#' || c.is_ascii_alphabetic()) {
                continue;
            }
            let numbers: Vec<f64> = line.split(',').filter_map(|field| field.trim().parse().ok()).collect();
            let step = match (line.split(',').count() == numbers.len(), numbers.as_slice()) {
                (true, &[seconds, bits]) => {
                    Duration::try_from_secs_f64(seconds).ok().map(|at| (at, bits, 0.0))
                }
                (true, &[seconds, bits, loss]) => {
                    Duration::try_from_secs_f64(seconds).ok().map(|at| (at, bits, loss))
                }
                _ => None,
            };
            let Some((from, bits, loss)) = step else {
                return Err(Error::syntax(format!("line {}", i + 1), "not seconds,bits per second[,loss]"));
            };
            steps.push(Step { from, rate: bits / 8.0, loss });
        }
        Ok(steps)
    }

    /// What holds at a time.
    pub(super) fn at(&self, now: Micros) -> &Step {
        let past = self.steps.partition_point(|step| step.from.as_micros() <= u128::from(now));
        &self.steps[past.max(1) - 1]
    }

    pub(super) fn one_way(&self) -> Micros {
        micros(self.round_trip) / 2
    }

    /// The losses as a sender may know them.
    ///
    /// # Errors
    /// [`Error::Parameter`] for an independent loss that is none.
    pub fn estimate(&self) -> Result<GilbertElliott> {
        match self.loss {
            Loss::Independent(loss) => GilbertElliott::independent(loss),
            Loss::Bursts(chain) => Ok(chain),
        }
    }
}

pub(super) fn micros(time: Duration) -> Micros {
    Micros::try_from(time.as_micros()).unwrap_or(Micros::MAX)
}

/// What became of a packet.
pub(super) struct Passage {
    /// When its last bit was sent.
    pub(super) sent: Micros,
    /// When it arrived, and when a second time.
    pub(super) arrivals: [Option<Micros>; 2],
}

/// A channel in use: packets enter one after the other.
pub(super) struct Link<'a> {
    channel: &'a Channel,
    /// What befalls single packets.
    random: Random,
    /// What befalls the channel, whatever is sent over it.
    weather: Random,
    /// State of the bursts, and the time up to which it has been drawn.
    bad: bool,
    drawn: Micros,
    slot: Micros,
    /// When the last packet will have been sent.
    free: Micros,
    /// When the last one arrived that kept the order.
    last: Micros,
}

impl<'a> Link<'a> {
    pub(super) fn new(channel: &'a Channel, seed: u64) -> Self {
        let (random, mut weather) = (Random::new(seed), Random::new(seed.rotate_left(17)));
        let bad = match channel.loss {
            Loss::Independent(_) => false,
            Loss::Bursts(chain) => chain.start(weather.unit()),
        };
        let slot = (MAX_DATAGRAM as f64 / channel.at(0).rate * 1e6).max(1.0) as Micros;
        Link { channel, random, weather, bad, drawn: 0, slot, free: 0, last: 0 }
    }

    /// Sends a packet of some bytes as soon as the ones before it are sent.
    pub(super) fn send(&mut self, now: Micros, bytes: u32) -> Passage {
        let start = self.free.max(now);
        let step = *self.channel.at(start);
        let sent = start + ((f64::from(bytes) / step.rate * 1e6) as Micros).max(1);
        self.free = sent;
        let lost = self.loses(start, bytes, step.loss);
        let arrival = self.arrival(sent);
        let twice = self.random.unit() < self.channel.duplicated;
        let arrivals = [(!lost).then_some(arrival), (!lost && twice).then_some(arrival + self.slot)];
        Passage { sent, arrivals }
    }

    /// Whether a packet that goes another way, without delay by others, is lost: for reports.
    pub(super) fn loses(&mut self, now: Micros, bytes: u32, besides: f64) -> bool {
        let by_channel = match self.channel.loss {
            Loss::Independent(loss) => self.random.unit() < loss,
            Loss::Bursts(chain) => {
                while self.drawn + self.slot <= now {
                    self.bad = chain.step(self.bad, self.weather.unit());
                    self.drawn += self.slot;
                }
                chain.loses(self.bad, self.random.unit())
            }
        };
        let intact = (1.0 - self.channel.bit_errors).powf(8.0 * f64::from(bytes)) * (1.0 - besides);
        by_channel | (self.random.unit() >= intact)
    }

    fn arrival(&mut self, sent: Micros) -> Micros {
        let jitter = (self.random.unit() * micros(self.channel.jitter) as f64) as Micros;
        let arrival = sent + self.channel.one_way() + jitter;
        if self.random.unit() < self.channel.reordered {
            return arrival + micros(self.channel.round_trip) / 4;
        }
        self.last = self.last.max(arrival);
        self.last
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn channel(loss: Loss) -> Channel {
        Channel::new(loss, 125_000.0, Duration::from_millis(100)).unwrap()
    }

    #[test]
    fn a_link_has_the_channels_loss_rate_and_delay() {
        for loss in [Loss::Independent(0.1), Loss::Bursts(GilbertElliott::bursts(0.1, 8.0).unwrap())] {
            let channel = channel(loss);
            let mut link = Link::new(&channel, 1);
            let passages: Vec<Passage> = (0..100_000).map(|_| link.send(0, 1250)).collect();
            let lost = passages.iter().filter(|passage| passage.arrivals[0].is_none()).count();
            assert!(lost.abs_diff(10_000) < 600, "{lost}");
            assert_eq!(passages[99_999].sent, 100_000 * 10_000);
            let arrived = passages.iter().find(|passage| passage.arrivals[0].is_some()).unwrap();
            assert_eq!(arrived.arrivals, [Some(arrived.sent + 50_000), None]);
        }
    }

    #[test]
    fn faults_occur_as_often_as_asked() {
        let mut channel = channel(Loss::Independent(0.0));
        (channel.bit_errors, channel.duplicated, channel.reordered) = (1e-5, 0.05, 0.02);
        channel.jitter = Duration::from_millis(5);
        let mut link = Link::new(&channel, 1);
        let passages: Vec<Passage> = (0..50_000).map(|_| link.send(0, 1250)).collect();
        let part = |of: fn(&Passage) -> bool| passages.iter().filter(|p| of(p)).count() as f64 / 50_000.0;
        assert!((part(|p| p.arrivals[0].is_none()) - 0.0952).abs() < 0.005);
        assert!((part(|p| p.arrivals[1].is_some()) - 0.0452).abs() < 0.004);
        let times: Vec<Micros> = passages.iter().filter_map(|p| p.arrivals[0]).collect();
        let overtaken = times.windows(2).filter(|pair| pair[1] < pair[0]).count();
        assert!(overtaken.abs_diff(905) < 150, "{overtaken}");
    }

    #[test]
    fn traces_are_read_line_by_line() {
        let steps = Channel::trace("seconds,bits,loss\n0,1000000\n# tunnel\n2.5, 80000, 0.3\n").unwrap();
        let second = Step { from: Duration::from_millis(2500), rate: 10_000.0, loss: 0.3 };
        assert_eq!((steps.len(), steps[1]), (2, second));
        for bad in ["1", "0,x", "0,1,2,3", "-1,5"] {
            assert!(matches!(Channel::trace(bad), Err(Error::Syntax { .. })), "{bad}");
        }
        let channel = Channel::with_steps(Loss::Independent(0.0), Duration::ZERO, steps).unwrap();
        assert_eq!(channel.at(2_499_999).rate, 125_000.0);
        assert_eq!(channel.at(2_500_000).rate, 10_000.0);
    }

    #[test]
    fn the_same_seed_gives_the_same_phone() {
        let phone = |seed| Channel::phone(1000.0, Duration::from_secs(60), seed);
        assert_eq!(phone(1), phone(1));
        assert_ne!(phone(1), phone(2));
        assert!(Channel::with_steps(Loss::Independent(0.0), Duration::ZERO, phone(1)).is_ok());
        assert!(Channel::with_steps(Loss::Independent(0.0), Duration::ZERO, Vec::new()).is_err());
    }
}
