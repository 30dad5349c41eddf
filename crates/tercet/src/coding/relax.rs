//! Smoothing of estimates: where vertices lie of which nothing but the connectivity is known.
//!
//! The vertices of late levels move against the second difference of the surface (a damped step down
//! the gradient of its bilaplacian energy; Kobbelt et al., "Interactive multi-resolution modeling on
//! arbitrary meshes", 1998), while those with known positions stay. A few sweeps on each level do what
//! many on the finest would: coarse levels carry far.

use super::reciprocal::{self, divide_signed};
use super::vector::{COORDINATE_LIMIT, Point};
use crate::Effort;
use crate::mesh::Surface;
use crate::parallel;

/// Estimates of late vertices have so many bits behind the point.
pub(crate) const ESTIMATE_BITS: u32 = 3;

/// Sweeps on each level: in the `max` profile more, which serves large meshes.
fn sweeps(effort: Effort) -> usize {
    if effort.is_max() { 12 } else { 1 }
}

/// The largest coordinate of an estimate.
const LARGEST: i32 = ((COORDINATE_LIMIT as i64 - 1) << ESTIMATE_BITS) as i32;

/// A lattice point with the bits of an estimate.
pub(crate) fn precise(p: Point) -> Point {
    p.map(|x| x.clamp(1 - COORDINATE_LIMIT, COORDINATE_LIMIT - 1) << ESTIMATE_BITS)
}

/// The lattice point nearest to an estimate.
pub(crate) fn rounded(p: Point) -> Point {
    p.map(|x| (x + (1 << (ESTIMATE_BITS - 1))) >> ESTIMATE_BITS)
}

/// A point or what it is off by, and a zero: processors add four numbers of 32 bits at once.
type Padded = [i32; 4];

/// Smooths the estimates of the vertices from `first` on; `points` has an entry a vertex, and those of virtual
/// ones become 0. Time O(n).
pub(crate) fn relax(surface: &Surface, points: &mut [Point], first: u32, effort: Effort) {
    let (real, first) = (surface.virtuals as usize, first as usize);
    let neighbours = real_neighbours(surface);
    // So that virtual vertices add nothing to a sum.
    points[..real].fill([0; 3]);
    let mut sums = vec![Padded::default(); points.len()];
    let mut values = sums.clone();
    for _ in 0..sweeps(effort) {
        for (value, &[x, y, z]) in values.iter_mut().zip(points.iter()) {
            *value = [x, y, z, 0];
        }
        sum_neighbours(surface, &values, &mut sums);
        parallel::for_entries(&mut values[real..], |i, value| {
            let v = real + i;
            *value = from_mean(sums[v], neighbours[v], *value);
        });
        sum_neighbours(surface, &values, &mut sums);
        parallel::for_entries(&mut points[first..], |i, point| {
            let v = first + i;
            let second = from_mean(sums[v], neighbours[v], values[v]);
            for (x, second) in point.iter_mut().zip(second) {
                *x = x.saturating_sub(second / 2).clamp(-LARGEST, LARGEST);
            }
        });
    }
}

/// For each vertex the number of its ring members that are real.
fn real_neighbours(surface: &Surface) -> Vec<u32> {
    let mut count = vec![0; surface.vertices as usize];
    for [a, b, c] in corners(surface) {
        for (v, neighbour) in [(a, b), (b, c), (c, a)] {
            count[v as usize] += !surface.is_virtual(neighbour) as u32;
        }
    }
    count
}

/// For each vertex the sum of `values` over its neighbours, modulo 2³²: each follows it in one face.
fn sum_neighbours(surface: &Surface, values: &[Padded], sums: &mut [Padded]) {
    sums.fill(Padded::default());
    for [a, b, c] in corners(surface) {
        for (v, neighbour) in [(a, b), (b, c), (c, a)] {
            let (sum, value) = (&mut sums[v as usize], values[neighbour as usize]);
            (0..4).for_each(|k| sum[k] = sum[k].wrapping_add(value[k]));
        }
    }
}

/// The vertices of each face.
fn corners(surface: &Surface) -> impl Iterator<Item = [u32; 3]> + '_ {
    surface.vertex.as_chunks::<3>().0.iter().copied()
}

/// The mean of how far `count` values of the given sum are from `value`, rounded towards 0; 0 without values. Only what
/// they are together counts modulo 2³²: coordinates of any size come near to that by no face that is not as large.
fn from_mean(sum: Padded, count: u32, value: Padded) -> Padded {
    let n = count as usize;
    [0, 1, 2, 3].map(|k| {
        let off = sum[k].wrapping_sub(value[k].wrapping_mul(count as i32));
        match n {
            0 => 0,
            1..=reciprocal::LARGEST => divide_signed(off.into(), n) as i32,
            _ => (i64::from(off) / i64::from(count)) as i32,
        }
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::cut;
    use crate::shapes::grid;

    #[test]
    fn a_dent_in_a_plane_is_smoothed_away() {
        let mesh = grid(9, 9);
        let surface = cut(&mesh).surface;
        let virtuals = surface.virtuals as usize;
        let mut points = vec![[0; 3]; surface.vertices as usize];
        for (p, q) in points[virtuals..].iter_mut().zip(&mesh.positions) {
            *p = precise([(q[0] * 1000.0) as i32, (q[1] * 1000.0) as i32, 0]);
        }
        let middle = points.len() - 41;
        points[middle][2] = 8000;
        let (mut late, before) = (points.clone(), points);
        let first = middle as u32;
        for _ in 0..4 {
            relax(&surface, &mut late, first, Effort::Default);
        }
        assert_eq!(late[..middle], before[..middle]);
        assert!(late[middle][2].abs() < 800, "{:?}", late[middle]);
    }

    #[test]
    fn the_ends_of_the_range_hold() {
        let surface = cut(&grid(3, 3)).surface;
        let far = COORDINATE_LIMIT;
        let mut points: Vec<Point> =
            (0..surface.vertices as i32).map(|v| precise([far * (v % 2 * 2 - 1), -far, far])).collect();
        relax(&surface, &mut points, surface.virtuals, Effort::Default);
        assert!(points.iter().flatten().all(|x| x.abs() <= LARGEST));
        // A vertex at an end among others there, whose own neighbours are at the other.
        let surface = cut(&grid(5, 5)).surface;
        let middle = surface.virtuals as usize + 12;
        let mut points = vec![precise([-far; 3]); surface.vertices as usize];
        let ring =
            surface.fan(surface.any_corner()[middle]).map(|c| surface.at(crate::mesh::next(c)) as usize);
        ring.chain([middle]).for_each(|v| points[v] = precise([far; 3]));
        relax(&surface, &mut points, surface.virtuals, Effort::Default);
        assert!(points.iter().flatten().all(|x| x.abs() <= LARGEST));
        assert_eq!(rounded(precise([far, -far, 5])), [far - 1, 1 - far, 5]);
    }
}
