//! Flip bits: which edges beside a split face turn.
//!
//! Edges are coded in the order of their first corners. New vertices lie near the middle of their faces, so
//! that the angles that a flip would make are known; which flips remain possible and which valences they lead
//! to are known exactly. Profiles differ in how many opinions they hear.

use super::model::{LIMIT, PairModel};
#[cfg(feature = "max")]
use super::panel::FlipPanel;
use super::priors;
use super::shape::VIRTUAL;
use super::sketch::Sketch;
use crate::Effort;
use crate::entropy::{Coder, Counter};
use crate::mesh::Surface;

/// The models of flip bits; they live as long as the file.
pub(crate) enum FlipModels {
    /// One opinion.
    Counted(Vec<Counter>),
    Mixed(PairModel),
    /// More of them, for size.
    #[cfg(feature = "max")]
    Panel(Box<FlipPanel>),
}

/// Valences are expected in 1/32; an undecided edge counts as flipped with this probability.
pub(super) const UNIT: i32 = 32;
const PRIOR: i32 = 27;

/// A face: whether it is split or virtual, and the outcomes of its edges so far.
#[derive(Clone, Copy)]
struct Turned(u8);

impl Turned {
    const SPLIT: u8 = 0x80;
    const HIDDEN: u8 = 0x40;
    const FLIP: u8 = 4;
    const STAY: u8 = 1;

    #[inline(always)]
    fn flips(self) -> i32 {
        ((self.0 / Self::FLIP) & 3) as i32
    }

    /// An unsplit face turns with one flip at most.
    #[inline(always)]
    fn is_blocked(self) -> bool {
        self.0 & Self::SPLIT == 0 && self.flips() > 0
    }

    /// 0..15 in a split face: four times its flips and its stays; 15 in another.
    #[cfg(feature = "max")]
    #[inline(always)]
    fn outcomes(self) -> usize {
        if self.0 & Self::SPLIT != 0 { (self.0 & 15) as usize } else { 15 }
    }
}

/// What is decided of the edges of a surface.
struct Course<'a> {
    sketch: &'a Sketch,
    turned: Vec<Turned>,
    /// The valence to expect of each vertex.
    expected: Vec<i32>,
}

/// An edge that is asked about.
pub(super) struct Edge {
    /// The faces of the corners that face it.
    #[cfg_attr(not(feature = "max"), expect(dead_code, reason = "only that effort asks for it"))]
    turned: [Turned; 2],
    /// The valences to expect of its ends and of those corners' vertices, or of the new ones in place of these,
    /// but for this edge; modulo 2³².
    pub ends: [i32; 2],
    pub apexes: [i32; 2],
    /// Bin of the sum of the cotangents that face it.
    pub angle: usize,
    /// 1 if only one of the faces is split, and 2 if one is virtual.
    pub kind: usize,
}

impl FlipModels {
    pub fn new(effort: Effort) -> Self {
        match effort {
            Effort::Fast => FlipModels::Counted(priors::counters(&priors::FLIP[..1])),
            #[cfg(feature = "max")]
            Effort::Max => FlipModels::Panel(Box::default()),
            _ => {
                let contexts = [priors::FLIP[0], priors::FLIP[2]];
                FlipModels::Mixed(PairModel::expecting(contexts, priors::FLIP_WEIGHTS, Edge::SETS))
            }
        }
    }

