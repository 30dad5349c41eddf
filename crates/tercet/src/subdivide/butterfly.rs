//! The connectivity of one butterfly step: every edge receives a vertex, every face becomes four.
//!
//! (Dyn, Levin and Gregory, "A butterfly subdivision scheme for surface interpolation with tension
//! control", 1990.) A boundary edge receives its vertex like any other. The virtual faces behind it
//! are no part of the mesh: their fan is rebuilt around the longer loop, not cut in four.

pub(super) mod stencil;
mod weights;

use super::Refined;
use crate::mesh::{NONE, Surface, next, prev};

/// Whether the step applies: every virtual face has one virtual corner and a real face across from
/// it. True of every surface whose virtual faces are fans that fill boundary loops.
pub(crate) fn butterfly_applies(coarse: &Surface) -> bool {
    (0..coarse.faces()).filter(|&f| coarse.is_virtual_face(f)).all(|f| {
        let mut tips = (3 * f..3 * f + 3).filter(|&c| coarse.is_virtual(coarse.at(c)));
        let real_across = |c: u32| !coarse.is_virtual_face(coarse.across(c) / 3);
        tips.next().is_some_and(real_across) && tips.next().is_none()
    })
}

/// The edges that receive a vertex, which are those of the real faces, in the order in which their
/// new vertices are numbered: each given by the smaller of its two opposite corners, ascending.
pub(crate) fn cut_edges(coarse: &Surface) -> impl Iterator<Item = u32> + '_ {
    let real = |c: u32| !coarse.is_virtual_face(c / 3);
    let corners = 0..coarse.vertex.len() as u32;
    corners.filter(move |&c| c < coarse.across(c) && (real(c) || real(coarse.across(c))))
}

/// Refines `coarse` by one butterfly step, in linear time. `None` if it does not apply.
///
/// New vertices are numbered from `coarse.vertices` in the order of [`cut_edges`]. With mᵢ the new
/// vertex on the edge opposite to corner i, a real face (t0, t1, t2) becomes, from `first[f]` on,
/// the face at each corner in turn and the middle one,
///
/// ```text
///           t0
///          /  \
///        m2----m1          (t0, m2, m1) (m2, t1, m0) (m1, m0, t2) (m0, m1, m2)
///       /  \  /  \
///     t1----m0----t2       and a virtual face (w, a, b), from whichever corner, with m on a–b:
///          behind:         (w, a, m) (w, m, b)
///     a-----m-----b
/// ```
pub(crate) fn refine_butterfly(coarse: &Surface) -> Option<Refined> {
    butterfly_applies(coarse).then(|| Builder::new(coarse).build())
}

struct Builder<'a> {
    coarse: &'a Surface,
    /// For each coarse corner the new vertex on the edge opposite to it; `NONE` if that is not cut.
    middle: Vec<u32>,
    vertices: u32,
    first: Vec<u32>,
    vertex: Vec<u32>,
    opposite: Vec<u32>,
}

impl<'a> Builder<'a> {
    fn new(coarse: &'a Surface) -> Self {
        let mut vertices = coarse.vertices;
        let mut middle = vec![NONE; coarse.vertex.len()];
        for c in cut_edges(coarse) {
            middle[c as usize] = vertices;
            middle[coarse.across(c) as usize] = vertices;
            vertices += 1;
        }
        let mut first = Vec::with_capacity(coarse.faces() as usize);
        let mut faces = 0;
        for f in 0..coarse.faces() {
            first.push(faces);
            faces += if coarse.is_virtual_face(f) { 2 } else { 4 };
        }
        let corners = 3 * faces as usize;
        let opposite = vec![NONE; corners];
        Builder { coarse, middle, vertices, first, vertex: Vec::with_capacity(corners), opposite }
    }

    fn build(mut self) -> Refined {
        let coarse = self.coarse;
        for f in 0..coarse.faces() {
            match (3 * f..3 * f + 3).find(|&c| coarse.is_virtual(coarse.at(c))) {
                Some(tip) => self.two(tip),
                None => self.four(f),
            }
        }
        let Builder { vertices, first, vertex, opposite, .. } = self;
        Refined { surface: Surface { vertex, opposite, vertices, virtuals: coarse.virtuals }, first }
    }

    /// Whether corner `c` of the coarse surface is at a virtual vertex.
    fn is_tip(&self, c: u32) -> bool {
        self.coarse.is_virtual(self.coarse.at(c))
    }

    fn join(&mut self, a: u32, b: u32) {
        self.opposite[a as usize] = b;
        self.opposite[b as usize] = a;
    }

