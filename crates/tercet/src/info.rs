//! What a file says of itself before any of its levels is decoded.

use crate::container::{self, Approximation, Header, LevelEntry, LevelKind, Reader, UpdateRule};
use crate::{Effort, Error, Limits, Precision, Result, Update};

/// What a file says of itself.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub struct Info {
    /// Version of the file format.
    pub version: u8,
    /// What positions mean.
    pub precision: Precision,
    /// How much work the file takes.
    pub effort: Effort,
    /// Whether vertices and faces come back in the order of the original.
    pub order_kept: bool,
    /// Vertices of the original.
    pub vertices: u32,
    /// Faces of the original.
    pub faces: u32,
    /// What the original itself stands for, if the file is lossy beyond its precision.
    pub approximation: Option<Approximation>,
    /// The base, then each level above it.
    pub levels: Vec<LevelInfo>,
    /// Bytes before the first section: they are what this was read from.
    pub header_bytes: u64,
    /// Size of the whole file.
    pub bytes: u64,
}

/// One level of a file.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub struct LevelInfo {
    /// 0 is the base.
    pub level: u32,
    /// "base", "adaptive", "sqrt3", "butterfly", or "late": an adaptive level whose positions come
    /// after all levels. Until then its new vertices lie where they are expected.
    pub kind: &'static str,
    /// Whether its details come in groups, which can be shown in any order.
    pub grouped: bool,
    /// How its details moved the vertices of the level below.
    pub update: Update,
    /// Vertices of this level; of the finest, once it is restored.
    pub vertices: u32,
    /// Faces of this level; of the finest, once it is restored.
    pub faces: u32,
    /// Bytes from the file's start to the end of this level.
    pub bytes: u64,
    /// Root mean square distance of the original's vertices from this level's surface, as a
    /// part of the bounding box's diagonal; taken over a sample, and rather too large than small.
    /// In a lossy file it is that to the source, by the triangle inequality.
    pub error: f32,
}

impl Info {
    pub(crate) fn new(header: &Header) -> Self {
        let outline = &header.outline;
        let level = |(i, (entry, section)): (usize, (&LevelEntry, &container::Section))| LevelInfo {
            level: i as u32,
            kind: match entry.kind {
                LevelKind::Base => "base",
                LevelKind::Adaptive => "adaptive",
                LevelKind::Sqrt3Even | LevelKind::Sqrt3Odd => "sqrt3",
                LevelKind::Butterfly => "butterfly",
                LevelKind::Late => "late",
            },
            grouped: entry.grouped,
            update: rule(entry),
            vertices: entry.vertices,
            faces: entry.faces,
            bytes: section.end(),
            error: entry.error,
        };
        let mut levels: Vec<LevelInfo> =
            outline.levels.iter().zip(&header.sections).enumerate().map(level).collect();
        // What is handed out as the finest level has been through the restoring sections.
        if let Some(finest) = levels.last_mut() {
            (finest.vertices, finest.faces) = (outline.vertices, outline.faces);
        }
        Info {
            version: container::VERSION,
            precision: outline.precision.clone(),
            effort: outline.effort,
            order_kept: outline.order_kept,
            vertices: outline.vertices,
            faces: outline.faces,
            approximation: outline.approximation,
            levels,
            header_bytes: header.sections.first().map_or(0, |section| section.offset),
            bytes: header.sections.iter().map(container::Section::end).max().unwrap_or(0),
        }
    }

    pub(crate) fn of(file: &[u8]) -> Result<Info> {
        let mut reader = Reader::new(Limits::default());
        reader.push(file);
        reader.check()?;
        reader.header().map(Info::new).ok_or_else(|| Error::format("header", "incomplete"))
    }
}

/// How a level's details moved the vertices of the level below.
pub(crate) fn rule(entry: &LevelEntry) -> Update {
    match entry.update {
        UpdateRule::None => Update::None,
        UpdateRule::Third => Update::Third,
        UpdateRule::Paper => Update::Paper,
    }
}
