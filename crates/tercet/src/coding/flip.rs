//! Flip bits: which edges beside a split face turn.
//!
//! Edges are coded in the order of their first corners. New vertices lie where they are
//! predicted, so that the angles that a flip would make are known; which flips remain possible
//! and which valences they lead to are known exactly. The geometry depends on no flip, so that it
//! is computed for all edges at once, before the first bit.

#[cfg(feature = "max")]
use super::births::Births;
use super::model::BitModel;
#[cfg(feature = "max")]
use super::panel::Panel;
use super::shape::Shapes;
use super::vector::{Point, dot, sub};
use crate::Effort;
use crate::entropy::{Coder, log2_fixed};
use crate::mesh::{NONE, Surface, next, prev};

/// The models of flip bits; they live as long as the file.
pub(crate) enum FlipModels {
    Mixed(BitModel<6>),
    /// More contexts, for size.
    #[cfg(feature = "max")]
    Panel(Box<FlipPanel>),
}

/// Valences are expected in 1/32; an undecided edge counts as flipped with this probability.
pub(super) const UNIT: i32 = 32;
pub(super) const PRIOR: i32 = 27;

/// Cotangents, in 1/256, are held within ± this.
const COTANGENT_LIMIT: i32 = 1 << 16;

/// A face: whether it is split, and the outcomes of its edges so far.
#[derive(Clone, Copy)]
pub(super) struct Turned(pub u8);

impl Turned {
    pub const SPLIT: u8 = 0x80;
    pub const FLIP: u8 = 4;
    pub const STAY: u8 = 1;

    #[inline(always)]
    fn is_split(self) -> bool {
        self.0 & Self::SPLIT != 0
    }

    #[inline(always)]
    pub fn flips(self) -> i32 {
        ((self.0 / Self::FLIP) & 3) as i32
    }

    /// An unsplit face turns with one flip at most.
    #[inline(always)]
    pub fn is_blocked(self) -> bool {
        !self.is_split() && self.flips() > 0
    }

    /// 0..15 in a split face: four times its flips and its stays; 15 in another.
    #[inline(always)]
    fn outcomes(self) -> usize {
        if self.is_split() { (self.0 & 15) as usize } else { 15 }
    }
}

/// An edge beside a split face, by its first corner, and what does not depend on flips.
#[derive(Clone, Copy)]
struct Candidate {
    corner: u32,
    /// Only one of its faces is split.
    one: bool,
    /// An end or an apex is virtual.
    any_virtual: bool,
    /// Bin of the sum of the cotangents that face the edge: Delaunay edges turn where it is negative.
    angle: u8,
    /// Bin of the ratio of the two diagonals.
    ratio: u8,
}

struct State<'a> {
    surface: &'a Surface,
    turned: Vec<Turned>,
    expected: Vec<i32>,
}

impl FlipModels {
    pub fn new(effort: Effort) -> Self {
        match effort {
            #[cfg(feature = "max")]
            Effort::Max => FlipModels::Panel(Box::new(FlipPanel::new())),
            _ => FlipModels::Mixed(BitModel::new([512, 2048, 1024, 4096, 1024, 4096], 64, 260)),
        }
    }

    /// Codes `flip`, one entry a corner, equal on both sides of an edge; time O(n).
    ///
    /// `positions` holds the coarse vertices and behind them the predicted new ones.
    pub fn code<C: Coder>(
        &mut self,
        coder: &mut C,
        surface: &Surface,
        shapes: &Shapes,
        positions: &[Point],
        split: &[bool],
        flip: &mut [bool],
    ) {
        let (candidates, mut state) = survey(surface, shapes, positions, split);
        for candidate in candidates {
            let c = candidate.corner;
            let o = surface.across(c);
            let turned = [c, o].map(|c| state.turned[(c / 3) as usize]);
            let bit = !turned[0].is_blocked() && !turned[1].is_blocked() && {
                let known = flip[c as usize];
                match self {
                    FlipModels::Mixed(bits) => {
                        let (set, contexts) = state.contexts(candidate, [c, o], turned);
                        bits.code(coder, known, set, contexts)
                    }
                    #[cfg(feature = "max")]
                    FlipModels::Panel(panel) => panel.code(coder, known, &state, candidate, [c, o], turned),
                }
            };
            flip[c as usize] = bit;
            flip[o as usize] = bit;
            state.decide([c, o], bit);
        }
        #[cfg(feature = "max")]
        if let FlipModels::Panel(panel) = self {
            panel.births.advance(surface.vertices);
        }
    }
}

