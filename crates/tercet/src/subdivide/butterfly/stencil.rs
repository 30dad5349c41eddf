//! Where the new vertices of a butterfly step lie: each rule written once, as weights.
//!
//! A new vertex lies near the middle of an edge a–b with the *wings* u and v across its two faces,
//! each with the two *outer* vertices across the other edges of its face:
//!
//! ```text
//!     o-----u-----o
//!      \   / \   /
//!       \ /   \ /
//!        a-----b
//!       / \   / \
//!      /   \ /   \
//!     o-----v-----o
//! ```
//!
//! By its vertex, an end is *extraordinary* if it is inside with a valence of 3 to 64 but not 6.
//!
//! | edge | rule |
//! |---|---|
//! | boundary edge | along the boundary: −1, 9, 9, −1 over 16 |
//! | an end is extraordinary | the mean of the extraordinary ends' own rules |
//! | otherwise, with all outer vertices | eight points: ends 8/16, wings 2/16, outer −1/16 |
//! | with those of one wing only | ends 4/8, that wing 2/8, its outer vertices −1/8 |
//! | without | ends 1/2 |
//!
//! An outer vertex is missing where an edge of the two faces is a boundary edge. The boundary rule is
//! the four-point scheme, the eight points are the ten of Zorin, Schröder and Sweldens ("Interpolating
//! subdivision for meshes with arbitrary topology", 1996) with w = 0, the rows of extraordinary ends
//! theirs. Where outer vertices of one wing are missing, the rule is the eight points with these
//! extrapolated: on the regular lattice the second difference of a quadratic function along the edge is
//! the same at both wings, which gives o for the missing one, and everything at that wing cancels.
//! So all rules but those of extraordinary ends and the last one reproduce quadratic functions. A vertex
//! of more than 64 faces has no row: at constant cost an edge of it is treated as an ordinary one.

use super::super::stencil::{PLAIN, Stencil, inner_valences};
use super::super::weights::ONE;
use super::cut_edges;
use super::weights::ROWS;
use crate::mesh::{Surface, next, prev};
use crate::subdivide::StepKind;

/// Calls `visit` with the number, from 0, and the stencil of each vertex that the step inserts, in
/// the order of [`cut_edges`].
///
/// `coarse` is a surface that the step applies to. No stencil names a virtual vertex. Linear time.
pub(in crate::subdivide) fn for_each_stencil(coarse: &Surface, mut visit: impl FnMut(usize, &Stencil)) {
    let valences = inner_valences(coarse, StepKind::Butterfly);
    let mut stencil = Stencil::default();
    for (i, c) in cut_edges(coarse).enumerate() {
        let o = coarse.across(c);
        if coarse.is_virtual_face(c / 3) || coarse.is_virtual_face(o / 3) {
            let tip = if coarse.is_virtual_face(c / 3) { c } else { o };
            stencil.along_boundary(coarse, tip);
        } else {
            stencil.inside(coarse, [c, o], &valences);
        }
        visit(i, &stencil);
    }
}

impl Stencil {
    /// The edge that the virtual corner `tip` faces.
    fn along_boundary(&mut self, coarse: &Surface, tip: u32) {
        self.start(16);
        self.add([next(tip), prev(tip)].map(|c| coarse.at(c)), 9);
        self.add([next(tip), prev(tip)].map(|c| coarse.at(coarse.across(c))), -1);
    }

    /// The edge between two real faces that the corners `wings` face.
    fn inside(&mut self, coarse: &Surface, wings: [u32; 2], valences: &[u8]) {
        self.start(0);
        for end in wings.map(next) {
            let n = valences[coarse.at(end) as usize];
            if n != 6 && n != PLAIN {
                self.extraordinary_end(coarse, end, n.into());
            }
        }
        if self.terms.is_empty() {
            self.eight_points(coarse, wings);
        }
    }

    /// Adds the rule of the end at corner `end`, whose next vertex is the other end.
    fn extraordinary_end(&mut self, coarse: &Surface, end: u32, valence: usize) {
        let row = &ROWS[valence];
        self.denominator += i64::from(ONE);
        self.terms.push((coarse.at(end), row[0]));
        for (corner, &weight) in coarse.fan(end).zip(&row[1..]) {
            self.terms.push((coarse.at(next(corner)), weight));
        }
    }

    fn eight_points(&mut self, coarse: &Surface, wings: [u32; 2]) {
        let outer = |wing: u32| [next(wing), prev(wing)].map(|c| coarse.across(c));
        let is_whole = |wing: &u32| outer(*wing).iter().all(|c| !coarse.is_virtual_face(c / 3));
        let ends = [next(wings[0]), prev(wings[0])].map(|c| coarse.at(c));
        let whole = wings.into_iter().filter(is_whole);
        let (denominator, of_ends) = match whole.clone().count() {
            2 => (16, 8),
            1 => (8, 4),
            _ => (2, 1),
        };
        self.start(denominator);
        self.add(ends, of_ends);
        for wing in whole {
            self.terms.push((coarse.at(wing), 2));
            self.add(outer(wing).map(|c| coarse.at(c)), -1);
        }
    }
}

#[cfg(test)]
mod tests;
