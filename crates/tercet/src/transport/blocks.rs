//! A file as blocks, and the manifest that vouches for them: `spec/datagrams.md`, section 2.

use std::fmt;
use std::ops::Range;
use std::str::FromStr;

use sha2::{Digest, Sha256};

use super::code::{Code, MAX_BLOCK, MAX_SYMBOL};
use super::packet::Tag;
use super::quality::Quality;
use crate::container::{Groups, Header, Part, Reader, Section, Supplement};
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

/// From 64 hexadecimal digits, as it is displayed.
impl FromStr for FileId {
    type Err = Error;

    fn from_str(text: &str) -> Result<FileId> {
        let mut bytes = [0; 32];
        let digit = |digit: u8| char::from(digit).to_digit(16);
        let (pairs, rest) = text.as_bytes().as_chunks();
        if pairs.len() != bytes.len() || !rest.is_empty() {
            return Err(Error::format("file identity", "not of 64 digits"));
        }
        for (byte, &[high, low]) in bytes.iter_mut().zip(pairs) {
            let value = digit(high).zip(digit(low)).map(|(high, low)| 16 * high + low);
            // Two digits make a byte.
            *byte = value.ok_or(Error::format("file identity", "a digit that is not hexadecimal"))? as u8;
        }
        Ok(FileId(bytes))
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
    /// Of each block that is of use in part, which part of a level it is.
    holes: Vec<Option<Holes>>,
    /// The ends of the sections and groups, and what the file shows up to there.
    stages: Vec<(u64, Quality)>,
}

impl Blocks {
    /// Divides a whole file. Blocks end where sections do, so that no section waits for another;
    /// sections that fit into one symbol together share a block, those too large for one are cut evenly. The groups
    /// of a level have blocks of their own, of which each is a symbol.
    ///
    /// # Errors
    /// What is wrong with the file's header; [`Error::Truncated`] if the file is not whole;
    /// [`Error::Unsupported`] if it has more blocks than can be told.
    pub(super) fn cut(file: &[u8]) -> Result<Blocks> {
        let header = header(file)?;
        let grouped = grouped(&header, file);
        let mut ends: Vec<End> =
            header.sections.iter().map(|section| End::of(section.end() as usize)).collect();
        for level in &grouped {
            ends.push(End::of(level.start));
            ends.iter_mut().filter(|end| end.place == level.end).for_each(|end| end.unit = level.size);
        }
        ends.sort_by_key(|end| end.place);
        let start = header.sections.first().map_or(file.len(), |section| section.offset as usize);
        // As many sections open the file as share one symbol with the manifest.
        let heads = std::iter::once(End::of(start)).chain(ends);
        let cuts = heads.clone().map(|head| (head.place, group(head.place, heads.clone())));
        let fits =
            |(head, ranges): &(usize, Vec<_>)| MANIFEST_HEAD + ENTRY * ranges.len() + head <= MAX_SYMBOL;
        let (head, ranges) =
            cuts.clone().rev().find(fits).or(cuts.clone().next()).unwrap_or((start, Vec::new()));
        let opening = opening(file, head, &ranges)?;
        let reached = std::iter::once(head).chain(ranges.iter().map(|range| range.end));
        let qualities = reached.map(|end| quality(&header, end as u64)).collect();
        let of_block = |range: &Range<usize>| grouped.iter().find_map(|level| level.holes(range));
        let holes = std::iter::once(None).chain(ranges.iter().map(of_block)).collect();
        let sections = header.sections.iter().map(|section| (section.end(), quality(&header, section.end())));
        let mut stages: Vec<_> = sections.chain(grouped.iter().flat_map(Grouped::stages)).collect();
        stages.sort_by_key(|stage| stage.0);
        Ok(Blocks { opening, ranges, qualities, holes, stages })
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

    /// What the file shows once all before `block` is there, and so many of its source symbols, if it shows more than
    /// without them.
    pub(super) fn in_part(&self, block: usize, symbols: usize) -> Option<Quality> {
        self.holes.get(block)?.map(|holes| holes.quality(symbols))
    }

    /// The ends of the file's sections and groups, and what the file shows when it has arrived up to there.
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

/// Where a section, or the head of one in groups, ends.
#[derive(Clone, Copy)]
struct End {
    place: usize,
    /// Bytes that shall not be divided.
    unit: usize,
}

impl End {
    fn of(place: usize) -> Self {
        End { place, unit: 1 }
    }
}

/// A level in groups.
struct Grouped {
    /// Where its groups begin and end.
    start: usize,
    end: usize,
    /// Bytes of one.
    size: usize,
    /// The errors of the level below and its own.
    errors: [f64; 2],
}

impl Grouped {
    fn count(&self) -> usize {
        (self.end - self.start) / self.size
    }

    /// What part of the level a block is, if it is one and each of its groups is a source symbol.
    fn holes(&self, block: &Range<usize>) -> Option<Holes> {
        let code = Code::of(block.len()).filter(|code| code.size == self.size)?;
        let before = block.start.checked_sub(self.start).filter(|_| block.end <= self.end)?;
        let is_whole = code.symbols as usize * self.size == block.len();
        let holes = Holes { errors: self.errors, before: before / self.size, count: self.count() };
        (is_whole && before.is_multiple_of(self.size)).then_some(holes)
    }

    /// The ends of all groups but the last, and what is shown up to there.
    fn stages(&self) -> impl Iterator<Item = (u64, Quality)> {
        let holes = Holes { errors: self.errors, before: 0, count: self.count() };
        (1..self.count()).map(move |group| ((self.start + group * self.size) as u64, holes.quality(group)))
    }
}

/// What a block holds of a level in groups.
#[derive(Clone, Copy)]
struct Holes {
    /// The errors of the level below and its own.
    errors: [f64; 2],
    /// Groups in blocks before, and in all.
    before: usize,
    count: usize,
}

impl Holes {
    /// The quality of the level with these groups of the block: groups are about equally large parts of the
    /// surface, and where one is missing it is not worse than the level below. Errors are means of squares.
    fn quality(&self, groups: usize) -> Quality {
        let share = ((self.before + groups) as f64 / self.count.max(1) as f64).min(1.0);
        let [below, own] = self.errors.map(|error| error * error);
        Quality::of_error((below + share * (own - below)).max(0.0).sqrt())
    }
}

/// The levels of a file that are in groups.
fn grouped(header: &Header, file: &[u8]) -> Vec<Grouped> {
    let levels = header.sections.iter().zip(&header.outline.levels).filter(|(_, level)| level.grouped);
    let grouped = levels.filter_map(|(section, level)| {
        let Section { offset, length, part: Part::Level(index), .. } = *section else { return None };
        let place = offset as usize;
        let groups = Groups::read(file.get(place..place + length as usize)?, length).ok()??;
        let below = header.outline.levels.get(index.checked_sub(1)?)?;
        let errors = [below.error, level.error].map(f64::from);
        let start = place + groups.head();
        Some(Grouped { start, end: place + length as usize, size: groups.size(), errors })
    });
    grouped.collect()
}

/// The blocks after the first `head` bytes of a file whose sections end at `ends`, in order.
fn group(head: usize, ends: impl Iterator<Item = End>) -> Vec<Range<usize>> {
    let mut blocks: Vec<Range<usize>> = Vec::new();
    let mut start = head;
    for End { place: end, unit } in ends.filter(|end| end.place > head) {
        match blocks.last_mut() {
            Some(last) if end - last.start <= MAX_SYMBOL => last.end = end,
            _ => {
                let (units, parts) = ((end - start) / unit, (end - start).div_ceil(MAX_BLOCK / unit * unit));
                let cut = |i: usize| if i == parts { end } else { start + units * i / parts * unit };
                blocks.extend((0..parts).map(|i| cut(i)..cut(i + 1)));
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
