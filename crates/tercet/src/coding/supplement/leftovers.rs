//! Leftovers: vertices that no face uses, and faces that name a vertex twice.
//!
//! Vertices without faces are a set of points, so their order is free and what is coded is how
//! many lie in each cell of a k-d tree over the lattice (Gandoin and Devillers, "Progressive
//! lossless compression of arbitrary simplicial complexes", 2002). They mostly lie on the
//! surface: *samples* of it, the middles of its faces, are carried down the tree with them. How
//! many samples lie in each half of a cell predicts its split, and where there are none any more,
//! the plane of the last face does.

use super::NumberModel;
use crate::coding::Point;
use crate::coding::model::BitModel;
use crate::coding::vector::{cross, dot, sub, unit};
use crate::entropy::Coder;
use crate::{Error, Result};

/// Most bits of a coordinate.
const MOST_BITS: u32 = 28;
/// Up to this many points of a cell are counted one by one.
const FEW: u32 = 8;
/// Pairs of a number of few points and how many of them are known to lie in the lower half.
const TALLIES: usize = (FEW * (FEW + 1) / 2) as usize;
/// Samples for each point, if there are so many faces.
const SAMPLES: usize = 8;
/// Samples that are compared for the nearest.
const MOST_COMPARED: usize = 64;

/// Classes of the share of the samples in the lower half.
const SHARES: usize = 17;
/// Classes of the number of samples in a cell.
const CROWDS: usize = 8;
/// Classes of the distance from the middle of the cell to its guide.
const OFFSETS: usize = 17;
/// Classes of where a plane crosses an axis.
const CROSSINGS: usize = 12;
/// Classes of a plane: four of its slope times the crossings.
const PLANES: usize = 4 * CROSSINGS;
/// Classes of the width of a cell.
const SCALES: usize = MOST_BITS as usize;
/// Sets of the mixer: the least classes of the number of samples.
const SETS: usize = 4;

fn damaged(cause: &str) -> Error {
    Error::format("leftovers section", cause)
}

/// A point of the surface.
#[derive(Clone, Copy)]
struct Sample {
    at: Point,
    /// The face it lies in.
    face: u32,
}

/// A cell of the tree that holds points.
#[derive(Clone, Copy)]
struct Cell {
    corner: Point,
    /// Splits from the root to here; the axis of a split is its depth mod 3.
    depth: u32,
    /// The points in it: how many, and when encoding the first in the list.
    count: u32,
    first: usize,
    /// The samples in it: a run of the list.
    samples: [usize; 2],
    /// That of the cell that it is a half of.
    guide: Option<Guide>,
}

/// The sample nearest to the middle of a cell, or else of the smallest one around it that has some.
#[derive(Clone, Copy)]
struct Guide {
    sample: Sample,
    /// Of its face.
    normal: [i32; 3],
}

/// Codes `count` points as a set. When encoding, `points` are they. Returns them in the order
/// of the tree and, when encoding, the place of each in `points`; equal ones stay in order.
/// `vertices` and `faces` are the surface that they are expected to lie near.
/// The time is O((n + k) b) for n points, k faces and b bits a coordinate.
///
/// # Errors
/// [`Error::Format`] for coordinates of more than 28 bits.
pub(super) fn code_points<C: Coder>(
    coder: &mut C,
    [vertices, points]: [&[Point]; 2],
    faces: &[[u32; 3]],
    count: u32,
) -> Result<(Vec<Point>, Vec<u32>)> {
    let largest = points.iter().flatten().fold(0, |all, &x| all | x as u32);
    let bits = coder.raw(32 - largest.leading_zeros(), 5);
    if bits > MOST_BITS {
        return Err(damaged("coordinates of more than 28 bits"));
    }
    let mut samples = samples(vertices, faces, bits, count);
    let mut order: Vec<u32> = (0..points.len() as u32).collect();
    let mut spare = Vec::new();
    let mut models = Models::new();
    let mut found = Vec::new();
    let root = Cell { corner: [0; 3], depth: 0, count, first: 0, samples: [0, samples.len()], guide: None };
    let mut cells = if count > 0 { vec![root] } else { Vec::new() };
    while let Some(cell) = cells.pop() {
        if cell.depth == 3 * bits {
            found.extend((0..cell.count).map(|_| cell.corner));
            continue;
        }
        if coder.exhausted() {
            return Err(damaged("it ends early"));
        }
        let axis = cell.depth as usize % 3;
        let half = 1 << (bits - 1 - cell.depth / 3);
        let split = cell.corner[axis] + half;
        let members = &mut samples[cell.samples[0]..cell.samples[1]];
        let guide = cell.guide(members, half, |f| normal(vertices, faces[f as usize]));
        let lower_samples = partition(members, axis, split);
        let lower = if C::ENCODES {
            let list = &mut order[cell.first..cell.first + cell.count as usize];
            stable_partition(list, &mut spare, |&i| points[i as usize][axis] < split) as u32
        } else {
            0
        };
        let situation = Situation::new(&cell, half, [lower_samples, members.len()], guide);
        let lower = models.code(coder, lower, cell.count, &situation);
        let middle = cell.samples[0] + lower_samples;
        let child = |count, corner, first, samples| Cell {
            corner,
            depth: cell.depth + 1,
            count,
            first,
            samples,
            guide,
        };
        let mut corner = cell.corner;
        corner[axis] = split;
        let upper = child(cell.count - lower, corner, cell.first + lower as usize, [middle, cell.samples[1]]);
        let lower = child(lower, cell.corner, cell.first, [cell.samples[0], middle]);
        cells.extend([upper, lower].into_iter().filter(|cell| cell.count > 0));
    }
    Ok((found, order))
}

