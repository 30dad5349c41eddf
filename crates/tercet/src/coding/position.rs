//! Positions: one pass over a surface whose connectivity is known.
//!
//! Some vertices are known (the coarse ones, or none in the base), the others are coded in the
//! order of a [`Traversal`](super::traversal::Traversal). A vertex is expected where the parallelograms of its known neighbours, an
//! estimate made before, and the errors of that estimate nearby place it. Its three coordinates
//! follow in the order of the surface's normal: along the two axes that lie most nearly in the
//! surface first, and on the last one every expectation is moved into the tangent plane.

use super::pass::{AxisOrder, Pass, Progress, Roughness};
use super::residual::{Expert, ResidualModels, Situation};
use super::ring::{Neighbourhood, Ring};
use super::scale::{Scale, ScaleCell, bin, ratio};
use super::vector::{COORDINATE_LIMIT, Point, Vector};
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
pub(crate) struct PositionModels {
    residual: Residual,
    /// By kind of axis, size of the neighbourhood, roughness and how well it is known.
    by_roughness: Vec<ScaleCell>,
    /// By kind of axis, class and size of the neighbourhood.
    by_class: Vec<ScaleCell>,
    /// By expert, kind of axis, distance from the first expert and roughness.
    by_distance: Vec<ScaleCell>,
}

/// Kinds of axes: in the surface, across it, and either at a boundary.
pub(super) const TANGENTIAL: usize = 0;
pub(super) const NORMAL: usize = 1;
pub(super) const BOUNDARY: usize = 2;

const SIZES: usize = 64;
const ROUGH: usize = 24;
const CLASSES: usize = 8;
const DISTANCES: usize = 8;

impl PositionModels {
    pub fn new() -> Self {
        PositionModels {
            residual: Residual::new([243], [24, 120], |_| [[2730, 2730, 2730, 512, 512, 512, 512, 0]]),
            by_roughness: vec![ScaleCell::default(); 3 * SIZES * ROUGH * 3],
            by_class: vec![ScaleCell::default(); 3 * CLASSES * SIZES],
            by_distance: vec![ScaleCell::default(); EXPERTS * 3 * DISTANCES * ROUGH],
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
        while let Some((v, corner)) = progress.traversal.next() {
            if coder.exhausted() {
                // The caller refuses the level; what follows would only take time.
                break;
            }
            if !coder.is_ready() {
                return false;
            }
            let known = progress.traversal.known();
            ring.gather(pass.surface, corner, known, positions);
            let i = (v - pass.first) as usize;
            let target = targets.get(i).copied().unwrap_or_default();
            let point = if ring.known() == 0 {
                plain(coder, pass, target)
            } else {
                let (errors, estimate) = (&progress.errors, pass.estimates.get(i));
                let around = Neighbourhood::new(&ring, pass, known, positions, errors, estimate, rough);
                let (point, off) = self.vertex(coder, &around, pass.order, target);
                rough[v as usize] = off;
                for &y in ring.vertices() {
                    rough[y as usize].blend(off);
                }
                point
            };
            positions[v as usize] = point;
            progress.advance(pass, corner, i, point);
        }
        true
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
            let kind = match (around.at_boundary, is_across(step, order)) {
                (true, _) => BOUNDARY,
                (_, true) => NORMAL,
                _ => TANGENTIAL,
            };
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
        let size = around.size.min(SIZES - 1);
        let rough = if c.kind == NORMAL { around.rough.normal } else { around.rough.tangential } as u64;
        let roughness = bin(rough + 8, 2, -9, ROUGH);
        let certainty = match around.parallelograms {
            0 | 1 => 0,
            2..=4 => 1,
            _ => 2,
        };
        let cell = ((c.kind * SIZES + size) * ROUGH + roughness) * 3 + certainty;
        let class = (c.kind * CLASSES + around.class) * SIZES + size;
        let prior = rough / 2 + (around.edge >> if c.kind == NORMAL { 6 } else { 4 }) + 40;
        let by_class = self.by_class[class].mean(prior);
        let main = self.by_roughness[cell].mean(by_class);
        let first = Scale::new(main);
        let mut experts = [Expert { centre: centre[0], scale: first }; EXPERTS];
        let mut cells = [0; EXPERTS];
        for j in 1..EXPERTS {
            let distance = centre[j].abs_diff(centre[0]);
            let apart = ratio(distance + 12, main + 50, DISTANCES);
            cells[j] = ((j * 3 + c.kind) * DISTANCES + apart) * ROUGH + roughness;
            experts[j] = Expert {
                centre: centre[j],
                scale: Scale::new(self.by_distance[cells[j]].mean(main + distance / 2)),
            };
        }
        let situation = c.situation(&experts, main);
        let value = self.residual.code(coder, target, &experts, &situation);
        let off = |e: &Expert| ((value as i64) << FRACTION_BITS).abs_diff(e.centre);
        self.by_class[class].learn(off(&experts[0]));
        self.by_roughness[cell].learn(off(&experts[0]));
        for j in 1..EXPERTS {
            self.by_distance[cells[j]].learn(off(&experts[j]));
        }
        value
    }
}

/// A vertex without a known neighbour: its coordinates as they are.
pub(super) fn plain<C: Coder>(coder: &mut C, pass: &Pass, target: Point) -> Point {
    [0, 1, 2].map(|k| {
        let offset = coder.raw_wide(target[k].wrapping_sub(pass.origin[k]) as u32, pass.bits);
        pass.origin[k].wrapping_add(offset as i32).clamp(-COORDINATE_LIMIT, COORDINATE_LIMIT)
    })
}

/// The axes in the order of coding: by the size of the normal's component, then by number.
pub(super) fn axes(normal: Vector, order: AxisOrder) -> [usize; 3] {
    let size = normal.map(i64::unsigned_abs);
    let mut axes = [0, 1, 2];
    // A library's sort is larger than all the rest of a pass, which matters on the web.
    for [before, after] in [[0, 1], [1, 2], [0, 1]] {
        if size[axes[after]] < size[axes[before]] {
            axes.swap(before, after);
        }
    }
    match order {
        AxisOrder::NormalLast => axes,
        AxisOrder::NormalFirst => [axes[2], axes[0], axes[1]],
    }
}

/// Whether the axis that comes `step`th is the one along the normal.
pub(super) fn is_across(step: usize, order: AxisOrder) -> bool {
    step == if order == AxisOrder::NormalLast { 2 } else { 0 }
}

/// Moves the expectations of the later axes by what the coded one was off, so that the point
/// stays in the tangent plane (normal last) or on the normal line (normal first).
pub(super) fn shift<const E: usize>(
    centres: &mut [Vector; E],
    off: [i64; E],
    normal: Vector,
    axes: [usize; 3],
    step: usize,
    order: AxisOrder,
) {
    let ratio = |a: usize, b: usize| if normal[b] == 0 { 0 } else { (normal[a] << 14) / normal[b] };
    match (order, step) {
        (AxisOrder::NormalLast, 0 | 1) => {
            let slope = ratio(axes[step], axes[2]);
            for (centre, off) in centres.iter_mut().zip(off) {
                centre[axes[2]] -= (off.clamp(-FAR, FAR) * slope) >> 14;
            }
        }
        (AxisOrder::NormalFirst, 0) => {
            for later in [1, 2] {
                let slope = ratio(axes[later], axes[0]);
                for (centre, off) in centres.iter_mut().zip(off) {
                    centre[axes[later]] += (off.clamp(-FAR, FAR) * slope) >> 14;
                }
            }
        }
        _ => {}
    }
}

/// No expectation is moved by more than this.
const FAR: i64 = 1 << 37;

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
