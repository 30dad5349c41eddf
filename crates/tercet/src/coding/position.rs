//! Positions: one pass over a surface whose connectivity is known.
//!
//! Some vertices are known (the coarse ones, or none in the base), the others are coded in the
//! order of a [`Traversal`](super::traversal::Traversal). A vertex is expected where the parallelograms of its known neighbours, an
//! estimate made before, and the errors of that estimate nearby place it. Its three coordinates
//! follow in the order of the surface's normal: along the two axes that lie most nearly in the
//! surface first, and on the last one every expectation is moved into the tangent plane.

use super::axes::{AxisOrder, KINDS, axes, kind, shift};
use super::pass::{Pass, Progress, Roughness, plain};
use super::residual::{Expert, ResidualModels, Situation};
use super::ring::{Neighbourhood, Ring};
use super::scale::{Scale, ScaleCell, ratio};
use super::spread::{Cells, ROUGH, Spread};
use super::vector::Point;
use crate::entropy::Coder;
use crate::subdivide::FRACTION_BITS;

/// What is asked about a coordinate: experts, contexts, lists of candidates, sets of weights, histograms,
/// and how many vectors of eight opinions that makes.
pub(super) const EXPERTS: usize = 3;
const CONTEXTS: usize = 1;
pub(super) const LISTS: usize = 3;
const SETS: usize = 2;
type Residual = ResidualModels<EXPERTS, CONTEXTS, LISTS, SETS, 0, 1>;

/// The models of positions; they live as long as the file.
#[derive(Clone)]
pub(crate) struct PositionModels {
    residual: Residual,
    spread: Spread,
    /// By expert, kind of axis, distance from the first expert and roughness.
    by_distance: Vec<ScaleCell>,
}

const DISTANCES: usize = 8;

impl PositionModels {
    pub fn new() -> Self {
        PositionModels {
            residual: Residual::new([243], [24, 120], |_| [[2730, 2730, 2730, 512, 512, 512, 512, 0]]),
            spread: Spread::new(),
            by_distance: vec![ScaleCell::default(); EXPERTS * KINDS * DISTANCES * ROUGH],
        }
    }

    /// Codes the positions of the vertices of a pass that are left, those of `targets` when encoding, until
    /// all are coded or bytes are missing; whether all are. `positions` and `rough` have an entry a vertex.
    /// Time O(n).
    pub fn code<C: Coder>(
        &mut self,
        coder: &mut C,
        pass: &Pass,
        progress: &mut Progress,
        targets: &[Point],
        positions: &mut [Point],
        rough: &mut [Roughness],
    ) -> bool {
        let mut ring = Ring::default();
        progress.run(coder, pass, targets, positions, |coder, turn| {
            ring.gather(pass.surface, turn.corner, turn.known, turn.positions);
            if ring.known() == 0 {
                return plain(coder, pass, turn.target);
            }
            let around = Neighbourhood::new(&ring, pass, turn, rough);
            let (point, off) = self.vertex(coder, &around, pass.order, turn.target);
            Roughness::spread(rough, turn.v, off, ring.vertices());
            point
        })
    }

    fn vertex<C: Coder>(
        &mut self,
        coder: &mut C,
        around: &Neighbourhood,
        order: AxisOrder,
        target: Point,
    ) -> (Point, Roughness) {
        let axes = axes(around.normal, order);
        let mut centres = around.predictions;
        let mut point = target;
        let mut sizes = [0u64; 3];
        for (step, &axis) in axes.iter().enumerate() {
            let kind = kind(step, order, around.at_boundary);
            let coordinate = Coordinate { around, kind, axis };
            let centre = centres.map(|c| c[axis]);
            let value = self.coordinate(coder, &coordinate, centre, target[axis]);
            point[axis] = value;
            let off = centre.map(|c| ((value as i64) << FRACTION_BITS) - c);
            sizes[step] = off[0].unsigned_abs();
            shift(&mut centres, off, around.normal, axes, step, order);
        }
        (point, Roughness::of(sizes, order))
    }

    fn coordinate<C: Coder>(
        &mut self,
        coder: &mut C,
        c: &Coordinate,
        centre: [i64; EXPERTS],
        target: i32,
    ) -> i32 {
        let around = c.around;
        let place = Cells::new(around, c.kind);
        let main = self.spread.mean(&place);
        let first = Scale::new(main);
        let mut experts = [Expert { centre: centre[0], scale: first }; EXPERTS];
        let mut cells = [0; EXPERTS];
        for j in 1..EXPERTS {
            let distance = centre[j].abs_diff(centre[0]);
            let apart = ratio(distance + 12, main + 50, DISTANCES);
            cells[j] = ((j * KINDS + c.kind) * DISTANCES + apart) * ROUGH + place.roughness;
            experts[j] = Expert {
                centre: centre[j],
                scale: Scale::new(self.by_distance[cells[j]].mean(main + distance / 2)),
            };
        }
        let situation = c.situation(&experts, main);
        let value = self.residual.code(coder, target, &experts, &situation);
        let off = |e: &Expert| ((value as i64) << FRACTION_BITS).abs_diff(e.centre);
        self.spread.learn(&place, off(&experts[0]));
        for j in 1..EXPERTS {
            self.by_distance[cells[j]].learn(off(&experts[j]));
        }
        value
    }
}

/// One coordinate and what is known around it.
struct Coordinate<'a, 'b> {
    around: &'a Neighbourhood<'b>,
    kind: usize,
    axis: usize,
}

impl Coordinate<'_, '_> {
    fn situation(
        &self,
        experts: &[Expert; EXPERTS],
        main: u64,
    ) -> Situation<'static, CONTEXTS, LISTS, SETS, 0> {
        let around = self.around;
        let kind = self.kind;
        let centre = experts[0].centre;
        let scale = (experts[0].scale.log / 4).saturating_sub(8).min(23);
        let unit = experts[0].scale.unit().min(7) as usize;
        // Where another expectation lies, in bins of the scale.
        let beside = |other: i64, bins: i64| {
            let apart = experts[0].scale.standardise(other - centre) as i64;
            (((apart * 9) >> 11) + bins / 2).clamp(0, bins - 1) as usize
        };
        let parallelograms = around.parallelograms.min(3);
        let [nearest, second] = [experts[1].centre, around.second[self.axis]].map(|x| beside(x, 9));
        let contexts = |mirror: bool| {
            let turn = |x: usize| if mirror { 8 - x } else { x };
            [(turn(nearest) * 9 + turn(second)) * 3 + kind]
        };
        let apart = ratio(experts[1].centre.abs_diff(centre) + 25, main + 50, 5);
        Situation {
            above: contexts(false),
            below: contexts(true),
            sets: [
                scale,
                (parallelograms * 5 + apart) * 3 + kind + if around.parallelograms == 0 { 60 } else { 0 },
            ],
            candidates: around.candidates(self.axis, &experts.map(|e| e.centre)),
            trust: unit * 3 + kind,
            histograms: [],
        }
    }
}