/// The contexts of the mixed model and five more.
#[cfg(feature = "max")]
pub(crate) struct FlipPanel {
    bits: Panel<11, 5>,
    births: Births,
}

/// Pairs of ages: of the ends of an edge, and of its apexes, where new vertices have one of their own.
#[cfg(feature = "max")]
const END_AGES: usize = Births::AGES.pow(2);
#[cfg(feature = "max")]
const APEX_AGES: usize = (Births::AGES + 1).pow(2);

#[cfg(feature = "max")]
impl FlipPanel {
    fn new() -> Self {
        let ages = END_AGES * APEX_AGES;
        let sizes =
            [512, 2048, 1024, 4096, 1024, 4096, ages * 16, END_AGES * 64, 256 * 64, 256 * 64, 32 * 8 * 32];
        FlipPanel { bits: Panel::new(sizes, [64, 256, ages, 64, 4]), births: Births::default() }
    }

    fn code<C: Coder>(
        &mut self,
        coder: &mut C,
        bit: bool,
        state: &State,
        candidate: Candidate,
        [c, o]: [u32; 2],
        turned: [Turned; 2],
    ) -> bool {
        let surface = state.surface;
        let age = |c: u32| self.births.age(surface.at(c));
        let apex = |c: u32, turned: Turned| if turned.is_split() { Births::AGES } else { age(c) };
        let ordered = |[a, b]: [usize; 2]| [a.min(b), a.max(b)];
        let [young, old] = ordered([age(next(c)), age(prev(c))]);
        let ends = young * Births::AGES + old;
        let [young, old] = ordered([apex(c, turned[0]), apex(o, turned[1])]);
        let ages = ends * APEX_AGES + young * (Births::AGES + 1) + old;
        let [few, many] = ordered(turned.map(Turned::outcomes));
        let outcomes = few * 16 + many;
        let at_ends = [next(c), prev(c)].map(|c| state.expected[surface.at(c) as usize] + PRIOR);
        let at_apexes = [state.apex_valence(c, turned[0]), state.apex_valence(o, turned[1])];
        let excess = at_ends[0] + at_ends[1] - at_apexes[0] - at_apexes[1];
        let balance = (excess / (UNIT / 2) + 16).clamp(0, 31) as usize;
        let valences = |expected: [i32; 2]| {
            let [low, high] = ordered(expected.map(|e| ((e - 3 * UNIT) / UNIT).clamp(0, 7) as usize));
            low * 8 + high
        };
        let (angle, one) = (candidate.angle as usize, candidate.one as usize);
        let (set, [k0, k1, k2, k3, k4, k5]) = state.contexts(candidate, [c, o], turned);
        let contexts = [
            k0,
            k1,
            k2,
            k3,
            k4,
            k5,
            ages * 16 + many,
            (ends * 32 + angle) * 2 + one,
            outcomes * 64 + valences(at_ends),
            outcomes * 64 + valences(at_apexes),
            (balance * 8 + angle / 4) * 32 + candidate.ratio as usize * 2 + one,
        ];
        let kind = one + 2 * candidate.any_virtual as usize;
        self.bits.code(coder, bit, [set, outcomes, ages, balance * 2 + one, kind], contexts)
    }
}

/// Finds the candidates with their geometry, and the valences to expect before the first bit.
fn survey<'a>(
    surface: &'a Surface,
    shapes: &Shapes,
    positions: &[Point],
    split: &[bool],
) -> (Vec<Candidate>, State<'a>) {
    let mut candidates = Vec::with_capacity(surface.vertex.len() / 2);
    let mut expected: Vec<i32> = shapes.vertex.iter().map(|v| v.valence.min(1 << 20) as i32 * UNIT).collect();
    let mut inserted = surface.vertices;
    let new: Vec<u32> = split
        .iter()
        .map(|&s| {
            inserted += s as u32;
            if s { inserted - 1 } else { NONE }
        })
        .collect();
    let apex = |new: u32, v: u32| if new == NONE { v } else { new };
    for (f, t) in (0u32..).zip(surface.vertex.chunks_exact(3)) {
        let born = new[f as usize];
        for (k, v, x, y) in [(0, t[0], t[1], t[2]), (1, t[1], t[2], t[0]), (2, t[2], t[0], t[1])] {
            let c = 3 * f + k;
            let o = surface.across(c);
            let g = o / 3;
            let beyond = new[g as usize];
            if born == NONE && beyond == NONE {
                continue;
            }
            expected[v as usize] += if born != NONE { UNIT } else { PRIOR };
            if c > o {
                continue;
            }
            expected[x as usize] -= PRIOR;
            expected[y as usize] -= PRIOR;
            let [p, q] = [apex(born, v), apex(beyond, surface.at(o))];
            let any_virtual = surface.is_virtual(x.min(y).min(p).min(q));
            let [angle, ratio] = if any_virtual {
                [16, 8]
            } else {
                let [x, y, p, q] = [x, y, p, q].map(|v| positions[v as usize]);
                let cotangent = |f: u32, is_split: bool, p: Point| {
                    match shapes.face[f as usize] {
                        // A new vertex lies near the barycentre: it faces a third of the area.
                        face if !face.is_virtual() => face.inverse.ratio(dot(sub(x, p), sub(y, p)), is_split),
                        // … or, in a virtual face, near the middle of the edge.
                        _ => -COTANGENT_LIMIT,
                    }
                };
                let sum = cotangent(f, born != NONE, p) + cotangent(g, beyond != NONE, q);
                [angle(sum), ratio([x, y], [p, q])]
            };
            let one = born == NONE || beyond == NONE;
            candidates.push(Candidate { corner: c, one, any_virtual, angle, ratio });
        }
    }
    let turned = split.iter().map(|&s| Turned(if s { Turned::SPLIT } else { 0 })).collect();
    (candidates, State { surface, turned, expected })
}

