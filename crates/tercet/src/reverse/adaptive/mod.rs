//! The adaptive reverse step: which vertices of an irregular surface to divide off.
//!
//! One refinement step splits faces and flips edges beside them, so the encoder may choose a
//! set R of *odd* vertices if each vertex v of R satisfies this:
//!
//! - v is real, its ring is simple and has at most one virtual vertex, its valence d is 3 to 6;
//! - d − 3 of its spokes, no two cyclically adjacent, are flipped. That leaves v with three
//!   neighbours: the corners of the coarse face that it splits. They are not in R;
//! - a neighbour in R is joined to v by a spoke that both flip (it is one flip, shared);
//! - no flip makes an edge that the fine surface has or that another flip makes, and no two
//!   coarse faces have the same corners. So a simplicial complex stays one.
//!
//! ```text
//!         y                   y
//!       / | \               / |\ \
//!     z---v---w     ->    z---v | w
//!       \ | /               \ |/ /
//!         x                   x
//! ```
//!
//! Flipped back, the spoke from v to w becomes the edge xy of the coarse face (x, y, z). On its
//! other side lies the face (x, w, y), which stays, or the coarse face that w splits.
//!
//! Adjacent removals matter: in the √3 pattern every odd vertex has three odd neighbours, and
//! an independent set costs a sixth more bytes. A maximum set is out of reach, so vertices are
//! taken greedily by a [score] that rewards dense packing and predictable positions.

mod coarsen;
mod fan;
mod queue;
mod root;
mod score;
mod select;
#[cfg(test)]
mod tests;

pub(crate) use select::BLOCK;

use super::Reduction;
use crate::mesh::{NONE, Surface};

/// The ring positions whose spokes are flipped, as a bit set.
type Flips = u8;

/// Largest valence of a vertex that one step can insert.
const MAX_VALENCE: usize = 6;

/// All flip sets of a vertex of each valence: d − 3 positions, no two cyclically adjacent.
const FLIP_SETS: [&[Flips]; MAX_VALENCE + 1] = [
    &[],
    &[],
    &[],
    &[0],
    &[0b0001, 0b0010, 0b0100, 0b1000],
    &[0b00101, 0b01010, 0b10100, 0b01001, 0b10010],
    &[0b010101, 0b101010],
];

/// The three ring positions, ascending, that a flip set leaves unflipped.
#[inline(always)]
fn corners_of(flips: Flips) -> [usize; 3] {
    let mut unset = !flips;
    [(); 3].map(|()| {
        let i = unset.trailing_zeros() as usize;
        unset &= unset - 1;
        i
    })
}

/// The corner of smallest index of each vertex, and the number of its faces, at most 255.
fn fans(fine: &Surface) -> (Vec<u32>, Vec<u8>) {
    let mut corner = vec![NONE; fine.vertices as usize];
    let mut valence = vec![0u8; fine.vertices as usize];
    for c in (0..fine.vertex.len() as u32).rev() {
        let v = fine.at(c) as usize;
        corner[v] = c;
        valence[v] = valence[v].saturating_add(1);
    }
    (corner, valence)
}

/// Chooses a set of vertices to divide off and returns the step, or `None` if there is none.
///
/// `positions` holds lattice coordinates below 2^26 in magnitude, one point a vertex of `fine`;
/// those of virtual vertices are ignored. They guide the choice only: any positions give a
/// valid step. Deterministic, integer, linear time; about 80 bytes a vertex of scratch memory.
pub(crate) fn reduce(fine: &Surface, positions: &[[i32; 3]]) -> Option<Reduction> {
    let (corner, valence) = fans(fine);
    let odd = select::select(fine, &corner, &valence, positions);
    drop(valence);
    odd.iter().any(Option::is_some).then(|| coarsen::coarsen(fine, &corner, &odd))
}
