//! From a file to a mesh, as its bytes arrive.

use crate::coding::supplement::{self, Supplements};
use crate::coding::{Levels, Point};
use crate::container::{
    self, Approximation, Header, LevelEntry, LevelKind, Outline, Part, Reader, Supplement, UpdateRule,
};
use crate::entropy::{self, Coder};
use crate::mesh::Mesh;
use crate::subdivide::StepKind;
use crate::{Effort, Error, Limits, Precision, Result, Update};

/// What a file says of itself.
#[derive(Clone, Debug, PartialEq)]
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
pub struct LevelInfo {
    /// 0 is the base.
    pub level: u32,
    /// "base", "adaptive", "sqrt3", "butterfly", or "late": an adaptive level whose positions come
    /// after all levels. Until then its new vertices lie where they are expected.
    pub kind: &'static str,
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
    fn new(header: &Header) -> Self {
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
        let mut decoder = Decoder::new(Limits::default());
        decoder.push(file);
        decoder.reader.next_section()?;
        decoder.info().ok_or_else(|| Error::format("header", "incomplete"))
    }
}

fn rule(entry: &LevelEntry) -> Update {
    match entry.update {
        UpdateRule::None => Update::None,
        UpdateRule::Third => Update::Third,
        UpdateRule::Paper => Update::Paper,
    }
}

/// A mesh as far as it has arrived.
#[derive(Clone, Debug)]
pub struct Level {
    /// 0 is the base.
    pub level: u32,
    /// The mesh at this level. Its first [`kept`](Level::kept) vertices are those of the level below,
    /// in their order, unless sections that restore the original have renumbered them.
    pub mesh: Mesh,
    /// How many vertices this level keeps of the level below (the even ones); the further ones are new
    /// (odd). 0 for the base.
    pub kept: u32,
    /// The level without its details: where each vertex of `mesh` lies if nothing but the level below
    /// and this level's connectivity is known. Only where [`Decoder::keep_predictions`] asked for it;
    /// never for the base, nor for a finest level that further sections have restored.
    pub predicted: Option<Vec<[f32; 3]>>,
    /// Whether every section of the file has arrived, so that `mesh` is the original (under the
    /// precision that the file states).
    pub restored: bool,
}

/// How far decoding has come.
struct Reached {
    level: u32,
    restored: bool,
}

/// Memory that decoding a level takes: its surface and models' notes, the next coarser surface,
/// and the mesh that is handed out.
const BYTES_PER_VERTEX: u64 = 250;

/// A progressive decoder: bytes in, levels out.
///
/// A file with sections that complete its finest level yields that level twice: as the surface
/// that was coded, and once the sections have arrived as the original. If its positions come late,
/// it is also yielded in between, when they have arrived.
pub struct Decoder {
    limits: Limits,
    reader: Reader,
    levels: Levels,
    supplements: Supplements,
    keeps_predictions: bool,
    /// Vertices of the level below the current one.
    kept: u32,
    /// The current level without its details, if that is asked for.
    predicted: Option<Vec<Point>>,
}

impl Decoder {
    /// A decoder that holds no more memory than `limits` allow.
    pub fn new(limits: Limits) -> Self {
        Decoder {
            limits,
            reader: Reader::new(limits),
            levels: Levels::new(Effort::default()),
            supplements: Supplements::default(),
            keeps_predictions: false,
            kept: 0,
            predicted: None,
        }
    }

    /// Whether levels shall come with [`Level::predicted`], at 24 bytes for each vertex. Default: no.
    pub fn keep_predictions(&mut self, keep: bool) {
        self.keeps_predictions = keep;
    }

    /// Takes the next bytes of the file, any number of them.
    pub fn push(&mut self, bytes: &[u8]) {
        self.reader.push(bytes);
    }

    /// What the file says of itself, once its header has arrived.
    pub fn info(&self) -> Option<Info> {
        self.reader.header().map(Info::new)
    }

    /// The next level whose bytes have arrived, if any, as a mesh.
    ///
    /// # Errors
    /// What is wrong with the bytes; levels returned before stand.
    pub fn next_level(&mut self) -> Result<Option<Level>> {
        let Some(Reached { level, restored }) = self.advance()? else { return Ok(None) };
        let mesh = self.mesh(restored).map_err(|error| self.reader.refuse(error))?;
        let predicted = self.predicted.take();
        let precision = &self.outline()?.precision;
        let predicted = predicted.map(|points| supplement::coordinates(&points, precision));
        Ok(Some(Level { level, mesh, kept: self.kept, predicted, restored }))
    }

    /// Decodes the next level whose bytes have arrived, without making a mesh of it.
    fn advance(&mut self) -> Result<Option<Reached>> {
        while let Some((part, bytes)) = self.reader.next_section()? {
            let outline = self.outline()?;
            let finest = outline.levels.len() - 1;
            let restored = part == last_part(outline);
            match part {
                Part::Level(level) => {
                    let entry = outline.levels[level];
                    self.level(entry, &bytes)?;
                    return Ok(Some(Reached { level: level as u32, restored }));
                }
                Part::Supplement(Supplement::Positions) => {
                    self.complete(&bytes)?;
                    return Ok(Some(Reached { level: finest as u32, restored }));
                }
                Part::Supplement(kind) => self.keep(kind, bytes),
            }
            if restored {
                return Ok(Some(Reached { level: finest as u32, restored }));
            }
        }
        Ok(None)
    }

