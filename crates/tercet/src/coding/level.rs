//! A level: connectivity, then positions, in both directions.

use super::axes::AxisOrder;
use super::base::code_base;
use super::flip::FlipModels;
use super::group::Groups;
use super::model::number;
use super::pass::{ANYWHERE, Pass, Roughness};
use super::positions::Positions;
use super::predict::estimate;
use super::region::{Field, Regions, regions};
use super::relax::{ESTIMATE_BITS, precise, relax, rounded};
use super::ring::{LATE, NEAR, Shares};
use super::site::{Site, in_faces, in_rings, lie_in_faces};
use super::sketch::Sketch;
use super::split::SplitModels;
use super::symmetry::Symmetry;
use super::tabled::{TableModels, Walk};
use super::twin::Lone;
use super::vector::{COORDINATE_LIMIT, Point, Vector};
use crate::entropy::Coder;
use crate::mesh::{NONE, Surface};
use crate::parallel;
use crate::subdivide::{
    FRACTION_BITS, Refined, StepKind, Update, applies, flip_edges, predict_regular, refine_regular, round,
    split_faces, unlift_positions,
};
use crate::{Effort, Error, GROUPS, Limits, Result};
use std::borrow::Cow;

/// All models and the surface they have reached; the same in encoder and decoder.
pub(crate) struct Levels {
    /// The models of split and flip bits, from the first adaptive level on.
    bits: Option<(SplitModels, FlipModels)>,
    /// Of each region, unless the pass is coded by tables.
    position: Vec<Positions>,
    tables: Option<TableModels>,
    effort: Effort,
    /// Streams of the positions of a large pass, one a region.
    streams: u32,
    /// The plane by which the mesh is its own mirror image, if it is.
    symmetry: Option<Symmetry>,
    /// So many regions at most of a pass that is to begin are coded at once. The bytes do not depend on it.
    pub regions_at_once: usize,
    /// The finest surface so far.
    pub surface: Surface,
    /// What is known of its vertices.
    pub field: Field,
    /// What the last pass left without a twin, if it was coded by tables and looked for twins.
    lone: Option<Lone>,
    /// Where the positions of late levels are still to come.
    late: Option<Late>,
    /// The pass over positions that is going on.
    open: Option<Open>,
}

/// Vertices whose positions come after all levels.
struct Late {
    /// The first of them.
    first: u32,
    /// Where they are expected, with [`ESTIMATE_BITS`] behind the point.
    estimates: Vec<Point>,
}

/// A pass over positions that has begun and not ended.
struct Open {
    first: u32,
    estimates: Vec<Vector>,
    order: AxisOrder,
    shares: &'static Shares,
    bits: u32,
    origin: Point,
    symmetry: Option<Symmetry>,
    by_support: bool,
    course: Course,
    lifted: Option<Lifted>,
}

impl Open {
    /// What the pass over `surface` works on, and how far it has come.
    fn parts<'a>(&'a mut self, surface: &'a Surface) -> (Pass<'a>, &'a mut Course) {
        let Open { first, estimates, order, shares, bits, origin, symmetry, by_support, course, .. } = self;
        let pass = Pass {
            surface,
            first: *first,
            estimates,
            order: *order,
            by_support: *by_support,
            shares,
            bits: *bits,
            origin: *origin,
            symmetry: *symmetry,
        };
        (pass, course)
    }
}

/// How far a pass has come.
enum Course {
    Mixed(Box<Regions>),
    Tables(Walk),
    Groups(Box<Groups>),
}

/// How the pass over a level's new vertices is divided into groups.
#[derive(Clone, Copy)]
pub(crate) enum Grouping<'a> {
    /// Not at all.
    Whole,
    /// As the encoder will find.
    Open,
    /// Into groups of so many vertices.
    Of(&'a [u16]),
}

/// An update to be undone when all details are known.
struct Lifted {
    coarse: Surface,
    kind: StepKind,
    rule: Update,
}

impl Lifted {
    fn undo(&self, positions: &mut [Point]) {
        unlift_positions(&self.coarse, self.kind, positions, self.rule);
        let limit = COORDINATE_LIMIT;
        positions.iter_mut().flatten().for_each(|x| *x = (*x).clamp(-limit, limit));
    }
}

/// A step whose connectivity is known and whose new positions are not.
pub(crate) struct Step {
    pub kind: StepKind,
    pub refined: Refined,
    estimates: Vec<Vector>,
}

