//! Where new vertices stand among the old ones: what the fast profile, and regular levels of the default one, look at in place of
//! rings.
//!
//! A new vertex lies in a coarse face. Its *corners* are those of the face; its *wings* are what lies
//! beyond the three edges, the new vertex of the face there or, if that is not split, its far corner.
//!
//! ```text
//!      w1 ------- c0 ------- w2
//!        \       /  \       /
//!         \     / v  \     /
//!          \   /      \   /
//!           c1 ------- c2           (wings of unsplit faces; wₖ faces cₖ)
//!             \       /
//!              \     /
//!               \   /
//!                w0
//! ```
//!
//! So there are six places to look at whatever the surface is like, all of them known before the first
//! position of a level is.

use super::vector::{Point, Vector};
use crate::mesh::{NONE, Surface, next};
use crate::subdivide::StepKind;

/// Where a vertex stands. A corner or wing that is not there is the vertex itself.
#[derive(Clone, Copy)]
pub(crate) struct Site {
    pub corners: [u32; 3],
    pub wings: [u32; 3],
}

/// Whether a step inserts one vertex in each of the faces that become three.
pub(crate) fn lie_in_faces(kind: StepKind, coarse: &Surface) -> bool {
    match kind {
        StepKind::Adaptive | StepKind::Sqrt3Even => true,
        StepKind::Sqrt3Odd => coarse.virtuals == 0,
        StepKind::Butterfly => false,
    }
}

/// The sites of the new vertices of the surface `fine` that was refined from `coarse`, one in each split
/// face in their order; `first` tells, for each coarse face, the first of the fine faces that it became.
/// Time O(n).
pub(crate) fn in_faces(coarse: &Surface, first: &[u32], fine: &Surface) -> Vec<Site> {
    let faces = coarse.vertex.as_chunks::<3>().0.iter().zip(coarse.opposite.as_chunks::<3>().0);
    if fine.vertices - coarse.vertices == coarse.faces() {
        let born = |beyond: u32| coarse.vertices + beyond / 3;
        return faces.map(|(&corners, opposites)| Site { corners, wings: opposites.map(born) }).collect();
    }
    // The new vertex of each face that has become three.
    let mut vertex = coarse.vertices;
    let heirs = first.windows(2).map(|pair| pair[1] - pair[0]);
    let heirs = heirs.chain(first.last().map(|last| fine.faces() - last));
    let note = |heirs: u32| {
        let is_split = heirs == 3;
        let born = if is_split { vertex } else { NONE };
        vertex += is_split as u32;
        born
    };
    let born: Vec<u32> = heirs.map(note).collect();
    let mut sites = Vec::with_capacity((fine.vertices - coarse.vertices) as usize);
    for ((&corners, opposites), _) in faces.zip(&born).filter(|&(_, &born)| born != NONE) {
        let wings = opposites.map(|beyond| {
            let apex = coarse.at(beyond);
            let born = born[(beyond / 3) as usize];
            if born == NONE { apex } else { born }
        });
        sites.push(Site { corners, wings });
    }
    sites
}

/// Corners of a fan that are looked at.
const MOST: usize = 12;

/// The sites of the vertices from `first` on by the rings of `surface`: where vertices do not lie in faces.
/// Corners are the first three neighbours that come before a vertex, `old` ones if there are any, wings
/// the first others. Time O(n).
pub(crate) fn in_rings(surface: &Surface, first: u32) -> Vec<Site> {
    let corner = surface.any_corner_from(first);
    let has_old = first > surface.virtuals;
    let site = |(v, &corner): (u32, &u32)| {
        let (mut corners, mut wings) = ([v; 3], [v; 3]);
        let mut corner_count = 0;
        for c in surface.fan(corner).take(MOST) {
            let a = surface.at(next(c));
            if a < if has_old { first } else { v } {
                if let Some(corner) = corners.get_mut(corner_count) {
                    *corner = a;
                }
                corner_count += 1;
            } else {
                // What is between two corners faces the third; if there are several, others take what is free.
                let facing = (corner_count + 1) % 3;
                let free = [facing, 0, 1, 2].into_iter().find(|&k| wings[k] == v);
                if let Some(k) = free {
                    wings[k] = a;
                }
            }
        }
        Site { corners, wings }
    };
    (first..).zip(&corner).map(site).collect()
}