    /// After an [`Error::Checksum`]: forgets the damaged section, so that its bytes may be pushed
    /// anew, and returns how many bytes of the file stand before it. What was decoded stays.
    /// `None` after any other fault, and without one.
    pub fn discard_damaged(&mut self) -> Option<u64> {
        self.reader.discard_damaged()
    }

    /// Whether the whole file has arrived.
    ///
    /// # Errors
    /// [`Error::Truncated`] if not.
    pub fn finish(&self) -> Result<()> {
        self.reader.finish()
    }

    /// Decodes a level. After a failure the surface is of no use: the file ends there.
    fn level(&mut self, entry: LevelEntry, bytes: &[u8]) -> Result<()> {
        let mut coder = entropy::Decoder::new(bytes);
        let done = self.refine(entry, &mut coder).and_then(|()| match coder.exhausted() {
            true => Err(Error::format("level", "its bytes end before it is complete")),
            false => self.check_counts(entry),
        });
        done.map_err(|error| self.reader.refuse(error))
    }

    fn refine(&mut self, entry: LevelEntry, coder: &mut entropy::Decoder) -> Result<()> {
        let limits = *self.reader.limits();
        limits.check("bytes of a level", entry.vertices.into(), BYTES_PER_VERTEX)?;
        let kind = match entry.kind {
            LevelKind::Base => {
                self.levels = Levels::new(self.outline()?.effort);
                self.levels.base(coder, None, &limits)?;
                // Its positions take time and memory: not for another surface than announced.
                self.check_counts(entry)?;
                self.levels.base_positions(coder, &[]);
                return Ok(());
            }
            LevelKind::Adaptive | LevelKind::Late => StepKind::Adaptive,
            LevelKind::Sqrt3Even => StepKind::Sqrt3Even,
            LevelKind::Sqrt3Odd => StepKind::Sqrt3Odd,
            LevelKind::Butterfly => StepKind::Butterfly,
        };
        let coarse = &self.levels.surface;
        self.kept = coarse.vertices - coarse.virtuals;
        let step = self.levels.connectivity(coder, kind, Vec::new(), Vec::new(), entry.vertices as u64)?;
        self.predicted = self.keeps_predictions.then(|| self.levels.without_details(&step));
        match entry.kind {
            LevelKind::Late => self.levels.late_positions(step),
            _ => self.levels.positions(coder, step, &[], rule(&entry)),
        }
        Ok(())
    }

    /// Decodes the positions of late levels.
    fn complete(&mut self, bytes: &[u8]) -> Result<()> {
        let mut coder = entropy::Decoder::new(bytes);
        self.levels.complete(&mut coder, &[]);
        if coder.exhausted() {
            let error = Error::format("positions section", "its bytes end before it is complete");
            return Err(self.reader.refuse(error));
        }
        Ok(())
    }

    /// Fails unless the surface has the real vertices and faces that its entry announces.
    fn check_counts(&self, entry: LevelEntry) -> Result<()> {
        let surface = &self.levels.surface;
        let found = [surface.vertices - surface.virtuals, surface.real_faces()];
        if found != [entry.vertices, entry.faces] {
            let [vertices, faces] = found;
            let cause = format!("{vertices} vertices and {faces} faces, not as many as announced");
            return Err(Error::format("level", cause));
        }
        Ok(())
    }

    fn keep(&mut self, kind: Supplement, bytes: Vec<u8>) {
        let place = match kind {
            Supplement::Exactness => &mut self.supplements.exactness,
            Supplement::Merges => &mut self.supplements.merges,
            Supplement::Leftovers => &mut self.supplements.leftovers,
            Supplement::Order => &mut self.supplements.order,
            Supplement::Positions | Supplement::Optional(_) => return,
        };
        *place = Some(bytes);
    }

    /// The mesh of the current level or, once everything has arrived, the original.
    fn mesh(&self, restored: bool) -> Result<Mesh> {
        let outline = self.outline()?;
        if !restored {
            return Ok(supplement::surface_mesh(&self.levels, &outline.precision));
        }
        let counts = [outline.vertices, outline.faces];
        supplement::read(&self.levels, &outline.precision, counts, &self.supplements, &self.limits)
    }

    fn outline(&self) -> Result<&Outline> {
        let header = self.reader.header().ok_or_else(|| Error::format("header", "incomplete"))?;
        Ok(&header.outline)
    }
}

/// The last section that a reader needs.
fn last_part(outline: &Outline) -> Part {
    let needed = outline.supplements.iter().rev().find(|s| !matches!(s, Supplement::Optional(_)));
    needed.map_or(Part::Level(outline.levels.len() - 1), |&s| Part::Supplement(s))
}

/// Decodes a whole file.
///
/// # Errors
/// What is wrong with the bytes, [`Error::Truncated`] if they end early.
pub fn decode(bytes: &[u8], limits: &Limits) -> Result<Mesh> {
    let mut decoder = Decoder::new(*limits);
    decoder.push(bytes);
    let mut restored = false;
    while let Some(reached) = decoder.advance()? {
        restored = reached.restored;
    }
    decoder.finish()?;
    decoder.mesh(restored)
}
