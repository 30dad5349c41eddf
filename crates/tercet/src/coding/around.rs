//! What the tables know around a vertex before it is coded.
//!
//! All of it is made of sums and masks over the six places of a [site](super::site), so that which of them are
//! known is not branched on.

use super::pass::Roughness;
use super::site::Site;
use super::vector::{Point, Vector};
use crate::subdivide::FRACTION_BITS;
use wide::{i16x8, i32x8};

/// 65536 / n.
const RECIPROCAL: [u64; 4] = [0, 65536, 32768, 21845];

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
    /// Mean roughness of the known corners.
    pub rough: Roughness,
    pub candidates: Candidates,
}

/// The vertices that are known, and how far they were off.
pub(super) struct Known<'a> {
    /// They are those from `virtuals` to the next one, which is `v`; in a group, of its pass only what it has coded.
    pub virtuals: u32,
    pub v: u32,
    /// From here on they belong to this pass and had estimates, if it has any.
    pub first: u32,
    pub positions: &'a [Point],
    pub rough: &'a [Roughness],
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
        let &Known { virtuals, v, positions, rough, estimates, .. } = known;
        // One comparison: virtual vertices are the largest numbers here.
        let mask = |x: u32| -((x.wrapping_sub(virtuals) < v - virtuals) as i32);
        let origin = positions[v as usize];
        let place = |x: u32| offset(positions[x as usize], origin);
        let masks = site.corners.map(mask);
        let count = -masks.iter().sum::<i32>() as usize;
        if count == 0 {
            return None;
        }
        let (mut tangential, mut normal) = (0, 0);
        for (&a, mask) in site.corners.iter().zip(masks) {
            tangential += rough[a as usize].tangential & mask as u32;
            normal += rough[a as usize].normal & mask as u32;
        }
        let mean = |x: u32| ((x as u64 * RECIPROCAL[count & 3]) >> 16) as u32;
        let corners = site.corners.map(place);
        let expected = match estimates {
            [] => middle(corners, masks, origin),
            _ => Correction::new(site, known, |vertex| known.is_told(vertex)).expected(),
        };
        Some(Around {
            expected,
            origin,
            normal: site.normal(virtuals, |w| positions[w as usize]),
            at_boundary: site.corners.iter().any(|&a| a < virtuals),
            rough: Roughness { tangential: mean(tangential), normal: mean(normal) },
            candidates: Candidates::new(corners, masks, site.wings.map(place), site.wings.map(mask)),
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

/// Points relative to the rounded estimate of a vertex whose coordinates may be its own, axis by axis: the
/// known corners, and from [`Candidates::HALF`] on the parallelograms that they make with known wings.
pub(super) struct Candidates([i16x8; 3]);

impl Candidates {
    /// Where the second half begins.
    pub const HALF: usize = 4;

    /// Offsets are held above this …
    const FAR: i16 = 1 << 13;
    /// … and below this, which a point that is not there has.
    const NONE: i16 = 1 << 14;

    #[inline(always)]
    fn new(corners: [Point; 3], known: [i32; 3], wings: [Point; 3], known_wings: [i32; 3]) -> Self {
        let opposite = |k: usize| -> (Point, i32) {
            let (i, j) = ((k + 1) % 3, (k + 2) % 3);
            let (p, q, w) = (corners[i], corners[j], wings[k]);
            let point = [0, 1, 2].map(|axis| p[axis].wrapping_add(q[axis]).wrapping_sub(w[axis]));
            (point, known_wings[k] & known[i] & known[j])
        };
        let [a, b, c] = [opposite(0), opposite(1), opposite(2)];
        let masks = [known[0], known[1], known[2], 0, a.1, b.1, c.1, 0];
        let masks = i16x8::new(masks.map(|mask| mask as i16));
        let none = !masks & i16x8::splat(Self::NONE);
        Candidates([0, 1, 2].map(|axis| {
            let x = |point: Point| point[axis];
            let [p, q, r] = corners.map(x);
            let offsets = i32x8::new([p, q, r, 0, x(a.0), x(b.0), x(c.0), 0]);
            let held = i16x8::from_i32x8_saturate(offsets)
                .max(i16x8::splat(-Self::FAR))
                .min(i16x8::splat(Self::NONE));
            (held & masks) | none
        }))
    }

    /// How far each point is from `middle` on an axis, in 16 bits: points that are not there, and
    /// those far away, are farther than 2¹².
    #[inline(always)]
    pub fn from(&self, axis: usize, middle: i64) -> i16x8 {
        let far = Self::FAR as i64;
        self.0[axis] - i16x8::splat(middle.clamp(-far, far) as i16)
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