/// 32 bins of a sum of cotangents in 1/256, zero in the middle.
#[inline(always)]
fn angle(sum: i32) -> u8 {
    let sum = sum.clamp(-COTANGENT_LIMIT, COTANGENT_LIMIT);
    let squashed = (sum << 8) / (256 + ((90 * sum.abs()) >> 8));
    (((10 * squashed) >> 8) + 16).clamp(0, 31) as u8
}

/// 16 bins of the ratio of two lengths, two an octave.
#[inline(always)]
fn ratio(edge: [Point; 2], other: [Point; 2]) -> u8 {
    let square = |[a, b]: [Point; 2]| {
        let e = sub(a, b);
        log2_fixed(dot(e, e) as u64 + 1, 5)
    };
    (((2 * (square(edge) - square(other))) >> 5) + 8).clamp(0, 15) as u8
}

impl State<'_> {
    /// The valence to expect at an apex, but for this edge.
    #[inline(always)]
    fn apex_valence(&self, c: u32, turned: Turned) -> i32 {
        if turned.is_split() {
            UNIT * (3 + turned.flips())
        } else {
            self.expected[self.surface.at(c) as usize] - PRIOR
        }
    }

    #[inline(always)]
    fn contexts(&self, candidate: Candidate, [c, o]: [u32; 2], turned: [Turned; 2]) -> (usize, [usize; 6]) {
        let one = candidate.one as usize;
        let kind = one + 2 * candidate.any_virtual as usize;
        let (angle, ratio) = (candidate.angle as usize, candidate.ratio as usize);
        let ends = [next(c), prev(c)].map(|c| self.expected[self.surface.at(c) as usize] + PRIOR);
        let bin = |e: i32| ((e * 3 / 2 - 3 * UNIT) / UNIT).clamp(0, 15) as usize;
        let (low, high) = (bin(ends[0].min(ends[1])), bin(ends[0].max(ends[1])));
        let apexes = [self.apex_valence(c, turned[0]), self.apex_valence(o, turned[1])];
        let bin = |e: i32| ((e - 2 * UNIT) / UNIT).clamp(0, 7) as usize;
        let (near, far) = (bin(apexes[0].min(apexes[1])), bin(apexes[0].max(apexes[1])));
        let outcomes = turned.map(Turned::outcomes);
        let (s, t) = (outcomes[0].min(outcomes[1]), outcomes[0].max(outcomes[1]));
        let contexts = [
            ratio * 32 + angle,
            (angle * 16 + low) * 4 + kind,
            (low * 16 + high) * 4 + kind,
            ((angle / 2 * 16 + s) * 4 + t.min(3)) * 4 + kind,
            ((low / 2 * 8 + near) * 8 + far) * 2 + one,
            ((low + high) * 32 + angle) * 4 + kind,
        ];
        (angle / 2 + 16 * kind, contexts)
    }

    /// Replaces the expectation about an edge by its outcome.
    #[inline(always)]
    fn decide(&mut self, corners: [u32; 2], bit: bool) {
        let change = UNIT * bit as i32 - PRIOR;
        for c in corners {
            let turned = &mut self.turned[(c / 3) as usize];
            turned.0 += if bit { Turned::FLIP } else { Turned::STAY };
            let is_split = turned.is_split();
            self.expected[self.surface.at(next(c)) as usize] -= change;
            if !is_split {
                self.expected[self.surface.at(c) as usize] += change;
            }
        }
    }
}
