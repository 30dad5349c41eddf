//! Positions: one pass over a surface whose connectivity is known.
//!
//! Some vertices are known (the coarse ones, or none in the base), the others are coded in the
//! order of a [`Traversal`](super::traversal::Traversal). A vertex is expected where the parallelograms of
//! its known neighbours, an estimate made before, and the errors of that estimate nearby place it. Its
//! three coordinates follow in the order of the surface's normal: along the two axes that lie most nearly in the
//! surface first, and on the last one every expectation is moved into the tangent plane.

use super::axes::{AxisOrder, KINDS, axes, kind, shift};
use super::coordinate::{Candidates, CoordinateModels, EXPERTS, Expert, Situation};
use super::pass::{Pass, Progress, Roughness, plain};
use super::ring::{Neighbourhood, Ring};
use super::scale::{Scale, ScaleCell, ratio};
use super::spread::{Cells, ROUGH, Spread};
use super::twin::TwinModels;
use super::vector::Point;
use crate::entropy::Coder;
use crate::subdivide::FRACTION_BITS;

/// The models of positions; they live as long as the file.
#[derive(Clone)]
pub(crate) struct PositionModels {
    coordinate: CoordinateModels,
    spread: Spread,
    /// By expert after the first, kind of axis, distance from the first expert and roughness.
    by_distance: Vec<ScaleCell>,
    twins: TwinModels,
}

const DISTANCES: usize = 8;

impl PositionModels {
    pub fn new() -> Self {
        PositionModels {
            coordinate: CoordinateModels::new(),
            spread: Spread::new(),
            by_distance: vec![ScaleCell::default(); (EXPERTS - 1) * KINDS * DISTANCES * ROUGH],
            twins: TwinModels::new(),
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
        progress.run(coder, pass, targets, positions, |coder, turn, twins| {
            ring.gather(pass, turn);
            if ring.known() == 0 {
                return plain(coder, pass, turn.target);
            }
            let around = Neighbourhood::new(&ring, pass, turn, rough);
            let expected = around.expected;
            let (point, off) = match self.twins.code(coder, twins, expected, turn.target, turn.positions) {
                Some(point) => (point, Roughness::at(point, expected, around.normal, pass.order)),
                None => self.vertex(coder, &around, pass.order, turn.target),
            };
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
        let mut centres = [around.expected, around.corrected];
        let mut point = target;
        let mut sizes = [0u64; 3];
        for (step, &axis) in axes.iter().enumerate() {
            let kind = kind(step, order, around.at_boundary);
            let centre = centres.map(|c| c[axis]);
            let value = self.coordinate(coder, around, [kind, axis], centre, target[axis]);
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
        around: &Neighbourhood,
        [kind, axis]: [usize; 2],
        centre: [i64; EXPERTS],
        target: i32,
    ) -> i32 {
        let place = Cells::new(around, kind);
        let main = self.spread.mean(&place);
        let first = Expert { centre: centre[0], scale: Scale::new(main) };
        let mut experts = [first; EXPERTS];
        let mut cells = [0; EXPERTS];
        for j in 1..EXPERTS {
            let distance = centre[j].abs_diff(centre[0]);
            let apart = ratio(distance + 12, main + 50, DISTANCES);
            cells[j] = (((j - 1) * KINDS + kind) * DISTANCES + apart) * ROUGH + place.roughness;
            let mean = self.by_distance[cells[j]].mean(main + distance / 2);
            experts[j] = Expert { centre: centre[j], scale: Scale::new(mean) };
        }
        let situation = Situation {
            experts,
            kind,
            candidates: around.candidates(axis).map(|(values, count)| Candidates::new(values, count)),
        };
        let value = self.coordinate.code(coder, target, &situation);
        let off = |centre: i64| ((value as i64) << FRACTION_BITS).abs_diff(centre);
        self.spread.learn(&place, off(centre[0]));
        for j in 1..EXPERTS {
            self.by_distance[cells[j]].learn(off(centre[j]));
        }
        value
    }
}
