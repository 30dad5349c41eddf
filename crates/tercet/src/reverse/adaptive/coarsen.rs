//! Building the coarse surface once the odd vertices and their flips are known.

use super::{Flips, MAX_VALENCE, corners_of};
use crate::mesh::{NONE, Surface, next, prev};
use crate::reverse::{Reduction, StepKind};

/// Undoes the flips and the splits of the vertices v with `odd[v]`; linear time.
///
/// `corner` holds the first corner of each vertex, from which flip sets count ring positions.
/// Coarse faces come in the order of the first fine face that each odd vertex or unchanged
/// face has, so they inherit the locality of the fine ones.
pub(super) fn coarsen(fine: &Surface, corner: &[u32], odd: &[Option<Flips>]) -> Reduction {
    let mut builder = Builder::new(fine, odd);
    for f in 0..fine.faces() {
        let vertices = fine.face(f);
        let removed = vertices.map(|v| odd[v as usize]);
        if removed == [None; 3] {
            builder.plain_face(3 * f);
            continue;
        }
        for k in 0..3 {
            let c = 3 * f + k as u32;
            if let Some(flips) = removed[k]
                && corner[vertices[k] as usize] == c
            {
                builder.split_face(c, flips);
            }
        }
    }
    builder.finish()
}

struct Builder<'a> {
    fine: &'a Surface,
    odd: &'a [Option<Flips>],
    /// Number of each fine vertex on the coarse surface; meaningless for odd ones.
    number: Vec<u32>,
    /// For each fine corner that faces an edge which the coarse surface keeps, or which is
    /// flipped, the coarse corner that faces that edge (flipped back). Edges are matched
    /// through it rather than by their ends, which need not determine them.
    heir: Vec<u32>,
    out: Reduction,
}

impl<'a> Builder<'a> {
    fn new(fine: &'a Surface, odd: &'a [Option<Flips>]) -> Self {
        let mut kept = Vec::with_capacity(odd.len());
        let mut number = Vec::with_capacity(odd.len());
        for (v, odd) in (0..).zip(odd) {
            number.push(kept.len() as u32);
            if odd.is_none() {
                kept.push(v);
            }
        }
        // Each removal leaves two faces fewer.
        let faces = fine.faces() as usize - 2 * (odd.len() - kept.len());
        let coarse = Surface {
            vertex: Vec::with_capacity(3 * faces),
            opposite: vec![NONE; 3 * faces],
            vertices: kept.len() as u32,
            virtuals: fine.virtuals,
        };
        let out = Reduction {
            kind: StepKind::Adaptive,
            coarse,
            kept,
            split: Vec::with_capacity(faces),
            flip: vec![false; 3 * faces],
            anchor: Vec::with_capacity(faces),
        };
        Self { fine, odd, number, heir: vec![NONE; fine.vertex.len()], out }
    }

    /// Appends a face with the given vertices of the fine surface; returns its corner 0.
    fn push(&mut self, vertices: [u32; 3], split: bool, anchor: u32) -> u32 {
        let first = self.out.coarse.vertex.len() as u32;
        self.out.coarse.vertex.extend(vertices.map(|v| self.number[v as usize]));
        self.out.split.push(split);
        self.out.anchor.push(anchor);
        first
    }

    /// A fine face that stays as it is; `c` is its corner 0.
    fn plain_face(&mut self, c: u32) {
        let face = self.push(self.fine.face(c / 3), false, c);
        for k in 0..3 {
            self.heir[(c + k) as usize] = face + k;
        }
    }

    /// The face that the vertex of corner `c` splits, then the faces that its flips leave.
    fn split_face(&mut self, c: u32, flips: Flips) {
        let mut fan = [NONE; MAX_VALENCE];
        let mut valence = 0;
        for d in self.fine.fan(c) {
            fan[valence] = d;
            valence += 1;
        }
        let ring = |i: usize| self.fine.at(next(fan[i]));
        let corners = corners_of(flips);
        let face = self.push(corners.map(ring), true, fan[corners[0]]);
        for (k, x) in corners.into_iter().enumerate() {
            // From x to the next corner around v: one fine face, or two and a flipped spoke to w.
            let facing = face + (k as u32 + 2) % 3;
            let w = if x + 1 == valence { 0 } else { x + 1 };
            if flips >> w & 1 == 0 {
                self.heir[fan[x] as usize] = facing;
                continue;
            }
            self.heir[prev(fan[w]) as usize] = facing;
            self.out.flip[facing as usize] = true;
            if self.odd[self.fine.at(next(fan[w])) as usize].is_none() {
                self.left_face(fan[x], fan[w]);
            }
        }
    }

    /// The face (x, w, y) that flipping the spoke from v to w leaves; `xw` and `wy` are the
    /// corners at v of the faces (v, x, w) and (v, w, y).
    fn left_face(&mut self, xw: u32, wy: u32) {
        let fine = self.fine;
        let face = self.push([fine.at(next(xw)), fine.at(next(wy)), fine.at(prev(wy))], false, NONE);
        self.heir[wy as usize] = face;
        self.heir[next(xw) as usize] = face + 1;
        self.heir[xw as usize] = face + 2;
        self.out.flip[face as usize + 1] = true;
    }

    fn finish(mut self) -> Reduction {
        for (&heir, &across) in self.heir.iter().zip(&self.fine.opposite) {
            if heir != NONE {
                self.out.coarse.opposite[heir as usize] = self.heir[across as usize];
            }
        }
        self.out
    }
}
