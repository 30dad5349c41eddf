//! Twins: vertices whose mirror images are known.
//!
//! Where a mesh has a [`Symmetry`], the mirror image of where a vertex is expected tells which known vertex may be its
//! twin: the nearest one that has none yet. If it is, the vertex lies at its twin's mirror image, or beside it, as
//! lattices and planes of symmetry do not care for each other, and none of its coordinates is coded. That holds for one
//! of each pair at most: the other one came before.

use super::pass::Pass;
use super::symmetry::Symmetry;
use super::vector::{COORDINATE_LIMIT, Point, Vector};
use crate::entropy::{Coder, Counter};
use crate::mesh::NONE;
use crate::subdivide::round;
use std::ops::Range;

/// So many vertices of a cell are looked at.
const MOST: usize = 16;

/// Cells are so many octaves longer than the greatest power of two up to the mean edge: twins are looked for within half
/// of one, which is less than an edge.
const OCTAVES: u32 = 1;

/// To see who has a twin cells are so long, as a power of two: within a step there are few.
const PAIRING: u32 = 3;

/// So many faces tell how long edges are, or up to twice as many.
const FACES: usize = 1 << 10;

/// Odd, and without a pattern: the fractions of the golden ratio's powers and of the root of 3.
const FACTORS: [u32; 3] = [0x9e37_79b1, 0x7f4a_7c15, 0xbb67_ae85];

/// Classes of how far a candidate's image is from where it was expected, each an eighth of what it may be.
const DISTANCES: usize = 9;
/// Whether the last two candidates were twins.
const PASTS: usize = 4;

/// The counters' memory.
const LIMIT: u16 = 120;

/// The models of twins; they live as long as those of positions.
#[derive(Clone)]
pub(crate) struct TwinModels {
    /// Whether a candidate is a twin, by its distance and what the last ones were.
    is_twin: [[Counter; PASTS]; DISTANCES],
    past: usize,
    /// Along the plane and across it: whether a coordinate is beside that of the image, and whether above it.
    beside: [[Counter; 2]; 2],
}

/// Known vertices without a twin, by the cells of a grid in which they lie; it lives as long as a pass.
#[derive(Clone)]
pub(crate) struct Twins {
    symmetry: Symmetry,
    /// Cells are 2 to this steps long on each axis.
    shift: u32,
    /// For each bucket of cells the vertex that came last: 2 to 31 − `spare`.
    heads: Vec<u32>,
    spare: u32,
    /// For each vertex the one in its bucket that came before.
    next: Vec<u32>,
    /// Whether the vertex whose turn it is has found its twin.
    found: bool,
}

/// The vertices that a pass leaves without a twin, in ascending order.
pub(crate) struct Lone(Vec<u32>);

/// A vertex that may be a twin.
struct Candidate {
    vertex: u32,
    /// Its mirror image, and how far that is from where it was looked for.
    image: Point,
    distance: u32,
}

impl Twins {
    /// Of a pass before which its known vertices lie at `positions`; `lone` are those of them that the pass before
    /// left without a twin, if that is known. Time O(n).
    // Here and below: one copy serves all passes and profiles.
    #[inline(never)]
    pub fn new(symmetry: Symmetry, pass: &Pass, positions: &[Point], lone: Option<Lone>) -> Self {
        let known = pass.surface.virtuals..pass.first;
        let buckets = (known.len() + 1).next_power_of_two();
        let next = vec![NONE; pass.surface.vertices as usize];
        let (heads, spare) = (vec![NONE; buckets], 31 - buckets.ilog2());
        let mut twins = Twins { symmetry, shift: PAIRING, heads, spare, next, found: false };
        let lone = lone.map_or_else(|| twins.pair(known, positions), |lone| lone.0);
        twins.shift = mean_edge(pass, positions).max(1).ilog2() + OCTAVES;
        lone.into_iter().for_each(|v| twins.add(v, positions[v as usize]));
        twins
    }

    /// Which of the `known` vertices have no twin among them, in ascending order: the others have been found, or could
    /// have been. The grid is empty before and after.
    fn pair(&mut self, known: Range<u32>, positions: &[Point]) -> Vec<u32> {
        known.clone().for_each(|v| self.add(v, positions[v as usize]));
        let image = |v: u32| self.symmetry.image(positions[v as usize]);
        let lone = known.filter(|&v| self.nearest(image(v), 1, positions).is_none()).collect();
        self.heads.fill(NONE);
        lone
    }

