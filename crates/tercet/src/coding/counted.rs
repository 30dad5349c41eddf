//! Split and flip bits by single counters: what the fast profile codes in place of
//! [`split`](super::split)'s and [`flip`](super::flip)'s mixed decisions.
//!
//! The questions and their order are the same. What does not depend on the answers is gathered
//! before the first of them.

use super::flip::{PRIOR, Turned, UNIT};
use super::model::LIMIT;
use super::shape::VIRTUAL;
use super::sketch::Sketch;
use crate::entropy::{Coder, Counter};
use crate::mesh::{Surface, next, prev};

/// The models of split and flip bits; they live as long as the file.
pub(crate) struct CountedModels {
    split: Vec<Counter>,
    flip: Vec<Counter>,
}

/// Values of the contexts.
const SPLITS: usize = 16 * 16 * 3 * 2;
const FLIPS: usize = 32 * 16 * 4 * 4;

impl CountedModels {
    pub fn new() -> Self {
        CountedModels { split: vec![Counter::NEW; SPLITS], flip: vec![Counter::NEW; FLIPS] }
    }

    /// Codes `split`, one entry a face of `surface`; time O(n).
    pub fn split<C: Coder>(&mut self, coder: &mut C, surface: &Surface, sketch: &Sketch, split: &mut [bool]) {
        // Of each face 0 until it is decided, then 4 if it is split and 1 if not.
        let mut decided = vec![0u8; split.len()];
        // Of each vertex how many faces at it are split so far and, in the upper half, how many are not.
        let mut counts = vec![0u64; surface.vertices as usize];
        let mut threshold = Threshold::default();
        let faces = surface.vertex.chunks_exact(3).zip(surface.opposite.chunks_exact(3));
        for (((f, (t, o)), &area), bit) in faces.enumerate().zip(&sketch.area).zip(split) {
            let neighbours: u8 = o.iter().map(|&o| decided[(o / 3) as usize]).sum();
            let around = t.iter().fold(0u64, |sum, &v| sum.wrapping_add(counts[v as usize]));
            let [local, large] = if area == VIRTUAL {
                [0, 0]
            } else {
                let mean = t.iter().map(|&v| sketch.vertex[v as usize].area as i32).sum::<i32>() / 3;
                let local = (((area as i32 - mean) >> 3) + 8).clamp(1, 15);
                [local as usize, threshold.is_below(area) as usize]
            };
            let context = ((neighbours as usize * 16 + local) * 3 + share(around)) * 2 + large;
            let counter = &mut self.split[context];
            *bit = coder.bit(*bit, counter.p());
            counter.learn(*bit, LIMIT);
            decided[f] = if *bit { 4 } else { 1 };
            if area != VIRTUAL {
                threshold.learn(area, *bit);
            }
            let one = if *bit { 1 } else { 1 << 32 };
            for &v in t {
                counts[v as usize] = counts[v as usize].wrapping_add(one);
            }
        }
    }

    /// Codes `flip`, one entry a corner, equal on both sides of an edge, and returns the corners before their
    /// opposites whose edges are flipped; time O(n).
    pub fn flip<C: Coder>(
        &mut self,
        coder: &mut C,
        surface: &Surface,
        sketch: &Sketch,
        split: &[bool],
        flip: &[bool],
    ) -> Vec<u32> {
        let (candidates, mut state) = State::new(surface, sketch, split);
        let mut flipped = Vec::with_capacity(candidates.len());
        for c in candidates {
            let o = surface.across(c);
            let turned = [c, o].map(|c| state.turned[(c / 3) as usize]);
            let bit = !turned.iter().any(|turned| turned.is_blocked()) && {
                let counter = &mut self.flip[state.context(sketch, [c, o], turned)];
                let bit = coder.bit(flip.get(c as usize).is_some_and(|&flip| flip), counter.p());
                counter.learn(bit, LIMIT);
                bit
            };
            if bit {
                flipped.push(c);
            }
            state.decide([c, o], turned, bit);
        }
        flipped
    }
}

/// How many of the decided faces at three corners are split: less than a third, a half, more. `around` counts
/// the split ones and, in its upper half, the others.
#[inline(always)]
fn share(around: u64) -> usize {
    let (split, unsplit) = (around & u32::MAX as u64, around >> 32);
    (3 * split >= unsplit) as usize + (2 * split >= unsplit) as usize
}

/// What lies between the areas of the faces that were split and of those that were not.
#[derive(Default)]
struct Threshold {
    /// Running means of the areas, in 1/2²¹ octaves, and how many there were, of faces unsplit and split.
    means: [(i32, u32); 2],
}

impl Threshold {
    /// Larger faces by this many 1/32 octaves are large.
    const MARGIN: i32 = 11;
    /// A new area counts for 2⁻¹⁰ at least.
    const LIMIT: u32 = 1 << 10;

