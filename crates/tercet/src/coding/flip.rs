//! Flip bits: which edges beside a split face turn.
//!
//! Edges are coded in the order of their first corners. New vertices lie where they are
//! predicted, so that the angles that a flip would make are known; which flips remain possible
//! and which valences they lead to are known exactly.

use super::model::BitModel;
use super::vector::{Point, cross, dot, length, sub};
use crate::entropy::{Coder, log2_fixed};
use crate::mesh::{Surface, next, prev};

/// The models of flip bits; they live as long as the file.
pub(crate) struct FlipModels {
    bits: BitModel<8>,
}

/// Valences are expected in 1/20; an undecided edge counts as flipped with this probability.
const UNIT: i32 = 20;
const PRIOR: i32 = 17;

/// Outcomes so far at a face.
#[derive(Clone, Copy, Default)]
struct Turned {
    flips: u8,
    stays: u8,
}

struct State<'a> {
    surface: &'a Surface,
    /// Positions of the coarse vertices, then of the new ones as predicted.
    positions: &'a [Point],
    split: &'a [bool],
    /// The new vertex of each split face.
    inserted: Vec<u32>,
    turned: Vec<Turned>,
    expected: Vec<i32>,
}

impl FlipModels {
    pub fn new() -> Self {
        FlipModels { bits: BitModel::new([128, 512, 2048, 1024, 1024, 4096, 1024, 4096], 64, 260) }
    }

    /// Codes `flip`, one entry a corner, equal on both sides of an edge; time O(n).
    ///
    /// `positions` holds the coarse vertices and behind them the predicted new ones.
    pub fn code<C: Coder>(
        &mut self,
        coder: &mut C,
        surface: &Surface,
        positions: &[Point],
        split: &[bool],
        flip: &mut [bool],
    ) {
        let mut state = State::new(surface, positions, split);
        for c in 0..surface.vertex.len() as u32 {
            let o = surface.across(c);
            if c > o || !state.is_candidate(c) {
                continue;
            }
            let blocked = |c: u32| !split[(c / 3) as usize] && state.turned[(c / 3) as usize].flips > 0;
            let bit = !blocked(c) && !blocked(o) && {
                let (set, contexts) = state.contexts(c);
                self.bits.code(coder, flip[c as usize], set, contexts)
            };
            flip[c as usize] = bit;
            flip[o as usize] = bit;
            state.decide(c, bit);
        }
    }
}

impl<'a> State<'a> {
    fn new(surface: &'a Surface, positions: &'a [Point], split: &'a [bool]) -> Self {
        let mut count = surface.vertices;
        let inserted = split
            .iter()
            .map(|&s| {
                count += s as u32;
                count.wrapping_sub(1)
            })
            .collect();
        let mut expected: Vec<i32> =
            surface.valences().iter().map(|&v| (v as i32).min(1 << 20) * UNIT).collect();
        let mut state = State {
            surface,
            positions,
            split,
            inserted,
            turned: vec![Turned::default(); split.len()],
            expected: Vec::new(),
        };
        for c in 0..surface.vertex.len() as u32 {
            if split[(c / 3) as usize] {
                expected[surface.at(c) as usize] += UNIT;
            } else if state.is_candidate(c) {
                expected[surface.at(c) as usize] += PRIOR;
            }
            if c < surface.across(c) && state.is_candidate(c) {
                expected[surface.at(next(c)) as usize] -= PRIOR;
                expected[surface.at(prev(c)) as usize] -= PRIOR;
            }
        }
        state.expected = expected;
        state
    }

    fn is_candidate(&self, c: u32) -> bool {
        self.split[(c / 3) as usize] || self.split[(self.surface.across(c) / 3) as usize]
    }

    /// The vertex that faces the edge after splitting.
    fn apex(&self, c: u32) -> u32 {
        let f = (c / 3) as usize;
        if self.split[f] { self.inserted[f] } else { self.surface.at(c) }
    }

    /// The valence to expect at an apex, but for this edge.
    fn apex_valence(&self, c: u32) -> i32 {
        let f = (c / 3) as usize;
        if self.split[f] {
            UNIT * (3 + self.turned[f].flips as i32)
        } else {
            self.expected[self.surface.at(c) as usize] - PRIOR
        }
    }