impl Site {
    /// The normal of the surface, below 2¹⁵, by `positions` that are known or estimates; 0 if a corner is virtual.
    #[inline(always)]
    pub fn normal(&self, virtuals: u32, position: impl Fn(u32) -> Point) -> Vector {
        if self.corners.iter().any(|&v| v < virtuals) {
            return [0; 3];
        }
        let [p, q, r] = self.corners.map(&position);
        direction([p, q, r], self.wings.map(|w| if w < virtuals { p } else { position(w) }))
    }
}

/// The direction of the area of the hexagon *p*, *c*, *q*, *a*, *r*, *b*, below 2¹⁵: seen from *p* that is
/// *q* × (*a* − *c*) + *r* × (*b* − *a*).
#[inline(always)]
fn direction([p, q, r]: [Point; 3], [a, b, c]: [Point; 3]) -> Vector {
    let sub = |x: Point, y: Point| -> Vector { [0, 1, 2].map(|k| x[k].wrapping_sub(y[k]) as i64) };
    let (q, r, beside_q, beside_r) = (sub(q, p), sub(r, p), sub(a, c), sub(b, a));
    let area: Vector = [0, 1, 2].map(|k| {
        let (x, y) = ((k + 1) % 3, (k + 2) % 3);
        let cross = |a: Vector, b: Vector| (a[x] * b[y]).wrapping_sub(a[y] * b[x]);
        cross(q, beside_q).wrapping_add(cross(r, beside_r))
    });
    let all = area.iter().fold(0, |all, x| all | x.unsigned_abs());
    let spare = 50u32.saturating_sub(all.leading_zeros());
    area.map(|x| x >> spare)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::cut;
    use crate::shapes::{grid, torus};
    use crate::subdivide::{flipped, refine};

    /// A site's corners and wings, beginning with the smallest corner.
    fn turned(site: &Site) -> [[u32; 3]; 2] {
        let least = (0..3).min_by_key(|&k| site.corners[k]).unwrap_or(0);
        [site.corners, site.wings].map(|list| [0, 1, 2].map(|k| list[(k + least) % 3]))
    }

    #[test]
    fn where_every_face_is_split_and_every_edge_turned_rings_hold_what_faces_do() {
        let coarse = cut(&torus(7, 6)).surface;
        let flips = flipped(&coarse, &vec![true; coarse.vertex.len()]);
        let refined = refine(&coarse, &vec![true; coarse.faces() as usize], &flips);
        let in_faces = in_faces(&coarse, &refined.first, &refined.surface);
        let in_rings = in_rings(&refined.surface, coarse.vertices);
        assert_eq!(in_faces.len(), coarse.faces() as usize);
        for (a, b) in in_faces.iter().zip(&in_rings) {
            assert_eq!(turned(a), turned(b));
        }
    }

    #[test]
    fn beyond_an_edge_there_is_a_new_vertex_or_the_corner_of_an_unsplit_face() {
        let coarse = cut(&grid(6, 5)).surface;
        let split: Vec<bool> = (0..coarse.faces()).map(|f| f % 3 != 1).collect();
        let refined = refine(&coarse, &split, &[]);
        let sites = in_faces(&coarse, &refined.first, &refined.surface);
        let faces = (0..coarse.faces()).filter(|&f| split[f as usize]);
        for ((f, site), v) in faces.zip(&sites).zip(coarse.vertices..) {
            assert_eq!(site.corners, coarse.face(f));
            assert!(refined.surface.face(refined.first[f as usize]).contains(&v));
            for k in 0..3 {
                let beyond = coarse.across(3 * f + k);
                let wing = site.wings[k as usize];
                match split[(beyond / 3) as usize] {
                    true => {
                        assert!(refined.surface.face(refined.first[(beyond / 3) as usize]).contains(&wing))
                    }
                    false => assert_eq!(wing, coarse.at(beyond)),
                }
            }
        }
    }

    #[test]
    fn a_flat_hexagon_has_its_normal_whatever_its_size() {
        for scale in [1, 1000, 1 << 26] {
            let hexagon = [[2, 0, 0], [0, 3, 0], [-2, -3, 0]].map(|p: Point| p.map(|x| x * scale));
            let wings = [[-3, 1, 0], [1, -4, 0], [2, 3, 0]].map(|p: Point| p.map(|x| x * scale));
            let [x, y, z] = direction(hexagon, wings);
            assert_eq!((x, y), (0, 0));
            assert!(z > 0);
        }
    }
}
