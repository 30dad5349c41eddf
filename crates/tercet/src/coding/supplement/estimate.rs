//! Which lattice suits an exact file.
//!
//! A mesh need not lie on a lattice: what it lacks, the exactness section adds. A finer lattice
//! leaves less to add but costs more in the levels. Each candidate is judged by a sample of
//! coordinates: a part of the length of an edge, in steps, stands for what the levels' prediction
//! leaves, and the section's symbols are tallied as its models would. The arithmetic is that of
//! integers and of single `f64` operations, so that a mesh has one file everywhere.

use super::digits::{DECADES, MAX_DIGITS, decade, mirrored};
use super::exactness::{EXPONENTS, cell, exponent_bits, number_of};
use crate::Precision;
use crate::entropy::log2_fixed;
use crate::mesh::{
    Lattice, Mesh, binary_origin, bounds, decimal_index, decimal_step, decimal_value, power_of_two,
    refined_grid,
};
use std::collections::HashMap;

/// Coordinates that are looked at: about so many, and at most three times as many.
const SAMPLE: usize = 20_000;
/// Cells along the longest side that are in the sample or not.
const CELLS: f64 = 8192.0;
/// Faces whose edges are looked at, at most.
const FACES: usize = 7000;
/// A prediction is off by about this part of an edge.
const PART: f64 = 0.25;
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
/// The levels have `coded` vertices: those of the mesh, some of them more than once.
/// Time O(n), of a small constant.
pub(crate) fn exact_lattice(mesh: &Mesh, coded: usize) -> Precision {
    let search = Search::new(mesh, coded);
    let refined = refined_grid(mesh);
    let Precision::Refined { exponent, .. } = refined else { return refined };
    let middle = i32::from(exponent);
    let mut best = Best { cost: i64::MAX, precision: refined };
    (0..=9).for_each(|exponent| search.decimals(exponent, &mut best));
    (middle - FINER..=middle + COARSER).rev().for_each(|exponent| search.binaries(exponent, &mut best));
    best.precision
}

/// The best candidate so far; of equals the first: the decimal grid before the binary, the coarse
/// one before the fine.
struct Best {
    cost: i64,
    precision: Precision,
}

impl Best {
    fn offer(&mut self, cost: i64, precision: Precision) {
        if cost < self.cost {
            *self = Best { cost, precision };
        }
    }
}

/// A coordinate of the sample and its axis.
type Sampled = (usize, f32);

struct Search<'a> {
    mesh: &'a Mesh,
    low: [f32; 3],
    high: [f32; 3],
    sample: Vec<Sampled>,
    /// Extents of edges along the axes.
    edges: Vec<f64>,
    /// Coordinates in the levels.
    coded: i64,
}

impl<'a> Search<'a> {
    /// Samples by magnitude, some 2^13 cells of it, so that coordinates that share a place do so
    /// in the sample too.
    fn new(mesh: &'a Mesh, coded: usize) -> Self {
        let (low, high) = bounds(mesh);
        let one_in = (3 * mesh.positions.len()).div_ceil(SAMPLE).max(1) as u32;
        let coordinates = mesh.positions.iter().flat_map(|p| p.iter().copied().enumerate());
        let sides = (0..3).map(|k| f64::from(high[k]) - f64::from(low[k]));
        let cell = sides.fold(f64::MIN_POSITIVE, f64::max) / CELLS;
        let hash = |x: f32| ((f64::from(x.abs()) / cell) as u32).wrapping_mul(0x9e37_79b1) >> 8;
        let chosen = coordinates.filter(|&(_, x)| hash(x) % one_in == 0);
        // The order of the file may bring mirror images together; that of the levels does not.
        let mut sample: Vec<(u32, Sampled)> =
            (0u32..).map(|i| i.wrapping_mul(0x9e37_79b1)).zip(chosen).take(3 * SAMPLE).collect();
        sample.sort_unstable_by_key(|&(key, _)| key);
        let sample = sample.into_iter().map(|(_, sampled)| sampled).collect();
        let apart = mesh.faces.len().div_ceil(FACES).max(1);
        let edges = mesh.faces.iter().step_by(apart).flat_map(|&[a, b, _]| {
            let [a, b] = [a, b].map(|v| mesh.positions[v as usize]);
            (0..3).map(move |k| (f64::from(a[k]) - f64::from(b[k])).abs() * PART)
        });
        let mut edges: Vec<f64> = edges.collect();
        if edges.is_empty() {
            edges = (0..3).map(|k| f64::from(high[k]) - f64::from(low[k])).collect();
        }
        Search { mesh, low, high, sample, edges, coded: 3 * coded.max(1) as i64 }
    }

    /// The cost of the section from what it takes for the sample.
    fn section(&self, cost: i64) -> i64 {
        let coordinates = 3 * self.mesh.positions.len() as i64;
        if cost == 0 { 0 } else { cost * coordinates / self.sample.len() as i64 + SECTION }
    }

