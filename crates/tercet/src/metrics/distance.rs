//! Squared distances of a point from segments and triangles.
//!
//! The answers go into files, so they must not depend on the platform: only `+ − · /` on
//! `f64`, which IEEE 754 defines to the last bit, in a fixed order and never contracted.

pub(super) type Vector = [f64; 3];

pub(super) fn sub(a: Vector, b: Vector) -> Vector {
    [a[0] - b[0], a[1] - b[1], a[2] - b[2]]
}

pub(super) fn dot(a: Vector, b: Vector) -> f64 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

pub(super) fn cross(a: Vector, b: Vector) -> Vector {
    [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
}

/// a − s · b
fn less(a: Vector, s: f64, b: Vector) -> Vector {
    [a[0] - s * b[0], a[1] - s * b[1], a[2] - s * b[2]]
}

/// Where on a triangle the point nearest to another one lies.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Feature {
    Inside,
    /// Inside the edge opposite to this corner.
    Edge(u32),
    Corner(u32),
}

/// The point of a segment or triangle that is nearest to another point.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Nearest {
    /// The squared distance between the two.
    pub square: f64,
    pub feature: Feature,
    /// From the nearest point to the other one.
    pub off: Vector,
}

impl Nearest {
    fn new(off: Vector, feature: Feature) -> Self {
        Nearest { square: dot(off, off), feature, off }
    }
}

/// From the edge opposite to `corner` of a triangle, which runs from `a` to `b` and may be a point.
pub(super) fn to_edge(p: Vector, a: Vector, b: Vector, corner: u32) -> Nearest {
    from_edge(sub(p, a), sub(b, a), corner)
}

/// As [`to_edge`], from the origin to `end`.
fn from_edge(p: Vector, end: Vector, corner: u32) -> Nearest {
    let square = dot(end, end);
    let along = if square > 0.0 { (dot(p, end) / square).clamp(0.0, 1.0) } else { 0.0 };
    let feature = match along {
        0.0 => Feature::Corner((corner + 1) % 3),
        1.0 => Feature::Corner((corner + 2) % 3),
        _ => Feature::Edge(corner),
    };
    Nearest::new(less(p, along, end), feature)
}

/// From the triangle (a, b, c), which may be degenerate.
///
/// With p's foot in the triangle's plane written as a + (s · ab + t · ac) / det, the foot lies
/// inside if s, t ≥ 0 and s + t ≤ det; otherwise the nearest point is on an edge beyond which
/// the foot lies. Whatever rounding does to s and t, the answer is the distance from a point of
/// the triangle; it is 0 if `p` is one of its corners.
pub(super) fn to_triangle(p: Vector, [a, b, c]: [Vector; 3]) -> Nearest {
    let (ab, ac, ap) = (sub(b, a), sub(c, a), sub(p, a));
    let (bb, bc, cc) = (dot(ab, ab), dot(ab, ac), dot(ac, ac));
    let (pb, pc) = (dot(ap, ab), dot(ap, ac));
    let det = bb * cc - bc * bc;
    let s = pb * cc - pc * bc;
    let t = bb * pc - bc * pb;
    let degenerate = det <= 0.0;
    if !degenerate && s >= 0.0 && t >= 0.0 && s + t <= det {
        return Nearest::new(less(less(ap, s / det, ab), t / det, ac), Feature::Inside);
    }
    let mut best = Nearest { square: f64::INFINITY, feature: Feature::Inside, off: ap };
    let mut take = |found: Nearest| {
        if found.square < best.square {
            best = found;
        }
    };
    if degenerate || s + t > det {
        take(to_edge(p, b, c, 0));
    }
    if degenerate || s < 0.0 {
        // From a to c, so that a is the origin: the corners have to be swapped.
        let found = from_edge(ap, ac, 1);
        take(Nearest { feature: mirrored(found.feature), ..found });
    }
    if degenerate || t < 0.0 {
        take(from_edge(ap, ab, 2));
    }
    best
}

/// The edge opposite to corner 1, taken from corner 0 to corner 2.
fn mirrored(feature: Feature) -> Feature {
    match feature {
        Feature::Corner(k) => Feature::Corner(2 - k),
        other => other,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    const TRIANGLE: [Vector; 3] = [[0.0, 0.0, 0.0], [4.0, 0.0, 0.0], [0.0, 2.0, 0.0]];

    fn square(p: Vector, triangle: [Vector; 3]) -> f64 {
        to_triangle(p, triangle).square
    }

    #[test]
    fn each_feature_of_a_triangle_is_nearest_somewhere() {
        use Feature::{Corner, Edge, Inside};
        for (p, squared, feature) in [
            ([1.0, 0.5, 3.0], 9.0, Inside),
            ([2.0, -1.0, 2.0], 5.0, Edge(2)),
            ([-1.0, 1.0, 0.0], 1.0, Edge(1)),
            ([3.0, 3.0, 0.0], 5.0, Edge(0)),
            ([-1.0, -2.0, 2.0], 9.0, Corner(0)),
            ([6.0, -1.0, 0.0], 5.0, Corner(1)),
            ([0.0, 5.0, 4.0], 25.0, Corner(2)),
        ] {
            for turn in 0..3 {
                let turned = [0, 1, 2].map(|k| TRIANGLE[(k + turn) % 3]);
                let back = |k: u32| (k + 3 - turn as u32) % 3;
                let expected = match feature {
                    Inside => Inside,
                    Edge(k) => Edge(back(k)),
                    Corner(k) => Corner(back(k)),
                };
                let found = to_triangle(p, turned);
                assert!((found.square - squared).abs() < 1e-12, "{p:?}: {found:?}");
                assert_eq!(found.feature, expected, "{p:?}: {found:?}");
            }
        }
    }

    #[test]
    fn a_degenerate_triangle_is_its_longest_edge() {
        let [a, b] = [[0.0; 3], [2.0, 0.0, 0.0]];
        for triangle in [[a, b, a], [a, b, b], [a, a, b], [a, b, [1.0, 0.0, 0.0]]] {
            assert_eq!(square([1.0, 3.0, 0.0], triangle), 9.0);
            assert_eq!(square([5.0, 4.0, 0.0], triangle), 25.0);
        }
        assert_eq!(square([3.0, 4.0, 0.0], [a, a, a]), 25.0);
    }

    fn vector() -> impl Strategy<Value = Vector> {
        prop::array::uniform3(-1e3f32..1e3).prop_map(|p| p.map(f64::from))
    }

    proptest! {
        #[test]
        fn corners_are_at_distance_zero_and_no_point_of_the_triangle_is_nearer(
            corners in prop::array::uniform3(vector()), p in vector(), u in 0.0..1.0, v in 0.0..1.0f64,
        ) {
            for corner in corners {
                prop_assert_eq!(square(corner, corners), 0.0);
            }
            let [a, b, c] = corners;
            let (s, t) = if u + v > 1.0 { (1.0 - u, 1.0 - v) } else { (u, v) };
            let off = less(less(sub(p, a), s, sub(b, a)), t, sub(c, a));
            prop_assert!(square(p, corners) <= dot(off, off) * (1.0 + 1e-9) + 1e-6);
        }
    }
}
