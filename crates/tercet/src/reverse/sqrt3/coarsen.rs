//! The coarse surface of a labelled one.
//!
//! An odd vertex inside is a coarse face: its three even neighbours, counter-clockwise. Two odd
//! vertices v and u on an edge inside are two coarse faces on the edge between the even vertices
//! x and y beside them, which refinement flipped:
//!
//! ```text
//!          y                    y
//!         / \                  /|\
//!        / G \                / | \
//!       v-----u      ->      v  |  u        coarse faces (x, y, ..) of v and (y, x, ..) of u
//!        \ F /                \ | /
//!         \ /                  \|/
//!          x                    x
//! ```
//!
//! Every fine face but those on a boundary edge is the F or the G of exactly one such pair. So
//! each coarse corner is *tied* to a fine one: the corner of v's coarse face opposite to x→y to
//! the corner at v of F = (v, x, u), that of u's to the corner at u of G = (u, y, v). Opposite
//! corners are found through their ties, never by the ends of their edge, so that two coarse
//! edges with the same ends do no harm. An edge on or behind a boundary is not flipped; there
//! the tie is the fine corner that faces the edge or a third of it.

use super::facts::Facts;
use crate::mesh::{NONE, Surface, next, prev};
use crate::reverse::Reduction;
use crate::subdivide::StepKind;

/// The corner at the same vertex in the next face clockwise.
fn swing_back(s: &Surface, c: u32) -> u32 {
    prev(s.across(prev(c)))
}

/// Builds the coarse surface of a labelling that passed [`label`](crate::reverse::label::label).
///
/// `None` if it would have fewer than four vertices or a face that meets a vertex twice.
pub(super) fn coarsen(fine: &Surface, facts: &Facts, even: &[bool]) -> Option<Reduction> {
    let kept: Vec<u32> = (0..fine.vertices).filter(|&v| even[v as usize]).collect();
    if kept.len() < 4 {
        return None;
    }
    let mut builder = Builder::new(fine, even, &kept);
    // An odd vertex on a boundary has no coarse face of its own.
    let mut done = facts.open.clone();
    for f in 0..fine.faces() {
        let real = facts.evens[f as usize] > 0;
        match facts.kind {
            StepKind::Sqrt3Odd => builder.cut_face(f, real),
            _ if !real => builder.untouched_face(f),
            _ => {}
        }
        for c in 3 * f..3 * f + 3 {
            let v = fine.at(c) as usize;
            if !even[v] && !done[v] {
                done[v] = true;
                builder.centred_face(c);
            }
        }
    }
    builder.finish(facts.kind, kept)
}

struct Builder<'a> {
    fine: &'a Surface,
    even: &'a [bool],
    /// The coarse number of each even fine vertex.
    rank: Vec<u32>,
    vertex: Vec<u32>,
    split: Vec<bool>,
    flip: Vec<bool>,
    anchor: Vec<u32>,
    /// For each coarse corner the fine corner tied to it.
    tie: Vec<u32>,
    /// For each fine corner the coarse corner tied to it, or `NONE`.
    tied: Vec<u32>,
}

impl<'a> Builder<'a> {
    fn new(fine: &'a Surface, even: &'a [bool], kept: &[u32]) -> Self {
        let mut rank = vec![NONE; fine.vertices as usize];
        for (i, &v) in kept.iter().enumerate() {
            rank[v as usize] = i as u32;
        }
        let corners = fine.vertex.len();
        Builder {
            fine,
            even,
            rank,
            vertex: Vec::with_capacity(corners / 3),
            split: Vec::with_capacity(corners / 9),
            flip: Vec::with_capacity(corners / 3),
            anchor: Vec::with_capacity(corners / 9),
            tie: Vec::with_capacity(corners / 3),
            tied: vec![NONE; corners],
        }
    }

    fn is_even(&self, c: u32) -> bool {
        self.even[self.fine.at(c) as usize]
    }

