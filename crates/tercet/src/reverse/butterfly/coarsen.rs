//! The coarse surface of a labelled one.
//!
//! A middle face (m0, m1, m2) is the coarse face of the even vertices across its edges:
//!
//! ```text
//!           t0
//!          /  \
//!        m2----m1        corner k of the coarse face, at tk, and the corner of the middle face at mk
//!       /  \  /  \       face the same coarse edge: it runs through mk
//!     t1----m0----t2
//! ```
//!
//! Around the odd vertex m on an edge inside, three faces on from the one middle face, there is the
//! other; its corner at m stands for the opposite coarse corner. On a boundary there are, two faces on,
//! the two virtual halves of the virtual coarse face behind the edge.

use crate::mesh::{NONE, Surface, next, prev};
use crate::reverse::Reduction;
use crate::subdivide::StepKind;

/// Builds the coarse surface of a labelling that passed [`label`](crate::reverse::label::label).
///
/// `None` if it would have fewer than four vertices or a face that meets a vertex twice.
pub(super) fn coarsen(fine: &Surface, even: &[bool]) -> Option<Reduction> {
    let kept: Vec<u32> = (0..fine.vertices).filter(|&v| even[v as usize]).collect();
    if kept.len() < 4 {
        return None;
    }
    let (anchor, owner) = coarse_faces(fine, even);
    let mut rank = vec![NONE; fine.vertices as usize];
    for (i, &v) in (0..).zip(&kept) {
        rank[v as usize] = i;
    }
    let mut vertex = Vec::with_capacity(3 * anchor.len());
    for &a in &anchor {
        let ends = match fine.is_virtual(fine.at(a)) {
            true => [a, next(a), prev(fine.swing(a))],
            false => [a, next(a), prev(a)].map(|c| fine.across(c)),
        };
        let face = ends.map(|c| rank[fine.at(c) as usize]);
        if face[0] == face[1] || face[1] == face[2] || face[2] == face[0] {
            return None;
        }
        vertex.extend(face);
    }
    let opposite = opposites(fine, &anchor, &owner);
    let coarse = Surface { vertex, opposite, vertices: kept.len() as u32, virtuals: fine.virtuals };
    let (split, flip) = (Vec::new(), Vec::new());
    Some(Reduction { kind: StepKind::Butterfly, coarse, kept, split, flip, anchor })
}

/// For each coarse face its anchor: corner 0 of the middle face or, of a virtual one, the virtual
/// corner of the half that has its even vertex next to that. And for each middle face and each virtual
/// one its coarse face.
fn coarse_faces(fine: &Surface, even: &[bool]) -> (Vec<u32>, Vec<u32>) {
    let mut anchor = Vec::with_capacity(fine.faces() as usize / 4);
    let mut owner = vec![NONE; fine.faces() as usize];
    for f in 0..fine.faces() {
        let is_even = |c: u32| even[fine.at(c) as usize];
        let tip = (3 * f..3 * f + 3).find(|&c| fine.is_virtual(fine.at(c)));
        let first = match tip {
            Some(tip) => is_even(next(tip)).then_some(tip),
            None => (!(3 * f..3 * f + 3).any(is_even)).then_some(3 * f),
        };
        let Some(first) = first else { continue };
        owner[f as usize] = anchor.len() as u32;
        if tip.is_some() {
            owner[(fine.swing(first) / 3) as usize] = anchor.len() as u32;
        }
        anchor.push(first);
    }
    (anchor, owner)
}

/// Opposite corners of the coarse surface.
fn opposites(fine: &Surface, anchor: &[u32], owner: &[u32]) -> Vec<u32> {
    let mut opposite = vec![NONE; 3 * anchor.len()];
    let mut join = |a: u32, b: u32| {
        opposite[a as usize] = b;
        opposite[b as usize] = a;
    };
    for (f, &a) in (0..).zip(anchor) {
        if fine.is_virtual(fine.at(a)) {
            let following = fine.swing(fine.swing(a));
            join(3 * f + 1, 3 * owner[(following / 3) as usize] + 2);
            continue;
        }
        for (k, c) in (0..).zip([a, next(a), prev(a)]) {
            let half = fine.swing(fine.swing(c));
            let beyond = match fine.is_virtual_face(half / 3) {
                true => 3 * owner[(half / 3) as usize],
                false => {
                    let middle = fine.swing(half);
                    3 * owner[(middle / 3) as usize] + middle % 3
                }
            };
            join(3 * f + k, beyond);
        }
    }
    opposite
}
