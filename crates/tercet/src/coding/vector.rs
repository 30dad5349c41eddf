//! Integer vectors on the lattice.
//!
//! Coordinates stay below 2²⁸ in magnitude, so that differences fit 29 bits, their cross
//! products 60 and sums of eight of those an `i64`.

/// A lattice point.
pub(crate) type Point = [i32; 3];

/// A difference, sum or product of lattice points.
pub(crate) type Vector = [i64; 3];

/// Coordinates are kept within ± this.
pub(crate) const COORDINATE_LIMIT: i32 = 1 << 28;

#[inline(always)]
pub(crate) fn sub(a: Point, b: Point) -> Vector {
    [0, 1, 2].map(|k| a[k] as i64 - b[k] as i64)
}

#[inline(always)]
pub(crate) fn cross(a: Vector, b: Vector) -> Vector {
    [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
}

#[inline(always)]
pub(crate) fn dot(a: Vector, b: Vector) -> i64 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

/// Adds within the range of an `i64`: the sum over a fan of thousands could leave it.
#[inline(always)]
pub(crate) fn add_to(sum: &mut Vector, a: Vector) {
    for k in 0..3 {
        sum[k] = sum[k].saturating_add(a[k]);
    }
}

/// Shifts `a` right until every component is below 2³⁰; returns the shift.
#[inline(always)]
pub(crate) fn shrink(a: Vector) -> (Vector, u32) {
    let all = a[0].unsigned_abs() | a[1].unsigned_abs() | a[2].unsigned_abs();
    let shift = 34u32.saturating_sub(all.leading_zeros());
    (a.map(|x| x >> shift), shift)
}

/// a / |a| in 1/2¹⁴; zero stays zero.
#[inline]
pub(crate) fn unit(a: Vector) -> [i32; 3] {
    let (a, _) = shrink(a);
    let length = dot(a, a).unsigned_abs().isqrt() as i64;
    if length == 0 { [0; 3] } else { a.map(|x| ((x << 14) / length) as i32) }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lengths_hold_at_both_ends_of_the_range() {
        let far = COORDINATE_LIMIT;
        let huge = cross(sub([far, -far, far], [-far, far, -far]), sub([-far, -far, far], [far, far, -far]));
        assert_eq!(unit([0, 0, -7]), [0, 0, -(1 << 14)]);
        assert_eq!(unit([0; 3]), [0; 3]);
        let exact = huge.iter().map(|&x| (x as f64) * (x as f64)).sum::<f64>().sqrt();
        for (x, y) in unit(huge).into_iter().zip(huge) {
            assert!((x as f64 - y as f64 / exact * 16384.0).abs() < 2.0);
        }
    }
}