    /// Those without a twin after a pass over all vertices.
    pub fn lone(self) -> Lone {
        let mut is_lone = vec![false; self.next.len()];
        for &head in &self.heads {
            let mut v = head;
            while let Some(is_lone) = is_lone.get_mut(v as usize) {
                *is_lone = true;
                v = self.next[v as usize];
            }
        }
        let lone = (0..).zip(is_lone).filter_map(|(v, is_lone)| is_lone.then_some(v)).collect();
        Lone(lone)
    }

    /// Notes where the vertex whose turn it was, the `v`th of `positions`, lies. Its twin may be known without having
    /// been found, as it was looked for elsewhere; then neither is looked for any more, nor is a vertex that is its own
    /// mirror image.
    pub fn note(&mut self, v: u32, positions: &[Point]) {
        if std::mem::take(&mut self.found) {
            return;
        }
        let p = positions[v as usize];
        let image = self.symmetry.image(p);
        if image[self.symmetry.axis()].abs_diff(p[self.symmetry.axis()]) <= 1 {
            return;
        }
        match self.nearest(image, 1, positions) {
            Some((twin, _)) => self.remove(twin, positions[twin as usize]),
            None => self.add(v, p),
        }
    }

    fn add(&mut self, v: u32, p: Point) {
        let bucket = self.bucket(p.map(|x| x >> self.shift));
        self.next[v as usize] = std::mem::replace(&mut self.heads[bucket], v);
    }

    /// Takes away the vertex at `p`, one of the first [`MOST`] of its bucket. Time O(1).
    fn remove(&mut self, v: u32, p: Point) {
        let bucket = self.bucket(p.map(|x| x >> self.shift));
        let after = self.next[v as usize];
        let mut at = self.heads[bucket];
        if at == v {
            self.heads[bucket] = after;
        }
        while at != NONE && at != v {
            let following = self.next[at as usize];
            if following == v {
                self.next[at as usize] = after;
            }
            at = following;
        }
    }

    fn bucket(&self, cell: Point) -> usize {
        let [x, y, z] = [0, 1, 2].map(|k| Self::part(cell[k], k));
        self.of_parts(x ^ y ^ z)
    }

    /// What the place of a cell on an axis adds to the number of its bucket.
    #[inline(always)]
    fn part(place: i32, axis: usize) -> u32 {
        (place as u32).wrapping_mul(FACTORS[axis])
    }

    /// The upper bits, which depend on all bits of the places.
    #[inline(always)]
    fn of_parts(&self, parts: u32) -> usize {
        (parts >> 1 >> self.spare) as usize & (self.heads.len() - 1)
    }

    /// The vertex nearest to `p`, on no axis farther than `radius`, and how far it is. Time O(1) for a radius of half a
    /// cell at most.
    #[inline(never)]
    fn nearest(&self, p: Point, radius: i32, positions: &[Point]) -> Option<(u32, u32)> {
        // One cell or two on each axis.
        let low = p.map(|x| (x - radius) >> self.shift);
        let parts: [[u32; 2]; 3] =
            std::array::from_fn(|k| [Self::part(low[k], k), Self::part(low[k].wrapping_add(1), k)]);
        let [xs, ys, zs] = parts;
        let heads: [u32; 8] =
            std::array::from_fn(|i| self.heads[self.of_parts(xs[i >> 2] ^ ys[i >> 1 & 1] ^ zs[i & 1])]);
        // Most cells are empty: which ones a processor could not guess one by one.
        let mut filled = (0..8).fold(0, |set, i| set | ((heads[i] != NONE) as u32) << i);
        for (k, lower) in [0b0000_1111, 0b0011_0011, 0b0101_0101].into_iter().enumerate() {
            let only_lower = (p[k] + radius) >> self.shift == low[k];
            filled &= lower | (only_lower as u32).wrapping_sub(1);
        }
        let mut best = (NONE, radius as u32 + 1);
        while filled != 0 {
            let mut v = heads[filled.trailing_zeros() as usize & 7];
            filled &= filled - 1;
            for _ in 0..MOST {
                let Some(q) = positions.get(v as usize) else { break };
                let off = |k: usize| p[k].abs_diff(q[k]);
                let distance = off(0).max(off(1)).max(off(2));
                best = if distance < best.1 { (v, distance) } else { best };
                v = self.next[v as usize];
            }
        }
        (best.0 != NONE).then_some(best)
    }

    fn candidate(&self, expected: Vector, positions: &[Point]) -> Option<Candidate> {
        let place = self.symmetry.image_of_place(expected);
        let (vertex, distance) = self.nearest(place, (1 << self.shift) / 2, positions)?;
        Some(Candidate { vertex, image: self.symmetry.image(positions[vertex as usize]), distance })
    }
}