    /// The cost of the levels on a lattice of this step, with extents of so many `steps`; `None`
    /// if there are too many.
    fn levels(&self, step: f64, steps: [i64; 3]) -> Option<i64> {
        let fit = steps.iter().all(|steps| (0..1 << EXTENT_BITS).contains(steps));
        let cost = |length: &f64| log2((length / step * 256.0) as u64 + 256) - bits(8);
        fit.then(|| self.edges.iter().map(cost).sum::<i64>() * self.coded / self.edges.len() as i64)
    }

    /// Decimal lattices of numbers with `exponent` digits after the point.
    fn decimals(&self, exponent: u8, best: &mut Best) {
        let index = |p: [f32; 3]| p.map(|x| decimal_index(x, exponent));
        let (low, high) = (index(self.low), index(self.high));
        if low.iter().chain(&high).any(|i| i.unsigned_abs() > INDEX_LIMIT as u64) {
            return;
        }
        let indices: Vec<(usize, i64)> =
            self.sample.iter().map(|&(axis, x)| (axis, decimal_index(x, exponent))).collect();
        let mut offsets = Offsets::new();
        let pairs = self.sample.iter().zip(&indices);
        let off: i64 = pairs.map(|(&(_, x), &(_, i))| offsets.cost(decimal_value(i, exponent), x)).sum();
        for digits in 0..=MAX_DIGITS {
            let step = decimal_step(digits);
            let origin: [i64; 3] = std::array::from_fn(|axis| {
                let on_axis = indices.iter().filter(|&&(a, _)| a == axis);
                let phase = common_rest(on_axis.map(|&(_, i)| i.rem_euclid(step)));
                phase + (low[axis] - phase + step / 2).div_euclid(step) * step
            });
            let steps = std::array::from_fn(|k| (high[k] - origin[k] + step / 2).div_euclid(step));
            let levels = self.levels(f64::from(decimal_value(step, exponent)), steps);
            // The digits take the most time to judge, and are not worth it where the rest is too dear.
            let Some(levels) = levels.filter(|levels| levels + self.section(off) < best.cost) else {
                continue;
            };
            let section = self.section(off + digits_cost(&indices, digits, origin));
            best.offer(levels + section, Precision::Decimal { exponent, digits, origin });
        }
    }

    /// The binary and the refined lattice of step 2^`exponent`.
    fn binaries(&self, exponent: i32, best: &mut Best) {
        let Some(origin) = binary_origin(self.mesh, exponent) else { return };
        let precision = Precision::Binary { exponent: exponent as i16, origin };
        let lattice = Lattice::new(&precision);
        let step = power_of_two(exponent);
        let steps = lattice.quantise(self.high).map(i64::from);
        let Some(levels) = self.levels(step, steps) else { return };
        let mut offsets = Offsets::new();
        let (mut off, mut within) = (0, 0);
        for &(axis, x) in &self.sample {
            let q = lattice.quantise([x; 3]);
            off += offsets.cost(lattice.value(q)[axis], x);
            let cell = cell(origin[axis] + i64::from(q[axis]), exponent);
            within += cell.map_or(0, |[first, last]| log2((last - first) as u64 + 1));
        }
        let refined = Precision::Refined { exponent: exponent as i16, origin };
        best.offer(levels + self.section(off), precision);
        best.offer(levels + self.section(within), refined);
    }
}

/// The rest that more than half of `rests` are, if there is one; else 0 (Boyer and Moore, 1981).
fn common_rest(rests: impl Iterator<Item = i64> + Clone) -> i64 {
    let (mut common, mut lead) = (0, 0i64);
    for rest in rests.clone() {
        if lead == 0 {
            common = rest;
        }
        lead += if rest == common { 1 } else { -1 };
    }
    let (same, all) = rests.fold((0, 0), |(same, all), rest| (same + usize::from(rest == common), all + 1));
    if 2 * same > all { common } else { 0 }
}

/// What the digits below the step cost.
fn digits_cost(indices: &[(usize, i64)], digits: u8, origin: [i64; 3]) -> i64 {
    if digits == 0 {
        return 0;
    }
    let step = decimal_step(digits);
    let mut same = [const { Tally::<2>::NEW }; DECADES];
    let mut tallies = [const { [const { Tally::<10>::NEW }; MAX_DIGITS as usize] }; DECADES];
    let mut seen: HashMap<(usize, u64), i64> = HashMap::new();
    let mut cost = 0;
    for &(axis, index) in indices {
        let rest = (index - origin[axis]).rem_euclid(step);
        let point = index - if 2 * rest < step { rest } else { rest - step };
        let held = mirrored(rest, point, step);
        let decade = decade(point);
        if let Some(before) = seen.insert((axis, point.unsigned_abs()), held) {
            let again = before == held;
            cost += same[decade].cost(usize::from(!again));
            if again {
                continue;
            }
        }
        for k in 0..digits {
            let digit = rest / decimal_step(k) % 10;
            cost += tallies[decade][usize::from(k)].cost(digit as usize);
        }
    }
    cost
}

/// The cost of distances in floats.
struct Offsets(Vec<Tally<68>>);

