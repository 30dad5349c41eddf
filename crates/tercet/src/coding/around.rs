//! What the tables know around a vertex before it is coded.
//!
//! All of it is made of sums and masks over the six places of a [site](super::site), so that which of them are
//! known is not branched on.

use super::site::Site;
use super::vector::{Point, Vector};
use crate::subdivide::FRACTION_BITS;
use wide::i32x4;

/// How much of each wing's error to expect again, in 1/256, by the number of wings that have one.
const SHARE: [i64; 4] = [0, 48, 36, 28];

/// What is known around a vertex.
pub(super) struct Around {
    /// Where it is expected, in 1/256, and its rounded estimate.
    pub expected: Vector,
    pub origin: Point,
    /// Of the surface, below 2¹⁵.
    pub normal: Vector,
    pub at_boundary: bool,
    pub parallelograms: Parallelograms,
}

/// The vertices that are known.
pub(super) struct Known<'a> {
    /// They are those from `virtuals` to the next one, which is `v`; in a group, of its pass only what it has coded.
    pub virtuals: u32,
    pub v: u32,
    /// From here on they belong to this pass and had estimates, if it has any.
    pub first: u32,
    pub positions: &'a [Point],
    pub estimates: &'a [Vector],
}

impl Known<'_> {
    /// Whether a vertex of this pass has a smaller number.
    #[inline(always)]
    pub fn is_told(&self, vertex: u32) -> bool {
        vertex.wrapping_sub(self.first) < self.v - self.first
    }
}

impl Around {
    /// Of the vertex at `site`; nothing if no corner is known.
    #[inline(always)]
    pub fn new(site: &Site, known: &Known) -> Option<Self> {
        let &Known { virtuals, v, first, positions, estimates } = known;
        // One comparison: virtual vertices are the largest numbers here.
        let mask = |x: u32| -((x.wrapping_sub(virtuals) < v - virtuals) as i32);
        let origin = positions[v as usize];
        let place = |x: u32| offset(positions[x as usize], origin);
        let masks = site.corners.map(mask);
        if masks == [0; 3] {
            return None;
        }
        let corners = site.corners.map(place);
        let expected = match estimates.get((v - first) as usize) {
            Some(&estimate) => estimate,
            None => middle(corners, masks, origin),
        };
        Some(Around {
            expected,
            origin,
            normal: site.normal(virtuals, |w| positions[w as usize]),
            at_boundary: site.corners.iter().any(|&a| a < virtuals),
            parallelograms: Parallelograms::new(corners, masks, site.wings.map(place), site.wings.map(mask)),
        })
    }
}

/// A share of how far estimates nearby were off, by which another is to be moved.
pub(super) struct Correction {
    estimate: Vector,
    shift: Vector,
    /// How large the sum of the wings' errors is, |x| + |y| + |z| in 1/256, and of how many wings it is.
    pub magnitude: u64,
    pub count: usize,
}

impl Correction {
    /// Of the vertex at `site`, in a pass that has estimates: by the errors of those wings that are vertices of the pass
    /// and known: `told`.
    #[inline(always)]
    pub fn new(site: &Site, known: &Known, told: impl Fn(u32) -> bool) -> Self {
        let &Known { v, first, positions, estimates, .. } = known;
        let own = (v - first) as usize;
        let mut error = [0; 3];
        let mut count = 0;
        for &a in &site.wings {
            let has_error = told(a);
            let from = &estimates[if has_error { (a - first) as usize } else { own }];
            let mask = -(has_error as i64);
            let at = positions[a as usize].map(|x| (x as i64) << FRACTION_BITS);
            error = [0, 1, 2].map(|i| error[i] + ((at[i] - from[i]) & mask));
            count += has_error as usize;
        }
        let share = SHARE[count & 3];
        Correction {
            estimate: estimates[own],
            shift: error.map(|x| (x * share) >> 8),
            magnitude: error.iter().map(|x| x.unsigned_abs()).sum(),
            count,
        }
    }
}

impl Correction {
    /// The estimate, moved.
    #[inline(always)]
    pub fn expected(&self) -> Vector {
        [0, 1, 2].map(|i| self.estimate[i] + self.shift[i])
    }

