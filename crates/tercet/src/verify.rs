//! Is a decoded mesh the original? Answered without any of the codec's own code.
//!
//! Floats are compared by their bits: −0 is not 0. Besides equal arrays, two meshes count as
//! the same if one becomes the other by renumbering vertices, reordering faces and rotating the
//! corners of faces. Where every position occurs once that is decided by sorting. Where
//! vertices coincide, they are told apart by *colour refinement* (Weisfeiler and Leman,
//! 1968): a vertex's colour starts as its position and repeatedly takes in its neighbours'
//! colours. Different colours prove different meshes; equal colours prove that every vertex
//! has a counterpart with the same surroundings, several rings wide.

use crate::mesh::Lattice;
use crate::{Mesh, Precision};

/// How often colours are refined, which is how many rings around a vertex its colour takes in.
const ROUNDS: u32 = 8;

/// How two meshes relate.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Sameness {
    /// The same arrays: the same vertices and faces in the same order.
    Identical,
    /// Equal up to the order of vertices, the order of faces and the rotation of their corners.
    Renumbered,
    /// Not the same mesh. One line says what differs first, with counts.
    Different(String),
}

/// Compares a decoded mesh with its original. Time O(n log n).
pub fn compare(original: &Mesh, decoded: &Mesh) -> Sameness {
    if identical(original, decoded) {
        return Sameness::Identical;
    }
    match difference(original, decoded) {
        Some(difference) => Sameness::Different(difference),
        None => Sameness::Renumbered,
    }
}

/// What `mesh` becomes at a precision: each position moved to its point of a
/// [`Precision::Lattice`]; for the exact precisions, the mesh itself.
pub fn quantised(mesh: &Mesh, precision: &Precision) -> Mesh {
    if !matches!(precision, Precision::Lattice { .. }) {
        return mesh.clone();
    }
    let lattice = Lattice::new(precision);
    let positions = mesh.positions.iter().map(|&p| lattice.value(lattice.quantise(p))).collect();
    Mesh { positions, faces: mesh.faces.clone() }
}

fn bits(position: [f32; 3]) -> [u32; 3] {
    position.map(f32::to_bits)
}

fn identical(a: &Mesh, b: &Mesh) -> bool {
    a.faces == b.faces
        && a.positions.len() == b.positions.len()
        && a.positions.iter().zip(&b.positions).all(|(&p, &q)| bits(p) == bits(q))
}

/// What differs first, beyond numbering.
fn difference(original: &Mesh, decoded: &Mesh) -> Option<String> {
    for (mesh, name) in [(original, "the original"), (decoded, "the decoded mesh")] {
        if let Err(error) = mesh.check() {
            return Some(format!("{name} is not valid: {error}"));
        }
    }
    let counts = |mesh: &Mesh| [(mesh.positions.len(), "vertices"), (mesh.faces.len(), "faces")];
    for ((a, name), (b, _)) in counts(original).into_iter().zip(counts(decoded)) {
        if a != b {
            return Some(format!("{a} {name} in the original, {b} in the decoded mesh"));
        }
    }
    different_positions(original, decoded)
        .or_else(|| different_faces(original, decoded))
        .or_else(|| different_surroundings(original, decoded))
}

fn different_positions(original: &Mesh, decoded: &Mesh) -> Option<String> {
    let sorted = |mesh: &Mesh| sorted(mesh.positions.iter().map(|&p| bits(p)).collect());
    let (count, first) = missing(&sorted(original), &sorted(decoded))?;
    let n = original.positions.len();
    let [x, y, z] = first.map(f32::from_bits);
    Some(format!("{count} of {n} positions are not in the decoded mesh, among them ({x}, {y}, {z})"))
}

/// Compares faces as triples of positions. The positions must be the same.
fn different_faces(original: &Mesh, decoded: &Mesh) -> Option<String> {
    let faces = |mesh: &Mesh| {
        let positions = mesh.faces.iter().map(|f| turned(f.map(|v| bits(mesh.positions[v as usize]))));
        sorted(positions.collect())
    };
    let (count, first) = missing(&faces(original), &faces(decoded))?;
    let n = original.faces.len();
    let [a, b, c] = first.map(|p| p.map(f32::from_bits));
    Some(format!("{count} of {n} faces are not in the decoded mesh, among them {a:?} {b:?} {c:?}"))
}

