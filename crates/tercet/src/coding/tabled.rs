//! Positions by tables: what the fast profile codes in place of [`position`](super::position)'s
//! mixed decisions.
//!
//! The pass, the ring and the shift into the tangent plane are the same; but a coordinate has one
//! expectation, and what it is off by is one symbol of sixteen and a few plain bits. Coordinates
//! often repeat one nearby: the symbol that the nearest neighbour's would be, and that of the nearest
//! parallelogram, each select an adaptive distribution, and the two are averaged.

use super::axes::{AxisOrder, KINDS, NORMAL, axes, kind};
use super::pass::{Pass, Progress, Roughness, Turn, plain};
use super::scale::{Scale, ScaleCell, bin};
use super::vector::{COORDINATE_LIMIT, Point, Vector, cross, sub};
use crate::entropy::{Coder, Counter, Frequencies, SYMBOLS, log2_fixed, squash};
use crate::mesh::{Surface, next};
use crate::subdivide::FRACTION_BITS;
use wide::i16x8;

/// The models of positions; they live as long as the file.
#[derive(Clone)]
pub(crate) struct TableModels {
    /// By kind of axis, number of neighbours coded before, distance of the neighbours, roughness.
    cells: Vec<ScaleCell>,
    /// By kind of axis, width and the symbol that the nearest neighbour's coordinate would be.
    by_neighbour: Vec<Frequencies>,
    /// The same for the nearest parallelogram's coordinate.
    by_parallelogram: Vec<Frequencies>,
    /// By kind of axis and length in bits.
    escapes: Vec<Counter>,
}

const NEW: usize = 4;
const SIZES: usize = 32;
const ROUGH: usize = 24;
const WIDTHS: usize = 41;
const LENGTHS: usize = 32;

/// Corners of a fan that are looked at.
const MOST: usize = 32;

/// The first steps of distributions are 2⁻⁴.
const FASTEST: u32 = 4;

/// Symbols for errors within ± this, in units; the last symbol is for those beyond.
const NEAR: i64 = 7;