    /// The estimate, moved along the `normal`, whose components are below 2¹⁵, by twice its part of the share; across it
    /// hardly at all: what errors in the surface have in common is their roundings.
    #[inline(always)]
    pub fn expected_along(&self, normal: Vector) -> Vector {
        let square: i64 = normal.iter().map(|x| x * x).sum();
        if square == 0 {
            return self.expected();
        }
        let shift = self.shift.map(|x| x.clamp(-FARTHEST, FARTHEST));
        let product: i64 = shift.iter().zip(normal).map(|(x, y)| x * y).sum();
        // The product is below 2⁴³; one division, the slowest of what is done here, serves three axes.
        let ratio = (product << RATIO_BITS) / square;
        [0, 1, 2].map(|i| {
            let along = (ratio * normal[i]) >> RATIO_BITS;
            self.estimate[i] + 2 * along + (shift[i] - along).clamp(-ACROSS, ACROSS)
        })
    }
}

/// Shares of errors are held below this, 2¹⁸ steps.
const FARTHEST: i64 = 1 << 26;
const RATIO_BITS: u32 = 20;

/// In the surface an estimate is moved by no more than this on each axis, an eighth of a step.
const ACROSS: i64 = 32;

/// Known points are within 2²⁹ of one another; only estimates in a damaged file could leave 32 bits.
#[inline(always)]
fn offset(p: Point, origin: Point) -> Point {
    [0, 1, 2].map(|i| p[i].wrapping_sub(origin[i]))
}

/// The mean of the known corners, which are relative to `origin`, in 1/256. There is one at least.
#[cold]
fn middle(corners: [Point; 3], masks: [i32; 3], origin: Point) -> Vector {
    let count = -masks.iter().sum::<i32>() as i64;
    [0, 1, 2].map(|axis| {
        let there = corners.iter().zip(masks).map(|(x, mask)| (x[axis] & mask) as i64);
        ((origin[axis] as i64) << FRACTION_BITS) + (there.sum::<i64>() << FRACTION_BITS) / count
    })
}

/// The parallelograms that the corners of a site make with its wings, relative to the rounded estimate of its vertex, axis
/// by axis: points whose coordinates may be the vertex's own.
pub(super) struct Parallelograms([i32x4; 3]);

impl Parallelograms {
    /// The offset of a point that is not there: farther than any on a surface whose coordinates are not nearly as large.
    const NONE: i32 = 1 << 30;

    #[inline(always)]
    fn new(corners: [Point; 3], known: [i32; 3], wings: [Point; 3], known_wings: [i32; 3]) -> Self {
        let there = |k: usize| known_wings[k] & known[(k + 1) % 3] & known[(k + 2) % 3];
        let there = i32x4::new([there(0), there(1), there(2), 0]);
        let none = !there & i32x4::splat(Self::NONE);
        let ([p, q, r], [a, b, c]) = (corners, wings);
        let offsets = |axis: usize| {
            let one = i32x4::new([q[axis], r[axis], p[axis], 0]);
            let other = i32x4::new([r[axis], p[axis], q[axis], 0]);
            let beyond = i32x4::new([a[axis], b[axis], c[axis], 0]);
            ((one + other - beyond) & there) | none
        };
        Parallelograms([offsets(0), offsets(1), offsets(2)])
    }

    /// How far each point is from `middle` on an axis.
    #[inline(always)]
    pub fn from(&self, axis: usize, middle: i64) -> i32x4 {
        self.0[axis] - i32x4::splat(middle as i32)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn moved(shift: Vector, normal: Vector) -> Vector {
        Correction { estimate: [0; 3], shift, magnitude: 0, count: 1 }.expected_along(normal)
    }

    #[test]
    fn corrections_count_twice_along_the_normal_and_hardly_across_it() {
        assert_eq!(moved([1000, -20, 70], [16_384, 0, 0]), [2000, -20, 32]);
        assert_eq!(moved([-300, -300, 0], [9000, 9000, 0]), [-600, -600, 0]);
        assert_eq!(moved([-300, 300, 0], [9000, 9000, 0]), [-32, 32, 0]);
        assert_eq!(moved([-300, 300, 9], [0; 3]), [-300, 300, 9], "there is no normal at a boundary");
    }

    #[test]
    fn corrections_of_any_size_are_held() {
        let (far, long) = (i64::MAX >> 3, (1 << 15) - 1);
        for normal in [[long; 3], [long, -long, long], [1, 0, 0], [1, -1, long]] {
            for shift in [[far; 3], [-far; 3], [far, -far, 0]] {
                assert!(moved(shift, normal).iter().all(|x| x.abs() <= 4 * FARTHEST));
            }
        }
    }
}
