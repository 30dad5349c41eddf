//! Positions with as many opinions as pay: those of the `max` profile.
//!
//! Vertices, their order and the way a coordinate is taken apart are those of [`position`](super::position).
//! What is added are experts from beyond the ring, histograms, and a memory of how far each expert was off at
//! each vertex. By that memory every expert has a scale of its own, and their mean, each weighted by how well
//! it did around, is the centre of the coordinate's decisions.

use super::axes::{AxisOrder, KINDS, axes, is_across, kind, shift};
use super::beyond::Beyond;
use super::histogram::Histogram;
use super::opinions::INITIAL;
use super::pass::{Pass, Progress, Roughness, plain};
use super::residual::{Candidates, Expert, ResidualModels, Situation};
use super::ring::{Neighbourhood, Ring};
use super::scale::{Scale, ScaleCell, bin, ratio};
use super::spread::{Cells, FineSpread};
use super::vector::{Point, Vector};
use crate::entropy::Coder;
use crate::mesh::Surface;
use crate::subdivide::FRACTION_BITS;

/// What is asked about a coordinate; see [`ResidualModels`].
const EXPERTS: usize = 11;
const CONTEXTS: usize = 5;
const LISTS: usize = 4;
const SETS: usize = 5;
const HISTOGRAMS: usize = 1;
pub(super) const VECTORS: usize = 3;
type Residual = ResidualModels<EXPERTS, CONTEXTS, LISTS, SETS, HISTOGRAMS, VECTORS>;

/// Experts by their numbers. Further ones: 2 the corrected estimate, 3 the mean of the parallelograms, 4 the second nearest of
/// them, 5 the mean of the known neighbours, 6 the estimate as it is, 8 the mean of the reflections.
const BLEND: usize = 0;
const NEAREST: usize = 1;
const REFLECTION: usize = 7;
const LAPLACIAN: usize = 9;
const EXPECTED: usize = 10;

const DISTANCES: usize = 8;
const TRAILS: usize = 64;

/// How far each expert was off at a vertex.
type Trail = [Roughness; EXPERTS];

/// The models of positions; they live as long as the file.
#[derive(Clone)]
pub(crate) struct EnsembleModels {
    residual: Residual,
    spread: FineSpread,
    /// By expert, kind of axis, distance from the first expert and how far it was off around.
    by_trail: Vec<ScaleCell>,
    /// The known coordinates of each axis.
    histograms: [Histogram; 3],
    /// An entry a vertex, during a pass.
    trails: Vec<Trail>,
}

/// A vertex about to be coded.
struct Vertex<'a> {
    around: Neighbourhood<'a>,
    beyond: &'a Beyond,
    experts: [Vector; EXPERTS],
    /// The mean of the known neighbours' trails.
    trail: Trail,
}

impl EnsembleModels {
    pub fn new() -> Self {
        EnsembleModels {
            residual: Residual::new([243, 1536, 1728, 1728, 243], [24, 120, 144, 72, 3], initial_weights),
            spread: FineSpread::new(),
            by_trail: vec![ScaleCell::default(); EXPERTS * KINDS * DISTANCES * TRAILS],
            histograms: [(); 3].map(|()| Histogram::new()),
            trails: Vec::new(),
        }
    }

    /// Begins a pass over the vertices from `first` on. Time O(n).
    pub fn begin(&mut self, surface: &Surface, first: u32, positions: &[Point], rough: &[Roughness]) {
        self.trails.clear();
        self.trails.extend(rough.iter().map(|&rough| [rough; EXPERTS]));
        self.histograms.iter_mut().for_each(Histogram::clear);
        let known = surface.virtuals as usize..first as usize;
        positions[known].iter().for_each(|&p| self.count(p));
    }

    fn count(&mut self, point: Point) {
        self.histograms.iter_mut().zip(point).for_each(|(histogram, x)| histogram.add(x));
    }

    /// As [`PositionModels::code`](super::position::PositionModels::code).
    pub fn code<C: Coder>(
        &mut self,
        coder: &mut C,
        pass: &Pass,
        progress: &mut Progress,
        targets: &[Point],
        positions: &mut [Point],
        rough: &mut [Roughness],
    ) -> bool {
        let (mut ring, mut beyond) = (Ring::default(), Beyond::default());
        progress.run(coder, pass, targets, positions, |coder, turn| {
            ring.gather(pass, turn);
            let point = if ring.known() == 0 {
                plain(coder, pass, turn.target)
            } else {
                beyond.gather(pass.surface, turn.corner, turn.known, turn.positions);
                let around = Neighbourhood::new(&ring, pass, turn, rough);
                let vertex = Vertex::new(around, &ring, &beyond, &self.trails, turn.estimate);
                let (point, trail) = self.vertex(coder, &vertex, pass.order, turn.target);
                Roughness::spread(rough, turn.v, trail[EXPECTED], ring.vertices());
                self.remember(turn.v, trail, ring.vertices());
                point
            };
            self.count(point);
            point
        })
    }

