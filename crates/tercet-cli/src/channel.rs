//! A channel on the command line: "loss=0.1,burst=8,rate=1M,rtt=100ms".

use std::time::Duration;

use anyhow::{Context, Result, bail};
use tercet::transport::GilbertElliott;
use tercet::transport::simulation::{Channel, Loss};

/// How long the rates of a phone are drawn for; the last one stays.
const PHONE_TIME: Duration = Duration::from_secs(600);

/// What a person says of a channel, before it is one.
struct Words {
    loss: f64,
    burst: Option<f64>,
    /// The losses of the good and of the bad state.
    states: Option<[f64; 2]>,
    bits_per_second: f64,
    round_trip: Duration,
    jitter: Duration,
    bit_errors: f64,
    reordered: f64,
    duplicated: f64,
    phone: Option<u64>,
    trace: Option<String>,
}

/// Reads words like `loss=0.1`, separated by commas.
pub fn parse(text: &str) -> Result<Channel> {
    let mut words = Words {
        loss: 0.0,
        burst: None,
        states: None,
        bits_per_second: 1e6,
        round_trip: Duration::from_millis(100),
        jitter: Duration::ZERO,
        bit_errors: 0.0,
        reordered: 0.0,
        duplicated: 0.0,
        phone: None,
        trace: None,
    };
    for word in text.split(',').map(str::trim).filter(|word| !word.is_empty()) {
        let (name, value) = word.split_once('=').with_context(|| format!("{word}: say NAME=VALUE"))?;
        words.set(name, value).with_context(|| word.to_string())?;
    }
    words.channel()
}

impl Words {
    fn set(&mut self, name: &str, value: &str) -> Result<()> {
        match name {
            "loss" => self.loss = value.parse()?,
            "burst" => self.burst = Some(value.parse()?),
            "states" => {
                let (good, bad) = value.split_once('/').context("say GOOD/BAD")?;
                self.states = Some([good.parse()?, bad.parse()?]);
            }
            "rate" => self.bits_per_second = rate(value)?,
            "rtt" => self.round_trip = time(value)?,
            "jitter" => self.jitter = time(value)?,
            "ber" => self.bit_errors = part(value)?,
            "reorder" => self.reordered = part(value)?,
            "duplicate" => self.duplicated = part(value)?,
            "phone" => self.phone = Some(value.parse()?),
            "trace" => self.trace = Some(value.into()),
            _ => bail!(
                "a channel has loss, burst, states, rate, rtt, jitter, ber, reorder, duplicate, phone, trace"
            ),
        }
        Ok(())
    }

    fn channel(self) -> Result<Channel> {
        let loss = match (self.burst, self.states) {
            (None, None) => {
                GilbertElliott::independent(self.loss)?;
                Loss::Independent(self.loss)
            }
            (burst, states) => {
                let chain = GilbertElliott::bursts(self.loss, burst.unwrap_or(1.0))?;
                let [good, bad] = states.unwrap_or([0.0, 1.0]);
                Loss::Bursts(chain.with_losses(good, bad)?)
            }
        };
        let rate = self.bits_per_second / 8.0;
        let mut channel = match (self.phone, self.trace) {
            (None, None) => Channel::new(loss, rate, self.round_trip)?,
            (Some(seed), None) => {
                Channel::with_steps(loss, self.round_trip, Channel::phone(rate, PHONE_TIME, seed))?
            }
            (None, Some(path)) => {
                let csv = std::fs::read_to_string(&path).with_context(|| path.clone())?;
                let steps = Channel::trace(&csv).with_context(|| path.clone())?;
                Channel::with_steps(loss, self.round_trip, steps).context(path)?
            }
            (Some(_), Some(_)) => bail!("a channel's rates come from phone or from trace, not from both"),
        };
        channel.jitter = self.jitter;
        channel.bit_errors = self.bit_errors;
        channel.reordered = self.reordered;
        channel.duplicated = self.duplicated;
        Ok(channel)
    }
}

/// Bits in a second, with k or M for thousands and millions.
fn rate(text: &str) -> Result<f64> {
    let (digits, factor) = match text.strip_suffix('M') {
        Some(digits) => (digits, 1e6),
        None => text.strip_suffix('k').map_or((text, 1.0), |digits| (digits, 1e3)),
    };
    let rate = digits.parse::<f64>()? * factor;
    if !(8.0..=1e12).contains(&rate) {
        bail!("a rate lies between 8 and 10^12 bits in a second");
    }
    Ok(rate)
}

/// A time in ms or s.
fn time(text: &str) -> Result<Duration> {
    let (digits, factor) = match text.strip_suffix("ms") {
        Some(digits) => (digits, 1e-3),
        None => (text.strip_suffix('s').context("a time ends in ms or s")?, 1.0),
    };
    let seconds = digits.parse::<f64>()? * factor;
    if !(0.0..=60.0).contains(&seconds) {
        bail!("a time lies between 0 and 60 s");
    }
    Ok(Duration::from_secs_f64(seconds))
}

/// A probability below 1.
fn part(text: &str) -> Result<f64> {
    let part = text.parse()?;
    if !(0.0..1.0).contains(&part) {
        bail!("a part is a number from 0 to below 1");
    }
    Ok(part)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn words_make_a_channel() {
        let channel = parse("loss=0.1,burst=8,rate=500k,rtt=60ms,jitter=0.01s,ber=1e-6").unwrap();
        assert_eq!(channel.loss, Loss::Bursts(GilbertElliott::bursts(0.1, 8.0).unwrap()));
        assert_eq!((channel.steps[0].rate, channel.round_trip.as_millis()), (62_500.0, 60));
        assert_eq!((channel.jitter.as_millis(), channel.bit_errors), (10, 1e-6));
        assert_eq!(parse("").unwrap().loss, Loss::Independent(0.0));
        assert!(parse("phone=3,rate=2M").unwrap().steps.len() > 100);
    }

    #[test]
    fn what_is_no_channel_is_refused() {
        for bad in [
            "loss",
            "loss=1",
            "loss=x",
            "speed=3",
            "rate=0",
            "rate=1G",
            "rtt=5",
            "ber=2",
            "burst=0.1",
            "phone=1,trace=x",
            "trace=/none",
            "loss=0.1,states=0",
            "loss=0.5,states=1/1",
        ] {
            assert!(parse(bad).is_err(), "{bad}");
        }
    }
}