impl Offsets {
    fn new() -> Self {
        Offsets(vec![Tally::NEW; EXPONENTS])
    }

    fn cost(&mut self, expected: f32, known: f32) -> i64 {
        let offset = number_of(known) - number_of(expected);
        let size = 64 - offset.unsigned_abs().leading_zeros();
        let symbol = size as usize * 2 + usize::from(offset < 0);
        // The bits below the leading one are taken to be noise.
        self.0[exponent_bits(expected)].cost(symbol) + bits(size.saturating_sub(1).into())
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

#[cfg(test)]
mod tests {
    use super::*;

    /// A strip of triangles whose vertices have these coordinates in turn.
    fn strip(values: impl IntoIterator<Item = f32>) -> Mesh {
        let values: Vec<f32> = values.into_iter().collect();
        let positions: Vec<[f32; 3]> = values.chunks_exact(3).map(|c| [c[0], c[1], c[2]]).collect();
        let faces = (2..positions.len() as u32).map(|v| [v - 2, v - 1, v]).collect();
        Mesh { positions, faces }
    }

    fn chosen(mesh: &Mesh) -> Precision {
        exact_lattice(mesh, mesh.positions.len())
    }

    /// Numbers without a pattern below 10^6.
    fn noise(i: u32) -> f64 {
        f64::from(i.wrapping_mul(0x9e37_79b1).rotate_left(15).wrapping_mul(0x85eb_ca6b) % 1_000_000)
    }

    #[test]
    fn decimal_text_is_recognised_with_the_fewest_digits() {
        for digits in 0..=6u8 {
            let scale = 10f64.powi(digits.into());
            let mesh = strip((0..900).map(|i| (noise(i) / scale) as f32));
            let precision = chosen(&mesh);
            assert!(
                matches!(precision, Precision::Decimal { exponent, digits: 0, .. } if exponent == digits),
                "{digits}: {precision:?}"
            );
        }
    }

    #[test]
    fn outliers_do_not_hide_a_decimal_grid() {
        let value = |i: u32| if i % 100 == 7 { (noise(i) / 7e6) as f32 } else { (noise(i) / 1e6) as f32 };
        let precision = chosen(&strip((0..9000).map(value)));
        assert!(matches!(precision, Precision::Decimal { exponent: 6, digits: 0, .. }), "{precision:?}");
    }

    #[test]
    fn a_grid_between_the_decimals_is_found() {
        let mesh = strip((0..900).map(|i| ((10.0 * noise(i) + 5.0) / 1e7) as f32));
        let Precision::Decimal { exponent: 7, digits: 1, origin } = chosen(&mesh) else { panic!() };
        assert!(origin.iter().all(|x| x.rem_euclid(10) == 5), "{origin:?}");
    }

    #[test]
    fn digits_that_only_small_numbers_have_are_left_to_the_section() {
        // Six significant digits of numbers up to 100.
        let value = |i: u32| match i % 3 {
            0 => (noise(i) / 1e4) as f32,
            1 => (noise(i) / 1e5) as f32,
            _ => (noise(i) / 1e6) as f32,
        };
        let precision = chosen(&strip((0..9000).map(value)));
        assert!(matches!(precision, Precision::Decimal { exponent: 6, digits: 2, .. }), "{precision:?}");
    }

    #[test]
    fn the_grid_with_fewer_steps_wins() {
        // Eighths need three decimal digits, that is 1000 steps a unit instead of 8.
        let eighths = strip((0..900).map(|i| ((noise(i) % 4096.0) / 8.0) as f32));
        assert!(matches!(chosen(&eighths), Precision::Binary { exponent: -3, .. }));
        let thousands = strip((0..900).map(|i| (noise(i) % 4096.0) as f32 * 1024.0));
        assert!(matches!(chosen(&thousands), Precision::Binary { exponent: 10, .. }));
    }

    #[test]
    fn floats_of_no_grid_are_refined() {
        let mesh = strip((0..9000).map(|i| (noise(i) / 1e6).sqrt() as f32 + 1.0));
        let precision = chosen(&mesh);
        assert!(matches!(precision, Precision::Refined { .. } | Precision::Binary { .. }), "{precision:?}");
    }

    #[test]
    fn any_mesh_has_a_lattice_and_its_points_fit() {
        let tiny = f32::from_bits(1);
        for values in [
            vec![],
            vec![0.0; 9],
            vec![-0.0, 0.0, -0.0],
            vec![tiny, -tiny, 3.0 * tiny],
            vec![f32::MAX; 9],
            vec![f32::MAX, f32::MIN, tiny, 1.0, 1e-20, -1e20, 0.0, 5.0, 7.0],
            vec![1e30, 1e30, 1e30, 1.000_000_1e30, 1e30, 1e30],
        ] {
            let mesh = strip(values);
            let lattice = Lattice::new(&chosen(&mesh));
            for &p in &mesh.positions {
                assert!(lattice.quantise(p).iter().all(|q| (0..1 << EXTENT_BITS).contains(q)), "{p:?}");
            }
        }
    }
}
