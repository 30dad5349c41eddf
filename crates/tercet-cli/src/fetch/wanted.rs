//! How much of a file is wanted.

use tercet::Info;

use crate::args::Goal;

/// How much of a file is wanted.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Wanted {
    Everything,
    /// Everything through a level; of the finest one, all that restores it.
    Level(u32),
    /// Everything through the coarsest level of at most this error.
    Error(f32),
    /// The best level within as many bytes.
    Bytes(u64),
}

impl Wanted {
    pub fn new(goal: &Goal) -> Self {
        match *goal {
            Goal { level: Some(level), .. } => Wanted::Level(level),
            Goal { max_error: Some(error), .. } => Wanted::Error(error),
            Goal { bytes: Some(bytes), .. } => Wanted::Bytes(bytes),
            _ => Wanted::Everything,
        }
    }

    /// How many of the file's first bytes that takes.
    pub fn bytes(&self, info: &Info) -> u64 {
        // The finest level is the original once everything has arrived.
        let coarser = &info.levels[..info.levels.len().saturating_sub(1)];
        let found = match *self {
            Wanted::Everything => None,
            // There is no such level, which the header tells: no need to get all the others.
            Wanted::Level(level) if level as usize >= info.levels.len() => return info.header_bytes,
            Wanted::Level(level) => coarser.get(level as usize),
            Wanted::Error(most) => coarser.iter().find(|level| level.error <= most),
            Wanted::Bytes(most) if most >= info.bytes => None,
            Wanted::Bytes(most) => {
                return info
                    .levels
                    .iter()
                    .map(|level| level.bytes)
                    .filter(|&end| end <= most)
                    .max()
                    .unwrap_or(0);
            }
        };
        found.map_or(info.bytes, |level| level.bytes)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use tercet::{EncodeOptions, encode, shapes};

    #[test]
    fn bytes_end_where_levels_end() {
        let info = encode(&shapes::scan(1000, 1), &EncodeOptions::default()).unwrap().info;
        let ends: Vec<u64> = info.levels.iter().map(|level| level.bytes).collect();
        let finest = ends.len() - 1;
        assert!(finest > 2 && ends[finest] < info.bytes);
        for (wanted, bytes) in [
            (Wanted::Everything, info.bytes),
            (Wanted::Level(0), ends[0]),
            (Wanted::Level(2), ends[2]),
            (Wanted::Level(finest as u32), info.bytes),
            (Wanted::Level(finest as u32 + 1), info.header_bytes),
            (Wanted::Error(info.levels[1].error), ends[1]),
            (Wanted::Error(0.0), info.bytes),
            (Wanted::Bytes(ends[1] + 1), ends[1]),
            (Wanted::Bytes(info.bytes - 1), ends[finest]),
            (Wanted::Bytes(info.bytes), info.bytes),
            (Wanted::Bytes(10), 0),
        ] {
            assert_eq!(wanted.bytes(&info), bytes, "{wanted:?}");
        }
    }
}
