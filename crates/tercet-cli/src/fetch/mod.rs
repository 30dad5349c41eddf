//! Getting a file from a server, level by level, in spite of what the network does.
//!
//! [`Transfer`] is the loop: ask for what is missing, keep it on disk, decode it as it comes, and
//! ask again after a failure. Where the bytes come from is the business of `http`, `ws` and `wt`, and
//! which of them, of `source`.

mod announce;
mod decoding;
mod fault;
mod http;
mod part;
mod refusal;
mod retry;
mod source;
mod wanted;
mod ws;
#[cfg(feature = "webtransport")]
mod wt;

use anyhow::Result;
use bytes::Bytes;
use futures_util::StreamExt;
use futures_util::stream::BoxStream;
use tercet::{Decoder, Info, Level, Limits};

pub use announce::Announcer;
pub use part::Part;
pub use retry::Retries;
pub use source::{Protocol, Source};
pub use wanted::Wanted;

use decoding::{Decoding, Outcome};
use fault::Fault;

/// Bytes of a file, as they come.
pub struct Opened {
    /// Where in the file they begin: where they were asked for, or 0.
    start: u64,
    /// The strong entity tag of the file, quotes included, if the server names one.
    tag: Option<String>,
    bytes: BoxStream<'static, Result<Arrived, Fault>>,
}

/// Bytes of a file that have arrived.
pub enum Arrived {
    /// The next ones.
    Next(Bytes),
    /// Some from a place on that is not reached yet. They are for looking only: they come again in their turn, if they
    /// are right.
    Ahead(u64, Bytes),
}

/// What a transfer came to.
pub struct Fetched {
    /// The best level that arrived, if one did, perhaps in part.
    pub best: Option<Level>,
    /// What the file says of itself, if its header arrived.
    pub info: Option<Info>,
    /// The bytes of the file that arrived.
    pub part: Part,
    /// Why not everything that was asked for is there.
    pub failure: Option<anyhow::Error>,
}

/// A file on its way.
pub struct Transfer {
    source: Source,
    wanted: Wanted,
    part: Part,
    limits: Limits,
    retries: Retries,
    announcer: Announcer,
    /// How many bytes there ever were: only more than these are progress.
    furthest: u64,
}

/// How far a transfer has come, beyond what its [`Part`] holds.
struct Progress {
    /// Reads the header, and is of no use after that.
    header: Decoder,
    info: Option<Info>,
    decoding: Decoding,
}

impl Progress {
    fn new(transfer: &Transfer) -> Self {
        Progress {
            header: Decoder::new(transfer.limits),
            info: None,
            decoding: Decoding::start(transfer.limits, transfer.announcer.clone()),
        }
    }

    /// Takes the file's bytes from `from` on, as far as they are wanted, and hands them to the
    /// decoder; the result is those. The decoder may end; then its result says why.
    async fn take(&mut self, mut bytes: Bytes, from: u64, wanted: &Wanted) -> Bytes {
        if self.info.is_none() {
            self.header.push(&bytes);
            self.info = self.header.info();
        }
        // What comes beyond would be decoded to a finer level than was asked for.
        let left = self.end(wanted).map_or(u64::MAX, |end| end.saturating_sub(from));
        bytes.truncate(usize::try_from(left).unwrap_or(usize::MAX));
        self.decoding.push(bytes.clone()).await;
        bytes
    }

    /// Looks at bytes that came before their turn, if they are wanted and there are levels that can make use of them.
    fn glimpse(&self, from: u64, bytes: Bytes, wanted: &Wanted) {
        let grouped = self.info.as_ref().is_some_and(|info| info.levels.iter().any(|level| level.grouped));
        if grouped && self.end(wanted).is_some_and(|end| from.saturating_add(bytes.len() as u64) <= end) {
            self.decoding.glimpse(from, bytes);
        }
    }

    /// Where the bytes that are wanted end, once the header says so.
    fn end(&self, wanted: &Wanted) -> Option<u64> {
        self.info.as_ref().map(|info| wanted.bytes(info))
    }
}

impl Transfer {
    /// A transfer of what is missing in `part`.
    pub fn new(
        source: Source,
        wanted: Wanted,
        part: Part,
        limits: Limits,
        retries: Retries,
        announcer: Announcer,
    ) -> Self {
        Transfer { source, wanted, part, limits, retries, announcer, furthest: 0 }
    }

