//! From a file to a mesh, as its bytes arrive.

use crate::coding::payload::Opening;
use crate::coding::supplement::{self, Supplements};
use crate::coding::{Grouping, Levels, Point};
use crate::container::{Groups, LevelEntry, LevelKind, Outline, Part, Reader, Supplement};
use crate::entropy::{self, Coder, Cursor};
use crate::info::{Info, rule};
use crate::memory;
use crate::mesh::Mesh;
use crate::parallel;
use crate::subdivide::StepKind;
use crate::{Effort, Error, GROUPS, Limits, Result};
use std::ops::Range;

/// A mesh as far as it has arrived.
#[derive(Clone, Debug)]
#[non_exhaustive]
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
    /// How many vertices lie where they are expected only, as their positions are still to come: all
    /// of the late levels so far, or those that a [preview](Decoder::preview) lacks.
    pub pending: u32,
    /// Whether every section of the file has arrived, so that `mesh` is the original (under the
    /// precision that the file states).
    pub restored: bool,
}

/// How far decoding has come.
struct Reached {
    level: u32,
    restored: bool,
}

/// A section whose decoding has begun.
struct Begun {
    level: u32,
    streams: Vec<Stream>,
    /// What the payload consists of instead, if it does.
    groups: Option<Groups>,
}

/// A stream of a payload.
struct Stream {
    place: Range<usize>,
    /// Where in it the decoder stands, if it has begun.
    cursor: Option<Cursor>,
}

impl Stream {
    /// A decoder of it, given the first bytes of the payload; `None` if too few of them are its own.
    fn decoder<'a>(&self, payload: &'a [u8]) -> Option<entropy::Decoder<'a>> {
        let Range { start, end } = self.place;
        let bytes = payload.get(start..end.min(payload.len()))?;
        let whole = payload.len() >= end;
        match self.cursor {
            Some(cursor) => Some(entropy::Decoder::resume(cursor, bytes, whole)),
            None => entropy::Decoder::start(bytes, whole),
        }
    }
}

/// Memory that decoding a level takes: its surface and models' notes, the next coarser surface,
/// and the mesh that is handed out.
const BYTES_PER_VERTEX: u64 = 250;
/// What the slowest effort remembers of each vertex besides.
const MORE_BYTES_PER_VERTEX: u64 = 108;

/// What a region of positions takes of each vertex while it is at work, and what several take together.
const BYTES_PER_REGION: u64 = 52;