impl Levels {
    pub fn new(effort: Effort, streams: u32) -> Self {
        Levels {
            bits: None,
            position: Vec::new(),
            tables: None,
            effort,
            streams,
            symmetry: None,
            regions_at_once: parallel::threads(),
            surface: Surface::default(),
            field: Field::default(),
            lone: None,
            late: None,
            open: None,
        }
    }

    /// Codes the base's connectivity; `known` is it when encoding. Returns its `origin`: see
    /// [`Base`](super::base::Base).
    ///
    /// # Errors
    /// When decoding: if the base is not a closed surface, or larger than `limits` allow.
    pub fn base<C: Coder>(
        &mut self,
        coder: &mut C,
        known: Option<&Surface>,
        limits: &Limits,
    ) -> Result<Vec<u32>> {
        let faces = number(coder, known.map_or(0, Surface::faces));
        limits.check("bytes of the base", faces.into(), BYTES_PER_BASE_FACE)?;
        check_faces(faces.into())?;
        let base = code_base(coder, known, faces)?;
        self.surface = base.surface;
        Ok(base.origin)
    }

    /// Begins the pass over the base's positions, one entry a vertex when encoding, else ignored, as is by which plane
    /// the mesh is its own mirror image.
    pub fn begin_base<C: Coder>(&mut self, coder: &mut C, positions: &[Point], symmetry: Option<Symmetry>) {
        self.symmetry = Symmetry::code(coder, symmetry);
        let virtuals = self.surface.virtuals as usize;
        let real = positions.get(virtuals..).unwrap_or_default();
        // An update may have pushed base vertices below the lattice.
        let negative = real.iter().flatten().any(|&x| x < 0);
        let origin = match coder.raw(negative as u32, 1) {
            0 => [0; 3],
            _ => [0, 1, 2].map(|k| {
                let least = real.iter().map(|p| p[k]).min().unwrap_or(0);
                coder.raw_wide(least as u32, 32) as i32
            }),
        };
        let size = |p: &Point| (0..3).map(|k| p[k].wrapping_sub(origin[k]) as u32).max().unwrap_or(0);
        let largest = real.iter().map(size).max().unwrap_or(0);
        let bits = coder.raw(32 - largest.leading_zeros(), 5);
        self.field.positions = vec![[0; 3]; virtuals];
        let first = self.surface.virtuals;
        self.place(first, &[]);
        let course = self.course(first, AxisOrder::NormalLast, None);
        self.begin(first, Vec::new(), AxisOrder::NormalLast, &NEAR, course);
        if let Some(open) = &mut self.open {
            (open.bits, open.origin) = (bits, origin);
        }
    }

    /// Puts the vertices from `first` on where they are expected, if they are.
    fn place(&mut self, first: u32, estimates: &[Vector]) {
        let (surface, Field { positions, rough }) = (&self.surface, &mut self.field);
        let vertices = surface.vertices as usize;
        // Levels grow by a factor already: room for twice as many would stay empty at the last one.
        positions.reserve_exact(vertices.saturating_sub(positions.len()));
        positions.truncate(first as usize);
        positions.extend(estimates.iter().map(|&e| round(e)));
        positions.resize(vertices, [0; 3]);
        // Tables do not ask for it.
        if self.effort != Effort::Fast {
            rough.reserve_exact(vertices.saturating_sub(rough.len()));
            rough.resize(vertices, Roughness::START);
        }
    }

    /// The sites of the vertices from `first` on. They lie in the faces of a coarse surface that became the named
    /// ones, or do not.
    fn sites(&self, first: u32, faces: Option<(&Surface, &[u32])>) -> Vec<Site> {
        match faces {
            Some((coarse, heirs)) => in_faces(coarse, heirs, &self.surface),
            None => in_rings(&self.surface, first),
        }
    }

    /// How the vertices from `first` on, which are placed, are coded: by tables at their [`sites`](Levels::sites), or
    /// by mixing.
    fn course(&mut self, first: u32, order: AxisOrder, faces: Option<(&Surface, &[u32])>) -> Course {
        if Positions::tabled(self.effort, order) {
            return Course::Tables(Walk::new(self.sites(first, faces), self.lone.take()));
        }
        let by_support = Positions::visit_by_support(self.effort, order);
        let count = regions(self.streams, self.surface.vertices - first, by_support);
        while self.position.len() < count as usize {
            let models = self.position.first().cloned();
            self.position.push(models.unwrap_or_else(|| Positions::new(self.effort)));
        }
        Course::Mixed(Box::new(Regions::new(count, self.regions_at_once)))
    }

