//! The header: what the file holds, and the table of its sections.

use super::approximation::Approximation;
use super::fields::{Fields, malformed};
use super::section::{self, Entry, LevelEntry, LevelKind, Part, Section, Supplement};
use super::{piece, unsupported, varint};
use crate::mesh::Precision;
use crate::{Effort, Error, GROUPS, Limits, Result};

/// Flag: vertices and faces come back in the order of the original.
const ORDER_KEPT: u8 = 1;
/// Flag: the mesh stands for another one, and the header says for which.
const LOSSY: u8 = 2;
/// Flags: the effort.
const EFFORT: u8 = 3 << EFFORT_SHIFT;
const EFFORT_SHIFT: u32 = 2;
/// Flag: there are levels in groups.
const GROUPED: u8 = 1 << 4;
/// Streams that a large pass over positions has at most: each has models of its own, which take memory.
pub(crate) const MOST_STREAMS: u32 = 16;

/// What a file says of itself, except where its sections lie.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Outline {
    /// Whether vertices and faces come back in the order of the original.
    pub(crate) order_kept: bool,
    pub(crate) effort: Effort,
    /// Streams that a large pass over positions consists of, 1 to [`MOST_STREAMS`].
    pub(crate) streams: u32,
    pub(crate) precision: Precision,
    /// Vertices of the original mesh.
    pub(crate) vertices: u32,
    /// Faces of the original mesh.
    pub(crate) faces: u32,
    /// What the original itself stands for, in a lossy file.
    pub(crate) approximation: Option<Approximation>,
    /// The base, then each level above it; at least the base.
    pub(crate) levels: Vec<LevelEntry>,
    /// The sections after the levels, in the order of their types.
    pub(crate) supplements: Vec<Supplement>,
}

/// A header that was received whole: its checksum holds and its fields are in their ranges.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Header {
    pub(crate) outline: Outline,
    /// The sections in the order of the file: one for each level, one for each supplement.
    pub(crate) sections: Vec<Section>,
}

impl Outline {
    /// Fails if a rule of the format document is broken.
    pub(super) fn check(&self) -> Result<()> {
        self.precision.check()?;
        if !(1..=MOST_STREAMS).contains(&self.streams) {
            return Err(malformed("streams", "there are none, or too many"));
        }
        section::check_count(self.vertices, "vertices")?;
        section::check_count(self.faces, "faces")?;
        LevelEntry::check_all(&self.levels)?;
        Supplement::check_all(&self.supplements)?;
        let late = self.levels.last().is_some_and(|level| level.kind == LevelKind::Late);
        if self.supplements.contains(&Supplement::Positions) != late {
            return Err(malformed("section table", "late levels and a positions section go together"));
        }
        if self.supplements.contains(&Supplement::Order) && !self.order_kept {
            return Err(malformed("flags", "there is an order section, but the order is not kept"));
        }
        Ok(())
    }

    /// Whether some level is in groups.
    fn is_grouped(&self) -> bool {
        self.levels.iter().any(|level| level.grouped)
    }

    /// The header's bytes, for sections of the given lengths and CRC-32s.
    pub(super) fn write(&self, extents: &[(u32, u32)]) -> Vec<u8> {
        let effort = match self.effort {
            Effort::Default => 0,
            Effort::Fast => 1,
            #[cfg(feature = "max")]
            Effort::Max => 2,
        };
        let order = if self.order_kept { ORDER_KEPT } else { 0 };
        let lossy = if self.approximation.is_some() { LOSSY } else { 0 };
        let grouped = if self.is_grouped() { GROUPED } else { 0 };
        let mut out = vec![grouped | effort << EFFORT_SHIFT | lossy | order];
        varint::write(&mut out, self.streams.into());
        self.precision.write(&mut out);
        varint::write(&mut out, self.vertices.into());
        varint::write(&mut out, self.faces.into());
        if let Some(approximation) = &self.approximation {
            approximation.write(&mut out);
        }
        varint::write(&mut out, extents.len() as u64);
        let levels = self.levels.iter().map(|&level| Entry::Level(level));
        let supplements = self.supplements.iter().map(|&supplement| Entry::Supplement(supplement));
        for (entry, &(length, crc)) in levels.chain(supplements).zip(extents) {
            entry.write(&mut out, length, crc);
        }
        out
    }
}

impl Header {
    /// Parses the header's fields, whose checksum has been verified. The first section
    /// starts `offset` bytes into the file.
    ///
    /// # Errors
    /// [`Error::Format`] or [`Error::Unsupported`] for what the fields say,
    /// [`Error::Limit`] for a section that must be held whole and is too large.
    pub(super) fn read(mut fields: Fields, offset: u64, limits: &Limits) -> Result<Header> {
        let flags = fields.byte("flags")?;
        let effort = match (flags & EFFORT) >> EFFORT_SHIFT {
            _ if flags & !(ORDER_KEPT | LOSSY | EFFORT | if GROUPS { GROUPED } else { 0 }) != 0 => None,
            0 => Some(Effort::Default),
            1 => Some(Effort::Fast),
            #[cfg(feature = "max")]
            2 => Some(Effort::Max),
            _ => None,
        };
        let effort = effort.ok_or_else(|| unsupported(format!("flags {flags:#04x}")))?;
        let streams = fields.u32("streams")?;
        if !(1..=MOST_STREAMS).contains(&streams) {
            return Err(unsupported(format!("{streams} streams in a level")));
        }
        let mut outline = Outline {
            order_kept: flags & ORDER_KEPT != 0,
            effort,
            streams,
            precision: Precision::read(&mut fields)?,
            vertices: section::read_count(&mut fields, "vertices")?,
            faces: section::read_count(&mut fields, "faces")?,
            approximation: match flags & LOSSY {
                0 => None,
                _ => Some(Approximation::read(&mut fields)?),
            },
            levels: Vec::new(),
            supplements: Vec::new(),
        };
        let sections = read_table(&mut fields, &mut outline, offset)?;
        fields.end()?;
        outline.check()?;
        if outline.is_grouped() != (flags & GROUPED != 0) {
            return Err(malformed("flags", "they and the levels differ on whether there are groups"));
        }
        for section in &sections {
            // An optional section is passed over, not held.
            if !matches!(section.part, Part::Supplement(Supplement::Optional(_))) {
                limits.check("bytes of a section", section.length.into(), 1)?;
            }
        }
        Ok(Header { outline, sections })
    }
}

/// Reads the section table into `outline`'s lists and returns the sections.
///
/// The count it starts with reserves nothing: a table grows no longer than the header that holds it.
fn read_table(fields: &mut Fields, outline: &mut Outline, mut offset: u64) -> Result<Vec<Section>> {
    let mut sections = Vec::new();
    for _ in 0..fields.u32("sections")? {
        let (entry, length, crc) = Entry::read(fields)?;
        let (part, pieces) = match entry {
            Entry::Level(_) if !outline.supplements.is_empty() => {
                return Err(Error::format("header", "section table: a level follows another section"));
            }
            Entry::Level(level) => {
                outline.levels.push(level);
                (Part::Level(outline.levels.len() - 1), !level.grouped)
            }
            Entry::Supplement(supplement) => {
                outline.supplements.push(supplement);
                (Part::Supplement(supplement), true)
            }
        };
        let payload = if pieces { piece::check_length(length, || part.to_string())? } else { length };
        let section = Section { part, offset, length, payload, pieces, crc };
        offset = section.end();
        sections.push(section);
    }
    Ok(sections)
}
