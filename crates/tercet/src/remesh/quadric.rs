//! Sums of squared distances from planes (Garland and Heckbert 1997).

use std::ops::{Add, AddAssign};

use glam::{DMat3, DVec3};

/// The quadratic function p ↦ pᵀ A p + 2 b·p + c: weighted squared distances from planes.
#[derive(Clone, Copy, Debug)]
pub(super) struct Quadric {
    a: DMat3,
    b: DVec3,
    c: f64,
    /// What the planes' weights sum to: an area.
    pub weight: f64,
}

impl Quadric {
    /// No planes.
    pub const ZERO: Quadric = Quadric { a: DMat3::ZERO, b: DVec3::ZERO, c: 0.0, weight: 0.0 };

    /// The squared distance from the plane through `p` with unit normal `normal`, times `weight`.
    pub fn plane(p: DVec3, normal: DVec3, weight: f64) -> Self {
        let d = -normal.dot(p);
        Quadric {
            a: DMat3::from_cols(normal * normal.x, normal * normal.y, normal * normal.z) * weight,
            b: normal * (d * weight),
            c: d * d * weight,
            weight,
        }
    }

    /// Its value at `p`; rounding may make it negative.
    pub fn at(&self, p: DVec3) -> f64 {
        p.dot(self.a * p) + 2.0 * self.b.dot(p) + self.c
    }
}

impl Add for Quadric {
    type Output = Quadric;

    fn add(self, other: Quadric) -> Quadric {
        Quadric {
            a: self.a + other.a,
            b: self.b + other.b,
            c: self.c + other.c,
            weight: self.weight + other.weight,
        }
    }
}

impl AddAssign for Quadric {
    fn add_assign(&mut self, other: Quadric) {
        *self = *self + other;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn planes_add_up_to_their_squared_distances() {
        let sum = Quadric::plane(DVec3::new(1.0, 0.0, 0.0), DVec3::X, 2.0)
            + Quadric::plane(DVec3::new(5.0, 3.0, 0.0), DVec3::Y, 0.5);
        assert!((sum.at(DVec3::new(4.0, 1.0, 9.0)) - (2.0 * 9.0 + 0.5 * 4.0)).abs() < 1e-12);
        assert_eq!(sum.weight, 2.5);
    }
}