    /// Adds the four faces of real face `f`.
    fn four(&mut self, f: u32) {
        let [t0, t1, t2] = self.coarse.face(f);
        let [m0, m1, m2] = [0, 1, 2].map(|k| self.middle[(3 * f + k) as usize]);
        self.vertex.extend([t0, m2, m1, m2, t1, m0, m1, m0, t2, m0, m1, m2]);
        let o = self.first[f as usize];
        for k in 0..3 {
            self.join(3 * (o + k) + k, 3 * (o + 3) + k);
            let c = 3 * f + k;
            let [here, there] = [self.halves(c), self.halves(self.coarse.across(c))];
            self.join(here[0], there[1]);
            self.join(here[1], there[0]);
        }
    }

    /// Adds the two faces of the virtual face whose virtual corner is `tip`.
    fn two(&mut self, tip: u32) {
        let (a, b) = (self.coarse.at(next(tip)), self.coarse.at(prev(tip)));
        let (w, m) = (self.coarse.at(tip), self.middle[tip as usize]);
        self.vertex.extend([w, a, m, w, m, b]);
        let o = 3 * self.first[(tip / 3) as usize];
        self.join(o + 1, o + 5);
        // The other spoke is joined by the face beyond it, whose own next spoke it is.
        let beyond = 3 * self.first[(self.coarse.across(next(tip)) / 3) as usize];
        self.join(o + 4, beyond + 2);
    }

    /// The fine corners that face the two halves of the cut edge opposite to coarse corner `c`: of
    /// the half at the next corner's vertex, then of that at the previous one's.
    fn halves(&self, c: u32) -> [u32; 2] {
        let o = self.first[(c / 3) as usize];
        if self.is_tip(c) {
            return [3 * o, 3 * o + 3];
        }
        [next(c), prev(c)].map(|end| 3 * (o + end % 3) + c % 3)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::subdivide::shapes;

    fn refine(coarse: &Surface) -> Refined {
        refine_butterfly(coarse).unwrap()
    }

    #[test]
    fn a_step_gives_a_valid_surface_with_four_times_the_faces() {
        for (name, coarse) in shapes::all() {
            let edges = cut_edges(&coarse).count() as u32;
            let fine = refine(&coarse).surface;
            fine.validate().unwrap_or_else(|e| panic!("{name}: {e}"));
            assert_eq!(shapes::real_faces(&fine), 4 * shapes::real_faces(&coarse), "{name}");
            assert_eq!(fine.vertices, coarse.vertices + edges, "{name}");
            assert!(butterfly_applies(&fine), "{name}");
            refine(&fine).surface.validate().unwrap();
        }
    }

    #[test]
    fn old_vertices_keep_their_valence_and_new_ones_are_ordinary() {
        for (name, coarse) in shapes::all() {
            let fine = refine(&coarse).surface;
            let open = shapes::open_vertices(&fine);
            let before = coarse.valences();
            for (v, &d) in fine.valences().iter().enumerate() {
                let expected = match before.get(v) {
                    Some(&n) if fine.is_virtual(v as u32) => 2 * n,
                    Some(&n) => n,
                    // Three real and two virtual faces on a boundary.
                    None => 6 - u32::from(open[v]),
                };
                assert_eq!(d, expected, "{name}: vertex {v}");
            }
        }
    }

    #[test]
    fn faces_and_new_vertices_are_numbered_as_the_contract_says() {
        for (name, coarse) in shapes::all() {
            let Refined { surface: fine, first } = refine(&coarse);
            for (v, c) in (coarse.vertices..).zip(cut_edges(&coarse)) {
                for c in [c, coarse.across(c)].into_iter().filter(|&c| !coarse.is_virtual_face(c / 3)) {
                    let middle = first[(c / 3) as usize] + 3;
                    assert_eq!(fine.at(3 * middle + c % 3), v, "{name}");
                    let at_corner = first[(c / 3) as usize] + c % 3;
                    assert_eq!(fine.at(3 * at_corner + c % 3), coarse.at(c), "{name}");
                }
            }
            for tip in (0..coarse.vertex.len() as u32).filter(|&c| coarse.is_virtual(coarse.at(c))) {
                let (o, ends) = (first[(tip / 3) as usize], [next(tip), prev(tip)].map(|c| coarse.at(c)));
                let [one, two] = [o, o + 1].map(|f| fine.face(f));
                assert_eq!([one[0], one[1], two[0], two[2]], [coarse.at(tip), ends[0], one[0], ends[1]]);
                assert!(one[2] == two[1] && one[2] >= coarse.vertices);
            }
        }
    }

    #[test]
    fn virtual_faces_that_do_not_fill_loops_are_refused() {
        let tetrahedron = shapes::tetrahedron();
        for virtuals in 1..=4 {
            let hidden = Surface { virtuals, ..tetrahedron.clone() };
            // One virtual vertex leaves a triangle; with two, faces have two virtual corners.
            assert_eq!(butterfly_applies(&hidden), virtuals == 1);
            assert_eq!(refine_butterfly(&hidden).is_some(), virtuals == 1);
        }
    }
}
