//! Points spread evenly over a surface by area.

use super::TriangleTree;
use super::distance::{Vector, cross, dot, sub};
use crate::shapes::Random;

/// The areas of a tree's triangles.
pub(super) struct Areas {
    /// The area of all triangles up to each one, in the order of the leaves.
    sums: Vec<f64>,
    degenerate: usize,
}

impl Areas {
    /// Linear time.
    pub fn new(tree: &TriangleTree) -> Self {
        let mut areas = Areas { sums: Vec::with_capacity(tree.len() as usize), degenerate: 0 };
        let mut sum = 0.0;
        for t in 0..tree.len() {
            let area = area(tree.corners(t));
            areas.degenerate += usize::from(area == 0.0);
            sum += area;
            areas.sums.push(sum);
        }
        areas
    }

    /// Of all triangles.
    pub fn total(&self) -> f64 {
        self.sums.last().copied().unwrap_or_default()
    }

    /// How many triangles have none.
    pub fn degenerate(&self) -> usize {
        self.degenerate
    }
}

fn area([a, b, c]: [Vector; 3]) -> f64 {
    let normal = cross(sub(b, a), sub(c, a));
    0.5 * dot(normal, normal).sqrt()
}

/// Hands out `count` points of a surface that has an area, in the order of the tree's leaves.
///
/// Stratified: of `count` parts of equal area, which follow each other in that order and so are mostly
/// compact, each receives one point. This has the mean of independent points and a lower variance.
/// O(n + count) time.
pub(super) fn for_each_sample(
    tree: &TriangleTree,
    areas: &Areas,
    count: usize,
    seed: u64,
    mut take: impl FnMut(Vector),
) {
    let mut random = Random::new(seed);
    let mut t = 0;
    let last = areas.sums.len() - 1;
    for i in 0..count {
        let area = (i as f64 + random.unit()) / count as f64 * areas.total();
        // Not beyond the last triangle with an area, however the sums are rounded.
        while t < last && areas.sums[t] <= area && areas.sums[t] < areas.total() {
            t += 1;
        }
        take(within(tree.corners(t as u32), random.unit(), random.unit()));
    }
}

/// So many points of a surface; none if it has no area.
#[cfg(feature = "remesh")]
pub(crate) fn samples(tree: &TriangleTree, count: usize, seed: u64) -> Vec<Vector> {
    let areas = Areas::new(tree);
    let mut points = Vec::new();
    if areas.total() > 0.0 {
        points.reserve_exact(count);
        for_each_sample(tree, &areas, count, seed, |p| points.push(p));
    }
    points
}

/// A point of a triangle, evenly distributed if `u` and `v` are in 0..1: the half of the parallelogram
/// beyond the triangle is turned onto it.
fn within([a, b, c]: [Vector; 3], u: f64, v: f64) -> Vector {
    let (u, v) = if u + v > 1.0 { (1.0 - u, 1.0 - v) } else { (u, v) };
    let (ab, ac) = (sub(b, a), sub(c, a));
    std::array::from_fn(|k| a[k] + u * ab[k] + v * ac[k])
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{Mesh, shapes};

    fn samples(mesh: &Mesh, count: usize, seed: u64) -> Vec<Vector> {
        let tree = TriangleTree::new(mesh).unwrap();
        let mut points = Vec::new();
        for_each_sample(&tree, &Areas::new(&tree), count, seed, |p| points.push(p));
        points
    }

    #[test]
    fn every_triangle_gets_its_share_to_within_one_sample() {
        let mesh = shapes::scan(300, 1);
        let (tree, count) = (TriangleTree::new(&mesh).unwrap(), 20_000);
        let areas = Areas::new(&tree);
        let mut found = vec![0.0; mesh.faces.len()];
        for p in samples(&mesh, count, 5) {
            found[tree.search(p, None).unwrap().0 as usize] += 1.0;
        }
        for t in 0..tree.len() {
            let share = area(tree.corners(t)) / areas.total() * count as f64;
            // One stratum at either end may reach over the border; so may a point on an edge.
            assert!((found[t as usize] - share).abs() <= 3.0, "{t}: {} {share}", found[t as usize]);
        }
    }

    #[test]
    fn samples_are_even_within_a_triangle() {
        let positions = vec![[0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]];
        let points = samples(&Mesh { positions, faces: vec![[0, 1, 2]] }, 100_000, 1);
        let mean = |f: &dyn Fn(&Vector) -> f64| points.iter().map(f).sum::<f64>() / points.len() as f64;
        assert!(points.iter().all(|p| p[0] >= 0.0 && p[1] >= 0.0 && p[0] + p[1] <= 1.0));
        assert!((mean(&|p| p[0]) - 1.0 / 3.0).abs() < 3e-3 && (mean(&|p| p[1]) - 1.0 / 3.0).abs() < 3e-3);
        // ∫ x² over the triangle, and ∫ xy, by its area 1/2.
        assert!((mean(&|p| p[0] * p[0]) - 1.0 / 6.0).abs() < 3e-3);
        assert!((mean(&|p| p[0] * p[1]) - 1.0 / 12.0).abs() < 3e-3);
    }

    #[test]
    fn a_seed_gives_the_same_points_and_degenerate_triangles_none() {
        let mut mesh = shapes::icosahedron();
        assert_eq!(samples(&mesh, 100, 3), samples(&mesh, 100, 3));
        assert_ne!(samples(&mesh, 100, 3), samples(&mesh, 100, 4));
        mesh.positions.push([9.0; 3]);
        mesh.faces.extend([[12, 12, 12], [0, 12, 0]]);
        assert!(samples(&mesh, 1000, 3).iter().all(|p| p.iter().all(|x| x.abs() <= 1.0)));
    }
}