    /// Begins a pass over the positions of the vertices from `first` on, which are placed by these estimates.
    fn begin(
        &mut self,
        first: u32,
        estimates: Vec<Vector>,
        order: AxisOrder,
        shares: &'static Shares,
        course: Course,
    ) {
        let by_support = Positions::visit_by_support(self.effort, order);
        let (bits, origin) = ANYWHERE;
        // Where nothing is expected no twin can be looked for, and details of regular levels take too few bits.
        let symmetry = self.symmetry.filter(|_| order == AxisOrder::NormalLast && !estimates.is_empty());
        self.open = Some(Open {
            first,
            estimates,
            order,
            shares,
            bits,
            origin,
            symmetry,
            by_support,
            course,
            lifted: None,
        });
    }

    /// Codes the positions of the pass that has begun, of `targets` when encoding: one entry a vertex of it.
    /// There is a coder for each of its [`regions`], or for the first of them. Whether all are coded; if not,
    /// bytes are missing, and the next call goes on. Time O(n).
    pub fn positions<C: Coder + Send>(&mut self, coders: &mut [C], targets: &[Point]) -> bool {
        let Some(open) = &mut self.open else { return true };
        let (pass, course) = open.parts(&self.surface);
        let done = match (course, coders) {
            (Course::Mixed(regions), coders) => {
                regions.code(&pass, &mut self.position, coders, targets, &mut self.field)
            }
            (Course::Tables(walk), [coder, ..]) => {
                let models = self.tables.get_or_insert_with(TableModels::new);
                models.code(coder, &pass, walk, targets, &mut self.field.positions)
            }
            (Course::Tables(_), []) | (Course::Groups(_), _) => false,
        };
        if done {
            self.end();
        }
        done
    }

    /// Ends the pass, all of whose vertices are coded.
    fn end(&mut self) {
        let Some(open) = self.open.take() else { return };
        self.lone = None;
        match open.course {
            Course::Groups(groups) if GROUPS => self.tables = Some(groups.finish()),
            Course::Tables(walk) => self.lone = walk.lone(),
            _ => {}
        }
        if let Some(lifted) = open.lifted {
            lifted.undo(&mut self.field.positions);
        }
    }

    /// The group whose turn it is in the pass that has begun, if that has groups.
    pub fn next_group(&self) -> Option<usize> {
        match &self.open {
            Some(Open { course: Course::Groups(groups), .. }) => groups.next(),
            _ => None,
        }
    }

    /// Decodes a group of the pass that has begun: the next one for good if it `stays`, or any to be looked at until
    /// then. Whether its bytes hold all of its vertices.
    pub fn group<C: Coder>(&mut self, coder: &mut C, group: usize, stays: bool) -> bool {
        let Some(open) = &mut self.open else { return false };
        let (pass, Course::Groups(groups)) = open.parts(&self.surface) else { return false };
        let complete = groups.decode(coder, &pass, group, stays, &mut self.field);
        if groups.next().is_none() {
            self.end();
        }
        complete
    }

    /// Encodes the pass that has begun, if it has groups, of `targets`: one entry a vertex of it. As few groups as
    /// `most` bytes for each allow, of sizes as equal as may be; the vertices and bytes of each. Nothing if a few would
    /// hold all, which cost more than they are worth: then the pass has none any more.
    pub fn encode_groups(&mut self, targets: &[Point], most: usize) -> Option<Vec<(u16, Vec<u8>)>> {
        let open = self.open.as_mut()?;
        let (pass, course) = open.parts(&self.surface);
        let Course::Groups(groups) = course else { return None };
        let encoded = groups.encode_evenly(&pass, most, targets, &mut self.field);
        if let Some(encoded) = encoded {
            self.end();
            return Some(encoded);
        }
        let (models, sites) = groups.give_up(&pass, &mut self.field);
        self.tables = Some(models);
        let (first, order) = (pass.first, pass.order);
        let course = match Positions::tabled(self.effort, order) {
            true => Course::Tables(Walk::new(sites, self.lone.take())),
            false => self.course(first, order, None),
        };
        self.open.as_mut()?.course = course;
        None
    }

    /// How many streams a pass over `vertices` new vertices has, those of a step of `kind` if they come from
    /// one, in a file of so many `streams`.
    pub fn streams(effort: Effort, streams: u32, kind: Option<StepKind>, vertices: u32) -> u32 {
        regions(streams, vertices, Positions::visit_by_support(effort, axis_order(kind)))
    }

