//! The `.tct` file: magic, header with an index of all sections, sections.
//!
//! The container knows no triangles. It says how many bytes each level takes, what a
//! level promises and whether its bytes arrived unharmed; what the bytes mean is the
//! business of the coding. `spec/format.md` describes every field.

mod approximation;
mod checksum;
mod fields;
mod groups;
mod header;
mod piece;
mod precision;
mod reader;
mod section;
mod varint;
mod writer;

#[cfg(test)]
mod tests;

pub use approximation::Approximation;
#[cfg(feature = "transport")]
pub(crate) use checksum::checksum;
pub(crate) use groups::{Groups, MOST_IN_GROUP, join as join_groups};
pub(crate) use header::{Header, MOST_STREAMS, Outline};

pub(crate) use reader::Reader;
pub(crate) use section::{LevelEntry, LevelKind, Part, Section, Supplement, UpdateRule, round_error_up};
#[cfg(feature = "remesh")]
pub(crate) use writer::mark;
pub(crate) use writer::write;

use crate::Error;

/// The first bytes of a file. The first has its high bit set, so that no text begins like this.
const MAGIC: [u8; 4] = [0x8A, b'T', b'C', b'T'];
/// The version of the format that this build writes and reads.
pub const VERSION: u8 = 11;
/// Most bytes that a header may take: thousands of sections, yet nothing to hold in memory.
const MAX_HEADER: u64 = 1 << 16;
/// Bytes of the CRC-32 after the header.
const CRC_BYTES: usize = 4;

/// A feature that this version of the format leaves to later ones.
fn unsupported(feature: impl std::fmt::Display) -> Error {
    Error::Unsupported(format!("header: this version of tercet does not know {feature}"))
}
