//! The sections of a file and their entries in the header's table.

use std::fmt;

use super::fields::{Fields, malformed};
use super::{unsupported, varint};
use crate::{Error, Result};

/// Section type of a level. The types after it are those of [`Supplement`].
const LEVEL: u8 = 1;
/// From this section type on, a reader passes over what it does not know.
const FIRST_OPTIONAL: u8 = 128;
/// Largest count of vertices or faces; the value above it stays free to mean "none".
const MAX_COUNT: u32 = u32::MAX - 1;
/// The code of the largest geometric error: one more would be the infinity of an `f32`.
const MAX_ERROR_CODE: u16 = 0x7F7F;

/// What the kind of a level in groups has more than that of one without.
const GROUPED: u8 = 4;

/// How a level is coded.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum LevelKind {
    /// The coarsest surface, coded by itself. Level 0 and no other.
    Base,
    /// Split bits, flip bits and positions of any reverse step.
    Adaptive,
    /// One √3 step from an even generation, without connectivity bits.
    Sqrt3Even,
    /// One √3 step from an odd generation: boundary edges are cut in three.
    Sqrt3Odd,
    /// One butterfly step, without connectivity bits: every face becomes four.
    Butterfly,
    /// As `Adaptive`, but the positions come after all levels.
    Late,
}

impl LevelKind {
    /// Whether its connectivity costs no bits.
    pub(crate) fn is_regular(self) -> bool {
        matches!(self, LevelKind::Sqrt3Even | LevelKind::Sqrt3Odd | LevelKind::Butterfly)
    }
}

/// What the analysis added to the even positions after predicting the odd ones.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum UpdateRule {
    /// Nothing.
    None,
    /// A third of the transposed prediction.
    Third,
    /// The paper's own, unnormalised.
    Paper,
}

/// What the table says of a level, besides where it lies.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct LevelEntry {
    pub(crate) kind: LevelKind,
    /// Whether its payload consists of [`Groups`](super::Groups); only without connectivity bits.
    pub(crate) grouped: bool,
    pub(crate) update: UpdateRule,
    /// Vertices of the surface decoded at this level.
    pub(crate) vertices: u32,
    /// Faces of the surface decoded at this level.
    pub(crate) faces: u32,
    /// Distance to the original as a part of its bounding box's diagonal; finite, not negative.
    /// In a file it is rounded up to 8 significant bits, see [`round_error_up`].
    pub(crate) error: f32,
}

/// A section after the levels, completing what they decode to.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Supplement {
    /// Positions of the vertices of late levels.
    Positions,
    /// Bits of the coordinates that the levels' lattice lacks, negative zeros among them.
    Exactness,
    /// Which vertices were one vertex before the surface was cut.
    Merges,
    /// Vertices and faces that no surface can hold: unreferenced or degenerate.
    Leftovers,
    /// The order of vertices and faces.
    Order,
    /// A type of 128 or above: this reader does not know it, and need not.
    Optional(u8),
}

/// What a section is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Part {
    /// A level, counted from the base, 0.
    Level(usize),
    /// A section after the levels.
    Supplement(Supplement),
}

/// A section and where it lies.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Section {
    pub(crate) part: Part,
    /// First byte, counted from the start of the file.
    pub(crate) offset: u64,
    /// Bytes.
    pub(crate) length: u32,
    /// Bytes without the checks between them.
    pub(crate) payload: u32,
    /// Whether there are such checks if it is long: groups have their own.
    pub(crate) pieces: bool,
    /// CRC-32 of the payload.
    pub(crate) crc: u32,
}

impl Section {
    /// Bytes from the start of the file to the end of this section.
    pub(crate) fn end(&self) -> u64 {
        self.offset + u64::from(self.length)
    }
}

impl fmt::Display for Part {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        match self {
            Part::Level(0) => f.write_str("base"),
            Part::Level(level) => write!(f, "level {level}"),
            Part::Supplement(Supplement::Positions) => f.write_str("positions section"),
            Part::Supplement(Supplement::Exactness) => f.write_str("exactness section"),
            Part::Supplement(Supplement::Merges) => f.write_str("merges section"),
            Part::Supplement(Supplement::Leftovers) => f.write_str("leftovers section"),
            Part::Supplement(Supplement::Order) => f.write_str("order section"),
            Part::Supplement(Supplement::Optional(code)) => write!(f, "optional section of type {code}"),
        }
    }
}

