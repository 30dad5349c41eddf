//! A file as blocks, and the manifest that vouches for them: `spec/datagrams.md`, section 2.

use std::fmt;
use std::ops::Range;

use sha2::{Digest, Sha256};

use super::code::{MAX_BLOCK, MAX_SYMBOL};
use super::packet::Tag;
use super::quality::Quality;
use crate::container::{Header, Part, Reader, Supplement};
use crate::{Error, Limits, Result};

/// Bytes of the manifest before its entries.
const MANIFEST_HEAD: usize = 6;
/// Bytes of an entry: a block's length and the beginning of its digest.
const ENTRY: usize = 20;
/// Bytes that certainly hold a file's header.
const HEADER_ROOM: usize = (1 << 16) + 16;

/// What a file is, to the last bit: the SHA-256 of its opening block, which holds the digests of all others.
///
/// A receiver takes it from whom it trusts; whatever datagrams bring is measured by it.
#[derive(Clone, Copy, PartialEq, Eq, Hash)]
pub struct FileId(pub [u8; 32]);

impl FileId {
    pub(super) fn of(opening: &[u8]) -> FileId {
        FileId(Sha256::digest(opening).into())
    }

    /// The part of it that packets carry.
    pub(super) fn tag(&self) -> Tag {
        let [a, b, c, d, e, f, g, h, ..] = self.0;
        [a, b, c, d, e, f, g, h]
    }
}

impl fmt::Display for FileId {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        self.0.iter().try_for_each(|byte| write!(f, "{byte:02x}"))
    }
}

impl fmt::Debug for FileId {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        write!(f, "FileId({self})")
    }
}

/// The beginning of a block's digest.
type Check = [u8; 16];

fn check(block: &[u8]) -> Check {
    let mut check = Check::default();
    check.copy_from_slice(&Sha256::digest(block)[..16]);
    check
}

/// A file divided into blocks. Block 0 is the opening: the manifest and the first bytes of the file.
pub(super) struct Blocks {
    opening: Vec<u8>,
    /// Which bytes of the file each block after the opening holds: consecutive, none empty.
    ranges: Vec<Range<usize>>,
    /// What the file shows once each block and all before it are there.
    qualities: Vec<Quality>,
    /// The ends of the sections, and what the file shows up to there.
    stages: Vec<(u64, Quality)>,
}

impl Blocks {
    /// Divides a whole file. Blocks end where sections do, so that no section waits for another;
    /// sections that fit into one symbol together share a block, those too large for one are cut evenly.
    ///
    /// # Errors
    /// What is wrong with the file's header; [`Error::Truncated`] if the file is not whole;
    /// [`Error::Unsupported`] if it has more blocks than can be told.
    pub(super) fn cut(file: &[u8]) -> Result<Blocks> {
        let header = header(file)?;
        let ends: Vec<usize> = header.sections.iter().map(|section| section.end() as usize).collect();
        let start = header.sections.first().map_or(file.len(), |section| section.offset as usize);
        // As many sections open the file as share one symbol with the manifest.
        let heads = std::iter::once(start).chain(ends);
        let cuts = heads.clone().map(|head| (head, group(head, heads.clone())));
        let fits =
            |(head, ranges): &(usize, Vec<_>)| MANIFEST_HEAD + ENTRY * ranges.len() + head <= MAX_SYMBOL;
        let (head, ranges) =
            cuts.clone().rev().find(fits).or(cuts.clone().next()).unwrap_or((start, Vec::new()));
        let opening = opening(file, head, &ranges)?;
        let reached = std::iter::once(head).chain(ranges.iter().map(|range| range.end));
        let qualities = reached.map(|end| quality(&header, end as u64)).collect();
        let stages = header.sections.iter().map(|section| (section.end(), quality(&header, section.end())));
        let stages = stages.collect();
        Ok(Blocks { opening, ranges, qualities, stages })
    }

    pub(super) fn id(&self) -> FileId {
        FileId::of(&self.opening)
    }

    /// How many blocks there are, the opening among them.
    pub(super) fn count(&self) -> usize {
        1 + self.ranges.len()
    }

    /// What the file shows once `block` and all before it are there.
    pub(super) fn quality(&self, block: usize) -> Quality {
        self.qualities[block]
    }

    /// The ends of the file's sections, and what the file shows when it has arrived up to there.
    pub(super) fn stages(&self) -> &[(u64, Quality)] {
        &self.stages
    }

    /// The bytes of a block; `file` is the one that was divided.
    pub(super) fn bytes<'a>(&'a self, file: &'a [u8], block: usize) -> &'a [u8] {
        match block.checked_sub(1) {
            None => &self.opening,
            Some(i) => &file[self.ranges[i].clone()],
        }
    }
}