    /// Notes the trail of a vertex there and at its neighbours.
    fn remember(&mut self, v: u32, trail: Trail, neighbours: &[u32]) {
        self.trails[v as usize] = trail;
        for &y in neighbours {
            self.trails[y as usize].iter_mut().zip(trail).for_each(|(trail, off)| trail.blend(off));
        }
    }

    fn vertex<C: Coder>(
        &mut self,
        coder: &mut C,
        vertex: &Vertex,
        order: AxisOrder,
        target: Point,
    ) -> (Point, Trail) {
        let normal = vertex.around.normal;
        let axes = axes(normal, order);
        let mut centres = vertex.experts;
        let mut point = target;
        let mut sizes = [[0u64; 3]; EXPERTS];
        for (step, &axis) in axes.iter().enumerate() {
            let kind = kind(step, order, vertex.around.at_boundary);
            let across = is_across(step, order);
            let trail = vertex.trail.map(|off| if across { off.normal } else { off.tangential });
            let mut centre = centres.map(|c| c[axis]);
            centre[BLEND] = blend(&centre, &trail);
            let value = self.coordinate(coder, vertex, [kind, axis], &centre, &trail, target[axis]);
            point[axis] = value;
            let off = centre.map(|c| ((value as i64) << FRACTION_BITS) - c);
            sizes.iter_mut().zip(off).for_each(|(sizes, off)| sizes[step] = off.unsigned_abs());
            shift(&mut centres, off, normal, axes, step, order);
        }
        (point, sizes.map(|sizes| Roughness::of(sizes, order)))
    }

    fn coordinate<C: Coder>(
        &mut self,
        coder: &mut C,
        vertex: &Vertex,
        [kind, axis]: [usize; 2],
        centre: &[i64; EXPERTS],
        trail: &[u32; EXPERTS],
        target: i32,
    ) -> i32 {
        let around = &vertex.around;
        let place = Cells::new(around, kind);
        let main = self.spread.mean(&place);
        let mut experts = [Expert { centre: centre[BLEND], scale: Scale::new(main) }; EXPERTS];
        let mut cells = [0; EXPERTS];
        for j in 1..EXPERTS {
            let distance = centre[j].abs_diff(centre[BLEND]);
            let apart = ratio(distance + 12, main + 50, DISTANCES);
            cells[j] =
                ((j * KINDS + kind) * DISTANCES + apart) * TRAILS + bin(trail[j] as u64 + 8, 4, -6, TRAILS);
            let mean = self.by_trail[cells[j]].mean(main + distance / 2);
            experts[j] = Expert { centre: centre[j], scale: Scale::new(mean) };
        }
        let situation = situation(vertex, &self.histograms[axis], &experts, [kind, axis], main, trail[BLEND]);
        let value = self.residual.code(coder, target, &experts, &situation);
        let off = |e: &Expert| ((value as i64) << FRACTION_BITS).abs_diff(e.centre);
        self.spread.learn(&place, off(&experts[BLEND]));
        for j in 1..EXPERTS {
            self.by_trail[cells[j]].learn(off(&experts[j]));
        }
        value
    }
}

