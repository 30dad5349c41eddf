//! Which lattice suits an exact file.
//!
//! A mesh need not lie on a lattice: what it lacks, the exactness section adds. A finer lattice
//! leaves less to add but costs more in the levels. Each candidate is judged by a sample of
//! vertices: the bits of a coordinate within the extent stand for the levels (prediction takes off
//! as many of them whatever the lattice), and the section's symbols are tallied as its models
//! would. All of it is integer arithmetic, so that a mesh has one file.

use super::digits::{DECADES, decade};
use super::exactness::{EXPONENTS, cell, exponent_bits, number_of};
use crate::Precision;
use crate::entropy::log2_fixed;
use crate::mesh::{
    Lattice, Mesh, binary_origin, bounds, decimal_index, decimal_step, decimal_value, refined_grid,
};

/// Vertices that are looked at, at most.
const SAMPLE: usize = 6667;
/// Bits of the greatest lattice coordinate.
const EXTENT_BITS: u32 = 26;
/// Beyond this index two decimals can be one `f64`.
const INDEX_LIMIT: i64 = 1 << 52;
/// What a section costs beside its symbols: its entry in the table, the end of its coder.
const SECTION: i64 = bits(12 * 8);
/// Exponents around that of the refined lattice of 2^22 steps: to 2^26 steps, to one.
const FINER: i32 = 4;
const COARSER: i32 = 22;

/// Costs are in 1/256 bits.
const fn bits(n: i64) -> i64 {
    n << 8
}

fn log2(x: u64) -> i64 {
    log2_fixed(x, 8).into()
}

/// The precision that codes every bit of `mesh` in the fewest bytes, as far as a sample tells.
///
/// Time O(1) beyond the bounds of the mesh.
pub(crate) fn exact_lattice(mesh: &Mesh) -> Precision {
    let search = Search::new(mesh);
    let decimal = (0..=9).flat_map(|exponent| search.decimals(exponent));
    let Precision::Refined { exponent, .. } = refined_grid(mesh) else { return refined_grid(mesh) };
    let middle = i32::from(exponent);
    let binary = (middle - FINER..=middle + COARSER).rev().flat_map(|e| search.binaries(e));
    // Of equals the first: the decimal grid before the binary, the coarse one before the fine.
    let best = decimal.chain(binary).min_by_key(|&(cost, _)| cost);
    best.map_or_else(|| refined_grid(mesh), |(_, precision)| precision)
}

struct Search<'a> {
    mesh: &'a Mesh,
    low: [f32; 3],
    high: [f32; 3],
    sample: Vec<[f32; 3]>,
}

impl<'a> Search<'a> {
    fn new(mesh: &'a Mesh) -> Self {
        let (low, high) = bounds(mesh);
        let apart = mesh.positions.len().div_ceil(SAMPLE).max(1);
        Search { mesh, low, high, sample: mesh.positions.iter().step_by(apart).copied().collect() }
    }

    /// The cost of the whole mesh from what the levels and the section take for the sample.
    fn whole(&self, levels: i64, section: i64) -> i64 {
        let scaled = |cost: i64| cost * self.mesh.positions.len() as i64 / self.sample.len().max(1) as i64;
        scaled(levels) + if section > 0 { scaled(section) + SECTION } else { 0 }
    }

    /// The cost of the sample's coordinates within an extent of so many steps on each axis;
    /// `None` if there are too many.
    fn extent(&self, steps: [i64; 3]) -> Option<i64> {
        let fit = steps.iter().all(|steps| (0..1 << EXTENT_BITS).contains(steps));
        fit.then(|| steps.map(|steps| log2(steps as u64 + 1)).iter().sum::<i64>() * self.sample.len() as i64)
    }

