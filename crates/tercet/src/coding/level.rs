//! A level: connectivity, then positions, in both directions.

use super::axes::AxisOrder;
use super::base::code_base;
use super::counted::CountedModels;
#[cfg(feature = "max")]
use super::ensemble::EnsembleModels;
use super::flip::FlipModels;
use super::model::number;
use super::pass::{Pass, Progress, Roughness};
use super::position::PositionModels;
use super::predict::estimate;
use super::relax::{ESTIMATE_BITS, precise, relax, rounded};
use super::ring::{LATE, NEAR, Shares};
use super::shape::Shapes;
use super::site::{in_faces, in_rings, lie_in_faces};
use super::sketch::Sketch;
use super::split::SplitModels;
use super::tabled::{TableModels, Walk};
use super::traversal::Traversal;
use super::vector::{COORDINATE_LIMIT, Point, Vector};
use crate::entropy::Coder;
use crate::mesh::{NONE, Surface};
use crate::subdivide::{
    FRACTION_BITS, Refined, StepKind, Update, applies, flipped, predict_regular, refine, refine_regular,
    round, unlift_positions,
};
use crate::{Effort, Error, Limits, Result};
use std::borrow::Cow;

/// All models and the surface they have reached; the same in encoder and decoder.
pub(crate) struct Levels {
    split: SplitModels,
    flip: FlipModels,
    /// Both kinds of bits in the fast profile.
    counted: Option<CountedModels>,
    /// Positions of irregular levels, unless they are coded by tables.
    mixed: Option<Positions>,
    tables: Option<TableModels>,
    effort: Effort,
    /// The finest surface so far.
    pub surface: Surface,
    /// Its positions; those of virtual vertices are meaningless.
    pub positions: Vec<Point>,
    rough: Vec<Roughness>,
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

/// The mixed models of positions.
enum Positions {
    Mixed(Box<PositionModels>),
    #[cfg(feature = "max")]
    Ensemble(Box<EnsembleModels>),
}

impl Positions {
    fn new(effort: Effort) -> Self {
        match effort {
            #[cfg(feature = "max")]
            Effort::Max => Positions::Ensemble(Box::new(EnsembleModels::new())),
            _ => Positions::Mixed(Box::new(PositionModels::new())),
        }
    }
}

/// A pass over positions that has begun and not ended.
struct Open {
    first: u32,
    estimates: Vec<Vector>,
    order: AxisOrder,
    shares: &'static Shares,
    bits: u32,
    origin: Point,
    course: Course,
    lifted: Option<Lifted>,
}

/// How far a pass has come.
enum Course {
    Mixed(Progress),
    Tables(Walk),
}

impl Course {
    /// How many vertices are still to be visited.
    fn left(&self) -> usize {
        match self {
            Course::Mixed(progress) => progress.traversal.left(),
            Course::Tables(walk) => walk.left(),
        }
    }
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
    pub fn new(effort: Effort) -> Self {
        Levels {
            split: SplitModels::new(effort),
            flip: FlipModels::new(effort),
            counted: None,
            mixed: None,
            tables: None,
            effort,
            surface: Surface::default(),
            positions: Vec::new(),
            rough: Vec::new(),
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

    /// Begins the pass over the base's positions, one entry a vertex when encoding, else ignored.
    pub fn begin_base<C: Coder>(&mut self, coder: &mut C, positions: &[Point]) {
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
        self.positions = vec![[0; 3]; virtuals];
        self.begin(self.surface.virtuals, Vec::new(), AxisOrder::NormalLast, &NEAR, None);
        if let Some(open) = &mut self.open {
            (open.bits, open.origin) = (bits, origin);
        }
    }

    /// Begins a pass over the positions of the vertices from `first` on, which have these estimates. Until
    /// they are coded they lie there.
    fn begin(
        &mut self,
        first: u32,
        estimates: Vec<Vector>,
        order: AxisOrder,
        shares: &'static Shares,
        refined: Option<(&Surface, &[u32])>,
    ) {
        let surface = &self.surface;
        self.positions.truncate(first as usize);
        self.positions.extend(estimates.iter().map(|&e| round(e)));
        self.positions.resize(surface.vertices as usize, [0; 3]);
        self.rough.resize(surface.vertices as usize, Roughness::START);
        // Where details are normal ones mixing saves too little for its time.
        let regular = order == AxisOrder::NormalFirst;
        let course = if self.effort == Effort::Fast || regular && !self.effort.is_max() {
            let sites = match refined {
                Some((coarse, heirs)) => in_faces(coarse, heirs, surface, &self.positions),
                None => in_rings(surface, first, &self.positions),
            };
            Course::Tables(Walk::new(sites))
        } else {
            let traversal = match order {
                AxisOrder::NormalLast => Traversal::by_support(surface, first),
                AxisOrder::NormalFirst => Traversal::by_number(surface, first),
            };
            #[cfg(feature = "max")]
            if let Positions::Ensemble(models) = self.mixed.get_or_insert_with(|| Positions::new(self.effort))
            {
                models.begin(surface, first, &self.positions, &self.rough);
            }
            Course::Mixed(Progress::new(traversal, estimates.len()))
        };
        self.open =
            Some(Open { first, estimates, order, shares, bits: 0, origin: [0; 3], course, lifted: None });
    }

    /// Codes the positions of the pass that has begun, of `targets` when encoding: one entry a vertex of it.
    /// Whether all are coded; if not, bytes are missing, and the next call goes on. Time O(n).
    pub fn positions<C: Coder>(&mut self, coder: &mut C, targets: &[Point]) -> bool {
        let Some(mut open) = self.open.take() else { return true };
        let pass = Pass {
            surface: &self.surface,
            first: open.first,
            estimates: &open.estimates,
            order: open.order,
            shares: open.shares,
            bits: open.bits,
            origin: open.origin,
        };
        let (positions, rough) = (&mut self.positions, &mut self.rough);
        let done = match &mut open.course {
            Course::Tables(walk) => {
                let models = self.tables.get_or_insert_with(TableModels::new);
                models.code(coder, &pass, walk, targets, positions, rough)
            }
            Course::Mixed(progress) => match self.mixed.get_or_insert_with(|| Positions::new(self.effort)) {
                Positions::Mixed(models) => models.code(coder, &pass, progress, targets, positions, rough),
                #[cfg(feature = "max")]
                Positions::Ensemble(models) => models.code(coder, &pass, progress, targets, positions, rough),
            },
        };
        match (done, &open.lifted) {
            (false, _) => self.open = Some(open),
            (true, Some(lifted)) => lifted.undo(&mut self.positions),
            (true, None) => {}
        }
        done
    }

    /// How many vertices lie where they are expected: their positions are still to come.
    pub fn pending(&self) -> u32 {
        let late = self.late.as_ref().map_or(0, |late| late.estimates.len());
        let open = self.open.as_ref().map_or(0, |open| open.course.left());
        (late + open) as u32
    }

    /// The positions as far as they are known: of vertices still to come where they are expected. Those of
    /// virtual vertices are meaningless. Nothing while those of the base are being coded.
    pub fn known_positions(&self) -> Option<Cow<'_, [Point]>> {
        match &self.open {
            Some(open) if open.estimates.is_empty() => None,
            Some(Open { lifted: Some(lifted), .. }) => {
                let mut positions = self.positions.clone();
                lifted.undo(&mut positions);
                Some(positions.into())
            }
            _ => Some((&self.positions).into()),
        }
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
        mut flip: Vec<bool>,
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
            let estimates = predict_regular(surface, kind, &self.positions);
            announced(estimates.len() as u64)?;
            let refined = refine_regular(surface, kind)
                .ok_or_else(|| Error::format("level", "a step that does not apply to the boundary"))?;
            return Ok(Step { kind, refined, estimates });
        }
        split.resize(surface.faces() as usize, false);
        if self.effort == Effort::Fast {
            let models = self.counted.get_or_insert_with(CountedModels::new);
            let sketch = Sketch::new(surface, &self.positions);
            models.split(coder, surface, &sketch, &mut split);
            announced(split.iter().filter(|&&s| s).count() as u64)?;
            let normal = |v: u32| sketch.vertex[v as usize].normal;
            let estimates = estimate(surface, &self.positions, normal, &split);
            let flips = models.flip(coder, surface, &sketch, &split, &flip);
            return Ok(Step { kind, refined: refine(surface, &split, &flips), estimates });
        }
        flip.resize(surface.vertex.len(), false);
        let shapes = Shapes::new(surface, &self.positions);
        self.split.code(coder, surface, &shapes, &self.positions, &mut split);
        announced(split.iter().filter(|&&s| s).count() as u64)?;
        let estimates = estimate(surface, &self.positions, |v| shapes.vertex[v as usize].normal, &split);
        self.positions.extend(estimates.iter().map(|&e| round(e)));
        self.flip.code(coder, surface, &shapes, &self.positions, &split, &mut flip);
        self.positions.truncate(surface.vertices as usize);
        Ok(Step { kind, refined: refine(surface, &split, &flipped(surface, &flip)), estimates })
    }

