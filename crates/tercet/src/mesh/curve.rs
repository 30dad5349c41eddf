//! Cutting a large mesh in the order of a curve through space.
//!
//! A mesh may be numbered in any way, and a surface inherits its numbers. But the adaptive step decides blocks of
//! consecutive vertices together, and everything visits the neighbours of a vertex: where numbers say nothing of
//! space, the seams of the blocks are everywhere, and each neighbour is a miss of the cache. Cells of space in the
//! order of Morton's curve ("A computer oriented geodetic data base and a new technique in file sequencing",
//! 1966) keep near in memory what is near in space.

use super::{Cut, Lattice, Mesh, box_lattice, cut};

/// As `cut`, but the surface has its vertices in the order of the cells that they lie in, and its faces in the
/// order of their first vertices.
///
/// Time as `cut` and O(n log n) for loose vertices and degenerate faces.
pub(crate) fn cut_along_curve(mesh: &Mesh) -> Cut {
    let (vertices, faces) = (mesh.positions.len() as u32, mesh.faces.len() as u32);
    let cells = Cells::new(mesh);
    let number = places(vertices, cells.count(), |v| cells.of(mesh.positions[v as usize]));
    let renumbered = |f: u32| mesh.faces[f as usize].map(|v| number[v as usize]);
    let place = places(faces, vertices, |f| renumbered(f).into_iter().fold(vertices, u32::min));
    let mut arranged = Mesh {
        // Cutting asks for their number only.
        positions: vec![[0.0; 3]; mesh.positions.len()],
        faces: vec![[0; 3]; mesh.faces.len()],
    };
    for (f, &place) in (0..).zip(&place) {
        arranged.faces[place as usize] = renumbered(f);
    }
    let mut cut = cut(&arranged);
    drop(arranged);
    let (vertex, face) = (inverse(&number), inverse(&place));
    cut.vertex_source.iter_mut().for_each(|v| *v = vertex[*v as usize]);
    for (list, original) in [(&mut cut.loose, &vertex), (&mut cut.degenerate, &face)] {
        list.iter_mut().for_each(|i| *i = original[*i as usize]);
        list.sort_unstable();
    }
    cut
}

/// Cubes of equal size that fill a mesh's bounding box, in the order of Morton's curve.
struct Cells {
    lattice: Lattice,
    /// Bits of a coordinate.
    bits: u8,
}

impl Cells {
    /// At most as many as there are vertices, or one.
    fn new(mesh: &Mesh) -> Self {
        let bits = (mesh.positions.len().max(1).ilog2() / 3) as u8;
        Cells { lattice: Lattice::new(&box_lattice(mesh, bits.max(1))), bits }
    }

    fn count(&self) -> u32 {
        1 << (3 * self.bits)
    }

    /// The number of the cell that a position lies in: the bits of its coordinates, interleaved.
    fn of(&self, position: [f32; 3]) -> u32 {
        let cell = self.lattice.quantise(position);
        let interleaved = |code, bit| cell.iter().fold(code, |code, &x| code << 1 | (x as u32) >> bit & 1);
        (0..self.bits).rev().fold(0, interleaved)
    }
}

/// Where each of `items` comes when they are sorted by their keys, which are below `keys`; those of one key
/// keep their order. Time O(`items` + `keys`).
fn places(items: u32, keys: u32, key: impl Fn(u32) -> u32) -> Vec<u32> {
    let mut start = vec![0u32; keys as usize + 1];
    // A key at first, then the place.
    let mut places: Vec<u32> = (0..items).map(key).collect();
    for &key in &places {
        start[key as usize + 1] += 1;
    }
    for k in 0..keys as usize {
        start[k + 1] += start[k];
    }
    for place in &mut places {
        let next = &mut start[*place as usize];
        *place = *next;
        *next += 1;
    }
    places
}

/// The inverse of a permutation.
fn inverse(permutation: &[u32]) -> Vec<u32> {
    let mut inverse = vec![0; permutation.len()];
    for (i, &place) in (0..).zip(permutation) {
        inverse[place as usize] = i;
    }
    inverse
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::{Surface, next};
    use crate::shapes::{annulus, grid, join, scan, shuffled, soup};

    /// The real faces by the mesh's vertices, sorted; with the vertex across from the first corner.
    fn faces(cut: &Cut) -> Vec<[u32; 4]> {
        let Cut { surface, vertex_source, .. } = cut;
        let named = |v: u32| match surface.is_virtual(v) {
            true => u32::MAX,
            false => vertex_source[(v - surface.virtuals) as usize],
        };
        let real = (0..surface.faces()).filter(|&f| !surface.is_virtual_face(f));
        let corners = |f: u32| {
            let [a, b, c] = surface.face(f).map(named);
            [a, b, c, named(surface.at(surface.across(3 * f)))]
        };
        let mut faces: Vec<_> = real.map(corners).collect();
        faces.sort_unstable();
        faces
    }

    #[test]
    fn the_surface_is_the_same_by_other_numbers() {
        for mesh in [scan(900, 3), shuffled(&grid(20, 30), 1), join(&[annulus(9, 3), scan(40, 2)])] {
            let (plain, curved) = (cut(&mesh), cut_along_curve(&mesh));
            curved.surface.validate().unwrap();
            assert_eq!(curved.surface.virtuals, plain.surface.virtuals);
            assert_eq!(faces(&curved), faces(&plain));
        }
    }

    #[test]
    fn what_is_not_in_the_surface_is_named_as_in_the_mesh() {
        for mesh in [soup(400, 3), Mesh { positions: vec![[1.0; 3]; 3], faces: vec![] }, Mesh::default()] {
            let (plain, curved) = (cut(&mesh), cut_along_curve(&mesh));
            curved.surface.validate().unwrap();
            assert_eq!((curved.loose, curved.degenerate), (plain.loose, plain.degenerate));
        }
    }

    #[test]
    fn neighbours_have_near_numbers_however_the_mesh_was_numbered() {
        let far = |surface: &Surface| {
            let apart = |c: u32| surface.at(c).abs_diff(surface.at(next(c)));
            let edges = surface.vertex.len() as u32;
            (0..edges).filter(|&c| apart(c) > surface.vertices / 16).count() * 100 / edges as usize
        };
        let mesh = shuffled(&scan(20_000, 1), 2);
        let [plain, curved] = [cut(&mesh), cut_along_curve(&mesh)].map(|cut| far(&cut.surface));
        assert!(plain > 80 && curved < 10, "{plain} % and {curved} %");
    }
}
