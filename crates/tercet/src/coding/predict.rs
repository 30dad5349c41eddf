//! Where the new vertex of a split face is expected, before its neighbourhood is known.
//!
//! Inside: the barycentre, raised along the vertex normals as a curved patch through the three
//! corners would be (after Vlachos et al., "Curved PN triangles", 2001). Where one corner is
//! virtual the new vertex lies on the boundary: the midpoint of the real edge.

use super::sketch::Sketch;
use super::vector::{Point, Vector};
use crate::mesh::Surface;
use crate::subdivide::FRACTION_BITS;

/// The estimate for each split face, in face order; time O(n).
pub(crate) fn estimate(
    surface: &Surface,
    positions: &[Point],
    sketch: &Sketch,
    split: &[bool],
) -> Vec<Vector> {
    let normal = |v: u32| sketch.vertex[v as usize].normal;
    let mut estimates = Vec::with_capacity(split.iter().filter(|&&s| s).count());
    for f in (0..surface.faces()).filter(|&f| split[f as usize]) {
        let t = surface.face(f);
        estimates.push(match t.iter().position(|&v| surface.is_virtual(v)) {
            Some(k) => midpoint(surface, positions, t[(k + 1) % 3], t[(k + 2) % 3]),
            None => raised(t.map(|v| positions[v as usize]), t.map(normal)),
        });
    }
    estimates
}

fn midpoint(surface: &Surface, positions: &[Point], a: u32, b: u32) -> Vector {
    // Only a damaged file has faces with two virtual corners.
    let at = |v: u32| if surface.is_virtual(v) { [0; 3] } else { positions[v as usize] };
    let (p, q) = (at(a), at(b));
    [0, 1, 2].map(|k| (p[k] as i64 + q[k] as i64) << (FRACTION_BITS - 1))
}

fn raised(p: [Point; 3], n: [[i16; 3]; 3]) -> Vector {
    let sum = [0, 1, 2].map(|k| p[0][k] as i64 + p[1][k] as i64 + p[2][k] as i64);
    let mut bulge = [0i64; 3];
    for i in 0..3 {
        // Three times the height of corner i over the barycentre, along its normal, in 1/2¹⁴.
        let height: i64 = (0..3).map(|k| (3 * p[i][k] as i64 - sum[k]) * n[i][k] as i64).sum();
        for k in 0..3 {
            bulge[k] += (height >> 14) * n[i][k] as i64;
        }
    }
    // 0.6 of the mean height: 0.6 / 9 = 4369 / 2¹⁶.
    [0, 1, 2]
        .map(|k| ((sum[k] << FRACTION_BITS).div_euclid(3)) + ((bulge[k] * 4369) >> (14 + 16 - FRACTION_BITS)))
}
