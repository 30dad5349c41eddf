//! Positions with as many opinions as pay: those of the `max` profile.
//!
//! Vertices, their order and the way a coordinate is taken apart are those of [`position`](super::position).
//! What is added are experts from beyond the ring, histograms, and a memory of how far each expert was off at
//! each vertex. By that memory every expert has a scale of its own, and their mean is weighted by how well each
//! did around. What the experts were off from that mean together tells where the coordinate is, by least
//! squares: this is the centre of its decisions.

use super::axes::{AxisOrder, KINDS, axes, is_across, kind, shift};
use super::beyond::Beyond;
use super::coordinate::Expert;
use super::deviation::{Deviation, Forecast, HINTS, octaves};
use super::histogram::Histogram;
use super::opinions::{INITIAL, row};
use super::pass::{Pass, Progress, Roughness, plain};
use super::regression::{Regression, standardise};
use super::residual::{Candidates, ResidualModels, Situation};
use super::ring::{Neighbourhood, Ring};
use super::scale::{Scale, ScaleCell, bin, ratio};
use super::spread::{Cells, FineSpread};
use super::twin::TwinModels;
use super::vector::{Point, Vector, add_to};
use crate::entropy::Coder;
use crate::mesh::Surface;
use crate::subdivide::FRACTION_BITS;

/// What is asked about a coordinate; see [`ResidualModels`].
const EXPERTS: usize = 13;
const CONTEXTS: usize = 5;
const LISTS: usize = 4;
const SETS: usize = 5;
const HISTOGRAMS: usize = 1;
pub(super) const VECTORS: usize = 3;
type Residual = ResidualModels<EXPERTS, CONTEXTS, LISTS, SETS, HISTOGRAMS, VECTORS>;

/// Experts by their numbers. Further ones: 2 the corrected estimate, 3 the mean of the parallelograms, 4 the second nearest of
/// them, 5 the mean of the known neighbours, 6 the estimate as it is, 8 the mean of the reflections.
const FIT: usize = 0;
const NEAREST: usize = 1;
const SECOND: usize = 4;
const REFLECTION: usize = 7;
const LAPLACIAN: usize = 9;
const EXPECTED: usize = 10;
const BLEND: usize = 11;
/// The fit once more, as far off as its place alone says.
const PLAIN: usize = 12;

/// Points around a vertex: at the experts' numbers theirs, if they are points, and in place of the blend the
/// expected one, moved by what that was off around.
const POINTS: usize = 12;

/// Experts whose errors are remembered: all but the last.
const TRAILED: usize = 12;

/// What the fit is told from: all points but the first, which is none.
const FEATURES: usize = POINTS - 1;
/// Classes of neighbourhoods.
const CLASSES: usize = 7;

const DISTANCES: usize = 8;
const TRAILS: usize = 64;

/// How far each expert was off at a vertex.
type Trail = [Roughness; TRAILED];

/// The models of positions; they live as long as the file.
#[derive(Clone)]
pub(crate) struct EnsembleModels {
    residual: Residual,
    spread: FineSpread,
    /// By expert, kind of axis, distance from the first expert and how far it was off around.
    by_trail: Vec<ScaleCell>,
    /// The known coordinates of each axis.
    histograms: [Histogram; 3],
    /// What the points tell of the coordinate, by kind of axis and class of the neighbourhood.
    fits: Vec<Regression<FEATURES>>,
    deviation: Deviation,
    twins: TwinModels,
    /// An entry a vertex, during a pass.
    trails: Vec<Trail>,
    /// By how much the expected point was off, in 1/256; an entry a vertex, during a pass.
    errors: Vec<[i32; 3]>,
}

/// A vertex about to be coded.
struct Vertex<'a> {
    around: Neighbourhood<'a>,
    beyond: &'a Beyond,
    points: [Vector; POINTS],
    /// The mean of the known neighbours' trails.
    trail: Trail,
}

