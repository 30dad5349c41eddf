//! Where the new vertices of a step lie: each rule written once, as weights.
//!
//! Subdivision in floats, the transpose in the update step and prediction in integers all walk
//! the same [`Stencil`]s, or, in √3 steps, sums that come to the same ([`rings`](super::rings)). Those of √3 steps follow; those of butterfly steps are in
//! [`butterfly::stencil`]. Every rule's weights sum to one exactly, and every rule but the
//! extraordinary ones reproduces linear functions on the regular lattice.
//!
//! A corner of a face is, by its vertex,
//! - *ordinary*: inside, valence 6;
//! - *extraordinary*: inside, valence 3 to 64 but not 6;
//! - *plain*: on a boundary (its ring is open), or of a valence outside 3 to 64; in an odd step
//!   also the apex over a boundary edge, whose ring lacks the vertex beyond that edge.
//!
//! | face | rule |
//! |---|---|
//! | all corners ordinary | regular: corners 32/81, wings −1/81, the six further −2/81 |
//! | some corner extraordinary | the mean of the extraordinary corners' own rules |
//! | otherwise | plain: corners 4/9, wings −1/9 |
//! | even generation, one boundary edge | its ends 4/12, the apex 6/12, the two wings −1/12 |
//! | even generation, two boundary edges | 9/24 the inner edge's ends, 7/24 the tip, −1/24 the wing |
//! | even generation, three boundary edges | corners 1/3 |
//! | odd generation, one boundary edge | on the edge: −5, 60, 30, −4 over 81, and its mirror |
//!
//! A *wing* is the vertex across one of the face's edges. In an odd step, if the face across that
//! edge is on the boundary, its far corner is not where the lattice has a vertex, because the even
//! step before could not flip its boundary edge: with boundary edge a→b and apex q, the wing is
//! then the mirror image a + b − q.
//!
//! All rules but the plain one are Labsik and Greiner's ("Interpolatory √3-subdivision", 2000). The
//! plain one is the only combination of corners and wings that reproduces quadratic functions on
//! the regular lattice. It needs no vertex that a face without boundary edges could lack, and its
//! cost is constant, so that a corner of huge valence does not make a step quadratic.

use super::weights::{MAX_VALENCE, ONE, ROWS};
use super::{StepKind, butterfly};
use crate::mesh::{Surface, next, prev};

/// An affine combination of coarse vertices that gives one new vertex.
#[derive(Debug, Default)]
pub(crate) struct Stencil {
    /// Vertices and the numerators of their weights. A vertex may occur more than once.
    pub terms: Vec<(u32, i32)>,
    /// What the numerators sum to: 2, 3, 8, 9, 12, 16, 24, 81 or 1 to 3 times 2^24.
    pub denominator: i64,
}

/// All denominators divide this.
pub(super) const COMMON_DENOMINATOR: i64 = 81 << 25;

impl Stencil {
    pub(super) fn start(&mut self, denominator: i64) {
        self.terms.clear();
        self.denominator = denominator;
    }

    pub(super) fn add(&mut self, vertices: impl IntoIterator<Item = u32>, weight: i32) {
        self.terms.extend(vertices.into_iter().map(|v| (v, weight)));
    }

    /// The combination of integer positions at scale 2^`bits`, rounded once to nearest, halves
    /// upwards. `bits` is at most 24; exact for any 32-bit coordinates.
    pub fn fixed(&self, positions: &[[i32; 3]], bits: u32) -> [i64; 3] {
        let mut sum = [0i64; 3];
        for &(v, weight) in &self.terms {
            let p = positions[v as usize];
            for k in 0..3 {
                sum[k] += i64::from(weight) * i64::from(p[k]);
            }
        }
        sum.map(|s| {
            let d = self.denominator;
            let (whole, part) = (s.div_euclid(d), s.rem_euclid(d));
            (whole << bits) + ((part << (bits + 1)) + d) / (2 * d)
        })
    }

    /// The combination of real positions.
    pub fn real(&self, positions: &[[f64; 3]]) -> [f64; 3] {
        let mut sum = [0.0; 3];
        for &(v, weight) in &self.terms {
            let p = positions[v as usize];
            for k in 0..3 {
                sum[k] += f64::from(weight) * p[k];
            }
        }
        sum.map(|s| s / self.denominator as f64)
    }