/// The middles of faces that lie in the cube of 2^`bits` steps: of one face in so many that there are about
/// [`SAMPLES`] for each of `count` points, or of all.
fn samples(vertices: &[Point], faces: &[[u32; 3]], bits: u32, count: u32) -> Vec<Sample> {
    let step = (faces.len() / SAMPLES).checked_div(count as usize).unwrap_or(0).max(1);
    let mut samples = Vec::with_capacity(faces.len() / step + 1);
    for (f, face) in (0..).zip(faces).step_by(step) {
        let [a, b, c] = face.map(|v| vertices[v as usize]);
        // Of coordinates of 28 bits and a sign; without it, what is negative is beyond the cube, too.
        let sums = [0, 1, 2].map(|k| a[k].wrapping_add(b[k]).wrapping_add(c[k]) as u32);
        if sums.iter().all(|&sum| sum < 3 << bits) {
            samples.push(Sample { at: sums.map(|sum| (sum / 3) as i32), face: f });
        }
    }
    samples
}

/// The normal of a face, of length 2¹⁴, or zero.
fn normal(vertices: &[Point], face: [u32; 3]) -> [i32; 3] {
    let [a, b, c] = face.map(|v| vertices[v as usize]);
    unit(cross(sub(b, a), sub(c, a)))
}

impl Cell {
    /// Its guide; `half` is what it is halved to along its axis.
    fn guide(&self, samples: &[Sample], half: i32, normal: impl Fn(u32) -> [i32; 3]) -> Option<Guide> {
        // The root has none.
        let around = self.depth.checked_sub(1)?;
        // The axis before this one may have been halved once less.
        let half = if around % 3 == 2 { 2 * half } else { half };
        let Some(sample) = nearest(samples, self.corner.map(|x| x + half)) else { return self.guide };
        match self.guide {
            Some(guide) if guide.sample.face == sample.face => Some(guide),
            _ => Some(Guide { sample, normal: normal(sample.face) }),
        }
    }
}

/// Of the first samples the one nearest to `place`, if there are some.
fn nearest(samples: &[Sample], place: Point) -> Option<Sample> {
    // Both lie in the root, whose coordinates have 28 bits.
    let far = |s: &Sample| (0..3).map(|k| (s.at[k] - place[k]).abs()).sum::<i32>();
    samples.iter().take(MOST_COMPARED).min_by_key(|s| far(s)).copied()
}

/// One of `classes` for a distance, in quarters of `half`, a power of two.
fn class(distance: i64, half: i32, classes: usize) -> usize {
    let middle = classes as i64 / 2;
    let quarters = (4 * distance) >> half.ilog2();
    (quarters.clamp(-middle, classes as i64 - 1 - middle) + middle) as usize
}

/// What is known of a cell before its split.
struct Situation {
    /// Class of the share of the samples in the lower half.
    share: usize,
    /// Class of the number of samples.
    crowd: usize,
    /// Class of the distance from the middle to the guide along the axis.
    offset: usize,
    /// Class of where the guide's plane crosses the axis through the middle, and of its slope.
    plane: usize,
    /// log₂ of the width of a half.
    scale: usize,
}

