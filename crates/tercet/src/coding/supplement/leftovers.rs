//! Leftovers: vertices that no face uses, and faces that name a vertex twice.
//!
//! Vertices without faces are a set of points, so their order is free and what is coded is how
//! many lie in each cell of a k-d tree over the lattice (Gandoin and Devillers, "Progressive
//! lossless compression of arbitrary simplicial complexes", 2002). They mostly lie near the
//! surface, whose vertices are carried down the tree with them: how many of those lie in each
//! half of a cell, and where, predicts the split.

use super::NumberModel;
use crate::coding::Point;
use crate::coding::model::BitModel;
use crate::entropy::Coder;
use crate::{Error, Result};

/// Most bits of a coordinate.
const MOST_BITS: u32 = 28;
/// Up to this many points of a cell are counted one by one.
const FEW: u32 = 8;
/// Classes of the share of the known points in the lower half.
const SHARES: usize = 17;
/// Classes of the distance from the middle of the cell to the middle of the known points.
const OFFSETS: usize = 17;
/// Classes of the number of known points in a cell.
const CROWDS: usize = 8;

fn damaged(cause: &str) -> Error {
    Error::format("leftovers section", cause)
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
    /// The known points in it: a run of the list.
    known: [usize; 2],
    /// The middle of the known points in the smallest cell around this one that has some.
    middle: Point,
}

/// Codes `count` points as a set. When encoding, `points` are they. Returns them in the order
/// of the tree and, when encoding, the place of each in `points`; equal ones stay in order.
/// The time is O((n + k) b) for n points, k known ones and b bits a coordinate.
///
/// # Errors
/// [`Error::Format`] for coordinates of more than 28 bits.
pub(super) fn code_points<C: Coder>(
    coder: &mut C,
    known: &[Point],
    count: u32,
    points: &[Point],
) -> Result<(Vec<Point>, Vec<u32>)> {
    let largest = points.iter().flatten().fold(0, |all, &x| all | x as u32);
    let bits = coder.raw(32 - largest.leading_zeros(), 5);
    if bits > MOST_BITS {
        return Err(damaged("coordinates of more than 28 bits"));
    }
    let inside = |p: &Point| p.iter().all(|&x| x >= 0 && x >> bits == 0);
    let mut known: Vec<Point> = known.iter().copied().filter(inside).collect();
    let mut order: Vec<u32> = (0..points.len() as u32).collect();
    let mut spare = Vec::new();
    let mut models = Models::new();
    let mut found = Vec::new();
    let all = known.len();
    let root =
        Cell { corner: [0; 3], depth: 0, count, first: 0, known: [0, all], middle: middle(&known, [0; 3]) };
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
        let members = &mut known[cell.known[0]..cell.known[1]];
        let lower_known = partition(members, |p| p[axis] < split);
        let lower = if C::ENCODES {
            let list = &mut order[cell.first..cell.first + cell.count as usize];
            stable_partition(list, &mut spare, |&i| points[i as usize][axis] < split) as u32
        } else {
            0
        };
        let lower = models.code(coder, lower, &cell, [lower_known, members.len() - lower_known], half);
        let known_split = cell.known[0] + lower_known;
        let child = |count, corner, first, run: [usize; 2]| Cell {
            corner,
            depth: cell.depth + 1,
            count,
            first,
            known: run,
            middle: middle(&known[run[0]..run[1]], cell.middle),
        };
        let mut corner = cell.corner;
        corner[axis] = split;
        let upper =
            child(cell.count - lower, corner, cell.first + lower as usize, [known_split, cell.known[1]]);
        let lower = child(lower, cell.corner, cell.first, [cell.known[0], known_split]);
        cells.extend([upper, lower].into_iter().filter(|cell| cell.count > 0));
    }
    Ok((found, order))
}

/// The mean of some points, or `otherwise` of none.
fn middle(points: &[Point], otherwise: Point) -> Point {
    let n = points.len() as i64;
    let mean = |axis: usize| (points.iter().map(|p| p[axis] as i64).sum::<i64>() / n) as i32;
    if n == 0 { otherwise } else { [0, 1, 2].map(mean) }
}

/// Moves the items that `is_lower` to the front; returns how many they are.
fn partition<T>(items: &mut [T], is_lower: impl Fn(&T) -> bool) -> usize {
    let mut lower = 0;
    for i in 0..items.len() {
        if is_lower(&items[i]) {
            items.swap(i, lower);
            lower += 1;
        }
    }
    lower
}

/// As [`partition`], keeping the order within both parts.
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
    another: BitModel<3>,
    /// Of many: how many more lie in the lower half than its share.
    excess: NumberModel,
}

/// Pairs of a count of few points and how many of them are known to lie in the lower half.
const TALLIES: usize = (FEW * (FEW + 1) / 2) as usize;

impl Models {
    fn new() -> Self {
        let sizes = [
            TALLIES * SHARES * CROWDS,
            TALLIES * OFFSETS * CROWDS,
            TALLIES * OFFSETS * (MOST_BITS + 1) as usize,
        ];
        Models { another: BitModel::new(sizes, TALLIES, 300), excess: NumberModel::new(32) }
    }

    /// Codes how many of the cell's points lie in its lower half, `half` steps wide; of the
    /// known ones it has `known` in its halves.
    fn code<C: Coder>(
        &mut self,
        coder: &mut C,
        lower: u32,
        cell: &Cell,
        known: [usize; 2],
        half: i32,
    ) -> u32 {
        let (count, all) = (cell.count, known[0] + known[1]);
        if count > FEW {
            let share = (count as u64 * (2 * known[0] as u64 + 1) / (2 * all as u64 + 2)) as i64;
            let excess = self.excess.code_signed(coder, lower as i64 - share, count.ilog2() as usize);
            return (share + excess).clamp(0, count as i64) as u32;
        }
        let share = (known[0] * (SHARES - 1)).checked_div(all).unwrap_or(SHARES / 2);
        let crowd = (all.min(1 << 14) as u32 + 1).ilog2().min(CROWDS as u32 - 1) as usize;
        let axis = cell.depth as usize % 3;
        let steps = (cell.middle[axis] - cell.corner[axis] - half) as i64 * 4 / half as i64;
        let offset = (steps.clamp(-8, 8) + 8) as usize;
        let scale = half.ilog2() as usize;
        let mut found = 0;
        while found < count {
            let tally = (count * (count - 1) / 2 + found) as usize;
            let contexts = [
                (tally * SHARES + share) * CROWDS + crowd,
                (tally * OFFSETS + offset) * CROWDS + crowd,
                (tally * OFFSETS + offset) * (MOST_BITS + 1) as usize + scale,
            ];
            if !self.another.code(coder, lower > found, tally, contexts) {
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