/// A coordinate about to be coded.
struct Coordinate {
    axis: usize,
    kind: usize,
    place: Cells,
    /// How far the first expert should be off by its place, in 1/256.
    spread: u64,
    centre: [i64; EXPERTS],
    /// How far each expert was off around, in 1/256.
    trail: [u32; TRAILED],
    /// By how many octaves the earlier axes were further off than their places said.
    earlier: [i64; 2],
}

impl EnsembleModels {
    pub fn new() -> Self {
        EnsembleModels {
            residual: Residual::new([243, 1536, 1728, 1728, 243], [24, 120, 144, 72, 3], initial_weights),
            spread: FineSpread::new(),
            by_trail: vec![ScaleCell::default(); TRAILED * KINDS * DISTANCES * TRAILS],
            histograms: [(); 3].map(|()| Histogram::new()),
            fits: vec![Regression::NEW; KINDS * CLASSES],
            deviation: Deviation::new(),
            twins: TwinModels::new(),
            trails: Vec::new(),
            errors: Vec::new(),
        }
    }

    /// Begins a pass over the vertices from `first` on. Time O(n).
    pub fn begin(&mut self, surface: &Surface, first: u32, positions: &[Point], rough: &[Roughness]) {
        self.trails.clear();
        self.trails.extend(rough.iter().map(|&rough| [rough; TRAILED]));
        self.errors.clear();
        self.errors.resize(rough.len(), [0; 3]);
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
        progress.run(coder, pass, targets, positions, |coder, turn, twins| {
            ring.gather(pass, turn);
            let point = if ring.known() == 0 {
                plain(coder, pass, turn.target)
            } else {
                beyond.gather(pass.surface, turn.corner, turn.known, turn.positions);
                let around = Neighbourhood::new(&ring, pass, turn, rough);
                let vertex = Vertex::new(around, &ring, &beyond, self, turn.estimate);
                let expected = vertex.points[EXPECTED];
                let twin = self.twins.code(coder, twins, expected, turn.target, turn.positions);
                let (point, trail) = match twin {
                    Some(point) => {
                        let normal = vertex.around.normal;
                        (point, vertex.points.map(|p| Roughness::at(point, p, normal, pass.order)))
                    }
                    None => self.vertex(coder, &vertex, pass.order, turn.target),
                };
                Roughness::spread(rough, turn.v, trail[EXPECTED], ring.vertices());
                self.remember(turn.v, trail, ring.vertices());
                self.errors[turn.v as usize] = [0, 1, 2].map(|k| clamp(exact(point[k]) - expected[k]));
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
        let mut points = vertex.points;
        let mut point = target;
        let mut sizes = [[0u64; 3]; TRAILED];
        let mut earlier = [0; 2];
        for (step, &axis) in axes.iter().enumerate() {
            let kind = kind(step, order, vertex.around.at_boundary);
            let across = is_across(step, order);
            let trail = vertex.trail.map(|off| if across { off.normal } else { off.tangential });
            let place = Cells::new(&vertex.around, kind);
            let spread = self.spread.mean(&place);
            let centre = points.map(|p| p[axis]);
            let blend = blend(&centre, &trail);
            let features = std::array::from_fn(|j| standardise(centre[j + 1] - blend, spread));
            let set = kind * CLASSES + vertex.around.class;
            let more = (self.fits[set].predict(&features) * spread.min(MOST) as i64) >> 16;
            let centre = experts(&centre, blend, blend + more);
            let coordinate = Coordinate { axis, kind, place, spread, centre, trail, earlier };
            let value = self.coordinate(coder, vertex, &coordinate, target[axis]);
            point[axis] = value;
            self.fits[set].learn(&features, standardise(exact(value) - blend, spread));
            let off = centre.map(|c| exact(value) - c);
            sizes.iter_mut().zip(off).for_each(|(sizes, off)| sizes[step] = off.unsigned_abs());
            if let Some(earlier) = earlier.get_mut(step) {
                *earlier = octaves(off[FIT].unsigned_abs(), spread);
            }
            let off = points.map(|p| exact(value) - p[axis]);
            shift(&mut points, off, normal, axes, step, order);
        }
        (point, sizes.map(|sizes| Roughness::of(sizes, order)))
    }

    fn coordinate<C: Coder>(&mut self, coder: &mut C, vertex: &Vertex, c: &Coordinate, target: i32) -> i32 {
        let Coordinate { axis, kind, spread, centre, .. } = *c;
        let forecast = c.forecast(vertex, &self.deviation);
        let mut experts = centre.map(|centre| Expert { centre, scale: Scale::new(spread) });
        experts[FIT].scale = Scale::new(forecast.mean);
        let mut cells = [0; TRAILED];
        for (j, cell) in cells.iter_mut().enumerate().skip(1) {
            let distance = centre[j].abs_diff(centre[FIT]);
            let apart = ratio(distance + 12, spread + 50, DISTANCES);
            let off = bin(c.trail[j] as u64 + 8, 4, -6, TRAILS);
            *cell = ((j * KINDS + kind) * DISTANCES + apart) * TRAILS + off;
            experts[j].scale = Scale::new(self.by_trail[*cell].mean(spread + distance / 2));
        }
        let situation = situation(vertex, &self.histograms[axis], &experts, c);
        let value = self.residual.code(coder, target, &experts, &situation);
        let off = |j: usize| exact(value).abs_diff(centre[j]);
        self.spread.learn(&c.place, off(FIT));
        self.deviation.learn(&forecast, off(FIT));
        for (j, cell) in cells.into_iter().enumerate().skip(1) {
            self.by_trail[cell].learn(off(j));
        }
        value
    }
}

impl Coordinate {
    fn forecast(&self, vertex: &Vertex, deviation: &Deviation) -> Forecast {
        let points = &self.centre[NEAREST..=EXPECTED];
        let apart = points.iter().map(|c| c.abs_diff(self.centre[FIT])).sum::<u64>() / points.len() as u64;
        let around = &vertex.around;
        let off = [FIT, EXPECTED].map(|j| self.trail[j] as u64);
        let hints: [u64; HINTS] = [off[0], off[1], apart, around.extent(self.axis), around.edge];
        deviation.forecast(self.kind, self.spread, hints, self.earlier)
    }
}

/// The contexts of a coordinate.
fn situation<'a>(
    vertex: &Vertex,
    histogram: &'a Histogram,
    experts: &[Expert; EXPERTS],
    coordinate: &Coordinate,
) -> Situation<'a, CONTEXTS, LISTS, SETS, HISTOGRAMS> {
    let Coordinate { axis, kind, spread, trail, .. } = *coordinate;
    let around = &vertex.around;
    let first = experts[FIT];
    let log = first.scale.log;
    let scale = (log / 4).saturating_sub(8).min(23);
    // In which of nine bins of the scale another expectation lies.
    let beside = |other: i64| {
        let apart = first.scale.standardise(other - first.centre) as i64;
        (((apart * 9) >> 11) + 4).clamp(0, 8) as usize
    };
    let [nearest, expected, reflection, laplacian] =
        [NEAREST, EXPECTED, REFLECTION, LAPLACIAN].map(|j| beside(experts[j].centre));
    let second = beside(vertex.points[SECOND][axis]);
    let fine = log.saturating_sub(24).min(63);
    let fraction = ((first.centre & 255) >> 5) as usize;
    let off = bin(trail[FIT] as u64 + 8, 2, -6, 24);
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
    let apart =
        |j: usize, bins: usize| ratio(experts[j].centre.abs_diff(first.centre) + 25, spread + 50, bins);
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
        models: &EnsembleModels,
        estimate: Option<&Vector>,
    ) -> Self {
        let Neighbourhood { expected, corrected, .. } = around;
        let [nearest, second] = around.two_nearest();
        let [reflection, reflected] = beyond.reflected(expected).unwrap_or([expected; 2]);
        let smooth = beyond.laplacian().map(|off| [0, 1, 2].map(|k| around.mean[k] + off[k]));
        let count = ring.known() as u64;
        let mut error = [0; 3];
        ring.vertices().iter().for_each(|&y| add_to(&mut error, models.errors[y as usize].map(i64::from)));
        let points = [
            // The fit is made for each axis anew.
            expected,
            nearest,
            corrected,
            around.parallel,
            second,
            around.mean,
            estimate.copied().unwrap_or(expected),
            reflection,
            reflected,
            smooth.unwrap_or(expected),
            expected,
            [0, 1, 2].map(|k| expected[k] + error[k] / count as i64),
        ];
        let mut trail = [Roughness::START; TRAILED];
        for (j, mean) in trail.iter_mut().enumerate() {
            let around = ring.vertices().iter().map(|&y| models.trails[y as usize][j]);
            let [tangential, normal] =
                around.fold([0, 0], |[t, n], off| [t + off.tangential as u64, n + off.normal as u64]);
            *mean = Roughness { tangential: (tangential / count) as u32, normal: (normal / count) as u32 };
        }
        Vertex { around, beyond, points, trail }
    }

