//! The connectivity of one √3 step, for both generations of boundary.
//!
//! Two steps trisect every old edge. Inside, each of them inserts a centre per face and flips
//! the old edges; a boundary edge cannot flip, so the *even* generation leaves it alone and the
//! *odd* one cuts it in three (Kobbelt, "√3-subdivision", 2000, section 5; Labsik and Greiner,
//! 2000). The generations alternate, beginning with the even one.

use super::refine::{flip_edge, refine};
use super::{Refined, StepKind};
use crate::mesh::{NONE, Surface, next, prev};

/// Refines `coarse` by one √3 step, in linear time.
///
/// New vertices are numbered from `coarse.vertices` in the order of the coarse faces that
/// receive them. A `Sqrt3Even` step is [`refine`] with every real face split and every edge
/// between real faces flipped. In a `Sqrt3Odd` step every face becomes three,
/// `first[f] = 3 * f`; those of an inner face are as [`Refined::first`] says. A face with
/// boundary edge a→b and apex q receives p (near a), then p' (near b), and its three fine faces
/// are, before the flips, which leave the middle one alone,
///
/// ```text
///           q                 real face:           (a, p, q) (p, p', q) (p', b, q)
///         / | | \             virtual face behind: (p, a, w) (p', p, w) (b, p', w)
///       /  |   |  \
///     a----p---p'---b         then every old edge between real faces is flipped
///       \  |   |  /
///         \ | | /             so that corner 3 * first[f] + 3 is at p with p' next,
///           w                 and behind it at p' with p next
/// ```
///
/// Returns `None` if the odd step does not apply (see [`odd_applies`]) or `kind` is no √3 step.
pub(crate) fn refine_sqrt3(coarse: &Surface, kind: StepKind) -> Option<Refined> {
    match kind {
        StepKind::Sqrt3Even | StepKind::Sqrt3Odd if coarse.virtuals == 0 => Some(refine_closed(coarse)),
        StepKind::Sqrt3Even => Some(refine_even(coarse)),
        StepKind::Sqrt3Odd => Some(refine_odd(coarse, &boundary_apexes(coarse)?)),
        StepKind::Adaptive | StepKind::Butterfly => None,
    }
}

/// Whether the odd step applies: no real face has two boundary edges, and every virtual face
/// has one virtual corner and a real face across from it. True of every surface that an even
/// step has refined, if its virtual faces are fans that fill boundary loops.
pub(crate) fn odd_applies(coarse: &Surface) -> bool {
    boundary_apexes(coarse).is_some()
}

/// Whether an edge, given by a corner opposite to it, lies between two real faces.
fn is_inner_edge(surface: &Surface, c: u32) -> bool {
    !surface.is_virtual_face(c / 3) && !surface.is_virtual_face(surface.across(c) / 3)
}

/// A step of a closed surface, in which either generation does the same, written without an intermediate surface.
///
/// Every coarse corner *c*, of face *f* with its edge *x*→*y* opposite and face *g* across from it, leaves
/// the fine face (*x*, *w*, *v*), number *c*, where *v* is the new vertex of *f* and *w* that of *g*:
///
/// ```text
///            y
///          / | \
///        /   |   \        before: *v* and *w* on either side of the edge;
///      v ----+---- w      after: that edge flipped, so that *v*–*w* is one
///        \   |   /        of the face of *c*, below, and of that of opposite(c), above
///          \ | /
///            x
/// ```
///
/// Beyond *x*–*v* there lies the face of the corner across from prev(*c*), beyond *w*–*x* that of the
/// corner after the one across from *c*.
fn refine_closed(coarse: &Surface) -> Refined {
    let (mut vertex, mut opposite) = (vec![0; 3 * coarse.vertex.len()], vec![0; 3 * coarse.vertex.len()]);
    let faces = coarse.vertex.chunks_exact(3).zip(coarse.opposite.chunks_exact(3));
    let fine = vertex.chunks_exact_mut(9).zip(opposite.chunks_exact_mut(9));
    for ((v, (t, across)), (vertex, opposite)) in (coarse.vertices..).zip(faces).zip(fine) {
        for k in 0..3 {
            let (here, beyond) = (3 * k..3 * k + 3, across[k]);
            vertex[here.clone()].copy_from_slice(&[t[(k + 1) % 3], coarse.vertices + beyond / 3, v]);
            let around = [3 * beyond, 3 * across[(k + 2) % 3] + 2, 3 * next(beyond) + 1];
            opposite[here].copy_from_slice(&around);
        }
    }
    let vertices = coarse.vertices + coarse.faces();
    let surface = Surface { vertex, opposite, vertices, virtuals: 0 };
    Refined { surface, first: (0..coarse.faces()).map(|f| 3 * f).collect() }
}