    /// The real vertices of the surface that `step` leads to, as they would lie without details: the
    /// old ones where they are, the new ones where they are expected.
    pub fn without_details(&self, step: &Step) -> Vec<Point> {
        let old = &self.positions[self.surface.virtuals as usize..];
        old.iter().copied().chain(step.estimates.iter().map(|&e| round(e))).collect()
    }

    /// Makes the surface of a step the current one and begins the pass over its new vertices.
    pub fn begin_step(&mut self, step: Step, rule: Update) {
        let first = self.surface.vertices;
        let coarse = std::mem::replace(&mut self.surface, step.refined.surface);
        let kind = step.kind;
        let order = if kind == StepKind::Adaptive { AxisOrder::NormalLast } else { AxisOrder::NormalFirst };
        let heirs = step.refined.first;
        let refined = lie_in_faces(kind, &coarse).then_some((&coarse, &heirs[..]));
        self.begin(first, step.estimates, order, &NEAR, refined);
        // Only undoing an update asks for the coarse surface again.
        if let Some(open) = &mut self.open
            && kind != StepKind::Adaptive
            && rule != Update::None
        {
            open.lifted = Some(Lifted { coarse, kind, rule });
        }
    }

    /// Makes the surface of a late step the current one: its new vertices lie where they are
    /// expected, smoothed together with those of the late levels before.
    pub fn late_step(&mut self, step: Step) {
        let first = self.late.as_ref().map_or(self.surface.vertices, |late| late.first);
        let known = self.positions[..first as usize].iter().map(|&p| precise(p));
        let before = self.late.take().into_iter().flat_map(|late| late.estimates);
        let spare = FRACTION_BITS - ESTIMATE_BITS;
        let new = step
            .estimates
            .iter()
            .map(|e| e.map(|x| (x >> spare).clamp(i32::MIN as i64, i32::MAX as i64) as i32));
        let mut points: Vec<Point> = known.chain(before).chain(new).collect();
        self.surface = step.refined.surface;
        relax(&self.surface, &mut points, first, self.effort);
        let estimates = points.split_off(first as usize);
        self.positions.truncate(first as usize);
        self.positions.extend(estimates.iter().map(|&p| rounded(p)));
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
        let estimates = estimates.iter().map(|e| e.map(|x| (x as i64) << spare)).collect();
        // How far estimates are off is nothing that coarser levels could tell.
        (self.mixed, self.tables) = (None, None);
        self.begin(first, estimates, AxisOrder::NormalLast, &LATE, None);
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
