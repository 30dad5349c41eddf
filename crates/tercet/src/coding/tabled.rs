//! Positions by tables: what the fast profile codes in place of [`position`](super::position)'s
//! mixed decisions; on regular levels, where other things tell them apart, [`detail`](super::detail) chooses the tables.
//!
//! The order of axes and the shift into the tangent plane are the same; but of the neighbours only
//! those at the [site](super::site) of the vertex are looked at, a coordinate has one expectation, and
//! what it is off by is one symbol of sixteen and a few plain bits. Coordinates often repeat one nearby:
//! the symbol that the nearest parallelogram's would be selects an adaptive distribution.

use super::around::{Around, Known};
use super::axes::{AxisOrder, KINDS, NORMAL, axes, kind, shift};
use super::detail::{DetailModels, FRACTIONS, Lesson};
use super::pass::{Pass, plain};
use super::scale::{RecentMean, Scale, ScaleCell, bin};
use super::site::Site;
use super::twin::{Lone, TwinModels, Twins};
use super::vector::{COORDINATE_LIMIT, Point};
use crate::entropy::{Coder, Counter, Cumulative, Frequencies, SYMBOLS, log2_fixed, squash};
use crate::mesh::Surface;
use crate::subdivide::FRACTION_BITS;
use wide::i32x4;

/// The models of positions; they live as long as the file.
#[derive(Clone)]
pub(crate) struct TableModels {
    /// By kind of axis and the mean of the last errors.
    cells: Vec<ScaleCell>,
    /// By kind of axis, of the last errors.
    recent: [RecentMean<MEMORY>; KINDS],
    /// By kind of axis, width and the symbol that the nearest parallelogram's coordinate would be.
    symbols: Vec<Frequencies>,
    /// By kind of axis and length in bits.
    pub(super) escapes: Vec<Counter>,
    /// Those of regular levels.
    pub(super) details: DetailModels,
    twins: TwinModels,
}

/// Bins of the mean of the last errors.
const RECENT: usize = 24;

/// Each error counts 2^−this in the mean of the last ones.
const MEMORY: u32 = 3;
/// What the means begin with: errors of eight steps.
const START: u64 = 8 << FRACTION_BITS;
pub(super) const WIDTHS: usize = 41;
/// Lengths of escapes.
pub(super) const LENGTHS: usize = 32;

/// Symbols for errors within ± this, in units; the last symbol is for those beyond.
const NEAR: i64 = 7;

/// How far a pass has come.
pub(crate) struct Walk {
    sites: Vec<Site>,
    /// Vertices coded so far.
    cursor: usize,
    /// Once it has begun.
    twins: Option<Twins>,
    /// What the pass before left without a twin, until this one begins.
    lone: Option<Lone>,
}

impl Walk {
    /// Over the vertices at `sites`, after a pass that left the `lone` vertices without a twin, if it did look for twins;
    /// it has not begun.
    pub fn new(sites: Vec<Site>, lone: Option<Lone>) -> Self {
        Walk { sites, cursor: 0, twins: None, lone }
    }

    /// The vertices that it leaves without a twin, if it looked for twins.
    pub fn lone(self) -> Option<Lone> {
        self.twins.map(Twins::lone)
    }

    /// How many vertices are still to be visited.
    pub fn left(&self) -> usize {
        self.sites.len() - self.cursor
    }
}

/// How wide errors are: the bin of a mean magnitude, and how many of their low bits are plain.
#[derive(Clone, Copy)]
pub(super) struct Width {
    pub bin: usize,
    plain: u32,
}