/// The contexts of a coordinate; `off` is how far the blend was off around.
fn situation<'a>(
    vertex: &Vertex,
    histogram: &'a Histogram,
    experts: &[Expert; EXPERTS],
    [kind, axis]: [usize; 2],
    main: u64,
    off: u32,
) -> Situation<'a, CONTEXTS, LISTS, SETS, HISTOGRAMS> {
    let around = &vertex.around;
    let first = experts[BLEND];
    let log = first.scale.log;
    let scale = (log / 4).saturating_sub(8).min(23);
    // In which of nine bins of the scale another expectation lies.
    let beside = |other: i64| {
        let apart = first.scale.standardise(other - first.centre) as i64;
        (((apart * 9) >> 11) + 4).clamp(0, 8) as usize
    };
    let [nearest, expected, reflection, laplacian] =
        [NEAREST, EXPECTED, REFLECTION, LAPLACIAN].map(|j| beside(experts[j].centre));
    let second = beside(around.second[axis]);
    let fine = log.saturating_sub(24).min(63);
    let fraction = ((first.centre & 255) >> 5) as usize;
    let off = bin(off as u64 + 8, 2, -6, 24);
    let contexts = |mirror: bool| {
        let turn = |x: usize| if mirror { 8 - x } else { x };
        [
            (turn(nearest) * 9 + turn(second)) * 3 + kind,
            (fine * 8 + if mirror { 7 - fraction } else { fraction }) * 3 + kind,
            (fine * 9 + turn(expected)) * 3 + kind,
            (scale * 24 + off) * 3 + kind,
            (turn(reflection) * 9 + turn(laplacian)) * 3 + kind,
        ]
    };
    let parallelograms = around.parallelograms.min(3);
    let apart = |j: usize, bins: usize| ratio(experts[j].centre.abs_diff(first.centre) + 25, main + 50, bins);
    let class = around.class + if vertex.beyond.reflections.is_empty() { 0 } else { 6 };
    Situation {
        above: contexts(false),
        below: contexts(true),
        sets: [
            scale,
            (parallelograms * 5 + apart(NEAREST, 5)) * 3 + kind + if parallelograms == 0 { 60 } else { 0 },
            (class.min(11) * 4 + apart(EXPECTED, 4)) * 3 + kind,
            off * 3 + kind,
            kind,
        ],
        candidates: vertex.candidates(axis, experts),
        trust: first.scale.unit().min(7) as usize * 3 + kind,
        histograms: [histogram],
    }
}

impl<'a> Vertex<'a> {
    fn new(
        around: Neighbourhood<'a>,
        ring: &Ring,
        beyond: &'a Beyond,
        trails: &[Trail],
        estimate: Option<&Vector>,
    ) -> Self {
        let [expected, nearest, corrected] = around.predictions;
        let [reflection, reflected] = beyond.reflected(expected).unwrap_or([expected; 2]);
        let smooth = beyond.laplacian().map(|off| [0, 1, 2].map(|k| around.mean[k] + off[k]));
        let experts = [
            // The blend is made for each axis anew.
            expected,
            nearest,
            corrected,
            around.parallel,
            around.second,
            around.mean,
            estimate.copied().unwrap_or(expected),
            reflection,
            reflected,
            smooth.unwrap_or(expected),
            expected,
        ];
        let count = ring.known() as u64;
        let mut trail = [Roughness::START; EXPERTS];
        for (j, mean) in trail.iter_mut().enumerate() {
            let around = ring.vertices().iter().map(|&y| trails[y as usize][j]);
            let [tangential, normal] =
                around.fold([0, 0], |[t, n], off| [t + off.tangential as u64, n + off.normal as u64]);
            *mean = Roughness { tangential: (tangential / count) as u32, normal: (normal / count) as u32 };
        }
        Vertex { around, beyond, experts, trail }
    }

    /// Values of an axis that may repeat: the neighbours', the parallelograms', where the first experts
    /// expect it, and those across the ring's edges.
    fn candidates(&self, axis: usize, experts: &[Expert; EXPERTS]) -> [Candidates; LISTS] {
        let mut lists = [Candidates::EMPTY; LISTS];
        let rounded = |centre: i64| (centre + 128) >> FRACTION_BITS;
        let middle = rounded(experts[BLEND].centre);
        for (list, (values, count)) in lists.iter_mut().zip(self.around.candidates(axis)) {
            values[..count].iter().for_each(|&x| list.push(x as i64 - middle));
        }
        experts.iter().for_each(|e| lists[2].push(rounded(e.centre) - middle));
        self.beyond.across.iter().for_each(|p| lists[3].push(p[axis] as i64 - middle));
        lists
    }
}

/// The mean of the experts but the first, each weighted by the third power of how little it was off around.
fn blend(centre: &[i64; EXPERTS], trail: &[u32; EXPERTS]) -> i64 {
    let off = trail.map(|off| off as u64 + 16);
    let least = off[1..].iter().copied().min().unwrap_or(1);
    let (mut sum, mut total) = (0i64, 0i64);
    for j in 1..EXPERTS {
        let share = ((least << 8) / off[j]) as i64;
        let weight = (((share * share) >> 8) * share) >> 8;
        sum += weight * (centre[j] - centre[EXPECTED]).clamp(-FAR, FAR);
        total += weight;
    }
    centre[EXPECTED] + sum / total.max(1)
}

/// No expert draws the blend further than this.
const FAR: i64 = 1 << 37;

fn initial_weights(node: usize) -> [[i16; 8]; VECTORS] {
    INITIAL[match node {
        0 => 0,
        1 => 1,
        2..=3 => 2,
        4..=7 => 3,
        8..=12 => 4,
        _ => 5,
    }]
}