    #[inline(always)]
    fn is_below(&self, area: i16) -> bool {
        let [(a, some), (b, others)] = self.means;
        // Without both kinds there is no threshold.
        let both = (some.min(others) > 0) as i32;
        (area as i32 - ((a + b) >> 17)) * both >= Self::MARGIN
    }

    #[inline(always)]
    fn learn(&mut self, area: i16, split: bool) {
        let (mean, count) = &mut self.means[split as usize];
        *count = (*count + 1).min(Self::LIMIT);
        *mean += (((area as i32) << 16) - *mean) >> count.ilog2();
    }
}

/// Beside what [`Turned`] notes of a face, that it is virtual.
const HIDDEN: u8 = 0x40;

/// What flip bits depend on.
struct State<'a> {
    surface: &'a Surface,
    turned: Vec<Turned>,
    /// The valence to expect of each vertex.
    expected: Vec<i32>,
}

impl<'a> State<'a> {
    /// Before the first bit; also the edges beside a split face, by their first corners.
    fn new(surface: &'a Surface, sketch: &Sketch, split: &[bool]) -> (Vec<u32>, Self) {
        let turned: Vec<Turned> = split
            .iter()
            .zip(&sketch.area)
            .map(|(&split, &area)| Turned(Turned::SPLIT * split as u8 + HIDDEN * (area == VIRTUAL) as u8))
            .collect();
        let mut expected = vec![0i32; surface.vertices as usize];
        let mut candidates = vec![0; surface.vertex.len() / 2 + 1];
        let mut count = 0;
        let faces = surface.vertex.chunks_exact(3).zip(surface.opposite.chunks_exact(3));
        for (f, (t, o)) in faces.enumerate() {
            let born = split[f];
            let beside = [0, 1, 2].map(|k| born | split[(o[k] / 3) as usize]);
            for k in 0..3 {
                let as_apex = if born { UNIT } else { PRIOR * beside[k] as i32 };
                // Of the edges at a vertex each face takes one.
                let as_end = PRIOR * beside[(k + 1) % 3] as i32;
                let expected = &mut expected[t[k] as usize];
                *expected = expected.wrapping_add(UNIT + as_apex - as_end);
                let c = (3 * f + k) as u32;
                candidates[count] = c;
                count += (beside[k] & (c < o[k])) as usize;
            }
        }
        candidates.truncate(count);
        (candidates, State { surface, turned, expected })
    }

    #[inline(always)]
    fn expected(&self, c: u32) -> i32 {
        self.expected[self.surface.at(c) as usize]
    }

    /// The valence to expect at an apex, but for this edge.
    #[inline(always)]
    fn at_apex(&self, c: u32, turned: Turned) -> i32 {
        let [old, new] = [self.expected(c).wrapping_sub(PRIOR), UNIT * (3 + turned.flips())];
        // Split or not is hard to guess, for a processor too.
        old ^ ((old ^ new) & -((turned.0 >> 7) as i32))
    }

    #[inline(always)]
    fn context(&self, sketch: &Sketch, [c, o]: [u32; 2], turned: [Turned; 2]) -> usize {
        let one = (!turned[0].0 | !turned[1].0) & Turned::SPLIT;
        let hidden = (turned[0].0 | turned[1].0) & HIDDEN;
        let kind = (one >> 7 | hidden >> 5) as usize;
        let angle = angle(cotangent(sketch, c, turned[0]) + cotangent(sketch, o, turned[1]));
        let ends = self.expected(next(c)).wrapping_add(self.expected(prev(c))).wrapping_add(2 * PRIOR);
        let apexes = self.at_apex(c, turned[0]).wrapping_add(self.at_apex(o, turned[1]));
        let ends = ((ends >> 4) - 16).clamp(0, 15) as usize;
        let apexes = [205, 250, 295].into_iter().map(|least| (apexes >= least) as usize).sum::<usize>();
        ((angle * 16 + ends) * 4 + kind) * 4 + apexes
    }

    /// Replaces the expectation about an edge by its outcome.
    #[inline(always)]
    fn decide(&mut self, corners: [u32; 2], turned: [Turned; 2], bit: bool) {
        let change = UNIT * bit as i32 - PRIOR;
        for (c, turned) in corners.into_iter().zip(turned) {
            self.turned[(c / 3) as usize].0 = turned.0 + if bit { Turned::FLIP } else { Turned::STAY };
            let end = &mut self.expected[self.surface.at(next(c)) as usize];
            *end = end.wrapping_sub(change);
            let apex = &mut self.expected[self.surface.at(c) as usize];
            *apex = apex.wrapping_add(change & ((turned.0 >> 7) as i32 - 1));
        }
    }
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::cut;
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

    #[test]
    fn shares_split_at_a_third_and_a_half() {
        let around = |split: u64, unsplit: u64| share(split | unsplit << 32);
        assert_eq!([around(0, 1), around(1, 3), around(1, 2), around(0, 0)], [0, 1, 2, 2]);
    }
}
