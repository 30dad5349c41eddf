//! Where the new vertex of a split face is expected, before its neighbourhood is known.
//!
//! Inside: the barycentre, raised along the vertex normals as a curved patch through the three
//! corners would be (after Vlachos et al., "Curved PN triangles", 2001). Where one corner is
//! virtual the new vertex lies on the boundary: the midpoint of the real edge.

use super::sketch::Sketch;
use super::vector::{Point, Vector, dot, sub};
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
    let faces = surface.vertex.as_chunks().0.iter().zip(split);
    for (t, _) in faces.filter(|&(_, &split)| split) {
        estimates.push(if surface.any_virtual::<3>(t) {
            let k = t.iter().position(|&v| surface.is_virtual(v)).unwrap_or(0);
            midpoint(surface, positions, t[(k + 1) % 3], t[(k + 2) % 3])
        } else {
            raised(t.map(|v| positions[v as usize]), t.map(normal))
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
    let (q, r) = (sub(p[1], p[0]), sub(p[2], p[0]));
    // Three times the way from the barycentre to each corner.
    let ways = [[-1, -1], [2, -1], [-1, 2]].map(|[a, b]| [0, 1, 2].map(|k| a * q[k] + b * r[k]));
    let mut bulge = [0; 3];
    for (way, normal) in ways.into_iter().zip(n) {
        let normal = normal.map(i64::from);
        // Along the normal three times the height of the corner over the barycentre, in 1/2¹⁴.
        let height = dot(way, normal) >> 14;
        bulge = [0, 1, 2].map(|k| bulge[k] + height * normal[k]);
    }
    // 0.6 of the mean height: 0.6 / 9 = 4369 / 2¹⁶.
    [0, 1, 2].map(|k| {
        let sum = 3 * p[0][k] as i64 + q[k] + r[k];
        third(sum << FRACTION_BITS) + ((bulge[k] * 4369) >> (14 + 16 - FRACTION_BITS))
    })
}

/// ⌊x / 3⌋ of a number below 2⁴⁸ in magnitude: as a quotient without a sign, which takes half the instructions.
#[inline(always)]
fn third(x: i64) -> i64 {
    const BIAS: i64 = 1 << 48;
    ((x + 3 * BIAS) as u64 / 3) as i64 - BIAS
}

#[cfg(test)]
mod tests {
    use super::super::vector::COORDINATE_LIMIT;
    use super::*;
    use proptest::prelude::*;

    fn corners() -> impl Strategy<Value = [Point; 3]> {
        let point = || prop::array::uniform3(-COORDINATE_LIMIT..=COORDINATE_LIMIT);
        prop_oneof![
            prop::array::uniform3(point()),
            (point(), prop::array::uniform3(prop::array::uniform3(0..100))).prop_map(|(p, offsets)| {
                offsets.map(|o: Point| [0, 1, 2].map(|k| p[k].clamp(-1 << 27, 1 << 27) + o[k]))
            }),
        ]
    }

    proptest! {
        #[test]
        fn a_vertex_is_raised_by_the_heights_of_the_corners_over_the_barycentre(
            p in corners(),
            n in prop::array::uniform3(prop::array::uniform3(-(1i16 << 14)..=1 << 14)),
        ) {
            let sum = [0, 1, 2].map(|k| p.iter().map(|p| p[k] as i64).sum::<i64>());
            let mut bulge = [0i64; 3];
            for i in 0..3 {
                let height: i64 = (0..3).map(|k| (3 * p[i][k] as i64 - sum[k]) * n[i][k] as i64).sum();
                (0..3).for_each(|k| bulge[k] += (height >> 14) * n[i][k] as i64);
            }
            let third = sum.map(|x| (x << FRACTION_BITS).div_euclid(3));
            let expected = [0, 1, 2].map(|k| third[k] + ((bulge[k] * 4369) >> (30 - FRACTION_BITS)));
            prop_assert_eq!(raised(p, n), expected);
        }

        #[test]
        fn thirds_are_rounded_down(x in -(1i64 << 48)..=1 << 48) {
            prop_assert_eq!(third(x), x.div_euclid(3));
        }
    }
}