/// 65536 / n.
static RECIPROCAL: [u64; MOST + 1] = {
    let mut table = [0; MOST + 1];
    let mut n = 1;
    while n <= MOST {
        table[n] = 65536 / n as u64;
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

/// The distribution to begin with in a bin of widths: logistic, its centre a little above the
/// middle of symbol 0.
fn initial(bin: usize) -> Frequencies {
    let (mean, plain) = Width::representative(bin);
    let scale = Scale::new(mean);
    let half = (1i64 << plain) >> 1;
    // P(error < the first of a unit) in 1/65536.
    let below = |unit: i64| squash(scale.standardise(256 * ((unit << plain) - half) - 128 - 48)) as i64;
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
    /// Where it is expected, in 1/256, and its rounded estimate.
    expected: Vector,
    origin: Point,
    /// Of the surface, below 2²¹.
    normal: Vector,
    at_boundary: bool,
    /// Digits of a cell that hold for all axes.
    cell: usize,
    /// Mean distance of the known neighbours in 1/256, and their mean roughness.
    edge: u64,
    rough: Roughness,
}

/// Where a coordinate is expected, in 1/256.
struct Centre {
    kind: usize,
    axis: usize,
    place: i64,
}

/// A list of points, relative to the rounded estimate of a vertex, axis by axis.
struct Points {
    offsets: [[i16; Points::MOST]; 3],
    count: usize,
}

impl Points {
    const MOST: usize = 8;
    /// Offsets are held within ± this …
    const FAR: i16 = 1 << 13;
    /// … so that this, in the place of a point that is not there, is far from all of them.
    const NONE: i16 = 1 << 14;

    const EMPTY: Points = Points { offsets: [[Points::NONE; Points::MOST]; 3], count: 0 };

    /// Adds a point if there is room.
    #[inline(always)]
    fn push(&mut self, point: Vector) {
        if self.count < Self::MOST {
            for (offsets, offset) in self.offsets.iter_mut().zip(point) {
                offsets[self.count] = Self::held(offset);
            }
            self.count += 1;
        }
    }

    #[inline(always)]
    fn held(offset: i64) -> i16 {
        offset.clamp(-Self::FAR as i64, Self::FAR as i64) as i16
    }

    /// The least symbol that one of the coordinates would be.
    #[inline(always)]
    fn least_symbol(&self, axis: usize, frame: Frame) -> usize {
        if frame.plain > 8 {
            // Coarser than what is kept of the offsets.
            return SYMBOLS - 1;
        }
        let sign = i16x8::splat(-(frame.mirrored as i16));
        let offset = i16x8::new(self.offsets[axis]) - i16x8::splat(Self::held(frame.middle));
        let unit = (((offset ^ sign) - sign) + i16x8::splat(frame.half as i16)) >> frame.plain;
        let beyond = NEAR as i16 + 1;
        let turned = (-unit).max(i16x8::splat(-beyond)).min(i16x8::splat(beyond));
        let folded = (turned << 1_i32) ^ (turned >> 15_i32);
        (folded.reduce_min() as usize).min(SYMBOLS - 1)
    }
}

/// How errors of a coordinate become units.
#[derive(Clone, Copy)]
struct Frame {
    /// The lattice coordinate nearest to the expectation, less that of the rounded estimate.
    middle: i64,
    /// Whether errors below the middle count as positive: seen so, the expectation is never below it.
    mirrored: bool,
    /// Low bits that are plain, and half of what they count to.
    plain: u32,
    half: i64,
}

/// The known neighbours of the vertex visited last, and the parallelograms that they make.
struct Ring {
    members: [u32; MOST],
    count: usize,
    neighbours: Points,
    parallelograms: Points,
}

impl TableModels {
    pub fn new() -> Self {
        let start: Vec<Frequencies> = (0..WIDTHS).map(initial).collect();
        let table: Vec<Frequencies> =
            (0..KINDS * WIDTHS * SYMBOLS).map(|i| start[i / SYMBOLS % WIDTHS]).collect();
        TableModels {
            cells: vec![ScaleCell::default(); KINDS * NEW * SIZES * ROUGH],
            by_parallelogram: table.clone(),
            by_neighbour: table,
            escapes: vec![Counter::NEW; KINDS * LENGTHS],
        }
    }

    /// Codes the positions of the vertices of a pass that are left, those of `targets` when encoding, until
    /// all are coded or bytes are missing; whether all are. They are visited in the order of their
    /// numbers. `positions` and `rough` have an entry a vertex, the former of those to be coded the
    /// estimate, rounded, if there are any. Time O(n).
    pub fn code<C: Coder>(
        &mut self,
        coder: &mut C,
        pass: &Pass,
        progress: &mut Progress,
        targets: &[Point],
        positions: &mut [Point],
        rough: &mut [Roughness],
    ) -> bool {
        let mut ring =
            Ring { members: [0; MOST], count: 0, neighbours: Points::EMPTY, parallelograms: Points::EMPTY };
        progress.run(coder, pass, targets, positions, |coder, turn| {
            let Some(around) = look(pass, turn, rough, &mut ring) else {
                return plain(coder, pass, turn.target);
            };
            let (point, off) = self.vertex(coder, &around, &ring, pass.order, turn.target);
            Roughness::spread(rough, turn.v, off, &ring.members[..ring.count]);
            point
        })
    }

    #[inline(always)]
    fn vertex<C: Coder>(
        &mut self,
        coder: &mut C,
        around: &Around,
        ring: &Ring,
        order: AxisOrder,
        target: Point,
    ) -> (Point, Roughness) {
        let axes = axes(around.normal, order);
        let normal = around.normal;
        let mut point = target;
        let mut sizes = [0u64; 3];
        let mut moved = around.expected;
        for (step, &axis) in axes.iter().enumerate() {
            let kind = kind(step, order, around.at_boundary);
            let centre = Centre { kind, axis, place: moved[axis] };
            let value = self.coordinate(coder, around, ring, centre, target[axis]);
            point[axis] = value;
            let off = ((value as i64) << FRACTION_BITS) - moved[axis];
            sizes[step] = off.unsigned_abs();
            moved[axis] += off;
            shift(&mut moved, &around.expected, normal, axes, step, order);
        }
        (point, Roughness::of(sizes, order))
    }

    #[inline(always)]
    fn coordinate<C: Coder>(
        &mut self,
        coder: &mut C,
        around: &Around,
        ring: &Ring,
        Centre { kind, axis, place }: Centre,
        target: i32,
    ) -> i32 {
        let across = kind == NORMAL;
        let rough = around.rough.along(kind) as u64;
        let cell = (kind * NEW * SIZES + around.cell) * ROUGH + bin(rough + 8, 2, -9, ROUGH);
        let prior = rough / 2 + (around.edge >> if across { 6 } else { 4 }) + 40;
        let width = Width::new(self.cells[cell].mean(prior));
        let middle = (place + 128) >> FRACTION_BITS;
        let frame = Frame {
            middle: middle - around.origin[axis] as i64,
            mirrored: place < middle << FRACTION_BITS,
            plain: width.plain,
            half: (1i64 << width.plain) >> 1,
        };
        let sign = if frame.mirrored { -1 } else { 1 };
        let table = (kind * WIDTHS + width.bin) * SYMBOLS;
        let first = &mut self.by_neighbour[table + ring.neighbours.least_symbol(axis, frame)];
        let second = &mut self.by_parallelogram[table + ring.parallelograms.least_symbol(axis, frame)];
        let error = sign * (target as i64 - middle) + frame.half;
        let low = error & ((1 << width.plain) - 1);
        let error = error >> width.plain;
        let wanted = if error.abs() <= NEAR { fold(error) } else { SYMBOLS - 1 };
        let coded = coder.symbol(wanted, first.mean(second));
        first.learn(coded, FASTEST);
        second.learn(coded, FASTEST);
        let error = if coded < SYMBOLS - 1 { unfold(coded) } else { self.escape(coder, kind, error) };
        let low = if width.plain > 0 { coder.raw_wide(low as u32, width.plain) as i64 } else { 0 };
        let value = middle + sign * ((error << width.plain) + low - frame.half);
        let value = value.clamp(-(COORDINATE_LIMIT as i64), COORDINATE_LIMIT as i64) as i32;
        self.cells[cell].learn(((value as i64) << FRACTION_BITS).abs_diff(place));
        value
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

/// Looks around the vertex whose turn it is; nothing if no neighbour is known.
#[inline(always)]
fn look(pass: &Pass, turn: &Turn, rough: &[Roughness], ring: &mut Ring) -> Option<Around> {
    let Turn { v, corner, positions, errors, .. } = *turn;
    let surface: &Surface = pass.surface;
    let has_estimates = !pass.estimates.is_empty();
    let is_known = |x: u32| x < v && !surface.is_virtual(x);
    let origin = positions[v as usize];
    let (mut fan, mut error) = (Fan::default(), Sum::default());
    let (mut tangential, mut normal, mut distance) = (0u64, 0u64, 0u64);
    let mut at_boundary = false;
    ring.count = 0;
    ring.neighbours = Points::EMPTY;
    ring.parallelograms = Points::EMPTY;
    let mut c = corner;
    for _ in 0..MOST {
        let n = next(c);
        let a = surface.at(n);
        if surface.is_virtual(a) {
            at_boundary = true;
            fan.interrupt();
        } else if a < v {
            let p = positions[a as usize];
            let place = sub(p, origin);
            fan.add(place);
            distance += place.iter().map(|x| x.unsigned_abs()).sum::<u64>();
            tangential += rough[a as usize].tangential as u64;
            normal += rough[a as usize].normal as u64;
            if a >= pass.first && has_estimates {
                error.add(errors[(a - pass.first) as usize]);
            }
            ring.members[ring.count & (MOST - 1)] = a;
            ring.count += 1;
            ring.neighbours.push(place);
            let (b, w) = (surface.at(next(n)), surface.at(surface.across(c)));
            if is_known(b) && is_known(w) {
                let (q, r) = (positions[b as usize], positions[w as usize]);
                ring.parallelograms.push([0, 1, 2].map(|k| place[k] + q[k] as i64 - r[k] as i64));
            }
        } else if has_estimates {
            fan.add(sub(positions[a as usize], origin));
        } else {
            fan.interrupt();
        }
        c = next(surface.across(n));
        if c == corner {
            break;
        }
    }
    if ring.count == 0 {
        return None;
    }
    let reciprocal = RECIPROCAL[ring.count];
    let mean = |x: u64| (x * reciprocal) >> 16;
    let expected = match turn.estimate {
        Some(e) => [0, 1, 2].map(|k| e[k] + ((error.sum[k] * SHARE[error.count.min(7)]) >> 8)),
        None => middle(&ring.members[..ring.count], positions),
    };
    // |x| + |y| + |z| is some 3/2 of the length.
    let edge = mean(distance << FRACTION_BITS);
    Some(Around {
        expected,
        origin,
        normal: fan.normal(),
        at_boundary,
        cell: error.count.min(NEW - 1) * SIZES + bin(edge + 1, 2, -7, SIZES),
        edge,
        rough: Roughness { tangential: mean(tangential) as u32, normal: mean(normal) as u32 },
    })
}

/// The mean of some vertices' positions, in 1/256.
fn middle(vertices: &[u32], positions: &[Point]) -> Vector {
    [0, 1, 2].map(|k| {
        let sum: i64 = vertices.iter().map(|&v| positions[v as usize][k] as i64).sum();
        (sum << FRACTION_BITS) / vertices.len() as i64
    })
}

/// A sum of vectors.
#[derive(Default)]
struct Sum {
    sum: Vector,
    count: usize,
}

impl Sum {
    #[inline(always)]
    fn add(&mut self, x: [i32; 3]) {
        self.sum = [0, 1, 2].map(|k| self.sum[k] + x[k] as i64);
        self.count += 1;
    }
}

/// The area of a fan whose ring comes point by point.
#[derive(Default)]
struct Fan {
    first: Option<Vector>,
    before: Option<Vector>,
    area: Vector,
}

impl Fan {
    #[inline(always)]
    fn add(&mut self, place: Vector) {
        match self.before {
            Some(before) => self.triangle(before, place),
            None if self.first.is_none() => self.first = Some(place),
            None => {}
        }
        self.before = Some(place);
    }

    /// The ring has a gap here.
    #[inline(always)]
    fn interrupt(&mut self) {
        self.before = None;
    }

    /// Only a ring of the largest faces could leave 64 bits.
    #[inline(always)]
    fn triangle(&mut self, a: Vector, b: Vector) {
        let n = cross(a, b);
        self.area = [0, 1, 2].map(|k| self.area[k].wrapping_add(n[k]));
    }

    /// The area vector, below 2²¹.
    #[inline(always)]
    fn normal(mut self) -> Vector {
        if let (Some(before), Some(first)) = (self.before, self.first) {
            self.triangle(before, first);
        }
        let all = self.area.iter().fold(0, |m, x| m | x.unsigned_abs());
        let spare = 43u32.saturating_sub(all.leading_zeros());
        self.area.map(|x| x >> spare)
    }
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
