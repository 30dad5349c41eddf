//! The messages of the command protocol, for both of its ends; `spec/transport.md` describes them.

mod command;
mod data;
mod hello;

pub use command::Command;
pub use data::{Data, MOST_BYTES};
pub use hello::Hello;

/// The subprotocol's name.
pub const SUBPROTOCOL: &str = "tercet.1";
