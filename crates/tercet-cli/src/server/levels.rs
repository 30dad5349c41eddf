//! Where the levels of a file end: what the commands of a session refer to.

use bytes::Bytes;
use futures_util::TryStreamExt;
use tercet::{Decoder, Info, Limits};

use super::failure::Failure;
use super::rendition::Rendition;

/// More than the format lets a header be.
const MOST_HEADER: u64 = (1 << 16) + 64;

/// A file's header and what it says of the levels.
#[derive(Clone, Debug)]
pub struct Levels {
    /// The bytes before the first section.
    pub header: Bytes,
    /// The file's size.
    pub bytes: u64,
    /// Each level's end and error, coarsest first; the finest ends with the file.
    goals: Vec<(u64, f32)>,
    /// The end of the finest level's own section.
    finest: u64,
}

impl Levels {
    /// Reads the header of a file.
    ///
    /// # Errors
    /// [`Failure::Mesh`] if it is damaged.
    pub async fn read(rendition: &Rendition) -> Result<Levels, Failure> {
        let mut chunks = rendition.object.read(0..rendition.bytes().min(MOST_HEADER)).await?;
        let mut decoder = Decoder::new(Limits::default());
        let mut start = Vec::new();
        while let Some(chunk) = chunks.try_next().await? {
            start.extend_from_slice(&chunk);
            // Only the header: a level would be kept until it is decoded.
            decoder.push(&chunk);
            if let Some(info) = decoder.info() {
                return Ok(Levels::of(&info, start, rendition.bytes()));
            }
        }
        let damage = decoder.next_level().err().or_else(|| decoder.finish().err());
        Err(Failure::Mesh(damage.map_or("no header".into(), |error| error.to_string())))
    }

    /// `bytes` is what the file has, which may be less than its header announces.
    fn of(info: &Info, mut start: Vec<u8>, bytes: u64) -> Levels {
        start.truncate(info.header_bytes as usize);
        let mut goals: Vec<_> =
            info.levels.iter().map(|level| (level.bytes.min(bytes), level.error)).collect();
        let finest = goals.last().map_or(bytes, |&(end, _)| end);
        if let Some((end, _)) = goals.last_mut() {
            *end = bytes;
        }
        Levels { header: start.into(), bytes, goals, finest }
    }

    /// The first stop beyond a byte: a level's end or the file's.
    pub fn next(&self, byte: u64) -> u64 {
        let ends = self.goals.iter().map(|&(end, _)| end).chain([self.finest]);
        ends.filter(|&end| end > byte).min().unwrap_or(self.bytes)
    }

    /// What a level takes.
    pub fn level(&self, level: u32) -> Option<u64> {
        self.goals.get(level as usize).map(|&(end, _)| end)
    }

    /// What the coarsest level of at most this error takes; everything if there is none.
    pub fn until(&self, most: f32) -> u64 {
        let found = self.goals.iter().find(|&&(_, error)| most > 0.0 && error <= most);
        found.map_or(self.bytes, |&(end, _)| end)
    }
}
