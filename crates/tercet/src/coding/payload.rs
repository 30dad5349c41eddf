//! The payload of a level: one stream of decisions, connectivity before positions.
//!
//! In front of a long one stands how far a reader must have come in it to decode the connectivity, so that
//! the positions can be decoded as they arrive.

use crate::{Error, Result};

/// Streams of more bytes are long.
const LONG: usize = 1 << 12;

/// Bytes of the field in front of a long stream.
const FIELD: usize = size_of::<u32>();

/// The payload of a `stream` in which a decoder of the connectivity reads `reach` bytes.
pub(crate) fn assemble(stream: Vec<u8>, reach: usize) -> Vec<u8> {
    if stream.len() <= LONG {
        return stream;
    }
    // A stream lacks the zero bytes at its end; a reach of 4 GiB is more than a section can have.
    let reach = u32::try_from(reach.min(stream.len())).unwrap_or(u32::MAX);
    [&reach.to_le_bytes(), &stream[..]].concat()
}

/// What is known of a payload before its stream is read.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Opening {
    /// Where the stream begins.
    pub stream: usize,
    /// Bytes of the stream that a decoder of the connectivity reads at most.
    pub reach: usize,
}

impl Opening {
    /// Of a payload of `length` bytes whose first are `bytes`; nothing if they are too few to tell.
    pub fn read(bytes: &[u8], length: u32) -> Option<Self> {
        let length = length as usize;
        if length <= LONG {
            return Some(Opening { stream: 0, reach: length });
        }
        let reach = u32::from_le_bytes(*bytes.first_chunk()?);
        Some(Opening { stream: FIELD, reach: (reach as usize).min(length - FIELD) })
    }

    /// Fails if a decoder has read `reached` bytes for the connectivity of a payload of `length` bytes, and
    /// was told that fewer would do.
    pub fn check(self, reached: usize, length: u32) -> Result<()> {
        if self.stream + self.reach < length as usize && reached > self.reach {
            let cause = format!("{reached} bytes of connectivity, {} were announced", self.reach);
            return Err(Error::format("level", cause));
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_long_streams_have_a_field() {
        let short = assemble(vec![7; LONG], 100);
        assert_eq!(short, vec![7; LONG]);
        assert_eq!(Opening::read(&[], LONG as u32), Some(Opening { stream: 0, reach: LONG }));
        let long = assemble(vec![7; LONG + 1], 100);
        let length = long.len() as u32;
        assert_eq!(length as usize, LONG + 1 + FIELD);
        assert_eq!(Opening::read(&long[..3], length), None);
        let opening = Opening::read(&long[..4], length).unwrap();
        assert_eq!(
            (opening, &long[opening.stream..]),
            (Opening { stream: 4, reach: 100 }, &[7; LONG + 1][..])
        );
        opening.check(100, length).unwrap();
        opening.check(101, length).unwrap_err();
    }

    #[test]
    fn a_reach_through_the_end_is_no_promise() {
        let payload = assemble(vec![7; 5000], 5008);
        let length = payload.len() as u32;
        let opening = Opening::read(&payload, length).unwrap();
        assert_eq!(opening.reach, 5000);
        opening.check(5008, length).unwrap();
    }
}