    /// Adds a coarse face given by fine vertices, with its ties and flips corner by corner.
    fn push(&mut self, vertices: [u32; 3], ties: [u32; 3], flips: [bool; 3], split: bool, anchor: u32) {
        for (i, tie) in ties.into_iter().enumerate() {
            self.tied[tie as usize] = (self.tie.len() + i) as u32;
        }
        self.vertex.extend(vertices.map(|v| self.rank[v as usize]));
        self.tie.extend(ties);
        self.flip.extend(flips);
        self.split.push(split);
        self.anchor.push(anchor);
    }

    /// A virtual face that the step left alone.
    fn untouched_face(&mut self, f: u32) {
        let corners = [3 * f, 3 * f + 1, 3 * f + 2];
        self.push(self.fine.face(f), corners, [false; 3], false, 3 * f);
    }

    /// The face whose centre is at corner `c`.
    fn centred_face(&mut self, c: u32) {
        let fine = self.fine;
        // From the corner before one even neighbour to the corner before the following one; on
        // a boundary edge of the even generation they are neighbours, else an odd one between.
        let onward = |c: u32| {
            let beside = fine.swing(c);
            if self.is_even(next(beside)) { beside } else { fine.swing(beside) }
        };
        let first = if self.is_even(next(c)) { c } else { fine.swing(c) };
        let second = onward(first);
        let third = onward(second);
        let ties = [second, third, first];
        let flips = ties.map(|c| !self.is_even(prev(c)));
        self.push([first, second, third].map(|c| fine.at(next(c))), ties, flips, true, first);
    }

    /// The coarse face that fine face `f` is the middle third of, if `f` has a boundary edge
    /// with two odd ends: the real face (a, b, q) for (p, p', q) or the virtual face (b, a, w)
    /// for (p', p, w). Picture at `refine_sqrt3`.
    fn cut_face(&mut self, f: u32, real: bool) {
        let fine = self.fine;
        let tip = (3 * f..3 * f + 3).find(|&c| {
            let over_boundary = if real { fine.across(c) } else { c };
            fine.is_virtual(fine.at(over_boundary)) && !self.is_even(next(c)) && !self.is_even(prev(c))
        });
        let Some(tip) = tip else { return };
        let (left, right) = (next(tip), prev(tip));
        if real {
            let beside_a = fine.swing(left);
            let beside_b = swing_back(fine, swing_back(fine, right));
            let a = fine.at(prev(fine.swing(beside_a)));
            let b = fine.at(next(beside_b));
            let ties = [beside_b, beside_a, tip];
            self.push([a, b, fine.at(tip)], ties, [true, true, false], true, left);
        } else {
            // The thirds beside it on both sides, around the virtual vertex.
            let (beside_a, beside_b) = (fine.swing(tip), swing_back(fine, tip));
            let (a, b) = (fine.at(prev(beside_a)), fine.at(next(beside_b)));
            let ties = [next(beside_a), prev(beside_b), tip];
            self.push([b, a, fine.at(tip)], ties, [false; 3], false, left);
        }
    }

    fn finish(self, kind: StepKind, kept: Vec<u32>) -> Option<Reduction> {
        let fine = self.fine;
        if self.vertex.chunks_exact(3).any(|t| t[0] == t[1] || t[1] == t[2] || t[2] == t[0]) {
            return None;
        }
        let beyond = |(&tie, &flip): (&u32, &bool)| {
            let c = if flip { prev(fine.across(next(tie))) } else { fine.across(tie) };
            self.tied[c as usize]
        };
        let opposite = self.tie.iter().zip(&self.flip).map(beyond).collect();
        let vertices = kept.len() as u32;
        let coarse = Surface { vertex: self.vertex, opposite, vertices, virtuals: fine.virtuals };
        Some(Reduction { kind, coarse, kept, split: self.split, flip: self.flip, anchor: self.anchor })
    }
}
