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

/// Splits the faces with `split[f]` and flips the edges opposite to the corners `flips`, in linear time.
///
/// Of each edge one corner is named at most. A flipped edge has at least
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
pub(crate) fn refine(coarse: &Surface, split: &[bool], flips: &[u32]) -> Refined {
    let mut refined = split_faces(coarse, split);
    flip_edges(coarse, split, flips, &mut refined);
    refined
}

/// The first half of [`refine`]: splits the faces with `split[f]`.
pub(crate) fn split_faces(coarse: &Surface, split: &[bool]) -> Refined {
    let mut first = Vec::with_capacity(split.len());
    let mut count = 0;
    for &s in split {
        first.push(count);
        count += if s { 3 } else { 1 };
    }
    let heir = |c: u32| heir(&first, split, c);
    // Each face is written as if it were split; what is too much the next one overwrites.
    const SPARE: usize = 6;
    let corners = 3 * count as usize;
    let mut vertex = vec![0; corners + SPARE];
    let mut opposite = vec![0; corners + SPARE];
    let mut v = coarse.vertices;
    let faces = coarse.vertex.as_chunks().0.iter().zip(coarse.opposite.as_chunks::<3>().0);
    for (((&[t0, t1, t2], across), &s), &first) in faces.zip(split).zip(&first) {
        let o = 3 * first;
        let i = o as usize;
        let [h0, h1, h2] = across.map(heir);
        let [x, y, z] = if s { [t1, t2, v] } else { [t0, t1, t2] };
        vertex[i..i + 9].copy_from_slice(&[x, y, z, t2, t0, v, t0, t1, v]);
        let [x, y, z] = if s { [o + 4, o + 6, h0] } else { [h0, h1, h2] };
        opposite[i..i + 9].copy_from_slice(&[x, y, z, o + 7, o, h1, o + 1, o + 3, h2]);
        v += s as u32;
    }
    vertex.truncate(corners);
    opposite.truncate(corners);
    Refined { surface: Surface { vertex, opposite, vertices: v, virtuals: coarse.virtuals }, first }
}

/// The second half of [`refine`]: flips the edges opposite to the corners `flips`.
pub(crate) fn flip_edges(coarse: &Surface, split: &[bool], flips: &[u32], refined: &mut Refined) {
    let Refined { surface, first } = refined;
    for &c in flips {
        flip_edge(surface, heir(first, split, c), heir(first, split, coarse.across(c)));
    }
}

/// The corner that faces the edge that coarse corner `c` faces, before flips.
#[inline(always)]
fn heir(first: &[u32], split: &[bool], c: u32) -> u32 {
    let (f, k) = (c / 3, c % 3);
    3 * first[f as usize] + if split[f as usize] { 3 * k + 2 } else { k }
}

/// The corners before their opposites whose edges are flipped, of `flip` with one entry a corner, equal on both
/// sides of an edge.
#[cfg(test)]
pub(crate) fn flipped(coarse: &Surface, flip: &[bool]) -> Vec<u32> {
    (0..).zip(flip).filter(|&(c, &flip)| flip && c < coarse.across(c)).map(|(c, _)| c).collect()
}

/// Flips the edge between the opposite corners `a` (at P) and `b` (at Q): the faces (P, x, y)
/// and (Q, y, x) become (P, x, Q) and (Q, y, P), at the same face numbers.
#[inline(always)]
pub(crate) fn flip_edge(surface: &mut Surface, a: u32, b: u32) {
    let Surface { vertex, opposite, .. } = surface;
    // Both have an entry a corner: what lies within one lies within the other.
    let opposite = &mut opposite[..vertex.len()];
    let beyond_xq = opposite[next(b) as usize];
    let beyond_yp = opposite[next(a) as usize];
    vertex[prev(a) as usize] = vertex[b as usize];
    vertex[prev(b) as usize] = vertex[a as usize];
    for (c, d) in [(a, beyond_xq), (b, beyond_yp), (next(a), next(b))] {
        opposite[c as usize] = d;
        opposite[d as usize] = c;
    }
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
                let refined = refine(&coarse, &split, &flipped(&coarse, &flip));
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
        let fine = refine(&coarse, &[true; 4], &flipped(&coarse, &[true; 12])).surface;
        assert_eq!((fine.vertices, fine.faces()), (8, 12));
        assert_eq!(fine.valences(), [3, 3, 3, 3, 6, 6, 6, 6]);
    }
}
