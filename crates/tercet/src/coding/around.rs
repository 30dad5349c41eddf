//! What the fast profile knows around a vertex before it is coded.
//!
//! All of it is made of sums and masks over six places, so that which of them are known is not branched on.

use super::pass::Roughness;
use super::scale::bin;
use super::site::Site;
use super::vector::{Point, Vector};
use crate::subdivide::FRACTION_BITS;
use wide::{i16x8, i32x8};

/// Values of [`Around::place`].
pub(super) const PLACES: usize = NEW * SIZES;
const NEW: usize = 4;
const SIZES: usize = 32;

/// 65536 / n.
const RECIPROCAL: [u64; 8] = [0, 65536, 32768, 21845, 16384, 13107, 10922, 0];

/// How much of each neighbour's error to expect again, in 1/256, by the number of neighbours.
pub(super) const SHARE: [i64; NEW] = [0, 48, 36, 28];

/// What is known around a vertex.
pub(super) struct Around {
    /// Where it is expected, in 1/256, and its rounded estimate.
    pub expected: Vector,
    pub origin: Point,
    /// Of the surface, below 2¹⁵.
    pub normal: Vector,
    pub at_boundary: bool,
    /// How many neighbours are coded as it is, and how far neighbours are: digits of a context.
    pub place: usize,
    /// Mean distance of the known neighbours in 1/256, and their mean roughness.
    pub edge: u64,
    pub rough: Roughness,
    /// The known neighbours, and the parallelograms that they make.
    pub neighbours: Points,
    pub parallelograms: Points,
}

/// The vertices that are known, and how far they were off.
pub(super) struct Known<'a> {
    /// They are those from `virtuals` to the next one, which is `v`.
    pub virtuals: u32,
    pub v: u32,
    /// From here on they belong to this pass and had estimates, if it has any.
    pub first: u32,
    pub positions: &'a [Point],
    pub rough: &'a [Roughness],
    pub estimates: &'a [Vector],
}

impl Around {
    /// Of the vertex at `site`; nothing if no neighbour is known.
    #[inline(always)]
    pub fn new(site: &Site, known: &Known) -> Option<Self> {
        let &Known { virtuals, v, first, positions, rough, estimates } = known;
        // One comparison: virtual vertices are the largest numbers here.
        let mask = |x: u32| -((x.wrapping_sub(virtuals) < v - virtuals) as i32);
        let origin = positions[v as usize];
        let estimate = estimates.get((v - first) as usize);
        let [mut neighbours, mut parallelograms] = [Points::EMPTY; 2];
        let (mut count, mut distance, mut tangential, mut normal) = (0, 0, 0, 0);
        let (mut error, mut new) = ([0; 3], 0);
        for (k, &a) in site.corners.iter().enumerate() {
            let mask = mask(a);
            let place = offset(positions[a as usize], origin);
            distance += place.iter().map(|x| (x.unsigned_abs() & mask as u32) as u64).sum::<u64>();
            tangential += rough[a as usize].tangential & mask as u32;
            normal += rough[a as usize].normal & mask as u32;
            count -= mask;
            neighbours.set(k, place, mask);
        }
        if count == 0 {
            return None;
        }
        // |x| + |y| + |z| is some 3/2 of the length.
        let edge = ((distance << FRACTION_BITS) * RECIPROCAL[count as usize & 7]) >> 16;
        for (k, &a) in site.wings.iter().enumerate() {
            let mask = mask(a);
            let place = offset(positions[a as usize], origin);
            tangential += rough[a as usize].tangential & mask as u32;
            normal += rough[a as usize].normal & mask as u32;
            count -= mask;
            neighbours.set(3 + k, place, mask);
            let (p, q) = (neighbours.get((k + 1) % 3), neighbours.get((k + 2) % 3));
            let opposite = [0, 1, 2].map(|i| p.0[i].wrapping_add(q.0[i]).wrapping_sub(place[i]));
            parallelograms.set(k, opposite, mask & p.1 & q.1);
            if estimate.is_some() {
                let is_new = a.wrapping_sub(first) < v - first;
                let from = &estimates[(if is_new { a } else { v } - first) as usize];
                let mask = -(is_new as i64);
                let at = positions[a as usize].map(|x| (x as i64) << FRACTION_BITS);
                error = [0, 1, 2].map(|i| error[i] + ((at[i] - from[i]) & mask));
                new += is_new as usize;
            }
        }
        let mean = |x: u32| ((x as u64 * RECIPROCAL[count as usize & 7]) >> 16) as u32;
        let expected = match estimate {
            Some(e) => [0, 1, 2].map(|i| e[i] + ((error[i] * SHARE[new & 3]) >> 8)),
            None => neighbours.middle(origin),
        };
        Some(Around {
            expected,
            origin,
            normal: site.normal(virtuals, |w| positions[w as usize]),
            at_boundary: site.corners.iter().any(|&a| a < virtuals),
            place: new * SIZES + bin(edge + 1, 2, -7, SIZES),
            edge,
            rough: Roughness { tangential: mean(tangential), normal: mean(normal) },
            neighbours,
            parallelograms,
        })
    }
}

/// Known points are within 2²⁹ of one another; only estimates in a damaged file could leave 32 bits.
#[inline(always)]
fn offset(p: Point, origin: Point) -> Point {
    [0, 1, 2].map(|i| p[i].wrapping_sub(origin[i]))
}

/// Points relative to the rounded estimate of a vertex, axis by axis.
pub(super) struct Points {
    offsets: [[i32; 8]; 3],
    /// All ones where there is a point.
    masks: [i16; 8],
}

impl Points {
    /// Offsets are held above this …
    const FAR: i16 = 1 << 13;
    /// … and below this, which a point that is not there has.
    const NONE: i16 = 1 << 14;

    const EMPTY: Points = Points { offsets: [[0; 8]; 3], masks: [0; 8] };

    /// Sets the `k`th point, which is there if `mask` is all ones.
    #[inline(always)]
    fn set(&mut self, k: usize, point: Point, mask: i32) {
        for (offsets, x) in self.offsets.iter_mut().zip(point) {
            offsets[k] = x;
        }
        self.masks[k] = mask as i16;
    }

    /// The `k`th point and its mask.
    #[inline(always)]
    fn get(&self, k: usize) -> (Point, i32) {
        ([0, 1, 2].map(|axis| self.offsets[axis][k]), self.masks[k] as i32)
    }

    /// How far each point is from `middle` on an axis, in 16 bits: points that are not there, and
    /// those far away, are farther than 2¹².
    #[inline(always)]
    pub fn from(&self, axis: usize, middle: i64) -> i16x8 {
        let far = Self::FAR as i64;
        let held = i16x8::from_i32x8_saturate(i32x8::new(self.offsets[axis]))
            .max(i16x8::splat(-Self::FAR))
            .min(i16x8::splat(Self::NONE));
        let masks = i16x8::new(self.masks);
        let held = (held & masks) | (!masks & i16x8::splat(Self::NONE));
        held - i16x8::splat(middle.clamp(-far, far) as i16)
    }

    /// The mean of the points, which are relative to `origin`, in 1/256. There is one at least.
    #[cold]
    fn middle(&self, origin: Point) -> Vector {
        let count = -self.masks.iter().map(|&mask| mask as i64).sum::<i64>();
        [0, 1, 2].map(|axis| {
            let there = self.offsets[axis].iter().zip(self.masks).map(|(x, mask)| (x & mask as i32) as i64);
            ((origin[axis] as i64) << FRACTION_BITS) + (there.sum::<i64>() << FRACTION_BITS) / count
        })
    }
}