fn refine_even(coarse: &Surface) -> Refined {
    let split: Vec<bool> = (0..coarse.faces()).map(|f| !coarse.is_virtual_face(f)).collect();
    let real = |c: u32| split[(c / 3) as usize];
    let corners = 0..coarse.vertex.len() as u32;
    let is_flipped = |&c: &u32| c < coarse.across(c) && real(c) && real(coarse.across(c));
    let flips: Vec<u32> = corners.filter(is_flipped).collect();
    refine(coarse, &split, &flips)
}

/// For each face on a boundary edge, real or virtual, the corner opposite to that edge; `NONE`
/// for an inner face. No answer if the odd step does not apply.
fn boundary_apexes(coarse: &Surface) -> Option<Vec<u32>> {
    let mut apex = vec![NONE; coarse.faces() as usize];
    for f in 0..coarse.faces() {
        let hidden = coarse.is_virtual_face(f);
        for c in 3 * f..3 * f + 3 {
            let at_boundary = if hidden {
                coarse.is_virtual(coarse.at(c))
            } else {
                coarse.is_virtual_face(coarse.across(c) / 3)
            };
            if at_boundary {
                if apex[f as usize] != NONE || hidden == coarse.is_virtual_face(coarse.across(c) / 3) {
                    return None;
                }
                apex[f as usize] = c;
            }
        }
    }
    Some(apex)
}

/// The fine corner that faces the edge opposite to coarse corner `c`, which is not cut.
fn heir(coarse: &Surface, apex: &[u32], c: u32) -> u32 {
    let f = c / 3;
    let top = apex[f as usize];
    if top == NONE {
        return 9 * f + 3 * (c - 3 * f) + 2;
    }
    match (coarse.is_virtual_face(f), c == next(top)) {
        (false, true) => 9 * f + 6,
        (false, false) => 9 * f + 1,
        (true, true) => 9 * f,
        (true, false) => 9 * f + 7,
    }
}

/// The vertices of the three fine faces of coarse face `f` before any flip, where `born` numbers
/// its new vertex or the first of two, and the pairs of their corners that face each other.
fn thirds(coarse: &Surface, top: u32, f: u32, born: u32) -> ([u32; 9], &'static [(u32, u32)]) {
    if top == NONE {
        let ([x, y, z], v) = (coarse.face(f), born);
        return ([y, z, v, z, x, v, x, y, v], &[(0, 4), (3, 7), (6, 1)]);
    }
    let (t, left, right) = (coarse.at(top), coarse.at(next(top)), coarse.at(prev(top)));
    let (p, q) = (born, born + 1);
    if coarse.is_virtual_face(f) {
        ([p, right, t, q, p, t, left, q, t], &[(1, 3), (4, 6)])
    } else {
        ([left, p, t, p, q, t, q, right, t], &[(0, 4), (3, 7)])
    }
}

