//! Positions by tables: what the fast profile codes in place of [`position`](super::position)'s
//! mixed decisions.
//!
//! The pass, the ring and the shift into the tangent plane are the same; but a coordinate has one
//! expectation, and what it is off by is one symbol of sixteen and a few plain bits. Two adaptive
//! distributions, averaged, give the symbol's probability: one for how large errors are here, one
//! for how large those of the axes before turned out.

use super::pass::{AxisOrder, Pass, Roughness};
use super::position::{BOUNDARY, NORMAL, TANGENTIAL, axes, plain};
use super::scale::{Scale, ScaleCell, bin};
use super::vector::{COORDINATE_LIMIT, Point, Vector, add_to, cross, sub};
use crate::entropy::{Coder, Counter, Frequencies, SYMBOLS, log2_fixed, squash};
use crate::mesh::{Surface, next};
use crate::subdivide::FRACTION_BITS;

/// The models of positions; they live as long as the file.
pub(crate) struct TableModels {
    /// By kind of axis, number of neighbours coded before, distance of the neighbours, roughness.
    cells: Vec<ScaleCell>,
    /// By kind of axis, width and fraction.
    by_fraction: Vec<Frequencies>,
    /// By kind of axis, width and the errors on the axes before.
    by_surprise: Vec<Frequencies>,
    /// By kind of axis and length in bits.
    escapes: Vec<Counter>,
}

const KINDS: usize = 3;
const NEW: usize = 4;
const SIZES: usize = 32;
const ROUGH: usize = 24;
const WIDTHS: usize = 41;
const FRACTIONS: usize = 4;
const SURPRISES: usize = 7;
const LENGTHS: usize = 32;

/// Corners of a fan that are looked at.
const MOST: usize = 32;

/// Symbols for errors within ± this, in units; the last symbol is for those beyond.
const NEAR: i64 = 7;

/// 65536 / n.
static RECIPROCAL: [i64; MOST + 1] = {
    let mut table = [0; MOST + 1];
    let mut n = 1;
    while n <= MOST {
        table[n] = 65536 / n as i64;
        n += 1;
    }
    table
};

/// How wide errors are: the bin of a mean magnitude, and how many of their low bits are plain.
#[derive(Clone, Copy)]
struct Width {
    bin: usize,
    plain: u32,
}

impl Width {
    /// Of a mean magnitude in 1/256. Bins are quarter octaves; beyond the 37th only the part of
    /// an octave counts, because every octave then leaves one more bit plain.
    #[inline(always)]
    fn new(mean: u64) -> Self {
        let log = log2_fixed(mean, 2);
        let plain = ((log - 34).max(0) >> 2) as u32;
        let bin = (log - 17).max(0) as usize;
        Width { bin: if bin < 37 { bin } else { 37 + (bin - 37) % 4 }, plain }
    }

    /// A mean magnitude of the bin and its plain bits.
    fn representative(bin: usize) -> (u64, u32) {
        let log = bin as u32 + 17;
        let mean = ((9 + 2 * (log as u64 & 3)) << (log / 4)) / 8;
        (mean, (log.max(34) - 34) >> 2)
    }
}

/// The distribution to begin with: logistic, its centre `offset`/256 above the middle of symbol 0.
fn initial(bin: usize, offset: i64) -> Frequencies {
    let (mean, plain) = Width::representative(bin);
    let scale = Scale::new(mean);
    let half = (1i64 << plain) >> 1;
    // P(error < the first of a unit) in 1/65536.
    let below = |unit: i64| squash(scale.standardise(256 * ((unit << plain) - half) - 128 - offset)) as i64;
    let mut before = [0i16; SYMBOLS];
    let mut sum = 0i64;
    for (symbol, before) in before.iter_mut().enumerate() {
        *before = sum as i16;
        if symbol < SYMBOLS - 1 {
            let unit = unfold(symbol);
            sum += (((below(unit + 1) - below(unit)) * 16300) >> 16).max(4);
        }
    }
    Frequencies::new(before)
}