/// Compares how coincident vertices are joined. Positions and faces must be the same.
fn different_surroundings(original: &Mesh, decoded: &Mesh) -> Option<String> {
    if !has_coincident_vertices(original) {
        return None;
    }
    let (mut a, mut b) = (first_colours(original), first_colours(decoded));
    for _ in 0..ROUNDS {
        (a, b) = (refined_colours(original, &a), refined_colours(decoded, &b));
        // Most rounds find no difference, and a sum of hashes sees that without sorting.
        let digest = |colours: &[u64]| colours.iter().fold(0u64, |sum, &c| sum.wrapping_add(mixed(c, 0)));
        if digest(&a) != digest(&b) {
            let n = a.len();
            let (count, _) = missing(&sorted(a), &sorted(b))?;
            return Some(format!("{count} of {n} vertices are joined to other faces in the decoded mesh"));
        }
    }
    let faces = |mesh: &Mesh, colours: &[u64]| {
        sorted(mesh.faces.iter().map(|f| turned(f.map(|v| colours[v as usize]))).collect())
    };
    let (count, _) = missing(&faces(original, &a), &faces(decoded, &b))?;
    let n = original.faces.len();
    Some(format!("{count} of {n} faces join other vertices in the decoded mesh"))
}

fn has_coincident_vertices(mesh: &Mesh) -> bool {
    sorted(mesh.positions.iter().map(|&p| bits(p)).collect()).windows(2).any(|pair| pair[0] == pair[1])
}

/// The colour of every vertex by its position alone.
fn first_colours(mesh: &Mesh) -> Vec<u64> {
    mesh.positions.iter().map(|&p| bits(p).iter().fold(0, |hash, &x| mixed(hash, x.into()))).collect()
}

/// The colour of every vertex with those of the faces around it taken in.
fn refined_colours(mesh: &Mesh, colours: &[u64]) -> Vec<u64> {
    // A sum of hashes does not depend on the order of the corners, as a set must not.
    let mut around = vec![0u64; colours.len()];
    for f in &mesh.faces {
        let [a, b, c] = f.map(|v| colours[v as usize]);
        for (v, next, previous) in [(f[0], b, c), (f[1], c, a), (f[2], a, b)] {
            let sum = &mut around[v as usize];
            *sum = sum.wrapping_add(mixed(next, previous));
        }
    }
    colours.iter().zip(around).map(|(&colour, around)| mixed(colour, around)).collect()
}

/// A 64-bit hash of an ordered pair: the finaliser of SplitMix64 (Steele, Lea and Flood, 2014).
fn mixed(a: u64, b: u64) -> u64 {
    let mut x = a.rotate_left(25).wrapping_mul(0x9e37_79b9_7f4a_7c15) ^ b;
    for (shift, factor) in [(30, 0xbf58_476d_1ce4_e5b9), (27, 0x94d0_49bb_1331_11eb)] {
        x = (x ^ (x >> shift)).wrapping_add(0x9e37_79b9_7f4a_7c15).wrapping_mul(factor);
    }
    x ^ (x >> 31)
}

fn sorted<T: Ord>(mut items: Vec<T>) -> Vec<T> {
    items.sort_unstable();
    items
}

/// The least of the three rotations of a face.
fn turned<T: Ord + Copy>([a, b, c]: [T; 3]) -> [T; 3] {
    [a, b, c].min([b, c, a]).min([c, a, b])
}