    /// All corners have valence 6 inside the surface; `c` is one of them.
    fn regular(&mut self, coarse: &Surface, c: u32) {
        self.start(81);
        for c in [c, next(c), prev(c)] {
            let third = coarse.swing(coarse.swing(c));
            self.terms.push((coarse.at(c), 32));
            self.terms.push((coarse.at(coarse.across(c)), -1));
            self.terms.push((coarse.at(prev(third)), -2));
            self.terms.push((coarse.at(prev(coarse.swing(third))), -2));
        }
    }

    /// Adds the rule of the vertex at corner `c`, of valence 3 to 64, for the face of `c`.
    fn extraordinary(&mut self, coarse: &Surface, c: u32, valence: usize) {
        let row = &ROWS[valence];
        self.denominator += i64::from(ONE);
        self.terms.push((coarse.at(c), row[0]));
        for (corner, &weight) in coarse.fan(c).zip(&row[1..]) {
            self.terms.push((coarse.at(next(corner)), weight));
        }
    }

    fn plain(&mut self, coarse: &Surface, kind: StepKind, corners: [u32; 3]) {
        self.start(9);
        for c in corners {
            self.terms.push((coarse.at(c), 4));
            let wing = coarse.across(c);
            match [next(wing), prev(wing)].into_iter().find(|&d| is_boundary_edge(coarse, d)) {
                Some(apex) if kind == StepKind::Sqrt3Odd => {
                    self.add([next(apex), prev(apex)].map(|d| coarse.at(d)), -1);
                    self.terms.push((coarse.at(apex), 1));
                }
                _ => self.terms.push((coarse.at(wing), -1)),
            }
        }
    }

    /// A face without boundary edges.
    fn inner(&mut self, coarse: &Surface, kind: StepKind, corners: [u32; 3], valences: [u8; 3]) {
        if valences == [6; 3] {
            return self.regular(coarse, corners[0]);
        }
        self.start(0);
        for (c, n) in corners.into_iter().zip(valences) {
            if n != 6 && n != PLAIN {
                self.extraordinary(coarse, c, n.into());
            }
        }
        if self.terms.is_empty() {
            self.plain(coarse, kind, corners);
        }
    }

    /// A face whose edges opposite to the corners in `outer`, one to three, are boundary edges.
    fn on_even_boundary(&mut self, coarse: &Surface, corners: [u32; 3], outer: &[u32]) {
        let at = |c: u32| coarse.at(c);
        let wing = |c: u32| coarse.at(coarse.across(c));
        match *outer {
            [apex] => {
                let ends = [next(apex), prev(apex)];
                self.start(12);
                self.add([at(apex)], 6);
                self.add(ends.map(at), 4);
                self.add(ends.map(wing), -1);
            }
            [a, b] => {
                let tip = corners[0] + corners[1] + corners[2] - a - b;
                self.start(24);
                self.add([at(tip)], 7);
                self.add([a, b].map(at), 9);
                self.add([wing(tip)], -1);
            }
            _ => {
                self.start(3);
                self.add(corners.map(at), 1);
            }
        }
    }

    /// The new vertex at a third of boundary edge a→b beyond corner `apex`: near a, or near b if
    /// `mirrored`.
    fn on_odd_boundary(&mut self, coarse: &Surface, apex: u32, mirrored: bool) {
        let hub = coarse.across(apex);
        let before = coarse.at(coarse.across(next(hub)));
        let after = coarse.at(coarse.across(prev(hub)));
        let (a, b) = (coarse.at(next(apex)), coarse.at(prev(apex)));
        let line = if mirrored { [after, b, a, before] } else { [before, a, b, after] };
        self.start(81);
        self.terms.extend(line.into_iter().zip([-5, 60, 30, -4]));
    }
}

/// Mark of a plain corner.
pub(super) const PLAIN: u8 = 0;

/// Whether the edge opposite to corner `c` of a real face is a boundary edge.
fn is_boundary_edge(coarse: &Surface, c: u32) -> bool {
    coarse.is_virtual_face(coarse.across(c) / 3)
}

/// A valence if it is ordinary or extraordinary, else [`PLAIN`].
pub(super) fn inner_valence(valence: u32) -> u8 {
    if (3..=MAX_VALENCE as u32).contains(&valence) { valence as u8 } else { PLAIN }
}

/// For each vertex its valence if it is ordinary or extraordinary, else [`PLAIN`].
pub(super) fn inner_valences(coarse: &Surface, kind: StepKind) -> Vec<u8> {
    let mut valences: Vec<u8> = coarse.valences().into_iter().map(inner_valence).collect();
    mark_boundary(coarse, kind, |v| valences[v as usize] = PLAIN);
    valences
}