impl Supplement {
    /// The section type.
    pub(super) fn code(self) -> u8 {
        match self {
            Supplement::Positions => 2,
            Supplement::Exactness => 3,
            Supplement::Merges => 4,
            Supplement::Leftovers => 5,
            Supplement::Order => 6,
            Supplement::Optional(code) => code,
        }
    }

    fn from_code(code: u8) -> Result<Self> {
        match code {
            2 => Ok(Supplement::Positions),
            3 => Ok(Supplement::Exactness),
            4 => Ok(Supplement::Merges),
            5 => Ok(Supplement::Leftovers),
            6 => Ok(Supplement::Order),
            FIRST_OPTIONAL.. => Ok(Supplement::Optional(code)),
            _ => Err(unsupported(format!("section type {code}"))),
        }
    }

    /// Fails unless the types never decrease, each mandatory one occurs once at most, and
    /// each optional one is in its range.
    pub(super) fn check_all(supplements: &[Supplement]) -> Result<()> {
        for supplement in supplements {
            if matches!(supplement, Supplement::Optional(..FIRST_OPTIONAL)) {
                return Err(malformed("section table", "a mandatory section is marked optional"));
            }
        }
        for pair in supplements.windows(2) {
            let (first, second) = (pair[0].code(), pair[1].code());
            if second < first || (second == first && second < FIRST_OPTIONAL) {
                let cause = format!("section type {second} follows type {first}");
                return Err(malformed("section table", cause));
            }
        }
        Ok(())
    }
}

impl LevelEntry {
    /// Fails unless `levels` are a base and levels above it that never shrink.
    pub(super) fn check_all(levels: &[LevelEntry]) -> Result<()> {
        let Some(base) = levels.first() else {
            return Err(malformed("section table", "there is no base"));
        };
        if base.update != UpdateRule::None {
            return Err(Error::format("base", "has an update rule, but predicts nothing"));
        }
        for (i, level) in levels.iter().enumerate() {
            let place = || Part::Level(i).to_string();
            if level.grouped && !level.kind.is_regular() {
                return Err(Error::format(place(), "groups, but it has connectivity bits"));
            }
            if (level.kind == LevelKind::Base) != (i == 0) {
                return Err(Error::format(place(), "the first level, and no other, is the base"));
            }
            if level.vertices > MAX_COUNT || level.faces > MAX_COUNT {
                return Err(Error::format(place(), "more vertices or faces than can be numbered"));
            }
            if !level.error.is_finite() || level.error < 0.0 {
                return Err(Error::format(place(), "geometric error that is not finite"));
            }
        }
        for (i, pair) in levels.windows(2).enumerate() {
            if pair[1].vertices < pair[0].vertices || pair[1].faces < pair[0].faces {
                return Err(Error::format(
                    Part::Level(i + 1).to_string(),
                    "fewer vertices or faces than the level below",
                ));
            }
            if pair[0].kind == LevelKind::Late && pair[1].kind != LevelKind::Late {
                return Err(Error::format(
                    Part::Level(i + 1).to_string(),
                    "has positions, but those of the level below come late",
                ));
            }
        }
        Ok(())
    }

    /// Appends the fields that only levels have.
    fn write(&self, out: &mut Vec<u8>) {
        let kind = match self.kind {
            LevelKind::Base => 0,
            LevelKind::Adaptive => 1,
            LevelKind::Sqrt3Even => 2,
            LevelKind::Sqrt3Odd => 3,
            LevelKind::Butterfly => 4,
            LevelKind::Late => 5,
        };
        let kind = if self.grouped { kind + GROUPED } else { kind };
        let update = match self.update {
            UpdateRule::None => 0,
            UpdateRule::Third => 1,
            UpdateRule::Paper => 2,
        };
        out.push(update << 4 | kind);
        varint::write(out, self.vertices.into());
        varint::write(out, self.faces.into());
        out.extend(error_code(self.error).to_le_bytes());
    }

    fn read(fields: &mut Fields) -> Result<Self> {
        let byte = fields.byte("level kind")?;
        let grouped = matches!(byte & 0xF, 6..=8);
        let kind = match (byte & 0xF) - if grouped { GROUPED } else { 0 } {
            0 => LevelKind::Base,
            1 => LevelKind::Adaptive,
            2 => LevelKind::Sqrt3Even,
            3 => LevelKind::Sqrt3Odd,
            4 => LevelKind::Butterfly,
            5 => LevelKind::Late,
            kind => return Err(unsupported(format!("level kind {kind}"))),
        };
        let update = match byte >> 4 {
            0 => UpdateRule::None,
            1 => UpdateRule::Third,
            2 => UpdateRule::Paper,
            rule => return Err(unsupported(format!("update rule {rule}"))),
        };
        let (vertices, faces) =
            (read_count(fields, "vertices of a level")?, read_count(fields, "faces of a level")?);
        Ok(LevelEntry {
            kind,
            grouped,
            update,
            vertices,
            faces,
            error: read_error(fields, "geometric error")?,
        })
    }
}