/// The mean extent of an edge between real vertices, on the axis where that is greatest; of the first edges of some
/// faces, with the vertices of the pass where they are expected.
fn mean_edge(pass: &Pass, positions: &[Point]) -> u32 {
    let &Pass { surface, first, estimates, .. } = pass;
    let place = |v: u32| match v.checked_sub(first).and_then(|i| estimates.get(i as usize)) {
        Some(&estimate) => round(estimate),
        None => positions[v as usize],
    };
    let (mut sum, mut count) = (0u64, 0);
    let step = (surface.faces() as usize / FACES).max(1);
    for t in surface.vertex.chunks_exact(3).step_by(step) {
        if !surface.is_virtual(t[0]) && !surface.is_virtual(t[1]) {
            let (p, q) = (place(t[0]), place(t[1]));
            sum += (0..3).map(|k| p[k].abs_diff(q[k])).max().unwrap_or(0) as u64;
            count += 1;
        }
    }
    // Points are within 2²⁸ of the origin, so that cells are of 2²⁹ at most.
    sum.checked_div(count).unwrap_or(0).min(1 << 28) as u32
}

impl TwinModels {
    pub fn new() -> Self {
        TwinModels { is_twin: [[Counter::NEW; PASTS]; DISTANCES], past: 0, beside: [[Counter::NEW; 2]; 2] }
    }

    /// Codes where the vertex whose turn it is lies, which is `expected` in 1/256 and `target` when encoding, if it has
    /// a twin and the pass looks for `twins`. Time O(1).
    #[inline(always)]
    pub fn code<C: Coder>(
        &mut self,
        coder: &mut C,
        twins: &mut Option<Twins>,
        expected: Vector,
        target: Point,
        positions: &[Point],
    ) -> Option<Point> {
        self.among(coder, twins.as_mut()?, expected, target, positions)
    }

    #[inline(never)]
    fn among<C: Coder>(
        &mut self,
        coder: &mut C,
        twins: &mut Twins,
        expected: Vector,
        target: Point,
        positions: &[Point],
    ) -> Option<Point> {
        let Candidate { vertex, image, distance } = twins.candidate(expected, positions)?;
        let is_near = (0..3).all(|k| target[k].abs_diff(image[k]) <= 1);
        let class = (((distance as u64) << 4) >> twins.shift) as usize;
        let is_twin = self.is_twin[class.min(DISTANCES - 1)][self.past].code(coder, is_near, LIMIT);
        self.past = (self.past << 1 | is_twin as usize) & (PASTS - 1);
        if !is_twin {
            return None;
        }
        twins.remove(vertex, positions[vertex as usize]);
        twins.found = true;
        Some(std::array::from_fn(|k| {
            let [beside, above] = &mut self.beside[(k == twins.symmetry.axis()) as usize];
            match beside.code(coder, target[k] != image[k], LIMIT) {
                false => image[k],
                true if above.code(coder, target[k] > image[k], LIMIT) => {
                    (image[k] + 1).min(COORDINATE_LIMIT)
                }
                true => (image[k] - 1).max(-COORDINATE_LIMIT),
            }
        }))
    }
}

#[cfg(test)]
mod tests {
    use super::super::axes::AxisOrder;
    use super::super::pass::ANYWHERE;
    use super::super::ring::NEAR;
    use super::*;
    use crate::entropy::{Decoder, Encoder};
    use crate::mesh::{Surface, cut};
    use crate::shapes::grid;
    use crate::subdivide::FRACTION_BITS;

    /// A grid of 21 × 12 vertices, ten steps apart and rough, whose left and right halves are mirror images; those
    /// before `known` are known.
    fn pass(known: u32) -> (Symmetry, Surface, Vec<Point>, Twins) {
        let surface = cut(&grid(20, 11)).surface;
        let first = surface.virtuals;
        let mut positions = vec![[0; 3]; first as usize];
        positions.extend((0..21 * 12).map(|i| {
            let (x, y): (i32, i32) = (i % 21 - 10, i / 21);
            let rough = (x * x * 7 + y * y * 5) % 4;
            [10 * x + rough * x.signum(), 10 * y + rough, rough]
        }));
        let symmetry = Symmetry::find(&positions[first as usize..], [0; 3]).unwrap();
        let twins = twins(symmetry, &surface, known, &positions, &positions);
        (symmetry, surface, positions, twins)
    }

