//! A file over datagrams that may be lost: erasure codes, unequal protection, hybrid ARQ.
//!
//! Knows no sockets and no clock. A [`Source`] divides a file into blocks; a [`Sender`] says which
//! datagram to send next, by a plan that makes the expected quality of what is shown largest; a
//! [`Receiver`] takes datagrams in any order, complete or not, and gives out verified bytes, which a
//! [`Decoder`](crate::Decoder) takes; its [`Report`]s tell the sender what is missing. The bytes are
//! described in `spec/datagrams.md`. [`simulation`] holds models of channels to try all this on.
//!
//! ```
//! use std::{sync::Arc, time::Duration};
//! use tercet::transport::{Conditions, GilbertElliott, Goal, Objective, Receiver, Sender, Settings};
//! use tercet::transport::{Source, Strategy};
//! use tercet::{EncodeOptions, Limits, encode, shapes};
//!
//! let file = encode(&shapes::torus(40, 20), &EncodeOptions::default())?.bytes;
//! let source = Arc::new(Source::new(file.clone())?);
//! let mut receiver = Receiver::new(source.id(), Limits::default());
//! let conditions = Conditions {
//!     loss: GilbertElliott::independent(0.25)?,
//!     rate: 125_000.0,
//!     round_trip: Duration::from_millis(100),
//! };
//! let settings = Settings {
//!     strategy: Strategy::Optimal,
//!     objective: Objective::Psnr,
//!     goal: Goal::Anytime,
//!     conditions,
//! };
//! let mut sender = Sender::new(source, settings);
//!
//! let mut received = Vec::new();
//! for tick in 0.. {
//!     let now = Duration::from_millis(10 * tick);
//!     if let Some(datagram) = sender.next_packet(now)
//!         && tick % 4 != 0
//!     {
//!         receiver.push(&datagram);
//!     }
//!     while let Some(bytes) = receiver.take() {
//!         received.extend(bytes);
//!     }
//!     sender.report(&receiver.report().write(), now);
//!     if sender.is_done() {
//!         break;
//!     }
//! }
//! assert_eq!(received, file);
//! # Ok::<(), tercet::Error>(())
//! ```

mod blocks;
mod code;
mod cover;
mod loss;
mod pace;
mod packet;
mod plan;
mod pool;
mod quality;
mod receiver;
mod report;
mod schedule;
mod sender;
pub mod simulation;

#[cfg(test)]
mod tests;

pub use blocks::FileId;
pub use loss::GilbertElliott;
pub use packet::MAX_DATAGRAM;
pub use plan::Strategy;
pub use quality::{Objective, Quality};
pub use receiver::{Received, Receiver};
pub use report::{Progress, Report};
pub use schedule::{Conditions, Goal, Settings};
pub use sender::{Sender, Source};
