//! Positions by tables: what the fast profile codes in place of [`position`](super::position)'s
//! mixed decisions.
//!
//! The order of axes and the shift into the tangent plane are the same; but of the neighbours only
//! those at the [site](super::site) of the vertex are looked at, a coordinate has one expectation, and
//! what it is off by is one symbol of sixteen and a few plain bits. Coordinates often repeat one nearby:
//! the symbol that the nearest neighbour's would be, and that of the nearest parallelogram, each select an
//! adaptive distribution, and the two are averaged.

use super::around::{Around, Known, PLACES};
use super::axes::{AxisOrder, KINDS, NORMAL, axes, kind, shift};
use super::group;
use super::pass::{Pass, Roughness, plain};
use super::scale::{Scale, ScaleCell, bin};
use super::site::Site;
use super::vector::{COORDINATE_LIMIT, Point};
use crate::entropy::{Coder, Counter, Frequencies, SYMBOLS, log2_fixed, squash};
use crate::mesh::Surface;
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

const ROUGH: usize = 24;
const WIDTHS: usize = 41;
const LENGTHS: usize = 32;

/// Symbols for errors within ± this, in units; the last symbol is for those beyond.
const NEAR: i64 = 7;

/// How far a pass has come.
pub(crate) struct Walk {
    sites: Vec<Site>,
    /// What there was to learn, if that is noted.
    pub lessons: Option<Vec<Lesson>>,
    /// Vertices of the pass before the first one.
    before: usize,
    /// Vertices coded so far.
    cursor: usize,
}

impl Walk {
    /// Over the vertices at `sites`, `before` which a pass has so many others; it has not begun.
    pub fn new(sites: Vec<Site>, before: usize) -> Self {
        Walk { sites, lessons: None, before, cursor: 0 }
    }

    /// How many vertices are still to be visited.
    pub fn left(&self) -> usize {
        self.sites.len() - self.cursor
    }
}

/// What models learn of a coordinate: the cell and how large its error was, the distributions and their symbol.
#[derive(Clone, Copy, Default)]
pub(crate) struct Lesson {
    size: u64,
    cell: u32,
    tables: [u32; 2],
    symbol: u32,
}

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
    let sign = (symbol & 1) as i64 - 1;
    (half ^ sign) - sign
}

/// The inverse of [`unfold`].
#[inline(always)]
fn fold(unit: i64) -> usize {
    if unit > 0 { 2 * unit as usize - 1 } else { (-2 * unit) as usize }
}

/// How errors of a coordinate become units.
#[derive(Clone, Copy)]
struct Frame {
    /// The lattice coordinate nearest to the expectation.
    middle: i64,
    /// Whether errors below the middle count as positive: seen so, the expectation is never below it.
    mirrored: bool,
    /// Low bits that are plain, and half of what they count to.
    plain: u32,
    half: i64,
}

impl Frame {
    /// The least symbol that one of the coordinates would be that are so far `from` the middle.
    #[inline(always)]
    fn least_symbol(self, from: i16x8) -> usize {
        let sign = i16x8::splat(-(self.mirrored as i16));
        // Beyond eight bits a unit is coarser than what is kept of the offsets.
        let unit = (((from ^ sign) - sign) + i16x8::splat(self.half.min(1 << 7) as i16)) >> self.plain.min(8);
        let beyond = NEAR as i16 + 1;
        let turned = (-unit).max(i16x8::splat(-beyond)).min(i16x8::splat(beyond));
        let folded = (turned << 1_i32) ^ (turned >> 15_i32);
        (folded.reduce_min() as usize).min(SYMBOLS - 1)
    }
}