/// A progressive decoder: bytes in, levels out.
///
/// A file with sections that complete its finest level yields that level twice: as the surface
/// that was coded, and once the sections have arrived as the original. If its positions come late,
/// it is also yielded in between, when they have arrived.
///
/// With glibc, a block of up to 32 MB (a quarter of the limit at most) is reserved and freed untouched before the
/// base: the allocator then keeps blocks up to that size for the process instead of giving them back to the system.
pub struct Decoder {
    limits: Limits,
    reader: Reader,
    levels: Levels,
    supplements: Supplements,
    /// The section in flight, if its connectivity is decoded.
    begun: Option<Begun>,
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
            levels: Levels::new(Effort::default(), 1),
            supplements: Supplements::default(),
            begun: None,
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
        let mesh = self.mesh(restored).map_err(|error| self.refuse(error))?;
        let predicted = self.predicted.take();
        let precision = &self.outline()?.precision;
        let predicted = predicted.map(|points| supplement::coordinates(points, precision));
        let pending = self.levels.pending();
        Ok(Some(Level { level, mesh, kept: self.kept, predicted, pending, restored }))
    }

    /// The level that is arriving as far as it has come: [`pending`](Level::pending) of its vertices lie
    /// where they are expected. `None` between levels, and before the level's connectivity is there. Ask
    /// for it when there is no [next level](Decoder::next_level). Time linear in the level.
    pub fn preview(&self) -> Option<Level> {
        let level = self.begun.as_ref()?.level;
        let points = self.levels.known_positions()?;
        let mesh = supplement::surface_mesh(&self.levels.surface, &points, &self.outline().ok()?.precision);
        let pending = self.levels.pending();
        Some(Level { level, mesh, kept: self.kept, predicted: None, pending, restored: false })
    }

    /// Decodes the next level whose bytes have arrived, without making a mesh of it; of one whose bytes
    /// have arrived in part, that part.
    fn advance(&mut self) -> Result<Option<Reached>> {
        loop {
            // Before a fault that is known already: what stands before it does not depend on portions.
            if !self.section().map_err(|error| self.refuse(error))? {
                return self.reader.check().map(|()| None);
            }
            self.begun = None;
            let Some((part, payload)) = self.reader.take() else { return Ok(None) };
            let outline = self.outline()?;
            let restored = part == last_part(outline);
            let level = match part {
                Part::Level(level) => level,
                Part::Supplement(_) => outline.levels.len() - 1,
            };
            if let Part::Supplement(kind) = part {
                self.keep(kind, payload);
            }
            if restored || matches!(part, Part::Level(_) | Part::Supplement(Supplement::Positions)) {
                return Ok(Some(Reached { level: level as u32, restored }));
            }
        }
    }

    /// Takes bytes of the file from `place` on that came before those in front of them, to be looked at in a
    /// [`preview`](Decoder::preview). A checksum vouches for each group, which stops no forger. Of use are whole groups of the level that is arriving, if its groups have begun;
    /// how many there were. Nothing is kept but what the preview shows: what is decoded for good is decoded from the
    /// bytes that are pushed, in their order, these among them. Time linear in the groups.
    pub fn glimpse(&mut self, place: u64, bytes: &[u8]) -> usize {
        let begun = self.begun.as_ref().and_then(|begun| begun.groups.as_ref());
        let (Some(groups), Some(next), Some(start)) = (begun, self.levels.next_group(), self.reader.place())
        else {
            return 0;
        };
        let Some(skipped) = place.checked_sub(start).and_then(|skipped| usize::try_from(skipped).ok()) else {
            return 0;
        };
        let within = groups.within(skipped..skipped.saturating_add(bytes.len()));
        let streams = within
            .filter(|&group| group >= next)
            .filter_map(|group| Some((group, groups.stream(group, bytes, skipped)?)));
        streams
            .filter(|&(group, bytes)| self.levels.group(&mut entropy::Decoder::new(bytes), group, false))
            .count()
    }

    /// After an [`Error::Checksum`]: forgets the damaged bytes, some kilobytes of a section at most but all of a level in
    /// groups, so that they may be pushed anew, and returns how many bytes of the file stand before them. What was
    /// decoded stays. `None` after any other fault, and without one.
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

    /// From now on `error` is what is wrong with the file, whose surface is of no use.
    fn refuse(&mut self, error: Error) -> Error {
        self.begun = None;
        self.reader.refuse(error)
    }

    /// Decodes the section that is arriving as far as its bytes allow; whether it is done with.
    fn section(&mut self) -> Result<bool> {
        let Some(incoming) = self.reader.incoming() else { return Ok(false) };
        let (part, whole) = (incoming.part, incoming.is_whole());
        if matches!(part, Part::Supplement(kind) if kind != Supplement::Positions) {
            return Ok(whole);
        }
        if self.begun.is_none() {
            self.begun = self.begin(part)?;
        }
        let (Some(incoming), Some(begun)) = (self.reader.incoming(), &mut self.begun) else {
            return Ok(false);
        };
        if GROUPS && let Some(groups) = &begun.groups {
            while let Some(group) = self.levels.next_group() {
                // Another one may be there: it has its turn when the section is there as a whole, or is refused.
                let Some(bytes) = groups.stream(group, incoming.bytes, 0) else { break };
                if !self.levels.group(&mut entropy::Decoder::new(bytes), group, true) {
                    return Err(ends_early(part));
                }
            }
            return match self.levels.next_group() {
                Some(_) if whole => Err(Error::format(part.to_string(), "not made of groups")),
                _ => Ok(whole),
            };
        }
        let streams = begun.streams.iter();
        let mut coders: Vec<_> = streams.map_while(|stream| stream.decoder(incoming.bytes)).collect();
        self.levels.positions(&mut coders, &[]);
        for (stream, coder) in begun.streams.iter_mut().zip(&coders) {
            stream.cursor = Some(coder.cursor());
        }
        match coders.iter().any(Coder::exhausted) {
            true => Err(ends_early(part)),
            false => Ok(whole),
        }
    }

    /// Decodes what comes before positions, if enough of it has arrived.
    fn begin(&mut self, part: Part) -> Result<Option<Begun>> {
        let Some(incoming) = self.reader.incoming() else { return Ok(None) };
        let (bytes, length) = (incoming.bytes, incoming.length);
        let groups = match GROUPS && self.is_grouped(part)? {
            false => None,
            true => match Groups::read(bytes, length)? {
                None => return Ok(None),
                groups => groups,
            },
        };
        let opening = match groups {
            None => Opening::read(bytes, length, self.streams(part)?)?,
            Some(_) => Some(Opening { streams: std::iter::once(0..0).collect(), reach: 0 }),
        };
        let Some(opening) = opening else { return Ok(None) };
        let mut streams: Vec<Stream> =
            opening.streams.iter().map(|place| Stream { place: place.clone(), cursor: None }).collect();
        let regions_at_once = self.regions_at_once(part, streams.len())?;
        let Part::Level(level) = part else {
            self.levels.regions_at_once = regions_at_once;
            self.levels.begin_late();
            return Ok(Some(Begun { level: self.outline()?.levels.len() as u32 - 1, streams, groups }));
        };
        let first = &streams[0].place;
        if bytes.len() < first.end && bytes.len() < first.start + opening.reach {
            return Ok(None);
        }
        let outline = self.outline()?;
        let (entry, effort) = (outline.levels[level], outline.effort);
        let limits = *self.reader.limits();
        let Some(mut coder) = streams[0].decoder(bytes) else { return Ok(None) };
        match step_kind(entry.kind) {
            None => {
                memory::keep(outline.vertices.into(), limits.max_memory);
                self.levels = Levels::new(effort, outline.streams);
                self.levels.regions_at_once = regions_at_once;
                self.levels.base(&mut coder, None, &limits)?;
                // Its positions take time and memory: not for another surface than announced.
                check_counts(&self.levels, entry)?;
                self.levels.begin_base(&mut coder, &[], None);
            }
            Some(kind) => {
                let coarse = &self.levels.surface;
                self.kept = coarse.vertices - coarse.virtuals;
                self.levels.regions_at_once = regions_at_once;
                let vertices = entry.vertices as u64;
                let step = self.levels.connectivity(&mut coder, kind, Vec::new(), Vec::new(), vertices)?;
                self.predicted = self.keeps_predictions.then(|| self.levels.without_details(&step));
                match entry.kind {
                    LevelKind::Late => self.levels.late_step(step),
                    _ => {
                        let grouping = match &groups {
                            Some(groups) if GROUPS => Grouping::Of(&groups.vertices),
                            _ => Grouping::Whole,
                        };
                        self.levels.begin_step(step, rule(&entry), grouping)?;
                    }
                }
                check_counts(&self.levels, entry)?;
            }
        }
        opening.check(coder.reach())?;
        streams[0].cursor = Some(coder.cursor());
        Ok(Some(Begun { level: level as u32, streams, groups }))
    }

    /// How many regions of a section, of so many streams, may be decoded at once.
    ///
    /// # Errors
    /// If there is too little memory to decode one after the other, whatever the number of threads.
    fn regions_at_once(&self, part: Part, streams: usize) -> Result<usize> {
        let outline = self.outline()?;
        let level = match part {
            Part::Level(level) => outline.levels.get(level),
            Part::Supplement(_) => outline.levels.last(),
        };
        let vertices = level.map_or(0, |level| u64::from(level.vertices));
        let more = if outline.effort.is_max() { MORE_BYTES_PER_VERTEX } else { 0 };
        let (whole, region) = (BYTES_PER_VERTEX + more, BYTES_PER_REGION + more);
        if streams < 2 {
            self.limits.check("bytes of a level", vertices, whole)?;
            return Ok(1);
        }
        let shared = whole + region;
        self.limits.check("bytes of a level", vertices, shared + region)?;
        let fitting = (self.limits.max_memory / vertices.max(1) - shared) / region;
        Ok(parallel::threads().min(usize::try_from(fitting).unwrap_or(usize::MAX)))
    }

    /// Whether a section is a level in groups.
    fn is_grouped(&self, part: Part) -> Result<bool> {
        let Part::Level(level) = part else { return Ok(false) };
        Ok(self.outline()?.levels.get(level).is_some_and(|level| level.grouped))
    }

    /// How many streams the payload of a section has that holds connectivity or positions.
    fn streams(&self, part: Part) -> Result<u32> {
        let outline = self.outline()?;
        let Outline { effort, streams, ref levels, .. } = *outline;
        let new = |from: usize, to: usize| {
            levels[to].vertices - from.checked_sub(1).map_or(0, |below| levels[below].vertices)
        };
        let (kind, vertices) = match part {
            Part::Level(level) if levels[level].kind == LevelKind::Late => return Ok(1),
            Part::Level(level) => (step_kind(levels[level].kind), new(level, level)),
            Part::Supplement(_) => {
                let late = levels.iter().take_while(|level| level.kind != LevelKind::Late).count();
                (None, new(late, levels.len() - 1))
            }
        };
        Ok(Levels::streams(effort, streams, kind, vertices))
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
            let Levels { surface, field, .. } = &self.levels;
            return Ok(supplement::surface_mesh(surface, &field.positions, &outline.precision));
        }
        let counts = [outline.vertices, outline.faces];
        supplement::read(&self.levels, &outline.precision, counts, &self.supplements, &self.limits)
    }

    fn outline(&self) -> Result<&Outline> {
        let header = self.reader.header().ok_or_else(|| Error::format("header", "incomplete"))?;
        Ok(&header.outline)
    }
}

fn ends_early(part: Part) -> Error {
    Error::format(part.to_string(), "its bytes end before it is complete")
}

/// The step that leads to a level of this kind; the base comes from none.
fn step_kind(kind: LevelKind) -> Option<StepKind> {
    match kind {
        LevelKind::Base => None,
        LevelKind::Adaptive | LevelKind::Late => Some(StepKind::Adaptive),
        LevelKind::Sqrt3Even => Some(StepKind::Sqrt3Even),
        LevelKind::Sqrt3Odd => Some(StepKind::Sqrt3Odd),
        LevelKind::Butterfly => Some(StepKind::Butterfly),
    }
}

/// Fails unless the surface has the real vertices and faces that its entry announces.
fn check_counts(levels: &Levels, entry: LevelEntry) -> Result<()> {
    let surface = &levels.surface;
    let found = [surface.vertices - surface.virtuals, surface.real_faces()];
    if found != [entry.vertices, entry.faces] {
        let [vertices, faces] = found;
        let cause = format!("{vertices} vertices and {faces} faces, not as many as announced");
        return Err(Error::format("level", cause));
    }
    Ok(())
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

#[cfg(test)]
mod tests;