    /// Decimal lattices of numbers with `exponent` digits after the point.
    fn decimals(&self, exponent: u8) -> Vec<(i64, Precision)> {
        let index = |p: [f32; 3]| p.map(|x| decimal_index(x, exponent));
        let (low, high) = (index(self.low), index(self.high));
        if low.iter().chain(&high).any(|i| i.unsigned_abs() > INDEX_LIMIT as u64) {
            return Vec::new();
        }
        let indices: Vec<[i64; 3]> = self.sample.iter().map(|&p| index(p)).collect();
        let mut offsets = Offsets::new();
        let mut off = 0;
        for (known, index) in self.sample.iter().zip(&indices) {
            off += (0..3).map(|k| offsets.cost(decimal_value(index[k], exponent), known[k])).sum::<i64>();
        }
        let with_digits = |digits: u8| {
            let step = decimal_step(digits);
            let origin: [i64; 3] = std::array::from_fn(|axis| {
                let phase = commonest_rest(indices.iter().map(|p| p[axis]), step);
                phase + (low[axis] - phase + step / 2).div_euclid(step) * step
            });
            let steps = std::array::from_fn(|k| (high[k] - origin[k] + step / 2).div_euclid(step));
            let levels = self.extent(steps)?;
            let section = off + digits_cost(&indices, digits, origin);
            Some((self.whole(levels, section), Precision::Decimal { exponent, digits, origin }))
        };
        (0..=3).filter_map(with_digits).collect()
    }

    /// The binary and the refined lattice of step 2^`exponent`.
    fn binaries(&self, exponent: i32) -> Vec<(i64, Precision)> {
        let Some(origin) = binary_origin(self.mesh, exponent) else { return Vec::new() };
        let precision = Precision::Binary { exponent: exponent as i16, origin };
        let lattice = Lattice::new(&precision);
        let Some(levels) = self.extent(lattice.quantise(self.high).map(i64::from)) else { return Vec::new() };
        let mut offsets = Offsets::new();
        let (mut off, mut within) = (0, 0);
        for &known in &self.sample {
            let q = lattice.quantise(known);
            let value = lattice.value(q);
            for axis in 0..3 {
                off += offsets.cost(value[axis], known[axis]);
                let cell = cell(origin[axis] + i64::from(q[axis]), exponent);
                within += cell.map_or(0, |[first, last]| log2((last - first) as u64 + 1));
            }
        }
        let refined = Precision::Refined { exponent: exponent as i16, origin };
        vec![(self.whole(levels, off), precision), (self.whole(levels, within), refined)]
    }
}

/// The rest modulo `step` that most of `indices` have; of several the least.
fn commonest_rest(indices: impl Iterator<Item = i64>, step: i64) -> i64 {
    let mut counts = vec![0u32; step as usize];
    indices.for_each(|index| counts[index.rem_euclid(step) as usize] += 1);
    let most = counts.iter().copied().max().unwrap_or(0);
    counts.iter().position(|&count| count == most).unwrap_or(0) as i64
}

/// What the digits below the step cost.
fn digits_cost(indices: &[[i64; 3]], digits: u8, origin: [i64; 3]) -> i64 {
    let step = decimal_step(digits);
    let mut tallies = [const { [const { Tally::<10>::NEW }; 3] }; DECADES];
    let mut cost = 0;
    for index in indices {
        for axis in 0..3 {
            let rest = (index[axis] - origin[axis]).rem_euclid(step);
            let nearest = index[axis] - if 2 * rest < step { rest } else { rest - step };
            for k in 0..digits {
                let digit = rest / decimal_step(k) % 10;
                cost += tallies[decade(nearest)][usize::from(k)].cost(digit as usize);
            }
        }
    }
    cost
}

/// The cost of distances in floats.
struct Offsets(Vec<Tally<34>>);

impl Offsets {
    fn new() -> Self {
        Offsets(vec![Tally::NEW; EXPONENTS])
    }

    fn cost(&mut self, expected: f32, known: f32) -> i64 {
        let offset = number_of(known) - number_of(expected);
        let size = 64 - offset.unsigned_abs().leading_zeros();
        // Of a distance that is not 0, its bits below the leading one and the sign are not predicted.
        self.0[exponent_bits(expected)].cost(size as usize) + bits(size.into())
    }
}

/// How often each of `N` symbols has come.
#[derive(Clone)]
struct Tally<const N: usize> {
    counts: [u32; N],
    total: u32,
}

impl<const N: usize> Tally<N> {
    const NEW: Self = Tally { counts: [0; N], total: 0 };

    /// What a symbol costs after those before it. The first symbol is expected to go on for ever:
    /// it costs nothing until another one comes.
    fn cost(&mut self, symbol: usize) -> i64 {
        let before = self.counts[symbol];
        self.counts[symbol] += 1;
        self.total += 1;
        if symbol == 0 && before + 1 == self.total {
            return 0;
        }
        log2(20 * u64::from(self.total) + N as u64) - log2(20 * u64::from(before) + 1)
    }
}
