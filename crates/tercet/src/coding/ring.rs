//! What is known around a vertex, and where that places it.

use super::pass::{Pass, Roughness, Turn};
use super::position::{EXPERTS, LISTS};
use super::residual::Candidates;
use super::scale::bin;
use super::vector::{Point, Vector, add_to, cross, sub};
use crate::mesh::{NONE, Surface, next};
use crate::subdivide::FRACTION_BITS;

/// Rings are looked at this far: a hub's further neighbours add nothing but time.
const MOST: usize = 32;

/// The known part of a vertex's ring.
#[derive(Default)]
pub(crate) struct Ring {
    /// All ring members in order, `NONE` for virtual ones.
    all: Vec<u32>,
    /// The known ones.
    known: Vec<u32>,
    /// Parallelogram predictions from known neighbours.
    parallelograms: Vec<[i64; 3]>,
    at_boundary: bool,
}

impl Ring {
    /// Collects the ring of the vertex at `corner`.
    pub fn gather(&mut self, surface: &Surface, corner: u32, known: &[bool], positions: &[Point]) {
        self.all.clear();
        self.known.clear();
        self.parallelograms.clear();
        self.at_boundary = false;
        for c in surface.fan(corner).take(MOST) {
            let a = surface.at(next(c));
            if surface.is_virtual(a) {
                self.at_boundary = true;
                self.all.push(NONE);
                continue;
            }
            self.all.push(a);
            if !known[a as usize] {
                continue;
            }
            self.known.push(a);
            let b = surface.at(crate::mesh::prev(c));
            if !known[b as usize] {
                continue;
            }
            let w = surface.at(surface.across(c));
            if known[w as usize] {
                let (a, b, w) = (positions[a as usize], positions[b as usize], positions[w as usize]);
                self.parallelograms.push([0, 1, 2].map(|k| a[k] as i64 + b[k] as i64 - w[k] as i64));
            }
        }
    }

    /// How many neighbours are known.
    pub fn known(&self) -> usize {
        self.known.len()
    }

    /// The known neighbours.
    pub fn vertices(&self) -> &[u32] {
        &self.known
    }
}

/// Everything that the models look at.
pub(crate) struct Neighbourhood<'a> {
    /// The experts' points, in 1/256: the first, the nearest parallelogram, the corrected
    /// estimate.
    pub predictions: [Vector; EXPERTS],
    /// The second nearest parallelogram, in 1/256.
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
    positions: &'a [Point],
}