    /// Values of an axis that may repeat: the neighbours', the parallelograms', where the first experts
    /// expect it, and those across the ring's edges.
    fn candidates(&self, axis: usize, experts: &[Expert; EXPERTS]) -> [Candidates; LISTS] {
        let mut lists = [Candidates::EMPTY; LISTS];
        let rounded = |centre: i64| (centre + 128) >> FRACTION_BITS;
        let middle = rounded(experts[FIT].centre);
        for (list, (values, count)) in lists.iter_mut().zip(self.around.candidates(axis)) {
            values[..count].iter().for_each(|&x| list.push(x as i64 - middle));
        }
        experts.iter().for_each(|e| lists[2].push(rounded(e.centre) - middle));
        self.beyond.across.iter().for_each(|p| lists[3].push(p[axis] as i64 - middle));
        lists
    }
}

/// The experts' centres: the points', but for those that are made of them.
fn experts(points: &[i64; POINTS], blend: i64, fit: i64) -> [i64; EXPERTS] {
    let mut centre = [fit; EXPERTS];
    centre[..POINTS].copy_from_slice(points);
    (centre[FIT], centre[BLEND], centre[PLAIN]) = (fit, blend, fit);
    centre
}

/// The mean of the points that experts have, each weighted by the third power of how little it was off around.
fn blend(centre: &[i64; POINTS], trail: &[u32; TRAILED]) -> i64 {
    let off = trail.map(|off| off as u64 + 16);
    let least = off[NEAREST..=EXPECTED].iter().copied().min().unwrap_or(1);
    let (mut sum, mut total) = (0i64, 0i64);
    for j in NEAREST..=EXPECTED {
        let share = ((least << 8) / off[j]) as i64;
        let weight = (((share * share) >> 8) * share) >> 8;
        sum += weight * (centre[j] - centre[EXPECTED]).clamp(-FAR, FAR);
        total += weight;
    }
    centre[EXPECTED] + sum / total.max(1)
}

/// No point draws the blend further than this, and no fit lies further from it than some times this.
const FAR: i64 = 1 << 37;
/// Spreads count as no larger than this where points are placed by them.
const MOST: u64 = 1 << 36;

/// A coordinate in 1/256.
fn exact(value: i32) -> i64 {
    (value as i64) << FRACTION_BITS
}

/// A distance in 32 bits.
fn clamp(distance: i64) -> i32 {
    distance.clamp(i32::MIN as i64, i32::MAX as i64) as i32
}

fn initial_weights(node: usize) -> [[i16; 8]; VECTORS] {
    INITIAL[row(node)]
}

/// What the weights are at the end is what training is for.
#[cfg(test)]
impl Drop for EnsembleModels {
    fn drop(&mut self) {
        use super::training::{Table, note};
        self.residual.each_weight(|node, weights, uses| {
            note(Table::Initial, row(node), weights.as_flattened(), uses);
        });
    }
}
