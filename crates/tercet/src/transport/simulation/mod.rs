//! Sessions over models of channels, by discrete events: what would a viewer have seen, and when?
//!
//! Symbols are counted, not computed: under Reed–Solomon any as many as a block has source symbols
//! restore it, under RaptorQ one more is needed in 1 of 100 cases, and so on (RFC 6330). Everything
//! is drawn from seeds: two runs with the same arguments are the same.

mod channel;
mod ordered;
mod recovery;
mod session;
mod summary;

#[cfg(test)]
mod tests;

pub use channel::{Channel, Loss, Step};
pub use ordered::ordered;
pub use session::session;
pub use summary::{Point, Summary, summarize};

use std::time::Duration;

use channel::Micros;

use super::Quality;

/// What one session came to.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Run {
    /// When the viewer saw something better, and what; in the order of time.
    steps: Vec<(Micros, Quality)>,
    /// When a datagram was sent, and how many bytes had been sent by then.
    sent: Vec<(Micros, u64)>,
}

impl Run {
    /// What the viewer sees at a time.
    pub fn quality(&self, at: Duration) -> Quality {
        let past = self.steps.partition_point(|step| step.0 <= channel::micros(at));
        past.checked_sub(1).map_or(Quality::NOTHING, |last| self.steps[last].1)
    }

    /// Bytes of datagrams sent by a time.
    pub fn bytes(&self, at: Duration) -> u64 {
        let past = self.sent.partition_point(|sent| sent.0 <= channel::micros(at));
        past.checked_sub(1).map_or(0, |last| self.sent[last].1)
    }

    /// When the first mesh was there.
    pub fn base(&self) -> Option<Duration> {
        self.steps.iter().find(|step| step.1 != Quality::NOTHING).map(|step| Duration::from_micros(step.0))
    }

    /// When the original was there.
    pub fn exact(&self) -> Option<Duration> {
        self.steps.last().filter(|step| step.1 == Quality::EXACT).map(|step| Duration::from_micros(step.0))
    }

    fn saw(&mut self, now: Micros, quality: Quality) {
        if quality < self.steps.last().map_or(Quality::NOTHING, |step| step.1) {
            self.steps.push((now, quality));
        }
    }

    fn count(&mut self, now: Micros, bytes: u32) {
        let before = self.sent.last().map_or(0, |sent| sent.1);
        self.sent.push((now, before + u64::from(bytes)));
    }
}
