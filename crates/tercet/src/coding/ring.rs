//! What is known around a vertex, and where that places it.

use super::coordinate::EXPERTS;
use super::pass::{Pass, Roughness, Turn};
use super::reciprocal::{divide, divide_signed};
use super::scale::bin;
use super::vector::{Vector, add_to, cross};
use crate::mesh::{NONE, next, prev};
use crate::subdivide::FRACTION_BITS;

/// Rings are looked at this far: a hub's further neighbours add nothing but time.
const MOST: usize = 32;

/// What is known of a vertex's ring.
pub(crate) struct Ring {
    /// The known members in order, and their coordinates by axis.
    known: [u32; MOST],
    places: [[i32; MOST]; 3],
    count: usize,
    /// Parallelogram predictions from known neighbours, by axis.
    parallelograms: [[i32; MOST]; 3],
    predictions: usize,
    /// Where all members lie: those that are not known where they are expected. Nothing for virtual ones,
    /// and where nothing is expected.
    around: [Option<Vector>; MOST],
    members: usize,
    at_boundary: bool,
}

impl Default for Ring {
    fn default() -> Self {
        Ring {
            known: [NONE; MOST],
            places: [[0; MOST]; 3],
            count: 0,
            parallelograms: [[0; MOST]; 3],
            predictions: 0,
            around: [None; MOST],
            members: 0,
            at_boundary: false,
        }
    }
}

impl Ring {
    /// Collects the ring of the vertex whose turn it is.
    pub fn gather(&mut self, pass: &Pass, turn: &Turn) {
        let Turn { corner, known, positions, .. } = *turn;
        let surface = pass.surface;
        let place = |v: u32| known[v as usize].then(|| positions[v as usize]);
        self.at_boundary = false;
        let (mut count, mut predictions, mut members) = (0, 0, 0);
        let mut b = surface.at(next(corner));
        let mut place_of_b = place(b);
        for c in surface.fan(corner).take(MOST) {
            let (a, place_of_a) = (b, place_of_b);
            b = surface.at(prev(c));
            place_of_b = place(b);
            let Some(p) = place_of_a else {
                self.at_boundary |= surface.is_virtual(a);
                self.around[members & (MOST - 1)] = a
                    .checked_sub(pass.first)
                    .and_then(|i| pass.estimates.get(i as usize))
                    .map(|estimate| estimate.map(|x| x >> FRACTION_BITS));
                members += 1;
                continue;
            };
            self.around[members & (MOST - 1)] = Some(p.map(|x| x as i64));
            members += 1;
            let at = count & (MOST - 1);
            self.known[at] = a;
            (0..3).for_each(|k| self.places[k][at] = p[k]);
            count += 1;
            if let Some(q) = place_of_b
                && let Some(w) = place(surface.at(surface.across(c)))
            {
                let at = predictions & (MOST - 1);
                (0..3).for_each(|k| self.parallelograms[k][at] = p[k] + q[k] - w[k]);
                predictions += 1;
            }
        }
        (self.count, self.predictions, self.members) = (count, predictions, members);
    }

    /// How many neighbours are known.
    pub fn known(&self) -> usize {
        self.count
    }

    /// The known neighbours.
    pub fn vertices(&self) -> &[u32] {
        &self.known[..self.count]
    }

    /// The coordinates of the known neighbours along an axis.
    fn along(&self, axis: usize) -> &[i32] {
        &self.places[axis][..self.count]
    }
}

/// Everything that the models look at.
pub(crate) struct Neighbourhood<'a> {
    /// The experts' points, in 1/256: the first, the nearest parallelogram, the corrected
    /// estimate.
    pub predictions: [Vector; EXPERTS],
    /// The second nearest parallelogram, in 1/256.
    #[cfg_attr(not(feature = "max"), expect(dead_code, reason = "only that effort asks for it"))]
    pub second: Vector,
    /// The mean of the known neighbours, and that of the parallelograms (the corrected estimate without
    /// one), in 1/256.
    #[cfg_attr(not(feature = "max"), expect(dead_code, reason = "only that effort asks for it"))]
    pub mean: Vector,
    #[cfg_attr(not(feature = "max"), expect(dead_code, reason = "only that effort asks for it"))]
    pub parallel: Vector,
    /// Normal of the surface here, of any length below 2⁴⁸.
    pub normal: Vector,
    pub at_boundary: bool,
    pub parallelograms: usize,
    /// 0..=5 parallelograms, 6 if the whole ring is known.
    pub class: usize,
    /// Logarithm of the mean distance of the known neighbours, two an octave.
    pub size: usize,
    /// That distance, in 1/256.
    pub edge: u64,
    pub rough: Roughness,
    ring: &'a Ring,
}

impl Neighbourhood<'_> {
    /// How far apart the known neighbours lie along an axis, in 1/256.
    #[cfg(feature = "max")]
    pub fn extent(&self, axis: usize) -> u64 {
        let places = &self.ring.places[axis][..self.ring.count];
        let (least, most) = places.iter().fold((i32::MAX, i32::MIN), |(l, m), &x| (l.min(x), m.max(x)));
        (most.abs_diff(least) as u64) << FRACTION_BITS
    }

    /// Values of an axis that may repeat: the neighbours' and the parallelograms', the first eight of each and
    /// how many there are.
    #[inline(always)]
    pub fn candidates(&self, axis: usize) -> [([i32; 8], usize); 2] {
        let first = |values: &[i32; MOST]| std::array::from_fn(|i| values[i]);
        let ring = self.ring;
        [
            (first(&ring.places[axis]), ring.count.min(8)),
            (first(&ring.parallelograms[axis]), ring.predictions.min(8)),
        ]
    }
}