/// Calls `mark` with the vertices that are plain because of a boundary.
pub(super) fn mark_boundary(coarse: &Surface, kind: StepKind, mut mark: impl FnMut(u32)) {
    if coarse.virtuals == 0 {
        return;
    }
    for f in (0..coarse.faces()).filter(|&f| coarse.is_virtual_face(f)) {
        coarse.face(f).into_iter().for_each(&mut mark);
        if kind == StepKind::Sqrt3Odd {
            let apexes = (3 * f..3 * f + 3).filter(|&c| coarse.is_virtual(coarse.at(c)));
            apexes.for_each(|c| mark(coarse.at(coarse.across(c))));
        }
    }
}

/// Calls `visit` with the number, from 0, and the stencil of each vertex that the step `kind`, which
/// is not adaptive, inserts, in the order in which [`refine_regular`](super::refine_regular) numbers
/// them.
///
/// `coarse` is a surface that the step applies to. No stencil names a virtual vertex. Linear
/// time.
pub(crate) fn for_each_stencil(coarse: &Surface, kind: StepKind, mut visit: impl FnMut(usize, &Stencil)) {
    if kind == StepKind::Butterfly {
        return butterfly::stencil::for_each_stencil(coarse, visit);
    }
    let valences = inner_valences(coarse, kind);
    let mut stencil = Stencil::default();
    let mut index = 0;
    for f in (0..coarse.faces()).filter(|&f| !coarse.is_virtual_face(f)) {
        let valences = coarse.face(f).map(|v| valences[v as usize]);
        of_face(&mut stencil, coarse, kind, f, valences, |stencil| {
            visit(index, stencil);
            index += 1;
        });
    }
}

