//! The order in which a large surface is kept: along a curve through space.
//!
//! A mesh may be numbered in any way. The adaptive step decides blocks of consecutive vertices together
//! ([`BLOCK`](super::BLOCK)), and everything visits the neighbours of a vertex: where numbers say nothing of
//! space, the seams of the blocks are everywhere, and each neighbour is a miss of the cache. Cells of space in
//! the order of Morton's curve ("A computer oriented geodetic data base and a new technique in file
//! sequencing", 1966) keep near in memory what is near in space.

use crate::mesh::Surface;

/// Renumbers the real vertices of `surface` by the cells that they lie in, and its real faces by their first
/// vertices; virtual ones keep their order and their places, before and behind. `points` has a lattice point
/// for each vertex, `source` an entry for each real one; both are reordered too.
///
/// Linear time; memory of a second surface while it lasts.
pub(crate) fn along_curve(surface: &mut Surface, points: &mut Vec<[i32; 3]>, source: &mut Vec<u32>) {
    let virtuals = surface.virtuals;
    let cells = Cells::new(&points[virtuals as usize..]);
    let number = places(surface.vertices, cells.count() + 1, |v| match surface.is_virtual(v) {
        true => 0,
        false => 1 + cells.of(points[v as usize]),
    });
    *points = moved(points, &number);
    let real = number[virtuals as usize..].iter().map(|n| n - virtuals).collect::<Vec<_>>();
    *source = moved(source, &real);
    drop(real);

    let vertices = surface.vertices;
    let face = places(surface.faces(), vertices + 1, |f| match surface.is_virtual_face(f) {
        true => vertices,
        false => surface.face(f).map(|v| number[v as usize]).into_iter().min().unwrap_or(vertices),
    });
    let corner = |c: u32| 3 * face[(c / 3) as usize] + c % 3;
    surface.vertex = rearranged(&surface.vertex, corner, |v| number[v as usize]);
    surface.opposite = rearranged(&surface.opposite, corner, corner);
}

/// Cubes of equal size that fill a bounding box, in the order of Morton's curve.
struct Cells {
    low: [i32; 3],
    /// Bits of a coordinate that tell a place within a cell.
    inner: u32,
    /// Bits of a coordinate that tell the cell.
    outer: u32,
}

impl Cells {
    /// At most as many cells as there are points, or one.
    fn new(points: &[[i32; 3]]) -> Self {
        let least = |k: usize| points.iter().map(|p| p[k]).min().unwrap_or(0);
        let greatest = |k: usize| points.iter().map(|p| p[k]).max().unwrap_or(0);
        let low = [0, 1, 2].map(least);
        let extent = (0..3).map(|k| greatest(k).wrapping_sub(low[k]) as u32).max().unwrap_or(0);
        let bits = u32::BITS - extent.leading_zeros();
        let outer = (points.len().max(1).ilog2() / 3).min(bits);
        Cells { low, inner: bits - outer, outer }
    }

    fn count(&self) -> u32 {
        1 << (3 * self.outer)
    }

    /// The number of the cell that a point lies in: the bits of its coordinates, interleaved.
    fn of(&self, point: [i32; 3]) -> u32 {
        let cell = [0, 1, 2].map(|k| (point[k].wrapping_sub(self.low[k]) as u32).unbounded_shr(self.inner));
        (0..self.outer).rev().fold(0, |code, bit| cell.iter().fold(code, |code, x| code << 1 | x >> bit & 1))
    }
}

/// Where each of `items` comes when they are sorted by their keys, which are below `keys`; those of one key
/// keep their order.
fn places(items: u32, keys: u32, key: impl Fn(u32) -> u32) -> Vec<u32> {
    let mut start = vec![0u32; keys as usize + 1];
    for i in 0..items {
        start[key(i) as usize + 1] += 1;
    }
    for k in 0..keys as usize {
        start[k + 1] += start[k];
    }
    let mut take = |i: u32| {
        let place = &mut start[key(i) as usize];
        *place += 1;
        *place - 1
    };
    (0..items).map(&mut take).collect()
}

/// The items at their places.
fn moved<T: Copy + Default>(items: &[T], place: &[u32]) -> Vec<T> {
    let mut all = vec![T::default(); items.len()];
    for (&item, &place) in items.iter().zip(place) {
        all[place as usize] = item;
    }
    all
}

