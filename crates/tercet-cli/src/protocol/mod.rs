//! The messages of the command protocol and of sessions on WebTransport, for both of their ends;
//! `spec/transport.md` describes them.

mod command;
#[cfg(feature = "webtransport")]
mod control;
mod data;
mod hello;
mod offer;

pub use command::Command;
#[cfg(feature = "webtransport")]
pub use control::{Greeting, MOST_LINE, Open};
pub use data::{Data, MOST_BYTES};
pub use hello::Hello;
pub use offer::{CertificateHash, Offer, PATH};

/// The subprotocol's name.
pub const SUBPROTOCOL: &str = "tercet.1";
