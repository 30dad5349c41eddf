//! The connectivity of one refinement step: split and flip.

use crate::mesh::{Surface, next, prev};

/// A refined surface and where its faces came from.
#[derive(Debug, Default)]
pub(crate) struct Refined {
    /// The finer surface. Old vertices keep their numbers; the new vertex of the i-th split
    /// face is `coarse.vertices + i`.
    pub surface: Surface,
    /// For each coarse face, the first of the fine faces that it became.
    ///
    /// A split face `f` = (t0, t1, t2) with new vertex v became three, and corner
    /// `3 * first[f] + 8` is at v with t0 next. An unsplit face became one, and if none of its
    /// edges flipped its corners `3 * first[f] ..` are those of `f`.
    pub first: Vec<u32>,
}

/// The fine corner that faces the same edge as coarse corner `c`.
#[inline(always)]
fn heir(c: u32, split: &[bool], first: &[u32]) -> u32 {
    let f = c / 3;
    let k = c - 3 * f;
    if split[f as usize] { 3 * (first[f as usize] + k) + 2 } else { 3 * first[f as usize] + k }
}

/// Splits the faces with `split[f]` and flips the edges with `flip[c]`, in linear time.
///
/// `flip` has one entry a corner, equal on both sides of an edge; a flipped edge has at least
/// one split side and an unsplit face has at most one flipped edge, so that the flips act on
/// disjoint pairs of fine faces and their order is indifferent.
///
/// ```text
///        y                 y
///       /|\               / \
///      / | \             /   \
///     P  |  Q    ->     P-----Q
///      \ | /             \   /
///       \|/               \ /
///        x                 x
/// ```
pub(crate) fn refine(coarse: &Surface, split: &[bool], flip: &[bool]) -> Refined {
    let faces = coarse.faces();
    let mut first = Vec::with_capacity(faces as usize);
    let mut count = 0u32;
    for &s in split {
        first.push(count);
        count += if s { 3 } else { 1 };
    }
    let corners = 3 * count as usize;
    let mut vertex = vec![0; corners];
    let mut opposite = vec![0; corners];
    let mut vertices = coarse.vertices;
    for f in 0..faces {
        let t = coarse.face(f);
        let o = 3 * first[f as usize];
        let i = o as usize;
        let heirs = [0, 1, 2].map(|k| heir(coarse.across(3 * f + k), split, &first));
        if split[f as usize] {
            let v = vertices;
            vertices += 1;
            vertex[i..i + 9].copy_from_slice(&[t[1], t[2], v, t[2], t[0], v, t[0], t[1], v]);
            for (a, b) in [(0, 4), (3, 7), (6, 1)] {
                opposite[i + a] = o + b as u32;
                opposite[i + b] = o + a as u32;
            }
            for k in 0..3 {
                opposite[i + 3 * k + 2] = heirs[k];
            }
        } else {
            vertex[i..i + 3].copy_from_slice(&t);
            opposite[i..i + 3].copy_from_slice(&heirs);
        }
    }
    let mut fine = Surface { vertex, opposite, vertices, virtuals: coarse.virtuals };
    for c in 0..coarse.vertex.len() as u32 {
        if flip[c as usize] && c < coarse.across(c) {
            flip_edge(&mut fine, heir(c, split, &first), heir(coarse.across(c), split, &first));
        }
    }
    Refined { surface: fine, first }
}

/// Flips the edge between the opposite corners `a` (at P) and `b` (at Q): the faces (P, x, y)
/// and (Q, y, x) become (P, x, Q) and (Q, y, P), at the same face numbers.
pub(crate) fn flip_edge(surface: &mut Surface, a: u32, b: u32) {
    let beyond_xq = surface.across(next(b));
    let beyond_yp = surface.across(next(a));
    surface.vertex[prev(a) as usize] = surface.at(b);
    surface.vertex[prev(b) as usize] = surface.at(a);
    join(surface, a, beyond_xq);
    join(surface, b, beyond_yp);
    join(surface, next(a), next(b));
}

fn join(surface: &mut Surface, a: u32, b: u32) {
    surface.opposite[a as usize] = b;
    surface.opposite[b as usize] = a;
}

#[cfg(test)]
mod tests {
    use super::*;

    fn tetrahedron() -> Surface {
        // (0,1,2) (0,3,1) (1,3,2) (0,2,3)
        let vertex = vec![0, 1, 2, 0, 3, 1, 1, 3, 2, 0, 2, 3];
        let mut s = Surface { opposite: vec![0; 12], vertex, vertices: 4, virtuals: 0 };
        for c in 0..12u32 {
            let edge = (s.at(next(c)), s.at(prev(c)));
            s.opposite[c as usize] = (0..12u32).find(|&d| (s.at(prev(d)), s.at(next(d))) == edge).unwrap();
        }
        s
    }

    #[test]
    fn every_choice_of_splits_and_flips_on_a_tetrahedron_is_a_closed_surface() {
        let coarse = tetrahedron();
        coarse.validate().unwrap();
        for splits in 0..16u32 {
            let split: Vec<bool> = (0..4).map(|f| splits >> f & 1 == 1).collect();
            for flips in 0..64u32 {
                let mut flip = vec![false; 12];
                let mut taken = [false; 4];
                let edges = (0..12u32).filter(|&c| c < coarse.across(c));
                for (i, c) in edges.enumerate() {
                    let (f, g) = ((c / 3) as usize, (coarse.across(c) / 3) as usize);
                    let free = |f: usize| split[f] || !taken[f];
                    if flips >> i & 1 == 1 && (split[f] || split[g]) && free(f) && free(g) {
                        flip[c as usize] = true;
                        flip[coarse.across(c) as usize] = true;
                        (taken[f], taken[g]) = (true, true);
                    }
                }
                let refined = refine(&coarse, &split, &flip);
                refined.surface.validate().unwrap();
                let splits = (0..4).filter(|&f| split[f as usize]);
                for (f, v) in splits.zip(coarse.vertices..) {
                    let c = 3 * refined.first[f as usize] + 8;
                    assert_eq!(refined.surface.at(c), v);
                    assert_eq!(refined.surface.at(next(c)), coarse.face(f)[0]);
                }
            }
        }
    }

    #[test]
    fn yes_to_every_question_is_the_sqrt3_step() {
        let coarse = tetrahedron();
        let fine = refine(&coarse, &[true; 4], &[true; 12]).surface;
        assert_eq!((fine.vertices, fine.faces()), (8, 12));
        assert_eq!(fine.valences(), [3, 3, 3, 3, 6, 6, 6, 6]);
    }
}
