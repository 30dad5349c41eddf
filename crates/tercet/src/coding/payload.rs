//! The payload of a pass over positions: one stream of decisions, connectivity before positions, and a
//! further one for each region of the pass beyond the first.
//!
//! In front of several stand their lengths; in front of a long one, how far a reader must have come in it
//! to decode the connectivity, so that the positions can be decoded as they arrive.

use crate::{Error, Result};
use std::iter::once;
use std::ops::Range;

/// Streams of more bytes are long.
const LONG: usize = 1 << 12;

/// Bytes of a field in front of the streams.
const FIELD: usize = size_of::<u32>();

/// The payload of some `streams`, in whose first a decoder of the connectivity reads `reach` bytes.
pub(crate) fn assemble(mut streams: Vec<Vec<u8>>, reach: usize) -> Vec<u8> {
    if streams.len() == 1 && streams[0].len() <= LONG {
        return streams.remove(0);
    }
    // A stream lacks the zero bytes at its end; a reach of 4 GiB is more than a section can have.
    let last = streams.len() - 1;
    let fields = [reach.min(streams[0].len())].into_iter().chain(streams[..last].iter().map(Vec::len));
    let fields = fields.flat_map(|field| u32::try_from(field).unwrap_or(u32::MAX).to_le_bytes());
    fields.chain(streams.iter().flatten().copied()).collect()
}

/// What is known of a payload before its streams are read.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Opening {
    /// Where the streams lie.
    pub streams: Vec<Range<usize>>,
    /// Bytes of the first one that a decoder of the connectivity reads at most.
    pub reach: usize,
}

impl Opening {
    /// Of a payload of `length` bytes, whose first are `bytes`, with `count` streams; nothing if the bytes are
    /// too few to tell.
    ///
    /// # Errors
    /// If the streams are longer than the payload.
    pub fn read(bytes: &[u8], length: u32, count: u32) -> Result<Option<Self>> {
        let (length, count) = (length as usize, count as usize);
        if count == 1 && length <= LONG {
            return Ok(Some(Opening { streams: once(0..length).collect(), reach: length }));
        }
        let Some(head) = bytes.get(..count * FIELD) else {
            return if length < count * FIELD { Err(too_short()) } else { Ok(None) };
        };
        let mut fields =
            head.chunks_exact(FIELD).map(|x| u32::from_le_bytes([x[0], x[1], x[2], x[3]]) as usize);
        let reach = fields.next().unwrap_or(0);
        let mut streams = Vec::with_capacity(count);
        let mut start = head.len();
        for field in fields {
            let end = start.checked_add(field).filter(|&end| end <= length).ok_or_else(too_short)?;
            streams.push(start..end);
            start = end;
        }
        streams.push(start..length);
        let reach = reach.min(streams[0].len());
        Ok(Some(Opening { streams, reach }))
    }

    /// Fails if a decoder has read `reached` bytes for the connectivity, and was told that fewer would do.
    pub fn check(&self, reached: usize) -> Result<()> {
        if self.reach < self.streams[0].len() && reached > self.reach {
            let cause = format!("{reached} bytes of connectivity, {} were announced", self.reach);
            return Err(Error::format("level", cause));
        }
        Ok(())
    }
}

fn too_short() -> Error {
    Error::format("level", "its streams are longer than it")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_long_streams_have_a_field() {
        let short = assemble(vec![vec![7; LONG]], 100);
        assert_eq!(short, vec![7; LONG]);
        let opening = Opening::read(&[], LONG as u32, 1).unwrap();
        assert_eq!(opening, Some(Opening { streams: once(0..LONG).collect(), reach: LONG }));
        let long = assemble(vec![vec![7; LONG + 1]], 100);
        let length = long.len() as u32;
        assert_eq!(length as usize, LONG + 1 + FIELD);
        assert_eq!(Opening::read(&long[..3], length, 1).unwrap(), None);
        let opening = Opening::read(&long[..4], length, 1).unwrap().unwrap();
        assert_eq!(opening, Opening { streams: once(4..LONG + 5).collect(), reach: 100 });
        opening.check(100).unwrap();
        opening.check(101).unwrap_err();
    }

    #[test]
    fn a_reach_through_the_end_is_no_promise() {
        let payload = assemble(vec![vec![7; 5000]], 5008);
        let opening = Opening::read(&payload, payload.len() as u32, 1).unwrap().unwrap();
        assert_eq!(opening.reach, 5000);
        opening.check(5008).unwrap();
    }

    #[test]
    fn several_streams_have_their_lengths_in_front() {
        let payload = assemble(vec![vec![1; 30], vec![], vec![3; 20]], 10);
        let length = payload.len() as u32;
        assert_eq!(payload[..12], [10, 0, 0, 0, 30, 0, 0, 0, 0, 0, 0, 0]);
        let opening = Opening::read(&payload[..12], length, 3).unwrap().unwrap();
        assert_eq!(opening, Opening { streams: vec![12..42, 42..42, 42..62], reach: 10 });
        assert_eq!(Opening::read(&payload[..11], length, 3).unwrap(), None);
        // One that ends behind the payload, and fields that do.
        Opening::read(&payload[..12], 41, 3).unwrap_err();
        Opening::read(&payload[..11], 11, 3).unwrap_err();
    }
}