    /// Of a pass over the vertices from `first` on, which are expected at `expected` and lie, so far, at `positions`.
    fn twins(
        plane: Symmetry,
        surface: &Surface,
        first: u32,
        expected: &[Point],
        positions: &[Point],
    ) -> Twins {
        let estimates: Vec<Vector> =
            expected[first as usize..].iter().map(|p| p.map(|x| (x as i64) << FRACTION_BITS)).collect();
        pass_from(plane, surface, first, &estimates).twins(positions, None).unwrap()
    }

    fn pass_from<'a>(plane: Symmetry, surface: &'a Surface, first: u32, estimates: &'a [Vector]) -> Pass<'a> {
        let (bits, origin) = ANYWHERE;
        Pass {
            surface,
            first,
            estimates,
            order: AxisOrder::NormalLast,
            by_support: true,
            shares: &NEAR,
            bits,
            origin,
            symmetry: Some(plane),
        }
    }

    #[test]
    fn what_other_regions_have_coded_changes_nothing() {
        let (symmetry, surface, expected, before) = pass(120);
        let mut positions = expected.clone();
        positions.iter_mut().skip(120).for_each(|p| *p = p.map(|x| 50 * x));
        let after = twins(symmetry, &surface, 120, &expected, &positions);
        assert_eq!((before.shift, before.heads, before.next), (after.shift, after.heads, after.next));
    }

    #[test]
    fn the_nearest_of_those_without_a_twin_is_found() {
        let (symmetry, surface, positions, twins) = pass(120);
        let known = surface.virtuals..120;
        let is_lone = |v: u32| {
            let image = symmetry.image(positions[v as usize]);
            known.clone().all(|w| (0..3).any(|k| positions[w as usize][k].abs_diff(image[k]) > 1))
        };
        let radius = (1 << twins.shift) / 2;
        let mut found = 0;
        for x in (-140..140).step_by(7) {
            for y in (-40..160).step_by(9) {
                let p = [x, y, 2];
                let distance =
                    |v: &u32| (0..3).map(|k| positions[*v as usize][k].abs_diff(p[k])).max().unwrap();
                let least = known.clone().filter(|&v| is_lone(v)).map(|v| distance(&v)).min();
                let near = twins.nearest(p, radius, &positions);
                assert_eq!(near.map(|(_, d)| d), least.filter(|&d| d <= radius as u32), "{p:?}");
                found += near.is_some() as usize;
            }
        }
        assert!(found >= 15, "{found}");
    }

    #[test]
    fn what_a_pass_leaves_is_what_has_no_twin() {
        let (symmetry, surface, positions, mut before) = pass(120);
        (120..surface.vertices).for_each(|v| before.note(v, &positions));
        let Lone(left) = before.lone();
        let Lone(alone) = twins(symmetry, &surface, surface.vertices, &positions, &positions).lone();
        assert_eq!(left, alone);
        assert!(left.len() < 60, "{} of {}", left.len(), surface.vertices);
        // They are what the next pass begins with.
        let known = pass_from(symmetry, &surface, surface.vertices, &[]);
        assert_eq!(known.twins(&positions, Some(Lone(vec![70, 90]))).unwrap().lone().0, [70, 90]);
    }

    /// Codes all vertices from 60 on, each expected a little beside where it lies; which were coded by twins.
    fn code<C: Coder>(coder: &mut C, targets: &[Point]) -> (Vec<Point>, Vec<bool>) {
        let (_, surface, known, twins) = pass(60);
        let (mut models, mut twins) = (TwinModels::new(), Some(twins));
        let (mut positions, mut by_twin) = (known.clone(), Vec::new());
        for v in 60..surface.vertices {
            let expected = known[v as usize].map(|x| 256 * x as i64 + 300);
            let target = targets.get(v as usize).copied().unwrap_or_default();
            let coded = models.code(coder, &mut twins, expected, target, &positions);
            by_twin.push(coded.is_some());
            positions[v as usize] = coded.unwrap_or(known[v as usize]);
            twins.as_mut().unwrap().note(v, &positions);
        }
        (positions, by_twin)
    }

    #[test]
    fn the_second_of_two_twins_costs_little_and_may_be_beside() {
        let mut targets = pass(60).2;
        targets.iter_mut().skip(60).for_each(|p| p[1] += (p[0] > 20) as i32);
        let mut encoder = Encoder::new();
        let (written, by_twin) = code(&mut encoder, &targets);
        let count = by_twin.iter().filter(|&&twin| twin).count();
        assert!((80..=126).contains(&count), "{count} of {}", by_twin.len());
        let bytes = encoder.finish();
        assert!(bytes.len() < 60, "{} bytes", bytes.len());
        assert_eq!(code(&mut Decoder::new(&bytes), &[]), (written, by_twin));
    }
}