/// How many items of `a` have no partner in `b`, and the first of them. Both are sorted.
fn missing<T: Ord + Copy>(a: &[T], b: &[T]) -> Option<(usize, T)> {
    let mut b = b.iter().peekable();
    let mut without = a.iter().filter(|&item| {
        while b.next_if(|&other| other < item).is_some() {}
        b.next_if_eq(&item).is_none()
    });
    let first = *without.next()?;
    Some((1 + without.count(), first))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::shapes;
    use proptest::prelude::*;

    fn difference(a: &Mesh, b: &Mesh) -> String {
        match compare(a, b) {
            Sameness::Different(what) => what,
            same => panic!("{same:?}"),
        }
    }

    #[test]
    fn equal_arrays_are_identical_even_if_invalid() {
        for mesh in [Mesh::default(), shapes::icosahedron(), shapes::soup(50, 1)] {
            assert_eq!(compare(&mesh, &mesh.clone()), Sameness::Identical);
        }
        let nan = Mesh { positions: vec![[f32::NAN; 3]], faces: vec![[9; 3]] };
        assert_eq!(compare(&nan, &nan), Sameness::Identical);
        assert!(difference(&nan, &Mesh::default()).starts_with("the original is not valid: vertex 0"));
    }

    #[test]
    fn any_renumbering_is_seen_as_one() {
        for mesh in [shapes::torus(7, 5), shapes::grid(4, 3), shapes::soup(200, 3), shapes::scan(300, 5)] {
            for seed in 0..4 {
                assert_eq!(compare(&mesh, &shapes::shuffled(&mesh, seed)), Sameness::Renumbered);
            }
        }
    }

    #[test]
    fn one_bit_of_one_coordinate_is_a_difference() {
        let mesh = shapes::grid(3, 3);
        let mut other = shapes::shuffled(&mesh, 1);
        let x = &mut other.positions[5][1];
        *x = f32::from_bits(x.to_bits() ^ 1);
        assert!(difference(&mesh, &other).starts_with("1 of 16 positions are not in the decoded mesh"));
    }

    #[test]
    fn negative_zero_is_not_zero() {
        let mesh = Mesh { positions: vec![[0.0; 3]], faces: vec![] };
        let other = Mesh { positions: vec![[0.0, -0.0, 0.0]], faces: vec![] };
        assert_eq!(
            difference(&other, &mesh),
            "1 of 1 positions are not in the decoded mesh, among them (0, -0, 0)"
        );
    }

    #[test]
    fn counts_come_first() {
        let mesh = shapes::icosahedron();
        let mut less = mesh.clone();
        less.faces.pop();
        assert_eq!(difference(&mesh, &less), "20 faces in the original, 19 in the decoded mesh");
        less.positions.push([0.0; 3]);
        assert_eq!(difference(&mesh, &less), "12 vertices in the original, 13 in the decoded mesh");
    }

    #[test]
    fn a_face_turned_over_or_put_elsewhere_is_a_difference() {
        let mesh = shapes::torus(5, 4);
        let mut over = mesh.clone();
        over.faces[3].swap(0, 1);
        assert!(difference(&mesh, &over).starts_with("1 of 40 faces are not in the decoded mesh"));
        // The same face twice instead of two faces: sets would be equal in one direction only.
        let mut twice = mesh.clone();
        twice.faces[0] = twice.faces[1];
        assert!(difference(&twice, &mesh).starts_with("1 of 40 faces"));
        assert!(difference(&mesh, &twice).starts_with("1 of 40 faces"));
    }

    /// Two triangles on one edge, and the same with the edge's ends doubled.
    fn hinge(faces: [[u32; 3]; 2]) -> Mesh {
        let [a, b] = [[0.0; 3], [1.0, 0.0, 0.0]];
        Mesh { positions: vec![a, b, a, b, [0.0, 1.0, 0.0], [0.0, -1.0, 0.0]], faces: faces.to_vec() }
    }

    #[test]
    fn coincident_vertices_are_not_taken_for_welded_ones() {
        let welded = hinge([[0, 1, 4], [1, 0, 5]]);
        let apart = hinge([[0, 1, 4], [3, 2, 5]]);
        assert_eq!(
            difference(&welded, &apart),
            "4 of 6 vertices are joined to other faces in the decoded mesh"
        );
        let half = hinge([[0, 1, 4], [3, 0, 5]]);
        assert_eq!(
            difference(&apart, &half),
            "2 of 6 vertices are joined to other faces in the decoded mesh"
        );
        assert_eq!(compare(&apart, &hinge([[4, 2, 3], [1, 0, 5]])), Sameness::Renumbered);
    }

    #[test]
    fn swapping_coincident_vertices_far_from_each_other_is_a_difference() {
        // Two sheets that touch along a seam of doubled vertices: which half each sheet continues in
        // shows only some rings away.
        let sheet = shapes::grid(9, 2);
        let double = shapes::join(&[sheet.clone(), sheet.clone()]);
        let n = sheet.positions.len() as u32;
        let mut marked = double.clone();
        marked.positions[0] = [-9.0; 3];
        marked.positions[9] = [-8.0; 3];
        let mut crossed = marked.clone();
        for f in &mut crossed.faces {
            let right = f.iter().any(|&v| v % 10 > 5);
            if right {
                *f = f.map(|v| if v % n % 10 == 5 { (v + n) % (2 * n) } else { v });
            }
        }
        assert_ne!(compare(&marked, &crossed), Sameness::Identical);
        assert!(difference(&marked, &crossed).contains("vertices are joined to other faces"));
        assert_eq!(compare(&marked, &shapes::shuffled(&marked, 2)), Sameness::Renumbered);
    }

    #[test]
    fn quantising_moves_to_the_lattice_only() {
        let mesh = shapes::icosahedron();
        let exact = Precision::Binary { exponent: -3, origin: [0; 3] };
        assert_eq!(quantised(&mesh, &exact), mesh);
        let precision = Precision::Lattice { bits: 4, origin: [-1.0; 3], side: 2.0 };
        let coarse = quantised(&mesh, &precision);
        assert_ne!(coarse, mesh);
        assert_eq!(coarse.faces, mesh.faces);
        assert_eq!(quantised(&coarse, &precision), coarse);
    }

    proptest! {
        #[test]
        fn moving_one_corner_to_another_vertex_is_seen(face in 0usize..120, corner in 0usize..3, to in 1u32..60) {
            let mesh = shapes::torus(6, 10);
            let mut other = mesh.clone();
            let v = &mut other.faces[face][corner];
            *v = (*v + to) % 60;
            prop_assert!(difference(&mesh, &shapes::shuffled(&other, 1)).contains("of 120 faces"));
        }
    }
}