    /// Codes `flip`, one entry a corner when encoding and equal on both sides of an edge, and returns the corners
    /// before their opposites whose edges are flipped; time O(n).
    pub fn code<C: Coder>(
        &mut self,
        coder: &mut C,
        surface: &Surface,
        sketch: &Sketch,
        split: &[bool],
        flip: &[bool],
    ) -> Vec<u32> {
        let (candidates, mut course) = Course::new(surface, sketch, split);
        // Each edge is written as if it were flipped; if it is not, the next one takes its place.
        let (mut flipped, mut count) = (vec![0; candidates.len()], 0);
        for c in candidates {
            let corners = [c, surface.across(c)];
            let around = ends_and_apexes(surface, corners);
            let turned = corners.map(|c| course.turned[(c / 3) as usize]);
            let bit = !turned.iter().any(|turned| turned.is_blocked()) && {
                let known = flip.get(c as usize).is_some_and(|&flip| flip);
                let edge = course.look(corners, turned, around);
                match self {
                    FlipModels::Counted(counters) => counters[edge.context()].code(coder, known, LIMIT),
                    FlipModels::Mixed(bits) => {
                        bits.code(coder, known, edge.context(), || (edge.valences_context(), edge.set()))
                    }
                    #[cfg(feature = "max")]
                    FlipModels::Panel(panel) => panel.code(coder, known, surface, corners, &edge),
                }
            };
            flipped[count] = c;
            count += bit as usize;
            course.note(corners, turned, around, bit);
        }
        #[cfg(feature = "max")]
        if let FlipModels::Panel(panel) = self {
            panel.births.advance(surface.vertices);
        }
        flipped.truncate(count);
        flipped
    }
}

/// The vertices of an edge's ends, and those of the `corners` that face it. The ends of an edge between two faces are
/// the same from either side: one face says both.
#[inline(always)]
fn ends_and_apexes(surface: &Surface, corners: [u32; 2]) -> [[u32; 2]; 2] {
    let [c, o] = corners;
    let [x, y, z] = surface.face(c / 3);
    let (round, k) = ([x, y, z, x, y], (c % 3) as usize);
    [[round[k + 1], round[k + 2]], [round[k], surface.at(o)]]
}

impl<'a> Course<'a> {
    /// Before the first bit; also the edges beside a split face, by their first corners.
    fn new(surface: &'a Surface, sketch: &'a Sketch, split: &[bool]) -> (Vec<u32>, Self) {
        let turned: Vec<Turned> = split
            .iter()
            .zip(&sketch.area)
            .map(|(&split, &area)| {
                Turned(Turned::SPLIT * split as u8 + Turned::HIDDEN * (area == VIRTUAL) as u8)
            })
            .collect();
        let mut expected = vec![0i32; surface.vertices as usize];
        let mut candidates = vec![0; surface.vertex.len() / 2 + 1];
        let mut count = 0;
        let faces = surface.vertex.as_chunks::<3>().0.iter().zip(surface.opposite.as_chunks::<3>().0);
        let mut c = 0;
        for ((t, o), &born) in faces.zip(split) {
            let beside = o.map(|o| (born | split[(o / 3) as usize]) as i32);
            for k in 0..3 {
                // UNIT in a split face, beside which every edge is. A processor could not guess which are.
                let as_apex = PRIOR * beside[k] + (UNIT - PRIOR) * born as i32;
                // Of the edges at a vertex each face takes one.
                let as_end = PRIOR * beside[(k + 1) % 3];
                let expected = &mut expected[t[k] as usize];
                *expected = expected.wrapping_add(UNIT + as_apex - as_end);
                candidates[count] = c;
                count += (beside[k] & (c < o[k]) as i32) as usize;
                c += 1;
            }
        }
        candidates.truncate(count);
        (candidates, Course { sketch, turned, expected })
    }

    #[inline(always)]
    fn look(&self, corners: [u32; 2], turned: [Turned; 2], [ends, apexes]: [[u32; 2]; 2]) -> Edge {
        let [c, o] = corners;
        let one = (!turned[0].0 | !turned[1].0) & Turned::SPLIT;
        let hidden = (turned[0].0 | turned[1].0) & Turned::HIDDEN;
        let sum = cotangent(self.sketch, c, turned[0]) + cotangent(self.sketch, o, turned[1]);
        Edge {
            turned,
            ends: ends.map(|v| self.expected[v as usize].wrapping_add(PRIOR)),
            apexes: [self.at_apex(apexes[0], turned[0]), self.at_apex(apexes[1], turned[1])],
            angle: angle(sum),
            kind: (one >> 7 | hidden >> 5) as usize,
        }
    }

