//! Decoding on a thread of its own, so that the network need not wait for it.

use bytes::Bytes;
use tercet::{Decoder, Level, Limits};
use tokio::sync::mpsc;
use tokio::task::{JoinHandle, spawn_blocking};

use super::Arrived;
use super::announce::Announcer;

/// Pieces of the file, each some ten kilobytes, that may wait for the decoder.
const WAITING: usize = 64;

/// What came of the bytes.
#[derive(Default)]
pub struct Outcome {
    /// The best level that is there as a whole.
    pub best: Option<Level>,
    /// The next one, as far as it is there.
    pub preview: Option<Level>,
    /// What is wrong with the bytes behind them.
    pub damage: Option<anyhow::Error>,
}

/// A decoder that is fed from one side and announces levels at the other.
pub struct Decoding {
    pieces: mpsc::Sender<Arrived>,
    thread: JoinHandle<Outcome>,
}

impl Decoding {
    pub fn start(limits: Limits, announcer: Announcer) -> Self {
        let (pieces, waiting) = mpsc::channel(WAITING);
        Decoding { pieces, thread: spawn_blocking(move || decode(limits, waiting, &announcer)) }
    }

    /// Hands over the file's next bytes; waits while too many wait already.
    pub async fn push(&self, bytes: Bytes) {
        // A decoder that has ended needs no more bytes: its outcome says why.
        let _ = self.pieces.send(Arrived::Next(bytes)).await;
    }

    /// Hands over bytes that came before their turn, unless too many wait already: they are for looking only.
    pub fn glimpse(&self, from: u64, bytes: Bytes) {
        let _ = self.pieces.try_send(Arrived::Ahead(from, bytes));
    }

    /// Whether the decoder has found that the bytes are damaged.
    pub fn has_ended(&self) -> bool {
        self.pieces.is_closed()
    }

    /// Waits until all bytes are decoded.
    pub async fn finish(self) -> Outcome {
        drop(self.pieces);
        self.thread.await.unwrap_or_else(|error| Outcome { damage: Some(error.into()), ..Outcome::default() })
    }
}

fn decode(limits: Limits, mut waiting: mpsc::Receiver<Arrived>, announcer: &Announcer) -> Outcome {
    let mut decoder = Decoder::new(limits);
    let mut best = None;
    while let Some(piece) = waiting.blocking_recv() {
        match piece {
            Arrived::Next(bytes) => decoder.push(&bytes),
            Arrived::Ahead(from, bytes) => {
                if decoder.glimpse(from, &bytes) > 0 {
                    announcer.preview(|| decoder.preview());
                }
                continue;
            }
        }
        loop {
            match decoder.next_level() {
                Ok(Some(level)) => {
                    if let Some(info) = decoder.info() {
                        announcer.level(&level, &info);
                    }
                    best = Some(level);
                }
                Ok(None) => break,
                Err(damage) => {
                    let preview = decoder.preview();
                    return Outcome { best, preview, damage: Some(damage.into()) };
                }
            }
        }
    }
    Outcome { best, preview: decoder.preview(), damage: None }
}