/// Gives the stencils of the new vertices of real face `f`, whose corners have these inner valences.
pub(super) fn of_face(
    stencil: &mut Stencil,
    coarse: &Surface,
    kind: StepKind,
    f: u32,
    valences: [u8; 3],
    mut give: impl FnMut(&Stencil),
) {
    let corners = [3 * f, 3 * f + 1, 3 * f + 2];
    let mut outer = [0; 3];
    let mut count = 0;
    if valences.contains(&PLAIN) {
        for c in corners.into_iter().filter(|&c| is_boundary_edge(coarse, c)) {
            outer[count] = c;
            count += 1;
        }
    }
    match (count, kind) {
        (0, _) => {
            stencil.inner(coarse, kind, corners, valences);
            give(stencil);
        }
        (_, StepKind::Sqrt3Odd) => {
            for mirrored in [false, true] {
                stencil.on_odd_boundary(coarse, outer[0], mirrored);
                give(stencil);
            }
        }
        _ => {
            stencil.on_even_boundary(coarse, corners, &outer[..count]);
            give(stencil);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::subdivide::shapes::{self, Random, generation, refined};
    use std::collections::BTreeMap;

    type Weights = BTreeMap<u32, i64>;

    /// The merged numerators of new vertex `index`, whose stencil has this denominator.
    fn weights(coarse: &Surface, kind: StepKind, index: usize, denominator: i64) -> Weights {
        let mut merged = Weights::new();
        for_each_stencil(coarse, kind, |i, stencil| {
            if i == index {
                assert_eq!(stencil.denominator, denominator);
                for &(v, w) in &stencil.terms {
                    *merged.entry(v).or_default() += i64::from(w);
                }
            }
        });
        merged.retain(|_, w| *w != 0);
        merged
    }

    #[test]
    fn a_regular_face_has_the_twelve_point_stencil() {
        let (n, m) = (6, 6);
        let torus = shapes::torus(n, m);
        let at = |i: i32, j: i32| (i.rem_euclid(6) * 6 + j.rem_euclid(6)) as u32;
        // Face 0 is (0,0) (1,0) (1,1); lattice directions (1,0), (0,1), (1,1).
        let expected: Weights = [
            (at(0, 0), 32),
            (at(1, 0), 32),
            (at(1, 1), 32),
            (at(0, 1), -1),
            (at(0, -1), -1),
            (at(2, 1), -1),
            (at(-1, -1), -2),
            (at(-1, 0), -2),
            (at(1, -1), -2),
            (at(2, 0), -2),
            (at(2, 2), -2),
            (at(1, 2), -2),
        ]
        .into();
        assert_eq!(weights(&torus, StepKind::Sqrt3Even, 0, 81), expected);
    }

    #[test]
    fn a_face_with_one_extraordinary_corner_uses_that_corners_row() {
        for base in [
            shapes::tetrahedron(),
            shapes::bipyramid(4),
            shapes::icosahedron(),
            shapes::bipyramid(7),
            shapes::bipyramid(8),
        ] {
            let coarse = refined(&base, 2);
            let valences = coarse.valences();
            let v = base.vertices - 1;
            let c = coarse.any_corner()[v as usize];
            let n = valences[v as usize] as usize;
            let mut expected = Weights::from([(v, i64::from(ROWS[n][0]))]);
            let ring: Vec<u32> = coarse.fan(c).map(|d| coarse.at(next(d))).collect();
            for j in 0..n {
                expected.insert(ring[j], ROWS[n][j + 1].into());
            }
            expected.retain(|_, w| *w != 0);
            assert_eq!(
                weights(&coarse, StepKind::Sqrt3Even, (c / 3) as usize, ONE.into()),
                expected,
                "valence {n}"
            );
        }
    }

    #[test]
    fn several_extraordinary_corners_are_averaged() {
        // On a tetrahedron each corner of (0, 1, 2) gives 8/9 to itself, 4/27 to the two others
        // and -5/27 to vertex 3.
        let merged = weights(&shapes::tetrahedron(), StepKind::Sqrt3Even, 0, 3 * i64::from(ONE));
        let expected = [24 + 4 + 4, 32, 32, -15].map(|w| w as f64 / 27.0 * f64::from(ONE));
        for (v, e) in expected.into_iter().enumerate() {
            assert!((merged[&(v as u32)] as f64 - e).abs() < 4.0);
        }
    }

    #[test]
    fn even_boundary_faces_have_the_three_rules() {
        let one = shapes::triangle();
        assert_eq!(weights(&one, StepKind::Sqrt3Even, 0, 3), [(1, 1), (2, 1), (3, 1)].into());
        // Two triangles on edge 1-3: tips 2 and 4.
        let two = shapes::close(&[[0, 1, 2], [0, 2, 3]]);
        assert_eq!(weights(&two, StepKind::Sqrt3Even, 0, 24), [(1, 9), (2, 7), (3, 9), (4, -1)].into());
        // A strip of three: the middle one (0, 2, 3) + 1 has one boundary edge, 3-0.
        let three = shapes::close(&[[0, 1, 2], [0, 2, 3], [2, 4, 3]]);
        let expected = [(1, 4), (4, 4), (3, 6), (2, -1), (5, -1)].into();
        assert_eq!(weights(&three, StepKind::Sqrt3Even, 1, 12), expected);
    }

    #[test]
    fn odd_boundary_edges_have_the_curve_rule_and_its_mirror() {
        let coarse = shapes::annulus(5);
        let c = (0..30u32).find(|&c| coarse.is_virtual_face(coarse.across(c) / 3)).unwrap();
        assert!(c < 3);
        // Inner rim: vertices 0, 3, 6, 9, 12 of the grid, shifted by two loops; edge 2 -> 5.
        let near_a = [(14, -5), (2, 60), (5, 30), (8, -4)].into();
        let near_b = [(8, -5), (5, 60), (2, 30), (14, -4)].into();
        assert_eq!(weights(&coarse, StepKind::Sqrt3Odd, 0, 81), near_a);
        assert_eq!(weights(&coarse, StepKind::Sqrt3Odd, 1, 81), near_b);
    }

    #[test]
    fn an_inner_face_at_a_boundary_or_a_huge_vertex_has_the_plain_rule() {
        let coarse = shapes::bipyramid(90);
        // 4-valent corners are extraordinary: only a face of plain corners gets the plain rule.
        let merged = weights(&coarse, StepKind::Sqrt3Even, 0, 2 * i64::from(ONE));
        assert!(merged.len() > 4);
        let coarse = refined(&shapes::bipyramid(90), 1);
        let hub = (0..coarse.faces()).find(|&f| coarse.face(f).contains(&90)).unwrap();
        let corners = [3 * hub, 3 * hub + 1, 3 * hub + 2];
        let mut expected = Weights::new();
        for c in corners {
            *expected.entry(coarse.at(c)).or_default() += 4;
            *expected.entry(coarse.at(coarse.across(c))).or_default() -= 1;
        }
        assert_eq!(weights(&coarse, StepKind::Sqrt3Even, hub as usize, 9), expected);
    }

    #[test]
    fn every_stencil_sums_to_one_and_names_only_real_vertices() {
        for (name, base) in shapes::all() {
            for steps in 0..3 {
                let coarse = refined(&base, steps);
                let kind = generation(steps);
                let mut count = 0;
                for_each_stencil(&coarse, kind, |i, stencil| {
                    assert_eq!(i, count);
                    count += 1;
                    let sum: i64 = stencil.terms.iter().map(|t| i64::from(t.1)).sum();
                    assert_eq!(sum, stencil.denominator, "{name}, step {steps}");
                    assert_eq!(COMMON_DENOMINATOR % stencil.denominator, 0);
                    assert!(stencil.terms.iter().all(|t| !coarse.is_virtual(t.0)));
                });
                let fine = refined(&base, steps + 1);
                assert_eq!(count as u32, fine.vertices - coarse.vertices, "{name}, step {steps}");
            }
        }
    }

    #[test]
    fn on_a_regular_disk_new_vertices_are_centres_of_faces_and_thirds_of_boundary_edges() {
        let coarse = shapes::disk(7);
        let at: Vec<[i32; 3]> =
            (0..coarse.vertices as i32).map(|v| [(v - 1).div_euclid(8) * 72, (v - 1) % 8 * 72, 5]).collect();
        let mut faces = (0..coarse.faces()).filter(|&f| !coarse.is_virtual_face(f));
        let sum = |vertices: &[u32], at: &[[i32; 3]]| {
            [0, 1, 2].map(|k| vertices.iter().map(|&v| i64::from(at[v as usize][k])).sum::<i64>())
        };
        let mut placed = at.clone();
        for_each_stencil(&coarse, StepKind::Sqrt3Even, |_, stencil| {
            let face = coarse.face(faces.next().unwrap());
            let q = stencil.fixed(&at, 0);
            assert_eq!(q.map(|x| 3 * x), sum(&face, &at));
            placed.push(q.map(|x| x as i32));
        });

        let coarse = refined(&coarse, 1);
        let mut expected = Vec::new();
        for f in (0..coarse.faces()).filter(|&f| !coarse.is_virtual_face(f)) {
            match (3 * f..3 * f + 3).find(|&c| is_boundary_edge(&coarse, c)) {
                Some(c) => {
                    let (a, b) = (coarse.at(next(c)), coarse.at(prev(c)));
                    expected.push(sum(&[a, a, b], &placed));
                    expected.push(sum(&[a, b, b], &placed));
                }
                None => expected.push(sum(&coarse.face(f), &placed)),
            }
        }
        for_each_stencil(&coarse, StepKind::Sqrt3Odd, |i, stencil| {
            // A curve rule that reaches around a corner of the disk sees no straight line.
            let straight = stencil.terms.len() != 4 || {
                let line: Vec<_> = stencil.terms.iter().map(|t| placed[t.0 as usize]).collect();
                (0..2).any(|k| line.iter().all(|p| p[k] == line[0][k]))
            };
            if straight {
                assert_eq!(stencil.fixed(&placed, 0).map(|x| 3 * x), expected[i], "new vertex {i}");
            }
        });
    }

    #[test]
    fn rounding_is_to_nearest_with_halves_upwards_and_exact_at_the_ends_of_i32() {
        let mut stencil = Stencil { terms: vec![(0, 1), (1, 1)], denominator: 2 };
        assert_eq!(stencil.fixed(&[[0, -1, -3], [1, 0, 0]], 0), [1, 0, -1]);
        stencil.terms = vec![(0, 5), (1, -4)];
        stencil.denominator = 1;
        let ends = [[i32::MAX; 3], [i32::MIN; 3]];
        assert_eq!(stencil.fixed(&ends, 8)[0], 256 * (5 * i64::from(i32::MAX) - 4 * i64::from(i32::MIN)));
        let mut random = Random::new(3);
        let three = ONE as u32 * 3;
        for _ in 0..1000 {
            let w = random.below(three) as i32;
            let p = random.points(2, i32::MAX as u32 / 2);
            let stencil = Stencil { terms: vec![(0, w), (1, three as i32 - w)], denominator: three.into() };
            let exact = stencil
                .terms
                .iter()
                .map(|&(v, w)| i128::from(w) * i128::from(p[v as usize][0]))
                .sum::<i128>();
            let rounded = (512 * exact + i128::from(three)).div_euclid(2 * i128::from(three));
            assert_eq!(i128::from(stencil.fixed(&p, 8)[0]), rounded);
        }
    }
}