    /// The valence to expect at the apex `v`, but for this edge.
    #[inline(always)]
    fn at_apex(&self, v: u32, turned: Turned) -> i32 {
        let [old, new] = [self.expected[v as usize].wrapping_sub(PRIOR), UNIT * (3 + turned.flips())];
        // Split or not is hard to guess, for a processor too.
        old ^ ((old ^ new) & -((turned.0 >> 7) as i32))
    }

    /// Replaces the expectation about an edge by its outcome.
    #[inline(always)]
    fn note(&mut self, corners: [u32; 2], turned: [Turned; 2], [ends, apexes]: [[u32; 2]; 2], bit: bool) {
        let change = UNIT * bit as i32 - PRIOR;
        for (k, turned) in turned.into_iter().enumerate() {
            self.turned[(corners[k] / 3) as usize].0 =
                turned.0 + if bit { Turned::FLIP } else { Turned::STAY };
            let end = &mut self.expected[ends[k] as usize];
            *end = end.wrapping_sub(change);
            let apex = &mut self.expected[apexes[k] as usize];
            *apex = apex.wrapping_add(change & ((turned.0 >> 7) as i32 - 1));
        }
    }
}

impl Edge {
    /// Values of [`set`](Edge::set).
    pub const SETS: usize = 64;

    /// The first opinion, and the only one of the fast profile.
    #[inline(always)]
    fn context(&self) -> usize {
        let ends = self.ends[0].wrapping_add(self.ends[1]);
        let apexes = self.apexes[0].wrapping_add(self.apexes[1]);
        let ends = ((ends >> 4) - 16).clamp(0, 15) as usize;
        let apexes = [205, 250, 295].into_iter().map(|least| (apexes >= least) as usize).sum::<usize>();
        ((self.angle * 16 + ends) * 4 + self.kind) * 4 + apexes
    }

    #[inline(always)]
    pub fn set(&self) -> usize {
        self.angle / 2 + 16 * self.kind
    }

    /// The second opinion of the default profile.
    #[inline(always)]
    fn valences_context(&self) -> usize {
        let (low, _) = self.ends_in_bins();
        let [near, far] = ordered(self.apexes.map(|e| (e.wrapping_sub(2 * UNIT) >> 5).clamp(0, 7) as usize));
        ((low / 2 * 8 + near) * 8 + far) * 2 + self.kind % 2
    }

    #[cfg(feature = "max")]
    #[inline(always)]
    pub fn contexts(&self) -> [usize; 4] {
        let Edge { angle, kind, .. } = *self;
        let (low, high) = self.ends_in_bins();
        let [s, t] = self.outcomes();
        [
            self.context(),
            ((angle / 2 * 16 + s) * 4 + t.min(3)) * 4 + kind,
            self.valences_context(),
            ((low + high) * 32 + angle) * 4 + kind,
        ]
    }

    /// The lesser and the greater valence of the ends, in 16 bins.
    #[inline(always)]
    pub fn ends_in_bins(&self) -> (usize, usize) {
        let [low, high] =
            ordered(self.ends.map(|e| (e.wrapping_mul(3).wrapping_sub(6 * UNIT) >> 6).clamp(0, 15) as usize));
        (low, high)
    }

    /// The outcomes of both faces, in order.
    #[cfg(feature = "max")]
    #[inline(always)]
    pub fn outcomes(&self) -> [usize; 2] {
        ordered(self.turned.map(Turned::outcomes))
    }

    /// Whether the corners' faces are split.
    #[cfg(feature = "max")]
    pub fn are_split(&self) -> [bool; 2] {
        self.turned.map(|turned| turned.0 & Turned::SPLIT != 0)
    }
}

/// The lesser of two first.
#[inline(always)]
pub(super) fn ordered([a, b]: [usize; 2]) -> [usize; 2] {
    [a.min(b), a.max(b)]
}