/// 0, 1, −1, 2, −2, … for 0, 1, 2, 3, 4, …
#[inline(always)]
fn unfold(symbol: usize) -> i64 {
    let half = symbol.div_ceil(2) as i64;
    if symbol % 2 == 1 { half } else { -half }
}

/// The inverse of [`unfold`].
#[inline(always)]
fn fold(unit: i64) -> usize {
    if unit > 0 { 2 * unit as usize - 1 } else { (-2 * unit) as usize }
}

/// What is known around a vertex.
struct Around {
    /// Where it is expected, in 1/256.
    expected: Vector,
    /// Of the surface, below 2²¹.
    normal: Vector,
    at_boundary: bool,
    /// The cell of a tangential axis less its roughness.
    cell: usize,
    /// Mean distance of the known neighbours in 1/256, and their mean roughness.
    edge: u64,
    rough: Roughness,
}

/// The known neighbours of the vertex visited last.
struct Known {
    vertices: [u32; MOST],
    count: usize,
}

impl TableModels {
    pub fn new() -> Self {
        let distributions = |contexts: usize, offset: fn(usize) -> i64| -> Vec<Frequencies> {
            let table = (0..KINDS * WIDTHS * contexts)
                .map(|i| initial(i / contexts % WIDTHS, offset(i % contexts)));
            table.collect()
        };
        TableModels {
            cells: vec![ScaleCell::default(); KINDS * NEW * SIZES * ROUGH],
            by_fraction: distributions(FRACTIONS, |fraction| 32 * fraction as i64 + 16),
            by_surprise: distributions(SURPRISES, |_| 48),
            escapes: vec![Counter::NEW; KINDS * LENGTHS],
        }
    }

    /// Codes the positions of vertices `pass.first..`, those of `targets` when encoding. `positions`
    /// has an entry a vertex: of those to be coded the estimate, rounded, if there are any. Time O(n).
    pub fn code<C: Coder>(
        &mut self,
        coder: &mut C,
        pass: &Pass,
        corners: &[u32],
        targets: &[Point],
        positions: &mut [Point],
        rough: &mut [Roughness],
    ) {
        let mut errors: Vec<[i32; 3]> = Vec::with_capacity(pass.estimates.len());
        let mut known = Known { vertices: [0; MOST], count: 0 };
        for (i, &corner) in corners.iter().enumerate() {
            if coder.exhausted() {
                // The caller refuses the level; what follows would only take time.
                break;
            }
            let v = pass.first as usize + i;
            let target = targets.get(i).copied().unwrap_or([0; 3]);
            let around = look(pass, corner, v as u32, positions, &errors, rough, &mut known);
            let point = match around {
                None => plain(coder, pass, target),
                Some(around) => {
                    let (point, off) = self.vertex(coder, &around, pass.order, target);
                    rough[v] = off;
                    for &y in &known.vertices[..known.count] {
                        rough[y as usize].blend(off);
                    }
                    point
                }
            };
            if let Some(estimate) = pass.estimates.get(i) {
                errors.push([0, 1, 2].map(|k| (((point[k] as i64) << FRACTION_BITS) - estimate[k]) as i32));
            }
            positions[v] = point;
        }
    }

    #[inline(always)]
    fn vertex<C: Coder>(
        &mut self,
        coder: &mut C,
        around: &Around,
        order: AxisOrder,
        target: Point,
    ) -> (Point, Roughness) {
        let axes = axes(around.normal, order);
        let normal = around.normal;
        let mut point = target;
        let mut sizes = [0u64; 3];
        let mut moved = around.expected;
        let mut surprise = 0;
        let normal_step = if order == AxisOrder::NormalLast { 2 } else { 0 };
        for (step, &axis) in axes.iter().enumerate() {
            let kind = match around.at_boundary {
                true => BOUNDARY,
                false if step == normal_step => NORMAL,
                false => TANGENTIAL,
            };
            let (value, main) = self.coordinate(coder, around, kind, surprise, moved[axis], target[axis]);
            point[axis] = value;
            let off = ((value as i64) << FRACTION_BITS) - moved[axis];
            sizes[step] = off.unsigned_abs();
            surprise = match step {
                0 => 1 + (sizes[0] > main / 2) as usize + (sizes[0] > main + main / 2) as usize,
                _ => 4 + (sizes[0] + sizes[1] > main) as usize + (sizes[0] + sizes[1] > 3 * main) as usize,
            };
            moved[axis] += off;
            shift(&mut moved, &around.expected, normal, axes, step, order);
        }
        let [first, second, third] = sizes.map(|s| s.min(u32::MAX as u64 / 16) as u32);
        let rough = match order {
            AxisOrder::NormalLast => Roughness { tangential: (first + second) / 2, normal: third },
            AxisOrder::NormalFirst => Roughness { tangential: (second + third) / 2, normal: first },
        };
        (point, rough)
    }

