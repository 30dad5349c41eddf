//! The greatest distance of one surface from another, from below and from above.
//!
//! The distance from a triangle of the other surface is convex, so that over a piece of this surface
//! it is greatest at one of the piece's corners; and the distance from the whole other surface is no
//! greater. So each piece has an upper bound, and the pieces with the greatest are cut in four until
//! the bounds close or the queries run out (after Guthe, Borodin and Klein, "Fast and accurate
//! Hausdorff distance calculation between meshes", 2005).

use std::cmp::Ordering;
use std::collections::BinaryHeap;

use super::TriangleTree;
use super::distance::Vector;
use crate::Mesh;

/// Bounds that are nearer to each other than by this part are closed.
const TOLERANCE: f64 = 1.0 / 1024.0;

/// The greatest distance lies between these.
pub(super) struct Greatest {
    pub found: f64,
    pub at_most: f64,
}

/// Bounds the greatest distance of `from`'s surface, whose tree is `order`, from `to`.
///
/// `of_vertex` holds the triangle of `to` that is nearest to each vertex of `from`; `found` is the
/// distance of some point of `from`, and not less than any vertex's. A query for each face and
/// `queries` more are made; distances below `grain` count as 0.
pub(super) fn bound_greatest(
    from: &Mesh,
    order: &TriangleTree,
    to: &TriangleTree,
    of_vertex: &[u32],
    found: f64,
    queries: usize,
    grain: f64,
) -> Greatest {
    let mut bounds = Bounds { to, found, grain, pieces: BinaryHeap::new() };
    let mut guess = 0;
    for &f in order.faces() {
        let face = from.faces[f as usize];
        let corners = face.map(|v| from.positions[v as usize].map(f64::from));
        guess = bounds.add(corners, &face.map(|v| of_vertex[v as usize]), guess);
    }
    for _ in 0..queries / 3 {
        let Some(piece) = bounds.pieces.pop() else { break };
        if piece.bound <= bounds.found * (1.0 + TOLERANCE) {
            return Greatest { found: bounds.found, at_most: piece.bound };
        }
        bounds.cut(piece);
    }
    let at_most = bounds.pieces.peek().map_or(0.0, |piece| piece.bound);
    Greatest { found: bounds.found, at_most: at_most.max(bounds.found) }
}

/// The pieces that may yet hold a point farther away than any found.
struct Bounds<'a> {
    to: &'a TriangleTree,
    found: f64,
    grain: f64,
    pieces: BinaryHeap<Piece>,
}

/// A part of a triangle.
struct Piece {
    /// No point of it is farther away.
    bound: f64,
    corners: [Vector; 3],
    /// The triangle of the other surface that is nearest to its centre.
    nearest: u32,
}

impl Bounds<'_> {
    /// Adds a piece, if it may hold the greatest distance; returns the triangle nearest to its centre.
    /// `known` are triangles that may be near to all of it, `guess` is one near to its centre.
    fn add(&mut self, corners: [Vector; 3], known: &[u32], guess: u32) -> u32 {
        let Some((nearest, at_centre)) = self.to.search(centre(corners), Some(guess)) else { return guess };
        self.found = self.found.max(self.above_grain(at_centre.square));
        self.keep(corners, nearest, known);
        nearest
    }

    fn keep(&mut self, corners: [Vector; 3], nearest: u32, known: &[u32]) {
        let bounds = known.iter().chain([&nearest]).map(|&t| self.farthest(corners, t));
        let bound = bounds.fold(f64::INFINITY, f64::min);
        if bound > self.found {
            self.pieces.push(Piece { bound, corners, nearest });
        }
    }

    /// Cuts a piece in four; the one in the middle has its centre. Three queries.
    fn cut(&mut self, piece: Piece) {
        let [a, b, c] = piece.corners;
        let [ab, bc, ca] = [middle(a, b), middle(b, c), middle(c, a)];
        self.keep([ab, bc, ca], piece.nearest, &[]);
        for corners in [[a, ab, ca], [ab, b, bc], [ca, bc, c]] {
            self.add(corners, &[piece.nearest], piece.nearest);
        }
    }

    /// The greatest distance of a piece's points from triangle `t`.
    fn farthest(&self, corners: [Vector; 3], t: u32) -> f64 {
        let squares = corners.map(|p| self.to.nearest_on(p, t).square);
        self.above_grain(squares.into_iter().fold(0.0, f64::max))
    }

    fn above_grain(&self, square: f64) -> f64 {
        if square > self.grain * self.grain { square.sqrt() } else { 0.0 }
    }
}

fn centre([a, b, c]: [Vector; 3]) -> Vector {
    std::array::from_fn(|k| (a[k] + b[k] + c[k]) / 3.0)
}

fn middle(a: Vector, b: Vector) -> Vector {
    std::array::from_fn(|k| 0.5 * (a[k] + b[k]))
}

impl PartialEq for Piece {
    fn eq(&self, other: &Self) -> bool {
        self.cmp(other) == Ordering::Equal
    }
}

impl Eq for Piece {}

impl PartialOrd for Piece {
    fn partial_cmp(&self, other: &Self) -> Option<Ordering> {
        Some(self.cmp(other))
    }
}

impl Ord for Piece {
    fn cmp(&self, other: &Self) -> Ordering {
        self.bound.total_cmp(&other.bound)
    }
}
