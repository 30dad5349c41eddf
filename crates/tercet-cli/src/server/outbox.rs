//! What a session still has to send.

use std::fmt;
use std::sync::Arc;

use axum::extract::ws::close_code;
use bytes::Bytes;
use futures_util::TryStreamExt;
use futures_util::stream::BoxStream;

use super::failure::Failure;
use super::levels::Levels;
use super::metrics::Metrics;
use super::rendition::Rendition;
use crate::protocol::{Command, Data, MOST_BYTES};

/// Why the server ends a session.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Refusal {
    /// A message that is no command.
    Usage,
    /// A level or byte that the file has not.
    Range,
    /// The file is another one.
    Replaced,
    /// Nothing was asked for.
    Idle,
    /// The server stops.
    Stopping,
    /// The file cannot be read.
    Store,
}

impl Refusal {
    /// The word for programs.
    pub fn code(self) -> &'static str {
        match self {
            Refusal::Usage => "usage",
            Refusal::Range => "range",
            Refusal::Replaced => "replaced",
            Refusal::Idle => "idle",
            Refusal::Stopping => "stopping",
            Refusal::Store => "store",
        }
    }

    /// The status with which the WebSocket is closed.
    pub fn status(self) -> u16 {
        match self {
            Refusal::Usage | Refusal::Range | Refusal::Replaced => close_code::POLICY,
            Refusal::Idle | Refusal::Stopping => close_code::AWAY,
            Refusal::Store => close_code::ERROR,
        }
    }
}

/// The words for people.
impl fmt::Display for Refusal {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Refusal::Usage => "that is no command",
            Refusal::Range => "the file has no such level or byte",
            Refusal::Replaced => "the file was replaced",
            Refusal::Idle => "nothing was asked for",
            Refusal::Stopping => "the server stops",
            Refusal::Store => "the file cannot be read",
        })
    }
}

/// A file, how much of it was sent, and how much is asked for.
///
/// Holds one chunk of the store's, and the stream that it came from.
pub struct Outbox {
    rendition: Rendition,
    levels: Levels,
    /// The next byte to send; not beyond `goal`.
    position: u64,
    /// Where to stop.
    goal: u64,
    paused: bool,
    /// Whether a goal was set and not yet said to be reached.
    announce: bool,
    /// Bytes from `position` on that were read and not sent.
    chunk: Bytes,
    /// What follows `chunk`.
    source: Option<BoxStream<'static, Result<Bytes, Failure>>>,
    metrics: Arc<Metrics>,
}

impl Outbox {
    pub fn new(rendition: Rendition, levels: Levels, metrics: Arc<Metrics>) -> Self {
        let start = levels.header.len() as u64;
        Outbox {
            rendition,
            levels,
            position: start,
            goal: start,
            paused: false,
            announce: false,
            chunk: Bytes::new(),
            source: None,
            metrics,
        }
    }

    /// The header, which is sent first.
    pub fn header(&self) -> Vec<Data> {
        let parts = self.levels.header.chunks(MOST_BYTES).zip((0..).step_by(MOST_BYTES));
        parts.map(|(part, offset)| Data { offset, bytes: Bytes::copy_from_slice(part) }).collect()
    }

    /// Whether there is something to send.
    pub fn is_busy(&self) -> bool {
        !self.paused && self.position < self.goal
    }

    /// The position, once for each goal that was reached.
    pub fn reached(&mut self) -> Option<u64> {
        let reached = self.position == self.goal && std::mem::take(&mut self.announce);
        reached.then_some(self.position)
    }

    /// Carries out a command.
    ///
    /// # Errors
    /// [`Refusal::Range`] or [`Refusal::Replaced`], which end the session.
    pub fn obey(&mut self, command: Command) -> Result<(), Refusal> {
        match command {
            Command::Next => self.raise(self.levels.next(self.goal)),
            Command::Level(level) => self.raise(self.levels.level(level).ok_or(Refusal::Range)?),
            Command::Until(error) => self.raise(self.levels.until(error)),
            Command::Pause => self.paused = true,
            Command::Resume => self.paused = false,
            Command::Cancel => {
                self.goal = self.position;
                self.announce = true;
            }
            Command::From(byte, digest) => {
                if digest.is_some_and(|digest| digest != self.rendition.digest.as_str()) {
                    return Err(Refusal::Replaced);
                }
                if byte > self.levels.bytes {
                    return Err(Refusal::Range);
                }
                (self.position, self.goal, self.announce) = (byte, byte, false);
                (self.chunk, self.source) = (Bytes::new(), None);
            }
        }
        Ok(())
    }

    fn raise(&mut self, goal: u64) {
        self.goal = self.goal.max(goal);
        self.announce = true;
    }

    /// The next message's worth of bytes; waits for the store. To be called while there is
    /// something to send.
    ///
    /// # Errors
    /// [`Refusal::Replaced`] or [`Refusal::Store`].
    pub async fn next(&mut self) -> Result<Data, Refusal> {
        while self.chunk.is_empty() {
            self.chunk = self.read().await.map_err(|failure| match failure {
                Failure::Replaced | Failure::NotFound => Refusal::Replaced,
                other => {
                    tracing::error!(failure = %other, "session");
                    Refusal::Store
                }
            })?;
        }
        let wanted = (self.goal - self.position).min(MOST_BYTES as u64) as usize;
        let bytes = self.chunk.split_to(wanted.min(self.chunk.len()));
        let data = Data { offset: self.position, bytes };
        self.position += data.bytes.len() as u64;
        self.metrics.sent(data.bytes.len());
        Ok(data)
    }

    /// The next chunk; opens a stream to the present goal where the last one has ended.
    async fn read(&mut self) -> Result<Bytes, Failure> {
        if let Some(source) = &mut self.source {
            if let Some(chunk) = source.try_next().await? {
                return Ok(chunk);
            }
            self.source = None;
        }
        let source = self.source.insert(self.rendition.object.read(self.position..self.goal).await?);
        // A store that ends early has lost a part of the file.
        source.try_next().await?.ok_or(Failure::Replaced)
    }
}