    fn contexts(&self, c: u32) -> (usize, [usize; 8]) {
        let o = self.surface.across(c);
        let (x, y) = (self.surface.at(next(c)), self.surface.at(prev(c)));
        let (p, q) = (self.apex(c), self.apex(o));
        let both = self.split[(c / 3) as usize] && self.split[(o / 3) as usize];
        let any_virtual = [x, y, p, q].iter().any(|&v| self.surface.is_virtual(v));
        let kind = !both as usize + 2 * any_virtual as usize;
        let (angle, ratio) = if any_virtual { (16, 8) } else { self.geometry(x, y, p, q) };
        let ends = [x, y].map(|v| self.expected[v as usize] + PRIOR);
        let bin = |e: i32| ((e * 3 / 2 - 3 * UNIT) / UNIT).clamp(0, 15) as usize;
        let (low, high) = (bin(ends[0].min(ends[1])), bin(ends[0].max(ends[1])));
        let apexes = [c, o].map(|c| self.apex_valence(c));
        let bin = |e: i32| ((e - 2 * UNIT) / UNIT).clamp(0, 7) as usize;
        let (near, far) = (bin(apexes[0].min(apexes[1])), bin(apexes[0].max(apexes[1])));
        let outcomes = |c: u32| {
            let f = (c / 3) as usize;
            let t = self.turned[f];
            if self.split[f] { 4 * t.flips.min(3) as usize + t.stays.min(3) as usize } else { 15 }
        };
        let (s, t) = (outcomes(c).min(outcomes(o)), outcomes(c).max(outcomes(o)));
        let contexts = [
            angle * 4 + kind,
            ratio * 32 + angle,
            (angle * 16 + low) * 4 + kind,
            (low * 16 + high) * 4 + kind,
            (s * 16 + t) * 4 + kind,
            ((angle / 2 * 16 + s) * 4 + t.min(3)) * 4 + kind,
            ((low / 2 * 8 + near) * 8 + far) * 2 + !both as usize,
            ((low + high) * 32 + angle) * 4 + kind,
        ];
        (angle / 2 + 16 * kind, contexts)
    }

    /// Bins of the cotangents facing the edge (a Delaunay edge flips where their sum is
    /// negative) and of the ratio of the two diagonals.
    fn geometry(&self, x: u32, y: u32, p: u32, q: u32) -> (usize, usize) {
        let at = |v: u32| self.positions[v as usize];
        let cotangent = |apex: u32| {
            let (a, b) = (sub(at(x), at(apex)), sub(at(y), at(apex)));
            let cosine = dot(a, b);
            let sine = length(cross(a, b)) + 1;
            let spare = 10u32.saturating_sub(cosine.unsigned_abs().max(sine as u64).leading_zeros());
            ((cosine >> spare) << 8) / (sine >> spare).max(1)
        };
        let sum = cotangent(p) + cotangent(q);
        let sum = sum.clamp(-(1 << 16), 1 << 16);
        let squashed = (sum << 8) / (256 + ((90 * sum.abs()) >> 8));
        let square = |a: Point, b: Point| {
            let e = sub(a, b);
            dot(e, e).unsigned_abs() + 1
        };
        let ratio = log2_fixed(square(at(x), at(y)), 5) - log2_fixed(square(at(p), at(q)), 5);
        ((((10 * squashed) >> 8) + 16).clamp(0, 31) as usize, (((2 * ratio) >> 5) + 8).clamp(0, 15) as usize)
    }

    /// Replaces the expectation about an edge by its outcome.
    fn decide(&mut self, c: u32, bit: bool) {
        let change = UNIT * bit as i32 - PRIOR;
        for c in [c, self.surface.across(c)] {
            let f = (c / 3) as usize;
            self.expected[self.surface.at(next(c)) as usize] -= change;
            if !self.split[f] {
                self.expected[self.surface.at(c) as usize] += change;
            }
            let turned = &mut self.turned[f];
            if bit { turned.flips += 1 } else { turned.stays += 1 }
        }
    }
}
