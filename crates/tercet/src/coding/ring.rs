//! What is known around a vertex, and where that places it.

use super::pass::{Pass, Roughness, Turn};
use super::reciprocal::{divide, divide_signed};
use super::scale::bin;
use super::star::{MOST, places};
use super::vector::{Vector, add_to, cross};
use crate::mesh::NONE;
use crate::subdivide::FRACTION_BITS;

/// Distances beyond this are alike.
#[cfg(feature = "max")]
const FAR: i64 = 1 << 40;

/// What is known of a vertex's ring.
pub(crate) struct Ring {
    /// The known members in order, and their coordinates by axis.
    known: [u32; MOST],
    places: [[i32; MOST]; 3],
    count: usize,
    /// Parallelogram predictions from known neighbours, by axis.
    parallelograms: [[i32; MOST]; 3],
    predictions: usize,
    /// Sums of the coordinates of both.
    sum: Vector,
    sum_of_parallelograms: Vector,
    /// Where all members lie: those that are not known where they are expected. Virtual ones, and where nothing is
    /// expected, lie at the first known one, if there is any, and so add nothing to an area around that.
    around: [Vector; MOST],
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
            sum: [0; 3],
            sum_of_parallelograms: [0; 3],
            around: [[0; 3]; MOST],
            members: 0,
            at_boundary: false,
        }
    }
}

impl Ring {
    /// Collects the ring of the vertex whose turn it is.
    pub fn gather(&mut self, pass: &Pass, turn: &Turn) {
        let Turn { star, positions, .. } = *turn;
        let members = star.members();
        self.members = members.len();
        (self.count, self.predictions, self.at_boundary) = (0, 0, false);
        (self.sum, self.sum_of_parallelograms) = ([0; 3], [0; 3]);
        // Which members are known is hard to guess for a processor: those that are come first, then the others.
        for i in places(star.known()) {
            let p = positions[members[i] as usize];
            let at = self.count & (MOST - 1);
            self.known[at] = members[i];
            self.around[i] = p.map(i64::from);
            for (k, &x) in p.iter().enumerate() {
                self.places[k][at] = x;
                self.sum[k] += x as i64;
            }
            self.count += 1;
        }
        let nowhere = self.around[star.known().trailing_zeros() as usize & (MOST - 1)];
        for i in places(star.unknown()) {
            self.at_boundary |= pass.surface.is_virtual(members[i]);
            let estimate = members[i].checked_sub(pass.first).and_then(|i| pass.estimates.get(i as usize));
            self.around[i] = estimate.map_or(nowhere, |estimate| estimate.map(|x| x >> FRACTION_BITS));
        }
        for i in places(star.parallelograms()) {
            let place = |v: u32| positions[v as usize];
            let following = if i + 1 < members.len() { i + 1 } else { 0 };
            let (p, q, w) = (place(members[i]), place(members[following]), place(star.wing(i)));
            let at = self.predictions & (MOST - 1);
            for k in 0..3 {
                let x = p[k] + q[k] - w[k];
                self.parallelograms[k][at] = x;
                self.sum_of_parallelograms[k] += x as i64;
            }
            self.predictions += 1;
        }
    }

    /// How many neighbours are known.
    pub fn known(&self) -> usize {
        self.count
    }

    /// The known neighbours.
    pub fn vertices(&self) -> &[u32] {
        &self.known[..self.count]
    }
}

/// Everything that the models look at.
pub(crate) struct Neighbourhood<'a> {
    /// Where the vertex is expected, in 1/256.
    pub expected: Vector,
    /// Its estimate, corrected by what those nearby were off, or the mean of the known neighbours without one.
    pub corrected: Vector,
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
    /// The two parallelograms nearest to where the vertex is expected, in 1/256.
    #[cfg(feature = "max")]
    pub fn two_nearest(&self) -> [Vector; 2] {
        let (ring, to, otherwise) = (self.ring, self.expected, self.parallel);
        let point = |i: usize| [0, 1, 2].map(|k| (ring.parallelograms[k][i] as i64) << FRACTION_BITS);
        // Distances with the numbers of the points behind them, so that nothing branches on a comparison.
        let [mut least, mut following] = [i64::MAX; 2];
        for i in 0..ring.predictions {
            let p = point(i);
            let distance = (p[0] - to[0]).abs() + (p[1] - to[1]).abs() + (p[2] - to[2]).abs();
            let found = distance.min(FAR) << MOST.ilog2() | i as i64;
            following = following.min(least.max(found));
            least = least.min(found);
        }
        match ring.predictions {
            0 => [otherwise; 2],
            1 => [point(0); 2],
            _ => [least, following].map(|found| point(found as usize & (MOST - 1))),
        }
    }

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
            // By how much its estimate was off, if it had one: a processor could not guess which has.
            let estimated = y.wrapping_sub(pass.first) as usize;
            let has_error = estimated < pass.estimates.len();
            if let Some(e) = pass.estimates.get(if has_error { estimated } else { 0 }) {
                let off = |k: usize| ((ring.places[k][i] as i64) << FRACTION_BITS) - e[k];
                (0..3).for_each(|k| error[k] += off(k) & -(has_error as i64));
            }
            with_error += has_error as usize;
        }
        let mean = ring.sum.map(|sum| mean_of(sum, n));
        let mut edge = 0u64;
        for i in 0..n {
            let off = |k: usize| (((ring.places[k][i] as i64) << FRACTION_BITS) - mean[k]).unsigned_abs();
            edge += off(0).max(off(1)).max(off(2));
        }
        let edge = divide(edge, n);
        let count = ring.predictions;
        let class = if n == ring.members { 6 } else { count.min(5) };
        let error = error.map(|x| divide_signed(x, with_error + 1));
        let corrected = estimate.map(|&e| [0, 1, 2].map(|k| e[k] + error[k]));
        let fallback = corrected.unwrap_or(mean);
        let base =
            if count == 0 { fallback } else { ring.sum_of_parallelograms.map(|sum| mean_of(sum, count)) };
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
        Neighbourhood {
            expected: first,
            corrected: fallback,
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

/// The mean in 1/256 of up to 32 coordinates of this sum, rounded down.
#[inline(always)]
fn mean_of(sum: i64, n: usize) -> i64 {
    // Lifted by more than any of them, the sum is positive.
    const LIFT: i64 = 1 << 40;
    divide(((sum << FRACTION_BITS) + LIFT * n as i64) as u64, n) as i64 - LIFT
}

impl Ring {
    /// Area vector of the ring.
    fn normal(&self) -> Vector {
        let origin = [0, 1, 2].map(|k| self.places[k][0] as i64);
        let place = |i: usize| [0, 1, 2].map(|k| self.around[i & (MOST - 1)][k] - origin[k]);
        let mut sum = [0i64; 3];
        let mut before = place(self.members.wrapping_sub(1));
        for i in 0..self.members {
            let here = place(i);
            add_to(&mut sum, cross(before, here));
            before = here;
        }
        let all = sum.iter().fold(0, |m, x| m | x.unsigned_abs());
        let spare = 17u32.saturating_sub(all.leading_zeros());
        sum.map(|x| x >> spare)
    }
}