/// What each corner has, renamed, at the corner's new number.
fn rearranged(of_corner: &[u32], corner: impl Fn(u32) -> u32, renamed: impl Fn(u32) -> u32) -> Vec<u32> {
    let mut all = vec![0; of_corner.len()];
    for (c, &x) in (0..).zip(of_corner) {
        all[corner(c) as usize] = renamed(x);
    }
    all
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::{Cut, cut, next};
    use crate::shapes::{annulus, grid, join, scan, shuffled};
    use crate::{EncodeOptions, Limits, Mesh, decode, encode};

    /// A cut mesh with lattice points, and what the curve makes of it.
    fn arranged(mesh: &Mesh) -> [(Surface, Vec<[i32; 3]>, Vec<u32>); 2] {
        let Cut { surface, vertex_source, .. } = cut(mesh);
        let mut points = vec![[0; 3]; surface.virtuals as usize];
        let lattice = |x: f32| (x * 1000.0) as i32 - 500;
        points.extend(vertex_source.iter().map(|&v| mesh.positions[v as usize].map(lattice)));
        let before = (surface, points, vertex_source);
        let mut after = before.clone();
        along_curve(&mut after.0, &mut after.1, &mut after.2);
        [before, after]
    }

    /// The faces of a surface by the mesh's vertices and the points that their corners have, sorted; with
    /// the vertex across from the first corner.
    fn faces((surface, points, source): &(Surface, Vec<[i32; 3]>, Vec<u32>)) -> Vec<Vec<(u32, [i32; 3])>> {
        let named = |v: u32| match surface.is_virtual(v) {
            true => (u32::MAX - v, [0; 3]),
            false => (source[(v - surface.virtuals) as usize], points[v as usize]),
        };
        let corners = |f: u32| surface.face(f).into_iter().chain([surface.at(surface.across(3 * f))]);
        let mut faces: Vec<_> =
            (0..surface.faces()).map(|f| corners(f).map(named).collect::<Vec<_>>()).collect();
        faces.sort();
        faces
    }

    #[test]
    fn the_surface_stays_the_same_by_other_numbers() {
        for mesh in [scan(900, 3), shuffled(&grid(20, 30), 1), join(&[annulus(9, 3), scan(40, 2)])] {
            let [before, after] = arranged(&mesh);
            after.0.validate().unwrap();
            assert_eq!((after.0.vertices, after.0.virtuals), (before.0.vertices, before.0.virtuals));
            assert_eq!(faces(&after), faces(&before));
            let is_virtual = |f| after.0.is_virtual_face(f);
            assert!((0..after.0.faces()).map(is_virtual).is_sorted(), "virtual faces come last");
        }
    }

    #[test]
    fn neighbours_have_near_numbers_however_the_mesh_was_numbered() {
        let far = |surface: &Surface| {
            let apart = |c: u32| surface.at(c).abs_diff(surface.at(next(c)));
            let edges = surface.vertex.len() as u32;
            (0..edges).filter(|&c| apart(c) > surface.vertices / 16).count() * 100 / edges as usize
        };
        let [before, after] = arranged(&shuffled(&scan(20_000, 1), 2));
        assert!(far(&before.0) > 80, "{} %", far(&before.0));
        assert!(far(&after.0) < 10, "{} %", far(&after.0));
    }

    #[test]
    fn points_of_any_extent_have_a_cell() {
        for points in [vec![], vec![[7; 3]; 40], vec![[i32::MIN; 3], [i32::MAX; 3], [0, -1, 1], [5; 3]]] {
            let cells = Cells::new(&points);
            assert!(cells.count() as usize <= points.len().max(1));
            assert!(points.iter().all(|&p| cells.of(p) < cells.count()));
        }
    }

    #[test]
    fn a_large_mesh_comes_back_whole() {
        let mesh = shuffled(&grid(370, 360), 3);
        assert!(mesh.positions.len() > crate::reverse::BLOCK);
        let options = EncodeOptions { keep_order: true, ..EncodeOptions::default() };
        let file = encode(&mesh, &options).unwrap();
        assert_eq!(decode(&file.bytes, &Limits::default()).unwrap(), mesh);
    }
}