    #[inline(always)]
    fn coordinate<C: Coder>(
        &mut self,
        coder: &mut C,
        around: &Around,
        kind: usize,
        surprise: usize,
        centre: i64,
        target: i32,
    ) -> (i32, u64) {
        let rough = if kind == NORMAL { around.rough.normal } else { around.rough.tangential } as u64;
        let cell = (kind * NEW * SIZES + around.cell) * ROUGH + bin(rough + 8, 2, -9, ROUGH);
        let prior = rough / 2 + (around.edge >> if kind == NORMAL { 6 } else { 4 }) + 40;
        let main = self.cells[cell].mean(prior);
        let width = Width::new(main);
        let middle = (centre + 128) >> FRACTION_BITS;
        let fraction = centre - (middle << FRACTION_BITS);
        let mirror = |x: i64| if fraction < 0 { -x } else { x };
        let table = kind * WIDTHS + width.bin;
        let fraction = (fraction.unsigned_abs() as usize / 32).min(FRACTIONS - 1);
        let first = &mut self.by_fraction[table * FRACTIONS + fraction];
        let second = &mut self.by_surprise[table * SURPRISES + surprise];
        let half = (1i64 << width.plain) >> 1;
        let error = mirror(target as i64 - middle) + half;
        let unit = error >> width.plain;
        let wanted = if unit.abs() <= NEAR { fold(unit) } else { SYMBOLS - 1 };
        let symbol = coder.symbol(wanted, first.mean(second));
        first.learn(symbol, 5);
        second.learn(symbol, 4);
        let unit = if symbol < SYMBOLS - 1 { unfold(symbol) } else { self.escape(coder, kind, unit) };
        let low = if width.plain == 0 { 0 } else { coder.raw_wide((error & ((1 << width.plain) - 1)) as u32, width.plain) };
        let value = middle + mirror((unit << width.plain) + low as i64 - half);
        let value = value.clamp(-(COORDINATE_LIMIT as i64), COORDINATE_LIMIT as i64) as i32;
        self.cells[cell].learn(((value as i64) << FRACTION_BITS).abs_diff(centre));
        (value, main)
    }

    /// An error of more than [`NEAR`] units: its sign, the length of the rest, its bits.
    #[cold]
    fn escape<C: Coder>(&mut self, coder: &mut C, kind: usize, unit: i64) -> i64 {
        let negative = coder.raw((unit < 0) as u32, 1) == 1;
        let rest = (unit.abs() - NEAR).clamp(1, u32::MAX as i64) as u32;
        let wanted = rest.ilog2() as usize;
        let mut length = 0;
        while length < LENGTHS - 1 {
            let counter = &mut self.escapes[kind * LENGTHS + length];
            let more = coder.bit(length < wanted, counter.p());
            counter.learn(more, 250);
            if !more {
                break;
            }
            length += 1;
        }
        let rest = 1i64 << length | coder.raw_wide(rest & ((1 << length) - 1), length as u32) as i64;
        if negative { -NEAR - rest } else { NEAR + rest }
    }
}