    /// Gets what is wanted, or as much of it as can be had.
    ///
    /// # Errors
    /// If the disk fails. What the network or the server does wrong is in the result.
    pub async fn run(mut self) -> Result<Fetched> {
        let mut progress = self.resumed().await?;
        let mut damaged_before = None;
        let failure = loop {
            let mut fault = self.attempt(&mut progress).await.err();
            // A decoder that has ended early has found the bytes to be damaged.
            if fault.is_none() || progress.decoding.has_ended() {
                let info = progress.info.take();
                let mut outcome = progress.decoding.finish().await;
                let Some(damage) = outcome.damage.take() else {
                    return Ok(self.ended(outcome, info, None));
                };
                let sound = outcome.best.as_ref().map(|level| level.level);
                if damaged_before == Some(sound) {
                    let failure = damage.context("damaged twice in the same place");
                    return Ok(self.ended(outcome, info, Some(failure)));
                }
                damaged_before = Some(sound);
                self.part.truncate(sound_bytes(&outcome.best, info.as_ref()))?;
                progress = self.resumed().await?;
                fault = Some(Fault::transient(damage));
            }
            match fault {
                Some(Fault::Replaced) => {
                    self.announcer.warn("the file was replaced: beginning again");
                    self.part.truncate(0)?;
                    self.part.set_tag(None)?;
                    self.announcer.forget();
                    progress = self.resumed().await?;
                    if !self.retries.again(None).await {
                        break anyhow::anyhow!("it is replaced again and again");
                    }
                }
                Some(Fault::Transient { cause, wait }) => {
                    if !self.retries.are_left() {
                        break cause;
                    }
                    self.announcer.warn(&format!("{cause:#}; trying again"));
                    self.retries.again(wait).await;
                }
                Some(Fault::Fatal(cause)) => break cause,
                None => {}
            }
        };
        let info = progress.info.take();
        let outcome = progress.decoding.finish().await;
        Ok(self.ended(outcome, info, Some(failure)))
    }

    /// What the transfer came to. A level that is there in part is finer than the best whole one.
    fn ended(self, outcome: Outcome, info: Option<Info>, failure: Option<anyhow::Error>) -> Fetched {
        Fetched { best: outcome.preview.or(outcome.best), info, part: self.part, failure }
    }

    /// A decoder that has seen what is there already.
    async fn resumed(&mut self) -> Result<Progress> {
        let mut progress = Progress::new(self);
        let mut from = 0;
        while let Some(bytes) = self.part.read(from)? {
            let start = from;
            from += bytes.len() as u64;
            progress.take(bytes, start, &self.wanted).await;
        }
        Ok(progress)
    }

    /// Asks for what is missing, once or, where the header had to come first, twice.
    async fn attempt(&mut self, progress: &mut Progress) -> Result<(), Fault> {
        loop {
            let end = progress.end(&self.wanted);
            let from = self.part.bytes();
            if end.is_some_and(|end| from >= end) || progress.decoding.has_ended() {
                return Ok(());
            }
            let opened = self.source.open(from, self.part.tag(), &self.wanted, end).await?;
            if self.receive(opened, progress).await? == from {
                return Err(Fault::transient(anyhow::anyhow!("the server sent nothing")));
            }
        }
    }

    /// Takes bytes until there are enough or no more; the result is how many there are.
    async fn receive(&mut self, mut opened: Opened, progress: &mut Progress) -> Result<u64, Fault> {
        let from = self.part.bytes();
        if opened.start != from || self.part.tag().is_some_and(|tag| opened.tag.as_deref() != Some(tag)) {
            if opened.start != 0 {
                return Err(Fault::Replaced);
            }
            // All of it comes again: either the file is another one, or the server knows no ranges.
            self.part.truncate(0)?;
            if self.part.tag() != opened.tag.as_deref() {
                self.announcer.forget();
            }
            *progress = Progress::new(self);
        }
        self.part.set_tag(opened.tag)?;
        while let Some(arrived) = opened.bytes.next().await {
            match arrived? {
                Arrived::Next(bytes) => self.keep(bytes, progress).await?,
                Arrived::Ahead(from, bytes) => progress.glimpse(from, bytes, &self.wanted),
            }
            let end = progress.end(&self.wanted);
            if end.is_some_and(|end| self.part.bytes() >= end) || progress.decoding.has_ended() {
                break;
            }
        }
        Ok(self.part.bytes())
    }

    /// Takes the file's next bytes, as far as they are wanted.
    async fn keep(&mut self, bytes: Bytes, progress: &mut Progress) -> Result<(), Fault> {
        let bytes = progress.take(bytes, self.part.bytes(), &self.wanted).await;
        self.part.append(&bytes)?;
        if self.part.bytes() > self.furthest {
            self.furthest = self.part.bytes();
            self.retries.reset();
        }
        self.announcer.progress(self.part.bytes(), progress.end(&self.wanted).unwrap_or_default());
        Ok(())
    }
}

/// Where the sound bytes end: behind the last level that could be decoded.
fn sound_bytes(best: &Option<Level>, info: Option<&Info>) -> u64 {
    match (best, info) {
        (Some(level), Some(info)) => info.levels.get(level.level as usize).map_or(0, |level| level.bytes),
        (None, Some(info)) => info.header_bytes,
        _ => 0,
    }
}