impl Neighbourhood<'_> {
    /// How far apart the known neighbours lie along an axis, in 1/256.
    #[cfg(feature = "max")]
    pub fn extent(&self, axis: usize) -> u64 {
        let places = || self.ring.known.iter().map(|&y| self.positions[y as usize][axis]);
        let (least, most) = (places().min().unwrap_or(0), places().max().unwrap_or(0));
        (most.abs_diff(least) as u64) << FRACTION_BITS
    }

    /// Values of an axis that may repeat: the neighbours', the parallelograms', and where the experts (`centres`) expect it.
    #[inline]
    pub fn candidates(&self, axis: usize, centres: &[i64; EXPERTS]) -> [Candidates; LISTS] {
        let mut lists = [Candidates::EMPTY; LISTS];
        let middle = (centres[0] + 128) >> FRACTION_BITS;
        for &y in &self.ring.known {
            lists[0].push(self.positions[y as usize][axis] as i64 - middle);
        }
        for p in &self.ring.parallelograms {
            lists[1].push(p[axis] - middle);
        }
        for centre in centres {
            lists[2].push(((centre + 128) >> FRACTION_BITS) - middle);
        }
        lists
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
        let Turn { known, positions, errors, estimate, .. } = *turn;
        let n = ring.known.len() as i64;
        let mut sum = [0i64; 3];
        let (mut tangential, mut normal) = (0u64, 0u64);
        let mut error = [0i64; 3];
        let mut with_error = 0i64;
        for &y in &ring.known {
            add_to(&mut sum, positions[y as usize].map(|x| x as i64));
            tangential += rough[y as usize].tangential as u64;
            normal += rough[y as usize].normal as u64;
            if y >= pass.first && !errors.is_empty() {
                add_to(&mut error, errors[(y - pass.first) as usize].map(|x| x as i64));
                with_error += 1;
            }
        }
        let mean = sum.map(|x| floor_div(x << FRACTION_BITS, n));
        let mut edge = 0u64;
        for &y in &ring.known {
            let p = positions[y as usize];
            edge += (0..3).map(|k| ((p[k] as i64) << FRACTION_BITS).abs_diff(mean[k])).max().unwrap_or(0);
        }
        let edge = edge / n as u64;
        let count = ring.parallelograms.len();
        let whole = ring.known.len() == ring.all.len();
        let class = if whole { 6 } else { count.min(5) };
        let error = error.map(|x| x / (with_error + 1));
        let corrected = estimate.map(|&e| [0, 1, 2].map(|k| e[k] + error[k]));
        let fallback = corrected.unwrap_or(mean);
        let base = if count == 0 {
            fallback
        } else {
            let mut sum = [0i64; 3];
            ring.parallelograms.iter().for_each(|&p| add_to(&mut sum, p));
            sum.map(|x| floor_div(x << FRACTION_BITS, count as i64))
        };
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
            normal: ring.normal(pass, known, positions),
            at_boundary: ring.at_boundary,
            parallelograms: count,
            class,
            size: bin(edge + 1, 2, -6, 64),
            edge,
            rough: Roughness {
                tangential: (tangential / n as u64) as u32,
                normal: (normal / n as u64) as u32,
            },
            ring,
            positions,
        }
    }
}

/// ⌊a / n⌋ for n > 0; the short division, which is several times faster, where it does.
#[inline(always)]
fn floor_div(a: i64, n: i64) -> i64 {
    match u32::try_from(a) {
        Ok(a) => (a / n as u32) as i64,
        Err(_) => a.div_euclid(n),
    }
}

impl Ring {
    /// The two parallelograms nearest to `to`, in 1/256.
    fn two_nearest(&self, to: Vector, otherwise: Vector) -> [Vector; 2] {
        let mut best = [(i64::MAX, otherwise), (i64::MAX, otherwise)];
        for p in &self.parallelograms {
            let p = p.map(|x| x << FRACTION_BITS);
            let distance = (0..3).map(|k| (p[k] - to[k]).abs()).sum();
            if distance < best[0].0 {
                best = [(distance, p), best[0]];
            } else if distance < best[1].0 {
                best[1] = (distance, p);
            }
        }
        if best[1].0 == i64::MAX {
            best[1] = best[0];
        }
        best.map(|b| b.1)
    }

    /// Area vector of the ring; unknown members lie where they are estimated.
    fn normal(&self, pass: &Pass, known: &[bool], positions: &[Point]) -> Vector {
        let origin = positions[self.known[0] as usize];
        let place = |x: u32| -> Option<Vector> {
            if x == NONE {
                None
            } else if known[x as usize] {
                Some(sub(positions[x as usize], origin))
            } else {
                let estimate = pass.estimates.get((x - pass.first) as usize)?;
                Some([0, 1, 2].map(|k| (estimate[k] >> FRACTION_BITS) - origin[k] as i64))
            }
        };
        let mut sum = [0i64; 3];
        for (i, &x) in self.all.iter().enumerate() {
            let y = self.all[(i + 1) % self.all.len()];
            if let (Some(a), Some(b)) = (place(x), place(y)) {
                add_to(&mut sum, cross(a, b));
            }
        }
        let all = sum.iter().fold(0, |m, x| m | x.unsigned_abs());
        let spare = 17u32.saturating_sub(all.leading_zeros());
        sum.map(|x| x >> spare)
    }
}