/// Looks around vertex `v` at `corner`; nothing if no neighbour is known.
#[inline(always)]
fn look(
    pass: &Pass,
    corner: u32,
    v: u32,
    positions: &[Point],
    errors: &[[i32; 3]],
    rough: &[Roughness],
    known: &mut Known,
) -> Option<Around> {
    let surface: &Surface = pass.surface;
    let has_estimates = !pass.estimates.is_empty();
    known.count = 0;
    let mut at_boundary = false;
    let mut error = [0i64; 3];
    let mut with_error = 0;
    let (mut tangential, mut normal_rough) = (0u64, 0u64);
    let mut distance = 0u64;
    let mut sum = [0i64; 3];
    let mut normal = [0i64; 3];
    let origin = positions[v as usize];
    let mut first: Option<Vector> = None;
    let mut before: Option<Vector> = None;
    let mut c = corner;
    for _ in 0..MOST {
        let n = next(c);
        let a = surface.at(n);
        let mut place = None;
        if surface.is_virtual(a) {
            at_boundary = true;
        } else {
            let i = a as usize;
            let is_known = a < v;
            if is_known || has_estimates {
                place = Some(sub(positions[i], origin));
            }
            if let (Some(at), true) = (place, is_known) {
                known.vertices[known.count] = a;
                known.count += 1;
                tangential += rough[i].tangential as u64;
                normal_rough += rough[i].normal as u64;
                distance += at[0].unsigned_abs() + at[1].unsigned_abs() + at[2].unsigned_abs();
                for k in 0..3 {
                    sum[k] += at[k];
                }
                if has_estimates && a >= pass.first {
                    let e = errors[(a - pass.first) as usize];
                    for k in 0..3 {
                        error[k] += e[k] as i64;
                    }
                    with_error += 1;
                }
            }
        }
        if let (Some(x), Some(y)) = (before, place) {
            add_to(&mut normal, cross(x, y));
        }
        if first.is_none() {
            first = place;
        }
        before = place;
        c = next(surface.across(n));
        if c == corner {
            break;
        }
    }
    if known.count == 0 {
        return None;
    }
    if let (Some(x), Some(y)) = (before, first) {
        add_to(&mut normal, cross(x, y));
    }
    let n = known.count;
    let reciprocal = RECIPROCAL[n];
    let mean = |x: u64| (x * reciprocal as u64) >> 16;
    let expected = match pass.estimates.get((v - pass.first) as usize) {
        Some(e) => [0, 1, 2].map(|k| e[k] + ((error[k] * SHARE[with_error.min(7)]) >> 8)),
        None => [0, 1, 2].map(|k| ((origin[k] as i64) << FRACTION_BITS) + ((sum[k] * reciprocal) >> 8)),
    };
    let all = normal.iter().fold(0, |m, x| m | x.unsigned_abs());
    let spare = 43u32.saturating_sub(all.leading_zeros());
    // |x| + |y| + |z| is some 3/2 of the length.
    let edge = mean(distance << FRACTION_BITS);
    let size = bin(edge + 1, 2, -7, SIZES);
    Some(Around {
        expected,
        normal: normal.map(|x| x >> spare),
        at_boundary,
        cell: with_error.min(NEW - 1) * SIZES + size,
        edge,
        rough: Roughness { tangential: mean(tangential) as u32, normal: mean(normal_rough) as u32 },
    })
}

/// How much of each neighbour's error to expect again, in 1/256, by the number of neighbours.
const SHARE: [i64; 8] = [0, 48, 36, 28, 23, 19, 16, 14];

/// Moves the expectations of the axes to come by what those before were off, so that the point stays
/// in the tangent plane (normal last) or on the normal line (normal first).
#[inline(always)]
fn shift(
    moved: &mut Vector,
    expected: &Vector,
    normal: Vector,
    axes: [usize; 3],
    step: usize,
    order: AxisOrder,
) {
    let off = |k: usize| (moved[k] - expected[k]).clamp(-FAR, FAR);
    match (order, step) {
        (AxisOrder::NormalLast, 1) if normal[axes[2]] != 0 => {
            let sum = normal[axes[0]] * off(axes[0]) + normal[axes[1]] * off(axes[1]);
            moved[axes[2]] -= sum / normal[axes[2]];
        }
        (AxisOrder::NormalFirst, 0) if normal[axes[0]] != 0 => {
            let off = off(axes[0]);
            for later in [axes[1], axes[2]] {
                moved[later] += normal[later] * off / normal[axes[0]];
            }
        }
        _ => {}
    }
}

/// No expectation is moved by more than this.
const FAR: i64 = 1 << 37;