/// The cotangent that faces the edge opposite to `c`, in 1/256: with the edges' squares *x*, *y*, *z* and the area
/// *A* it is (*x* + *y* − *z*) / 4*A*. The new vertex of a split face is taken to be the barycentre, from where it is
/// (*x* + *y* − 5*z*) / 12*A*.
#[inline(always)]
fn cotangent(sketch: &Sketch, c: u32, turned: Turned) -> i32 {
    let (f, k) = (c / 3, c % 3);
    let ratio = sketch.ratio[f as usize];
    let sum: i32 = ratio.iter().map(|&x| x as i32).sum();
    // A third, for a sum below 2¹⁶.
    let sum = if turned.0 & Turned::SPLIT != 0 { (sum * 21_846) >> 16 } else { sum };
    sum - 2 * ratio[k as usize] as i32
}

/// Cotangents beyond ± this, in 1/256, are alike.
const STEEP: i32 = 1 << 10;

/// For sums of cotangents from −[`STEEP`] on in steps of 1/32 their bins: 32 of *t*/(1 + 0.35 |*t*|), ten a
/// unit, zero in the middle.
static ANGLES: [u8; (2 * STEEP / 8) as usize] = {
    let mut table = [0; (2 * STEEP / 8) as usize];
    let mut i = 0;
    while i < table.len() {
        let sum = 8 * i as i32 - STEEP;
        let squashed = (sum << 8) / (256 + ((90 * sum.abs()) >> 8));
        let bin = ((10 * squashed) >> 8) + 16;
        table[i] = if bin < 0 {
            0
        } else if bin > 31 {
            31
        } else {
            bin as u8
        };
        i += 1;
    }
    table
};

/// 32 bins of a sum of cotangents in 1/256: Delaunay edges turn where it is negative.
#[inline(always)]
fn angle(sum: i32) -> usize {
    ANGLES[((sum.clamp(-STEEP, STEEP - 1) + STEEP) / 8) as usize] as usize
}

/// What they are at the end is what training is for.
#[cfg(all(test, feature = "max"))]
impl Drop for FlipModels {
    fn drop(&mut self) {
        if let FlipModels::Mixed(bits) = self {
            use super::training::Table;
            bits.note([Table::Flip(0), Table::Flip(2)], Table::FlipWeights);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::{cut, next, prev};
    use crate::shapes::{noisy, sphere};

    #[test]
    fn cotangents_are_those_of_the_faces_before_and_after_they_are_split() {
        let cut = cut(&noisy(&sphere(2), 0.05, 1));
        let surface = &cut.surface;
        let mesh = noisy(&sphere(2), 0.05, 1);
        let place =
            |v: u32| mesh.positions[cut.vertex_source[v as usize] as usize].map(|x| (x * 2000.0) as i32);
        let positions: Vec<_> = (0..surface.vertices).map(place).collect();
        let sketch = Sketch::new(surface, &positions);
        for c in 0..surface.vertex.len() as u32 {
            let at = |c: u32| positions[surface.at(c) as usize].map(f64::from);
            let [p, x, y] = [at(c), at(next(c)), at(prev(c))];
            let centre = [0, 1, 2].map(|k| (p[k] + x[k] + y[k]) / 3.0);
            for (apex, turned) in [(p, Turned(0)), (centre, Turned(Turned::SPLIT))] {
                let [u, v] = [x, y].map(|end| [0, 1, 2].map(|k| end[k] - apex[k]));
                let dot: f64 = (0..3).map(|k| u[k] * v[k]).sum();
                let square = |a: [f64; 3]| a.iter().map(|x| x * x).sum::<f64>();
                let exact = dot / (square(u) * square(v) - dot * dot).sqrt();
                let found = cotangent(&sketch, c, turned) as f64 / 256.0;
                assert!((found - exact).abs() < 0.03 * (1.0 + exact.abs()), "{found} {exact}");
            }
        }
    }

    #[test]
    fn bins_of_angles_ascend_with_their_middle_at_zero() {
        assert!((-1100..1100).all(|sum| angle(sum) <= angle(sum + 1)));
        assert_eq!((angle(i32::MIN), angle(0), angle(i32::MAX)), (0, 16, 31));
    }
}