/// The header of a file that is as long as its header says.
fn header(file: &[u8]) -> Result<Header> {
    let mut reader = Reader::new(Limits { max_memory: u64::MAX });
    reader.push(&file[..file.len().min(HEADER_ROOM)]);
    let Some(header) = reader.header() else {
        reader.check()?;
        reader.finish()?;
        return Err(Error::format("header", "incomplete"));
    };
    let need = header.sections.iter().map(|section| section.end()).max().unwrap_or(0);
    match file.len() as u64 {
        have if have < need => Err(Error::Truncated { place: "file".into(), have, need }),
        have if have > need => Err(Error::format("end of file", "bytes follow the last section")),
        _ => Ok(header.clone()),
    }
}

/// The blocks after the first `head` bytes of a file whose sections end at `ends`, in order.
fn group(head: usize, ends: impl Iterator<Item = usize>) -> Vec<Range<usize>> {
    let mut blocks: Vec<Range<usize>> = Vec::new();
    let mut start = head;
    for end in ends.filter(|&end| end > head) {
        match blocks.last_mut() {
            Some(last) if end - last.start <= MAX_SYMBOL => last.end = end,
            _ => {
                let (length, parts) = (end - start, (end - start).div_ceil(MAX_BLOCK));
                blocks
                    .extend((0..parts).map(|i| start + length * i / parts..start + length * (i + 1) / parts));
            }
        }
        start = end;
    }
    blocks
}

/// Manifest and first bytes.
fn opening(file: &[u8], head: usize, ranges: &[Range<usize>]) -> Result<Vec<u8>> {
    let too_large = |_| Error::Unsupported("a file of more than 65535 blocks in datagrams".into());
    let mut out = Vec::new();
    out.extend(u16::try_from(ranges.len()).map_err(too_large)?.to_le_bytes());
    // A head that is longer than a symbol is a header, at most 64 KiB; a block is at most MAX_BLOCK.
    out.extend((head as u32).to_le_bytes());
    for range in ranges {
        out.extend((range.len() as u32).to_le_bytes());
        out.extend(check(&file[range.clone()]));
    }
    out.extend(&file[..head]);
    if out.len() > MAX_BLOCK {
        return Err(Error::Unsupported("a file whose manifest exceeds a block".into()));
    }
    Ok(out)
}

/// What the first `bytes` of a file show.
fn quality(header: &Header, bytes: u64) -> Quality {
    let optional = |part: Part| matches!(part, Part::Supplement(Supplement::Optional(_)));
    if header.sections.iter().all(|section| section.end() <= bytes || optional(section.part)) {
        return Quality::EXACT;
    }
    let levels = header.sections.iter().zip(&header.outline.levels);
    let levels = levels.take_while(|(section, _)| section.end() <= bytes);
    levels.last().map_or(Quality::NOTHING, |(_, level)| Quality::of_error(level.error.into()))
}

/// A manifest as a receiver knows it.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct Manifest {
    entries: Vec<(u32, Check)>,
}

impl Manifest {
    /// Takes an opening apart: the manifest and the first bytes of the file. `None` if it is malformed.
    pub(super) fn read(opening: &[u8]) -> Option<(Manifest, &[u8])> {
        let (count, rest) = opening.split_first_chunk()?;
        let (head, rest) = rest.split_first_chunk()?;
        let (entries, head_bytes) = rest.split_at_checked(ENTRY * usize::from(u16::from_le_bytes(*count)))?;
        let entries = entries.as_chunks::<ENTRY>().0.iter().map(|entry| {
            let (length, check) = entry.split_first_chunk()?;
            Some((u32::from_le_bytes(*length), check.try_into().ok()?))
        });
        let manifest = Manifest { entries: entries.collect::<Option<_>>()? };
        (head_bytes.len() == u32::from_le_bytes(*head) as usize).then_some((manifest, head_bytes))
    }

    /// How many blocks the file has, the opening among them.
    pub(super) fn count(&self) -> usize {
        1 + self.entries.len()
    }

    /// The length of a block after the opening.
    pub(super) fn length(&self, block: usize) -> Option<usize> {
        self.entries.get(block.checked_sub(1)?).map(|entry| entry.0 as usize)
    }

    /// Whether these are the bytes of a block after the opening.
    pub(super) fn vouches(&self, block: usize, bytes: &[u8]) -> bool {
        let entry = block.checked_sub(1).and_then(|i| self.entries.get(i));
        entry.is_some_and(|entry| entry.1 == check(bytes))
    }
}