impl Width {
    /// Of a mean magnitude in 1/256. Bins are quarter octaves; beyond the 37th only the part of
    /// an octave counts, because every octave then leaves one more bit plain.
    #[inline(always)]
    pub fn new(mean: u64) -> Self {
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
    // P(error < the first of a unit) in 1/65536, from the lowest unit to beyond the highest.
    let below: [i64; SYMBOLS] = std::array::from_fn(|i| {
        let unit = i as i64 - NEAR;
        squash(scale.standardise(256 * ((unit << plain) - half) - 128 - 48)) as i64
    });
    let mut before = [0i16; SYMBOLS];
    let mut sum = 0i64;
    for (symbol, before) in before.iter_mut().enumerate() {
        *before = sum as i16;
        if symbol < SYMBOLS - 1 {
            let unit = (unfold(symbol) + NEAR) as usize;
            sum += (((below[unit + 1] - below[unit]) * 16300) >> 16).max(4);
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
pub(super) struct Frame {
    /// The lattice coordinate nearest to the expectation.
    pub middle: i64,
    /// Whether errors below the middle count as positive: seen so, the expectation is never below it.
    mirrored: bool,
    /// Low bits that are plain, and half of what they count to.
    plain: u32,
    half: i64,
}

impl Frame {
    /// Around the expectation `place`, in 1/256.
    #[inline(always)]
    pub fn new(place: i64, width: Width) -> Self {
        let middle = (place + 128) >> FRACTION_BITS;
        Frame {
            middle,
            mirrored: place < middle << FRACTION_BITS,
            plain: width.plain,
            half: (1i64 << width.plain) >> 1,
        }
    }

    /// Codes the coordinate `target`, with counters for the lengths of escapes; what it is and its symbol.
    #[inline(always)]
    pub fn code<C: Coder>(
        self,
        coder: &mut C,
        frequencies: Cumulative,
        escapes: &mut [Counter],
        target: i32,
    ) -> (i32, usize) {
        let Frame { middle, mirrored, plain, half } = self;
        let sign = if mirrored { -1 } else { 1 };
        // A decoder does not ask for it.
        let error = if C::ENCODES { sign * (target as i64 - middle) + half } else { 0 };
        let low = error & ((1 << plain) - 1);
        let error = error >> plain;
        let wanted = if error.abs() <= NEAR { fold(error) } else { SYMBOLS - 1 };
        let coded = coder.symbol(wanted, frequencies);
        let error = if coded < SYMBOLS - 1 { unfold(coded) } else { escape(coder, escapes, error) };
        let low = if plain > 0 { coder.raw_wide(low as u32, plain) as i64 } else { 0 };
        let value = middle + sign * ((error << plain) + low - half);
        (value.clamp(-(COORDINATE_LIMIT as i64), COORDINATE_LIMIT as i64) as i32, coded)
    }

    /// The least symbol that the coordinate of one of three points would be, which are so far `from` the middle.
    #[inline(always)]
    fn least_symbol(self, from: i32x4) -> usize {
        let sign = i32x4::splat(-(self.mirrored as i32));
        let unit = (((from ^ sign) - sign) + i32x4::splat(self.half as i32)) >> self.plain as i32;
        let turned = -unit;
        // As `fold`, of numbers without a sign: units beyond the last symbol stay beyond it.
        let [a, b, c, _] = ((turned << 1_i32) ^ (turned >> 31_i32)).to_array().map(|x| x as u32);
        (a.min(b).min(c) as usize).min(SYMBOLS - 1)
    }
}

impl TableModels {
    pub fn new() -> Self {
        let start: Vec<Frequencies> = (0..WIDTHS).map(initial).collect();
        // For every kind and width so many of the width's.
        let table = |each: usize| {
            let mut table = Vec::with_capacity(KINDS * WIDTHS * each);
            for _ in 0..KINDS {
                start.iter().for_each(|&start| table.extend(std::iter::repeat_n(start, each)));
            }
            table
        };
        TableModels {
            cells: vec![ScaleCell::default(); KINDS * RECENT],
            symbols: table(SYMBOLS),
            escapes: vec![Counter::NEW; KINDS * LENGTHS],
            recent: [RecentMean::new(START); KINDS],
            details: DetailModels::new(table(FRACTIONS)),
            twins: TwinModels::new(),
        }
    }

    /// Learns of details what others have learnt.
    pub fn learn(&mut self, lessons: &[Lesson]) {
        lessons.iter().for_each(|lesson| self.details.learn(lesson));
    }

    /// Codes the positions of the vertices of a pass that are left, those of `targets` when encoding, until
    /// all are coded or bytes are missing; whether all are. They are visited in the order of their
    /// numbers. `positions` has an entry a vertex, of those to be coded the estimate, rounded, if there are any. Time O(n).
    pub fn code<C: Coder>(
        &mut self,
        coder: &mut C,
        pass: &Pass,
        walk: &mut Walk,
        targets: &[Point],
        positions: &mut [Point],
    ) -> bool {
        let Walk { sites, cursor, twins, lone } = walk;
        if *cursor == 0 && twins.is_none() {
            *twins = pass.twins(positions, lone.take());
        }
        while let Some(site) = sites.get(*cursor) {
            if coder.exhausted() {
                // The caller refuses the level; what follows would only take time.
                break;
            }
            if !coder.is_ready() {
                return false;
            }
            let v = pass.first + *cursor as u32;
            let target = targets.get(*cursor).copied().unwrap_or_default();
            let Pass { surface: Surface { virtuals, .. }, first, estimates, .. } = *pass;
            let known = Known { virtuals: *virtuals, v, first, positions, estimates };
            let point = match pass.order {
                AxisOrder::NormalFirst => {
                    let told = |vertex| known.is_told(vertex);
                    self.details.code(coder, site, &known, told, &mut self.escapes, target).0
                }
                AxisOrder::NormalLast => match Around::new(site, &known) {
                    None => plain(coder, pass, target),
                    Some(around) => {
                        let expected = around.expected;
                        let twin = self.twins.code(coder, twins, expected, target, positions);
                        twin.unwrap_or_else(|| self.vertex(coder, &around, target))
                    }
                },
            };
            positions[v as usize] = point;
            if let Some(twins) = twins {
                twins.note(v, positions);
            }
            *cursor += 1;
        }
        true
    }

    #[inline(always)]
    fn vertex<C: Coder>(&mut self, coder: &mut C, around: &Around, target: Point) -> Point {
        let order = AxisOrder::NormalLast;
        let axes = axes(around.normal, order);
        // Both are known before the first coordinate is.
        let widths = [false, true].map(|across| self.width(around.at_boundary, across));
        let mut point = target;
        let mut centres = [around.expected];
        for (step, &axis) in axes.iter().enumerate() {
            let kind = kind(step, order, around.at_boundary);
            let (cell, width) = widths[(kind == NORMAL) as usize];
            let place = centres[0][axis];
            let frame = Frame::new(place, width);
            let relative = frame.middle - around.origin[axis] as i64;
            let nearby = frame.least_symbol(around.parallelograms.from(axis, relative));
            let frequencies = &mut self.symbols[(kind * WIDTHS + width.bin) * SYMBOLS + nearby];
            let escapes = &mut self.escapes[kind * LENGTHS..(kind + 1) * LENGTHS];
            let (value, symbol) = frame.code(coder, frequencies.cumulative(), escapes, target[axis]);
            frequencies.learn(symbol);
            point[axis] = value;
            let off = ((value as i64) << FRACTION_BITS) - place;
            self.cells[cell].learn(off.unsigned_abs());
            self.recent[kind].learn(off.unsigned_abs());
            shift(&mut centres, [off], around.normal, axes, step, order);
        }
        point
    }

    /// The cell of the coordinates in the surface or `across` it, and how wide their errors are.
    #[inline(always)]
    fn width(&self, at_boundary: bool, across: bool) -> (usize, Width) {
        let kind = kind(if across { 2 } else { 0 }, AxisOrder::NormalLast, at_boundary);
        let recent = self.recent[kind].get();
        let cell = kind * RECENT + bin(recent + 8, 2, -9, RECENT);
        (cell, Width::new(self.cells[cell].mean(recent * 3 / 4 + 40)))
    }
}

/// An error of more than [`NEAR`] units: its sign, the length of the rest, its bits.
#[cold]
fn escape<C: Coder>(coder: &mut C, counters: &mut [Counter], unit: i64) -> i64 {
    let negative = coder.raw((unit < 0) as u32, 1) == 1;
    let rest = (unit.abs() - NEAR).clamp(1, u32::MAX as i64) as u32;
    let wanted = rest.ilog2() as usize;
    let mut length = 0;
    for counter in &mut counters[..LENGTHS - 1] {
        if !counter.code(coder, length < wanted, 250) {
            break;
        }
        length += 1;
    }
    let rest = 1i64 << length | coder.raw_wide(rest & ((1 << length) - 1), length as u32) as i64;
    if negative { -NEAR - rest } else { NEAR + rest }
}