    /// How many regions the pass over positions that has begun has.
    pub fn regions(&self) -> usize {
        match &self.open {
            Some(Open { course: Course::Mixed(regions), .. }) => regions.count(),
            _ => 1,
        }
    }

    /// How many vertices lie where they are expected: their positions are still to come.
    pub fn pending(&self) -> u32 {
        let late = self.late.as_ref().map_or(0, |late| late.estimates.len());
        let open = self.open.as_ref().map_or(0, |open| match &open.course {
            Course::Mixed(regions) => (self.surface.vertices - open.first) as usize - regions.coded(),
            Course::Tables(walk) => walk.left(),
            Course::Groups(groups) => groups.pending(),
        });
        (late + open) as u32
    }

    /// The positions as far as they are known: of vertices still to come where they are expected. Those of
    /// virtual vertices are meaningless. Nothing while those of the base are being coded.
    pub fn known_positions(&self) -> Option<Cow<'_, [Point]>> {
        let Some(open) = &self.open else { return Some((&self.field.positions).into()) };
        if open.estimates.is_empty() {
            return None;
        }
        let mut positions: Cow<[Point]> = (&self.field.positions).into();
        if let Some(lifted) = &open.lifted {
            lifted.undo(positions.to_mut());
        }
        Some(positions)
    }

    /// Codes the connectivity of a step. When encoding an `Adaptive` one, `split` and `flip` say
    /// what it is; otherwise they are ignored.
    ///
    /// # Errors
    /// When decoding: if the step does not lead to `faces` real faces or does not apply.
    pub fn connectivity<C: Coder>(
        &mut self,
        coder: &mut C,
        kind: StepKind,
        mut split: Vec<bool>,
        flip: Vec<bool>,
        vertices: u64,
    ) -> Result<Step> {
        let surface = &self.surface;
        let announced = |found: u64| {
            let found_vertices = found + (surface.vertices - surface.virtuals) as u64;
            if found_vertices != vertices {
                let cause = format!("{found_vertices} vertices, not as many as announced");
                return Err(Error::format("level", cause));
            }
            // A closed surface gains two faces with each vertex.
            check_faces(surface.faces() as u64 + 2 * found)
        };
        if !applies(surface, kind) {
            return Err(Error::format("level", "a step that does not apply to the boundary"));
        }
        if kind != StepKind::Adaptive {
            let estimates = predict_regular(surface, kind, &self.field.positions);
            announced(estimates.len() as u64)?;
            let refined = refine_regular(surface, kind)
                .ok_or_else(|| Error::format("level", "a step that does not apply to the boundary"))?;
            return Ok(Step { kind, refined, estimates });
        }
        split.resize(surface.faces() as usize, false);
        let sketch = Sketch::new(surface, &self.field.positions);
        let effort = self.effort;
        let (split_models, flip_models) =
            self.bits.get_or_insert_with(|| (SplitModels::new(effort), FlipModels::new(effort)));
        split_models.code(coder, surface, &sketch, &mut split);
        announced(split.iter().filter(|&&s| s).count() as u64)?;
        // What splits make of the surface does not wait for the flips; but for one thread the sketch goes first, for
        // the sake of memory.
        let at_once = parallel::threads() > 1;
        let (flips, (estimates, refined)) = parallel::join(
            split.len(),
            || flip_models.code(coder, surface, &sketch, &split, &flip),
            || {
                let estimates = estimate(surface, &self.field.positions, &sketch, &split);
                (estimates, at_once.then(|| split_faces(surface, &split)))
            },
        );
        drop(sketch);
        let mut refined = refined.unwrap_or_else(|| split_faces(surface, &split));
        flip_edges(surface, &split, &flips, &mut refined);
        Ok(Step { kind, refined, estimates })
    }

    /// The real vertices of the surface that `step` leads to, as they would lie without details: the
    /// old ones where they are, the new ones where they are expected.
    pub fn without_details(&self, step: &Step) -> Vec<Point> {
        let old = &self.field.positions[self.surface.virtuals as usize..];
        old.iter().copied().chain(step.estimates.iter().map(|&e| round(e))).collect()
    }

    /// Makes the surface of a step the current one and begins the pass over its new vertices, divided as `grouping`
    /// says.
    ///
    /// # Errors
    /// If the groups do not have as many vertices as the step.
    pub fn begin_step(&mut self, step: Step, rule: Update, grouping: Grouping) -> Result<()> {
        let Step { kind, refined: Refined { surface, first: heirs }, estimates } = step;
        let groups = match grouping {
            Grouping::Whole => None,
            Grouping::Open => Some(&[][..]),
            Grouping::Of(groups) => {
                if groups.iter().map(|&n| u64::from(n)).sum::<u64>() != estimates.len() as u64 {
                    return Err(Error::format("level", "its groups have not as many vertices as it"));
                }
                Some(groups)
            }
        };
        let first = self.surface.vertices;
        let coarse = std::mem::replace(&mut self.surface, surface);
        self.place(first, &estimates);
        let order = axis_order(Some(kind));
        let faces = lie_in_faces(kind, &coarse).then_some((&coarse, &heirs[..]));
        let course = match groups.filter(|_| GROUPS) {
            None => self.course(first, order, faces),
            Some(vertices) => {
                let models = self.tables.take().unwrap_or_else(TableModels::new);
                let sites = self.sites(first, faces);
                Course::Groups(Box::new(Groups::new(first, sites, vertices, models)))
            }
        };
        // Only undoing an update asks for the coarse surface again; else it goes before the pass takes memory.
        let lifted = match (kind, rule) {
            (StepKind::Adaptive, _) | (_, Update::None) => {
                drop(coarse);
                None
            }
            _ => Some(Lifted { coarse, kind, rule }),
        };
        drop(heirs);
        self.begin(first, estimates, order, &NEAR, course);
        if let Some(open) = &mut self.open {
            open.lifted = lifted;
        }
        // No group is left to end the pass of a step that adds nothing.
        if matches!(grouping, Grouping::Of([])) {
            self.end();
        }
        Ok(())
    }

    /// Makes the surface of a late step the current one: its new vertices lie where they are
    /// expected, smoothed together with those of the late levels before.
    pub fn late_step(&mut self, step: Step) {
        let first = self.late.as_ref().map_or(self.surface.vertices, |late| late.first);
        // Each goes when it has been used: smoothing is where a decoder's memory is highest.
        let Step { refined: Refined { surface, .. }, estimates, .. } = step;
        self.surface = surface;
        let known = self.field.positions[..first as usize].iter().map(|&p| precise(p));
        let before = self.late.take().into_iter().flat_map(|late| late.estimates);
        let spare = FRACTION_BITS - ESTIMATE_BITS;
        let new = estimates
            .into_iter()
            .map(|e| e.map(|x| (x >> spare).clamp(i32::MIN as i64, i32::MAX as i64) as i32));
        let mut points: Vec<Point> = Vec::with_capacity(self.surface.vertices as usize);
        points.extend(known);
        points.extend(before);
        points.extend(new);
        relax(&self.surface, &mut points, first, self.effort);
        let estimates = points.split_off(first as usize);
        let positions = &mut self.field.positions;
        positions.reserve_exact(self.surface.vertices as usize - positions.len());
        positions.truncate(first as usize);
        positions.extend(estimates.iter().map(|&p| rounded(p)));
        self.late = Some(Late { first, estimates });
    }

    /// The first vertex whose position is still to come, if any is.
    pub fn first_late(&self) -> Option<u32> {
        self.late.as_ref().map(|late| late.first)
    }

    /// Begins the pass over the vertices of late levels.
    pub fn begin_late(&mut self) {
        let Some(Late { first, estimates }) = self.late.take() else { return };
        let spare = FRACTION_BITS - ESTIMATE_BITS;
        let estimates: Vec<Vector> = estimates.iter().map(|e| e.map(|x| (x as i64) << spare)).collect();
        // How far estimates are off is nothing that coarser levels could tell.
        self.position.clear();
        self.tables = None;
        self.place(first, &estimates);
        let course = self.course(first, AxisOrder::NormalLast, None);
        self.begin(first, estimates, AxisOrder::NormalLast, &LATE, course);
    }
}

/// The order of axes on the surface that a step leads to; in the base without one.
fn axis_order(kind: Option<StepKind>) -> AxisOrder {
    match kind {
        None | Some(StepKind::Adaptive) => AxisOrder::NormalLast,
        Some(_) => AxisOrder::NormalFirst,
    }
}

/// Memory that the region of a base takes while it grows.
const BYTES_PER_BASE_FACE: u64 = 100;

/// Fails if corners could not be numbered.
fn check_faces(faces: u64) -> Result<()> {
    if 3 * faces >= NONE.into() {
        return Err(Error::format("level", format!("{faces} faces are more than can be numbered")));
    }
    Ok(())
}