impl Situation {
    fn new(cell: &Cell, half: i32, [lower, all]: [usize; 2], guide: Option<Guide>) -> Self {
        let axis = cell.depth as usize % 3;
        let share = (lower * (SHARES - 1)).checked_div(all).unwrap_or(SHARES / 2);
        let crowd = (all.min(1 << 14) as u32 + 1).ilog2().min(CROWDS as u32 - 1) as usize;
        let scale = half.ilog2() as usize;
        let (mut offset, mut plane) = (OFFSETS / 2, 0);
        if let Some(Guide { sample, normal }) = guide {
            // Axes before this one have been halved once more.
            let to_middle = [0, 1, 2].map(|k| if k < axis { half / 2 } else { half });
            let away = [0, 1, 2].map(|k| (sample.at[k] - cell.corner[k] - to_middle[k]) as i64);
            offset = class(away[axis], half, OFFSETS);
            let normal = normal.map(i64::from);
            if normal[axis] != 0 {
                let slope = (3 * normal[axis].abs() + (1 << 13)) >> 14;
                let crossing = dot(normal, away) * normal[axis].signum() / normal[axis].abs();
                plane = slope as usize * CROSSINGS + class(crossing, half, CROSSINGS);
            }
        }
        Situation { share, crowd, offset, plane, scale }
    }
}

/// Moves the samples below `split` on an axis to the front, exchanging each with the first one that is not;
/// returns how many they are.
fn partition(samples: &mut [Sample], axis: usize, split: i32) -> usize {
    let is_lower = |s: &Sample| s.at[axis] < split;
    let mut lower = samples.iter().take_while(|s| is_lower(s)).count();
    for i in lower + 1..samples.len() {
        if is_lower(&samples[i]) {
            samples.swap(i, lower);
            lower += 1;
        }
    }
    lower
}

/// Moves the items that `is_lower` to the front, keeping the order within both parts; returns how many they are.
fn stable_partition(items: &mut [u32], spare: &mut Vec<u32>, is_lower: impl Fn(&u32) -> bool) -> usize {
    spare.clear();
    let mut lower = 0;
    for i in 0..items.len() {
        if is_lower(&items[i]) {
            items[lower] = items[i];
            lower += 1;
        } else {
            spare.push(items[i]);
        }
    }
    items[lower..].copy_from_slice(spare);
    lower
}

/// The models of a split.
struct Models {
    /// Of few points: whether one more lies in the lower half.
    another: BitModel<4>,
    /// Of many: how many more lie in the lower half than its share.
    excess: NumberModel,
}

impl Models {
    fn new() -> Self {
        let sizes = [
            TALLIES * SHARES * CROWDS,
            TALLIES * PLANES * CROWDS,
            TALLIES * OFFSETS * SCALES,
            TALLIES * PLANES * SCALES,
        ];
        Models { another: BitModel::new(sizes, SETS, 300), excess: NumberModel::new(32) }
    }

    /// Codes how many of the cell's points lie in its lower half.
    fn code<C: Coder>(&mut self, coder: &mut C, lower: u32, count: u32, at: &Situation) -> u32 {
        if count > FEW {
            let share = (count as u64 * (2 * at.share as u64 + 1) / (2 * SHARES as u64)) as i64;
            let excess = self.excess.code_signed(coder, lower as i64 - share, count.ilog2() as usize);
            return (share + excess).clamp(0, count as i64) as u32;
        }
        let mut found = 0;
        while found < count {
            let tally = (count * (count - 1) / 2 + found) as usize;
            let contexts = [
                (tally * SHARES + at.share) * CROWDS + at.crowd,
                (tally * PLANES + at.plane) * CROWDS + at.crowd,
                (tally * OFFSETS + at.offset) * SCALES + at.scale,
                (tally * PLANES + at.plane) * SCALES + at.scale,
            ];
            if !self.another.code(coder, lower > found, at.crowd.min(SETS - 1), contexts) {
                break;
            }
            found += 1;
        }
        found
    }
}