/// A section as the table lists it: what it is, its length and its CRC-32.
pub(super) enum Entry {
    Level(LevelEntry),
    Supplement(Supplement),
}

impl Entry {
    /// Appends an entry of the section table.
    pub(super) fn write(&self, out: &mut Vec<u8>, length: u32, crc: u32) {
        out.push(match self {
            Entry::Level(_) => LEVEL,
            Entry::Supplement(supplement) => supplement.code(),
        });
        varint::write(out, length.into());
        out.extend(crc.to_le_bytes());
        if let Entry::Level(level) = self {
            level.write(out);
        }
    }

    /// Reads an entry, its section's length and CRC-32.
    pub(super) fn read(fields: &mut Fields) -> Result<(Entry, u32, u32)> {
        let code = fields.byte("section type")?;
        // An unknown mandatory type is told before its fields, which may be of any shape.
        let supplement = if code == LEVEL { None } else { Some(Supplement::from_code(code)?) };
        let length = fields.u32("section length")?;
        let crc = u32::from_le_bytes(fields.array("section checksum")?);
        let entry = match supplement {
            None => Entry::Level(LevelEntry::read(fields)?),
            Some(supplement) => Entry::Supplement(supplement),
        };
        Ok((entry, length, crc))
    }
}

/// Reads a count of vertices or faces.
pub(super) fn read_count(fields: &mut Fields, name: &str) -> Result<u32> {
    let count = fields.u32(name)?;
    check_count(count, name)?;
    Ok(count)
}

/// Reads an error as [`error_code`] writes it.
pub(super) fn read_error(fields: &mut Fields, name: &str) -> Result<f32> {
    let code = u16::from_le_bytes(fields.array(name)?);
    if code > MAX_ERROR_CODE {
        return Err(malformed(name, format!("{code:#06x} is not a finite error")));
    }
    Ok(error_value(code))
}

/// Fails if `count` vertices or faces are more than can be numbered.
pub(super) fn check_count(count: u32, name: &str) -> Result<()> {
    if count > MAX_COUNT {
        return Err(malformed(name, format!("{count} are more than can be numbered")));
    }
    Ok(())
}

/// The geometric error that a file states for `error`: not less than it, and more by less
/// than one part in 128 (of a normal number).
///
/// Errors beyond the largest that can be stated, 255 · 2^120 ≈ 3.39 · 10^38, become that one.
pub(crate) fn round_error_up(error: f32) -> f32 {
    error_value(error_code(error))
}

/// The upper half of the bits of `error`, rounded up. `error` is finite and not negative,
/// so its bits grow with its value; the sign of −0 is dropped.
pub(super) fn error_code(error: f32) -> u16 {
    let code = error.abs().to_bits().div_ceil(1 << 16);
    // The cast keeps the value: the minimum has 15 bits.
    code.min(MAX_ERROR_CODE.into()) as u16
}

fn error_value(code: u16) -> f32 {
    f32::from_bits(u32::from(code) << 16)
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    #[test]
    fn a_stated_error_is_rounded_up() {
        assert_eq!(error_code(0.0), 0);
        assert_eq!(error_code(-0.0), 0);
        assert_eq!(error_code(1.0), 0x3F80);
        assert_eq!(error_code(f32::from_bits(0x3F80_0001)), 0x3F81);
        assert_eq!(error_code(f32::from_bits(1)), 1);
        assert_eq!(error_code(f32::MAX), MAX_ERROR_CODE);
        assert_eq!(error_value(MAX_ERROR_CODE), 255.0 * 2f32.powi(120));
    }

    proptest! {
        #[test]
        fn a_stated_error_bounds_the_true_one_closely(bits in 0x0080_0000u32..0x7F7F_0000) {
            let error = f32::from_bits(bits);
            let stated = round_error_up(error);
            prop_assert!(stated >= error);
            prop_assert!(f64::from(stated) < f64::from(error) * (1.0 + 1.0 / 128.0));
            prop_assert_eq!(round_error_up(stated), stated);
        }
    }
}
