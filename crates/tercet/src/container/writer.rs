//! Assembling a file.

use super::checksum::checksum;
use super::piece::{self, stored_length};
#[cfg(feature = "remesh")]
use super::{Approximation, Reader, round_error_up};
use super::{CRC_BYTES, MAGIC, MAX_HEADER, Outline, VERSION, varint};
#[cfg(feature = "remesh")]
use crate::Limits;
use crate::{Error, Result};

/// A whole file: the header made from `outline`, then `payloads`, one for each of its
/// levels and one for each of its supplements, in this order.
///
/// Takes time and memory linear in the payloads.
///
/// # Errors
/// [`Error::Format`] if `outline` breaks a rule of the format, [`Error::Limit`] if a
/// payload or the header is larger than the format allows.
///
/// # Panics
/// If the number of payloads is not that of the sections.
pub(crate) fn write(outline: &Outline, payloads: &[Vec<u8>]) -> Result<Vec<u8>> {
    assert_eq!(payloads.len(), outline.levels.len() + outline.supplements.len(), "one payload a section");
    outline.check()?;
    let mut extents = Vec::with_capacity(payloads.len());
    let in_pieces = |section: usize| !outline.levels.get(section).is_some_and(|level| level.grouped);
    for (i, payload) in payloads.iter().enumerate() {
        let length = if in_pieces(i) { stored_length(payload.len()) } else { payload.len() };
        let length =
            u32::try_from(length).map_err(|_| too_large("bytes of a section", length, u32::MAX.into()))?;
        extents.push((length, checksum(payload)));
    }
    let header = outline.write(&extents);
    if header.len() as u64 > MAX_HEADER {
        return Err(too_large("bytes of the header", header.len(), MAX_HEADER));
    }

    let total: usize = extents.iter().map(|extent| extent.0 as usize).sum();
    let mut out = Vec::with_capacity(MAGIC.len() + 1 + 5 + header.len() + CRC_BYTES + total);
    out.extend(MAGIC);
    out.push(VERSION);
    varint::write(&mut out, header.len() as u64);
    out.extend(header);
    out.extend(checksum(&out).to_le_bytes());
    for (i, payload) in payloads.iter().enumerate() {
        if in_pieces(i) {
            piece::write(payload, &mut out);
        } else {
            out.extend(payload);
        }
    }
    Ok(out)
}

/// The file with the mark of a lossy one. The errors of its levels, which were against the mesh that it
/// holds, grow by that mesh's own: so they hold against the source.
///
/// # Errors
/// What is wrong with `file`.
#[cfg(feature = "remesh")]
pub(crate) fn mark(file: &[u8], approximation: Approximation) -> Result<Vec<u8>> {
    let mut reader = Reader::new(Limits { max_memory: u64::MAX });
    reader.push(file);
    let mut payloads = Vec::new();
    while let Some((_, payload)) = reader.take() {
        payloads.push(payload);
    }
    reader.finish()?;
    let header = reader.header().ok_or_else(|| Error::format("header", "incomplete"))?;
    let mut outline = header.outline.clone();
    for level in &mut outline.levels {
        level.error = round_error_up(level.error + approximation.rms);
    }
    outline.approximation = Some(approximation);
    write(&outline, &payloads)
}

fn too_large(what: &'static str, needed: usize, allowed: u64) -> Error {
    Error::Limit { what, needed: needed as u64, allowed }
}