/// Codes `count` faces that name a vertex twice, as [a, a, b], ascending; `known` are they when
/// encoding.
///
/// # Errors
/// [`Error::Format`] if an index is not below `vertices`.
pub(super) fn code_degenerate<C: Coder>(
    coder: &mut C,
    vertices: u32,
    count: u32,
    known: &[[u32; 3]],
) -> Result<Vec<[u32; 3]>> {
    let mut repeated = NumberModel::new(1);
    let mut other = NumberModel::new(1);
    let mut faces = Vec::new();
    let mut last = 0;
    for i in 0..count {
        if coder.exhausted() {
            return Err(damaged("it ends early"));
        }
        let [a, _, b] = known.get(i as usize).copied().unwrap_or_default();
        let a = last as i64 + repeated.code(coder, a.wrapping_sub(last), 0) as i64;
        let b = a + other.code_signed(coder, b as i64 - a, 0);
        let within = 0..vertices as i64;
        if !within.contains(&a) || !within.contains(&b) {
            return Err(damaged("a face of a vertex that does not exist"));
        }
        last = a as u32;
        faces.push([last, last, b as u32]);
    }
    Ok(faces)
}

/// A face that names a vertex twice, turned to begin with the repeated one.
pub(super) fn turned([a, b, c]: [u32; 3]) -> [u32; 3] {
    match () {
        () if a == b => [a, b, c],
        () if b == c => [b, c, a],
        () => [c, a, b],
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::coding::vector::COORDINATE_LIMIT;
    use proptest::prelude::*;

    fn point(limit: i32) -> impl Strategy<Value = Point> {
        prop::array::uniform3(-limit..=limit)
    }

    proptest! {
        #[test]
        fn samples_are_the_middles_of_faces_within_the_cube(
            (vertices, bits) in (0..=MOST_BITS).prop_flat_map(|bits| {
                (prop::collection::vec(point(((1 << bits) * 3 / 2).min(COORDINATE_LIMIT)), 30), Just(bits))
            }),
        ) {
            let faces: Vec<[u32; 3]> = (0..10).map(|f| [3 * f, 3 * f + 1, 3 * f + 2]).collect();
            let middle = |face: &[u32; 3]| {
                let sum = |k: usize| face.iter().map(|&v| vertices[v as usize][k] as i64).sum::<i64>();
                [0, 1, 2].map(|k| sum(k).div_euclid(3))
            };
            let within = |at: &[i64; 3]| at.iter().all(|x| (0..1 << bits).contains(x));
            let all = (0..).zip(faces.iter().map(middle)).filter(|(_, at)| within(at));
            let found: Vec<_> =
                samples(&vertices, &faces, bits, 1000).iter().map(|s| (s.face, s.at.map(i64::from))).collect();
            prop_assert_eq!(found, all.collect::<Vec<_>>());
        }

        #[test]
        fn few_points_ask_for_few_samples(count in 0u32..40) {
            let faces = vec![[0, 1, 2]; 200];
            let found: Vec<_> = samples(&[[1; 3]; 3], &faces, 5, count).iter().map(|s| s.face).collect();
            let step = 25u32.checked_div(count).unwrap_or(1).max(1);
            prop_assert_eq!(found, (0..200).step_by(step as usize).collect::<Vec<_>>());
        }

        #[test]
        fn a_partition_exchanges_lower_samples_with_the_first_upper_ones(
            at in prop::collection::vec(point(3), 0..40),
            axis in 0usize..3,
            split in -4..=4,
        ) {
            let list: Vec<Sample> = (0..).zip(at).map(|(face, at)| Sample { at, face }).collect();
            let mut naive: Vec<_> = list.iter().map(|s| (s.face, s.at)).collect();
            let mut lower = 0;
            for i in 0..naive.len() {
                if naive[i].1[axis] < split {
                    naive.swap(i, lower);
                    lower += 1;
                }
            }
            let mut found = list;
            prop_assert_eq!(partition(&mut found, axis, split), lower);
            prop_assert_eq!(found.iter().map(|s| (s.face, s.at)).collect::<Vec<_>>(), naive);
        }

        #[test]
        fn a_distance_is_classed_by_quarters_of_a_half(distance in any::<i32>(), bits in 0..MOST_BITS) {
            let quarters = (4 * distance as i64).div_euclid(1 << bits);
            prop_assert_eq!(class(distance as i64, 1 << bits, OFFSETS) as i64, quarters.clamp(-8, 8) + 8);
        }
    }
}
