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
const SHARE: [i64; NEW] = [0, 48, 36, 28];

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
    /// From here on they belong to this pass and have errors.
    pub first: u32,
    pub positions: &'a [Point],
    pub rough: &'a [Roughness],
    pub errors: &'a [[i32; 3]],
}

impl Around {
    /// Of the vertex at `site`, which has an estimate or not; nothing if no neighbour is known.
    #[inline(always)]
    pub fn new(site: &Site, estimate: Option<&Vector>, known: &Known) -> Option<Self> {
        let &Known { virtuals, v, first, positions, rough, errors } = known;
        // One comparison: virtual vertices are the largest numbers here.
        let mask = |x: u32| -((x.wrapping_sub(virtuals) < v - virtuals) as i32);
        let origin = positions[v as usize];
        let [mut neighbours, mut parallelograms] = [Points::EMPTY; 2];
        let (mut count, mut distance, mut tangential, mut normal) = (0, 0, 0, 0);
        let (mut error, mut new) = ([0; 3], 0);
        let mut places = [[0; 3]; 3];
        let mut masks = [0; 3];
        for (k, &a) in site.corners.iter().enumerate() {
            let mask = mask(a);
            count -= mask;
            let place = offset(positions[a as usize], origin);
            distance += place.iter().map(|x| (x.unsigned_abs() & mask as u32) as u64).sum::<u64>();
            tangential += rough[a as usize].tangential & mask as u32;
            normal += rough[a as usize].normal & mask as u32;
            neighbours.set(k, place, mask);
            (places[k], masks[k]) = (place, mask);
        }
        if count == 0 {
            return None;
        }
        let edge = (distance << FRACTION_BITS) * RECIPROCAL[count as usize & 7] >> 16;
        for (k, &a) in site.wings.iter().enumerate() {
            let mask = mask(a);
            let place = offset(positions[a as usize], origin);
            neighbours.set(3 + k, place, mask);
            let (i, j) = ((k + 1) % 3, (k + 2) % 3);
            let [p, q] = [places[i], places[j]];
            let parallelogram = [0, 1, 2].map(|x| p[x].wrapping_add(q[x]).wrapping_sub(place[x]));
            parallelograms.set(k, parallelogram, mask & masks[i] & masks[j]);
            tangential += rough[a as usize].tangential & mask as u32;
            normal += rough[a as usize].normal & mask as u32;
            count -= mask;
            if estimate.is_some() {
                // Its own error is 0 as yet.
                let is_new = a.wrapping_sub(first) < v - first;
                let from = errors[(if is_new { a } else { v } - first) as usize];
                error = [0, 1, 2].map(|i| error[i] + from[i] as i64);
                new += is_new as usize;
            }
        }
        let mean = |x: u32| ((x as u64 * RECIPROCAL[count as usize & 7]) >> 16) as u32;
        let expected = match estimate {
            Some(e) => [0, 1, 2].map(|i| e[i] + ((error[i] * SHARE[new & 3]) >> 8)),
            None => middle(&places, &masks, origin),
        };
        Some(Around {
            expected,
            origin,
            normal: site.normal.map(i64::from),
            at_boundary: site.corners.iter().any(|&a| a < virtuals),
            place: new * SIZES + bin(edge + 1, 2, -7, SIZES),
            // |x| + |y| + |z| is some 3/2 of the length.
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

/// The mean of the points that lie at the `places` from `origin` that are known, in 1/256.
#[cold]
fn middle(places: &[Point; 3], masks: &[i32; 3], origin: Point) -> Vector {
    let count = -masks.iter().sum::<i32>() as i64;
    [0, 1, 2].map(|i| {
        let sum: i64 = places.iter().zip(masks).map(|(p, mask)| (p[i] & mask) as i64).sum();
        ((origin[i] as i64) << FRACTION_BITS) + (sum << FRACTION_BITS) / count.max(1)
    })
}

/// Points relative to the rounded estimate of a vertex, axis by axis.
pub(super) struct Points {
    offsets: [[i32; 8]; 3],
}

impl Points {
    /// Offsets are held above this …
    const FAR: i16 = 1 << 13;
    /// … and below this, which a point that is not there has.
    const NONE: i16 = 1 << 14;

    const EMPTY: Points = Points { offsets: [[i32::MAX; 8]; 3] };

    /// Sets the `k`th point if `mask` is all ones; it is 0 if the point is not there.
    #[inline(always)]
    fn set(&mut self, k: usize, point: Point, mask: i32) {
        for (offsets, x) in self.offsets.iter_mut().zip(point) {
            offsets[k] = (x & mask) | (!mask & i32::MAX);
        }
    }

    /// How far each point is from `middle` on an axis, in 16 bits: points that are not there, and
    /// those far away, are farther than 2¹².
    #[inline(always)]
    pub fn from(&self, axis: usize, middle: i64) -> i16x8 {
        let far = Self::FAR as i64;
        i16x8::from_i32x8_saturate(i32x8::new(self.offsets[axis]))
            .max(i16x8::splat(-Self::FAR))
            .min(i16x8::splat(Self::NONE))
            - i16x8::splat(middle.clamp(-far, far) as i16)
    }
}