impl TableModels {
    pub fn new() -> Self {
        let start: Vec<Frequencies> = (0..WIDTHS).map(initial).collect();
        let table: Vec<Frequencies> =
            (0..KINDS * WIDTHS * SYMBOLS).map(|i| start[i / SYMBOLS % WIDTHS]).collect();
        TableModels {
            cells: vec![ScaleCell::default(); KINDS * PLACES * ROUGH],
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
        walk: &mut Walk,
        targets: &[Point],
        positions: &mut [Point],
        rough: &mut [Roughness],
    ) -> bool {
        let Walk { sites, lessons, before, cursor } = walk;
        while let Some(site) = sites.get(*cursor) {
            if coder.exhausted() {
                // The caller refuses the level; what follows would only take time.
                break;
            }
            if !coder.is_ready() {
                return false;
            }
            let i = *before + *cursor;
            let v = pass.first + i as u32;
            let target = targets.get(i).copied().unwrap_or_default();
            let Pass { surface: Surface { virtuals, .. }, first, estimates, .. } = *pass;
            let known = Known { virtuals: *virtuals, v, first, positions, rough, estimates };
            let point = match Around::new(site, &known) {
                None => plain(coder, pass, target),
                Some(around) => {
                    let (point, off, learnt) = self.vertex(coder, &around, pass.order, target);
                    if group::KNOWN
                        && let Some(lessons) = lessons
                    {
                        lessons.extend(learnt);
                    }
                    Roughness::spread(rough, v, off, &site.corners);
                    Roughness::spread(rough, v, off, &site.wings);
                    point
                }
            };
            positions[v as usize] = point;
            *cursor += 1;
        }
        true
    }

    #[inline(always)]
    fn vertex<C: Coder>(
        &mut self,
        coder: &mut C,
        around: &Around,
        order: AxisOrder,
        target: Point,
    ) -> (Point, Roughness, [Lesson; 3]) {
        let axes = axes(around.normal, order);
        let mut lessons = [Lesson::default(); 3];
        // Both are known before the first coordinate is.
        let widths = [false, true].map(|across| self.width(around, across));
        let mut point = target;
        let mut sizes = [0u64; 3];
        let mut centres = [around.expected];
        for (step, &axis) in axes.iter().enumerate() {
            let kind = kind(step, order, around.at_boundary);
            let (cell, width) = widths[(kind == NORMAL) as usize];
            let place = centres[0][axis];
            let middle = (place + 128) >> FRACTION_BITS;
            let frame = Frame {
                middle,
                mirrored: place < middle << FRACTION_BITS,
                plain: width.plain,
                half: (1i64 << width.plain) >> 1,
            };
            let relative = middle - around.origin[axis] as i64;
            let [first, second] = [&around.neighbours, &around.parallelograms]
                .map(|points| frame.least_symbol(points.from(axis, relative)));
            let table = (kind * WIDTHS + width.bin) * SYMBOLS;
            let tables = [table + first, table + second];
            let (value, symbol) = self.coordinate(coder, kind, tables, frame, target[axis]);
            point[axis] = value;
            let off = ((value as i64) << FRACTION_BITS) - place;
            sizes[step] = off.unsigned_abs();
            self.cells[cell].learn(sizes[step]);
            lessons[step] = Lesson {
                cell: cell as u32,
                tables: tables.map(|table| table as u32),
                symbol: symbol as u32,
                size: sizes[step],
            };
            shift(&mut centres, [off], around.normal, axes, step, order);
        }
        (point, Roughness::of(sizes, order), lessons)
    }

    /// The cell of the coordinates in the surface or `across` it, and how wide their errors are.
    #[inline(always)]
    fn width(&self, around: &Around, across: bool) -> (usize, Width) {
        let kind = kind(if across { 2 } else { 0 }, AxisOrder::NormalLast, around.at_boundary);
        let rough = around.rough.along(kind) as u64;
        let cell = (kind * PLACES + around.place) * ROUGH + bin(rough + 8, 2, -9, ROUGH);
        let prior = rough / 2 + (around.edge >> if kind == NORMAL { 6 } else { 4 }) + 40;
        (cell, Width::new(self.cells[cell].mean(prior)))
    }

    #[inline(always)]
    fn coordinate<C: Coder>(
        &mut self,
        coder: &mut C,
        kind: usize,
        [first, second]: [usize; 2],
        Frame { middle, mirrored, plain, half }: Frame,
        target: i32,
    ) -> (i32, usize) {
        let sign = if mirrored { -1 } else { 1 };
        let first = &mut self.by_neighbour[first];
        let second = &mut self.by_parallelogram[second];
        let error = sign * (target as i64 - middle) + half;
        let low = error & ((1 << plain) - 1);
        let error = error >> plain;
        let wanted = if error.abs() <= NEAR { fold(error) } else { SYMBOLS - 1 };
        let coded = coder.symbol(wanted, first.mean(second));
        first.learn(coded);
        second.learn(coded);
        let error = if coded < SYMBOLS - 1 { unfold(coded) } else { self.escape(coder, kind, error) };
        let low = if plain > 0 { coder.raw_wide(low as u32, plain) as i64 } else { 0 };
        let value = middle + sign * ((error << plain) + low - half);
        (value.clamp(-(COORDINATE_LIMIT as i64), COORDINATE_LIMIT as i64) as i32, coded)
    }

    /// Learns what others have learnt.
    pub fn learn(&mut self, lessons: &[Lesson]) {
        for &Lesson { cell, tables: [first, second], symbol, size } in lessons {
            self.cells[cell as usize].learn(size);
            self.by_neighbour[first as usize].learn(symbol as usize);
            self.by_parallelogram[second as usize].learn(symbol as usize);
        }
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