/// The first expectation, beside the mean of the known neighbours: shares (in 1/64) of the mean
/// of the parallelograms, of the estimate and of the error of the estimates nearby, by class.
pub(crate) type Shares = [[i64; 3]; 7];

/// Where estimates are made from a coarse level that is known: least squares over the adaptive
/// levels of scans and CAD meshes.
pub(crate) static NEAR: Shares =
    [[0, 62, 30], [4, 60, 24], [5, 58, 24], [8, 54, 25], [8, 54, 23], [8, 50, 22], [7, 42, 22]];

/// Where they come from a level several steps coarser: the same over late levels, least absolute
/// deviations.
pub(crate) static LATE: Shares =
    [[0, 62, 30], [1, 57, 46], [12, 52, 48], [12, 51, 50], [4, 58, 52], [4, 56, 50], [1, 13, 17]];

impl<'a> Neighbourhood<'a> {
    pub fn new(ring: &'a Ring, pass: &Pass, turn: &Turn<'a>, rough: &[Roughness]) -> Self {
        let estimate = turn.estimate;
        let n = ring.count;
        let (mut tangential, mut normal) = (0u64, 0u64);
        let mut error = [0i64; 3];
        let mut with_error = 0;
        for (i, &y) in ring.vertices().iter().enumerate() {
            tangential += rough[y as usize].tangential as u64;
            normal += rough[y as usize].normal as u64;
            // By how much its estimate was off, if it had one.
            if let Some(e) = y.checked_sub(pass.first).and_then(|i| pass.estimates.get(i as usize)) {
                (0..3).for_each(|k| error[k] += ((ring.places[k][i] as i64) << FRACTION_BITS) - e[k]);
                with_error += 1;
            }
        }
        let mean = [0, 1, 2].map(|k| mean_of(ring.along(k)));
        let mut edge = 0u64;
        for i in 0..n {
            let off = |k: usize| ((ring.places[k][i] as i64) << FRACTION_BITS).abs_diff(mean[k]);
            edge += off(0).max(off(1)).max(off(2));
        }
        let edge = divide(edge, n);
        let count = ring.predictions;
        let class = if n == ring.members { 6 } else { count.min(5) };
        let error = error.map(|x| divide_signed(x, with_error + 1));
        let corrected = estimate.map(|&e| [0, 1, 2].map(|k| e[k] + error[k]));
        let fallback = corrected.unwrap_or(mean);
        let base =
            if count == 0 { fallback } else { [0, 1, 2].map(|k| mean_of(&ring.parallelograms[k][..count])) };
        let first = match estimate {
            Some(e) => {
                let [of_base, of_estimate, of_error] = pass.shares[class];
                [0, 1, 2].map(|k| {
                    let sum =
                        of_base * (base[k] - mean[k]) + of_estimate * (e[k] - mean[k]) + of_error * error[k];
                    mean[k] + (sum >> 6)
                })
            }
            None => base,
        };
        let [nearest, second] = ring.two_nearest(first, base);
        Neighbourhood {
            predictions: [first, nearest, fallback],
            second,
            mean,
            parallel: base,
            normal: ring.normal(),
            at_boundary: ring.at_boundary,
            parallelograms: count,
            class,
            size: bin(edge + 1, 2, -6, 64),
            edge,
            rough: Roughness { tangential: divide(tangential, n) as u32, normal: divide(normal, n) as u32 },
            ring,
        }
    }
}

/// The mean of up to 32 coordinates in 1/256, rounded down.
#[inline(always)]
fn mean_of(values: &[i32]) -> i64 {
    // Lifted by more than any of them, the sum is positive.
    const LIFT: i64 = 1 << 40;
    let n = values.len();
    let sum: i64 = values.iter().map(|&x| x as i64).sum();
    divide(((sum << FRACTION_BITS) + LIFT * n as i64) as u64, n) as i64 - LIFT
}

impl Ring {
    /// The two parallelograms nearest to `to`, in 1/256.
    fn two_nearest(&self, to: Vector, otherwise: Vector) -> [Vector; 2] {
        let point = |i: usize| [0, 1, 2].map(|k| (self.parallelograms[k][i] as i64) << FRACTION_BITS);
        let mut best = [(i64::MAX, 0), (i64::MAX, 0)];
        for i in 0..self.predictions {
            let p = point(i);
            let distance = (p[0] - to[0]).abs() + (p[1] - to[1]).abs() + (p[2] - to[2]).abs();
            if distance < best[0].0 {
                best = [(distance, i), best[0]];
            } else if distance < best[1].0 {
                best[1] = (distance, i);
            }
        }
        match self.predictions {
            0 => [otherwise; 2],
            1 => [point(0); 2],
            _ => best.map(|(_, i)| point(i)),
        }
    }

    /// Area vector of the ring.
    fn normal(&self) -> Vector {
        let origin = [0, 1, 2].map(|k| self.places[k][0] as i64);
        let members = &self.around[..self.members];
        let place = |member: &Option<Vector>| member.map(|p| [0, 1, 2].map(|k| p[k] - origin[k]));
        let mut sum = [0i64; 3];
        let mut before = members.last().and_then(place);
        for member in members {
            let here = place(member);
            if let (Some(a), Some(b)) = (before, here) {
                add_to(&mut sum, cross(a, b));
            }
            before = here;
        }
        let all = sum.iter().fold(0, |m, x| m | x.unsigned_abs());
        let spare = 17u32.saturating_sub(all.leading_zeros());
        sum.map(|x| x >> spare)
    }
}