fn refine_odd(coarse: &Surface, apex: &[u32]) -> Refined {
    let faces = coarse.faces();
    let mut vertices = coarse.vertices;
    let mut born = Vec::with_capacity(faces as usize);
    for f in 0..faces {
        born.push(vertices);
        if !coarse.is_virtual_face(f) {
            vertices += if apex[f as usize] == NONE { 1 } else { 2 };
        }
    }
    let mut vertex = Vec::with_capacity(9 * faces as usize);
    let mut opposite = vec![NONE; 9 * faces as usize];
    for f in 0..faces {
        let top = apex[f as usize];
        let owner = if coarse.is_virtual_face(f) { coarse.across(top) / 3 } else { f };
        let (corners, joints) = thirds(coarse, top, f, born[owner as usize]);
        vertex.extend(corners);
        for &(a, b) in joints {
            opposite[(9 * f + a) as usize] = 9 * f + b;
            opposite[(9 * f + b) as usize] = 9 * f + a;
        }
        for c in 3 * f..3 * f + 3 {
            let beyond = coarse.across(c);
            if c == top {
                for i in [2, 5, 8] {
                    opposite[(9 * f + i) as usize] = 9 * (beyond / 3) + i;
                }
            } else {
                opposite[heir(coarse, apex, c) as usize] = heir(coarse, apex, beyond);
            }
        }
    }
    let mut fine = Surface { vertex, opposite, vertices, virtuals: coarse.virtuals };
    for c in 0..coarse.vertex.len() as u32 {
        let beyond = coarse.across(c);
        if c < beyond && is_inner_edge(coarse, c) {
            flip_edge(&mut fine, heir(coarse, apex, c), heir(coarse, apex, beyond));
        }
    }
    Refined { surface: fine, first: (0..faces).map(|f| 3 * f).collect() }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::subdivide::shapes;

    #[test]
    fn both_steps_give_valid_surfaces_with_three_times_the_faces() {
        for (name, coarse) in shapes::all() {
            let even = refine_sqrt3(&coarse, StepKind::Sqrt3Even).unwrap().surface;
            even.validate().unwrap_or_else(|e| panic!("{name}: {e}"));
            assert_eq!(shapes::real_faces(&even), 3 * shapes::real_faces(&coarse), "{name}");
            assert!(odd_applies(&even), "{name}");
            let odd = refine_sqrt3(&even, StepKind::Sqrt3Odd).unwrap().surface;
            odd.validate().unwrap_or_else(|e| panic!("{name}: {e}"));
            assert_eq!(odd.faces(), 3 * even.faces(), "{name}");
        }
    }

    #[test]
    fn a_closed_surface_is_the_one_that_splits_and_flips_make() {
        for (name, coarse) in shapes::all().into_iter().filter(|(_, coarse)| coarse.virtuals == 0) {
            let (direct, flipped) = (refine_closed(&coarse), refine_even(&coarse));
            assert_eq!(direct.first, flipped.first, "{name}");
            assert_eq!(direct.surface, flipped.surface, "{name}");
            let apexes = boundary_apexes(&coarse).unwrap();
            assert_eq!(direct.surface, refine_odd(&coarse, &apexes).surface, "{name}");
        }
    }

    #[test]
    fn old_vertices_keep_their_valence_and_new_ones_are_ordinary() {
        for (name, coarse) in shapes::all() {
            let even = refine_sqrt3(&coarse, StepKind::Sqrt3Even).unwrap().surface;
            if coarse.virtuals == 0 {
                let n = coarse.vertices as usize;
                assert_eq!(even.valences()[..n], coarse.valences(), "{name}");
                assert!(even.valences()[n..].iter().all(|&d| d == 6), "{name}");
            }
            let odd = refine_sqrt3(&even, StepKind::Sqrt3Odd).unwrap().surface;
            let n = even.vertices as usize;
            let open = shapes::open_vertices(&odd);
            let mut over = vec![0; n];
            for c in (0..even.vertex.len() as u32).filter(|&c| even.is_virtual(even.at(c))) {
                over[even.at(even.across(c)) as usize] += 1;
            }
            for (v, &d) in odd.valences().iter().enumerate() {
                if v < odd.virtuals as usize {
                    assert_eq!(d, 3 * even.valences()[v], "{name}: loop {v}");
                } else if v < n {
                    // A boundary vertex loses a face, the apex over a boundary edge gains one.
                    let gained = over[v];
                    let lost = u32::from(open[v]);
                    assert_eq!(d + lost, even.valences()[v] + gained, "{name}: vertex {v}");
                } else {
                    // A boundary vertex counts its two virtual faces: 4 real neighbours.
                    assert_eq!(d, if open[v] { 5 } else { 6 }, "{name}: vertex {v}");
                }
            }
        }
    }

    #[test]
    fn an_even_and_an_odd_step_cut_every_boundary_edge_in_three() {
        let coarse = shapes::triangle();
        let fine = refine_sqrt3(&coarse, StepKind::Sqrt3Even).unwrap().surface;
        assert_eq!((fine.vertices, shapes::real_faces(&fine)), (5, 3));
        let fine = refine_sqrt3(&fine, StepKind::Sqrt3Odd).unwrap().surface;
        assert_eq!((fine.vertices, shapes::real_faces(&fine)), (11, 9));
        assert_eq!(fine.valences()[0], 9);
    }

    #[test]
    fn the_odd_step_refuses_a_face_with_two_boundary_edges() {
        assert!(refine_sqrt3(&shapes::triangle(), StepKind::Sqrt3Odd).is_none());
        assert!(!odd_applies(&shapes::disk(4)));
        assert!(odd_applies(&shapes::annulus(4)));
    }

    #[test]
    fn corners_that_tie_the_two_surfaces_are_where_the_contract_says() {
        let coarse = shapes::annulus(5);
        let refined = refine_sqrt3(&coarse, StepKind::Sqrt3Odd).unwrap();
        let fine = &refined.surface;
        let mut v = coarse.vertices;
        for f in (0..coarse.faces()).filter(|&f| !coarse.is_virtual_face(f)) {
            let o = 3 * refined.first[f as usize];
            let edge = (3 * f..3 * f + 3).find(|&c| coarse.is_virtual_face(coarse.across(c) / 3));
            if let Some(c) = edge {
                assert_eq!((fine.at(o + 3), fine.at(o + 4), fine.at(o + 5)), (v, v + 1, coarse.at(c)));
                let behind = fine.across(o + 5) / 3;
                assert_eq!(behind, refined.first[(coarse.across(c) / 3) as usize] + 1);
                assert_eq!(fine.face(behind)[..2], [v + 1, v]);
                v += 2;
            } else {
                assert_eq!((fine.at(o + 8), fine.at(next(o + 8))), (v, coarse.face(f)[0]));
                v += 1;
            }
        }
        assert_eq!(v, fine.vertices);
    }
}
