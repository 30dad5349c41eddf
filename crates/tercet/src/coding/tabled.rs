//! Positions by tables: what the fast profile codes in place of [`position`](super::position)'s
//! mixed decisions; on regular levels, where other things tell them apart, [`detail`](super::detail) chooses the tables.
//!
//! The order of axes and the shift into the tangent plane are the same; but of the neighbours only
//! those at the [site](super::site) of the vertex are looked at, a coordinate has one expectation, and
//! what it is off by is one symbol of sixteen and a few plain bits. Coordinates often repeat one nearby:
//! the symbol that the nearest neighbour's would be, and that of the nearest parallelogram, each select an
//! adaptive distribution, and the two are averaged. The neighbours are the corners of the site.

use super::around::{Around, Candidates, Known};
use super::axes::{AxisOrder, KINDS, NORMAL, axes, kind, shift};
use super::detail::{DetailModels, FRACTIONS, Lesson};
use super::pass::{Pass, Roughness, plain};
use super::scale::{Scale, ScaleCell, bin};
use super::site::Site;
use super::twin::{Lone, TwinModels, Twins};
use super::vector::{COORDINATE_LIMIT, Point};
use crate::entropy::{Coder, Counter, Cumulative, Frequencies, SYMBOLS, log2_fixed, squash};
use crate::mesh::Surface;
use crate::subdivide::FRACTION_BITS;
use wide::i16x8;

/// The models of positions; they live as long as the file.
#[derive(Clone)]
pub(crate) struct TableModels {
    /// By kind of axis and roughness.
    cells: Vec<ScaleCell>,
    /// By kind of axis, width and the symbol that the nearest neighbour's coordinate would be.
    by_neighbour: Vec<Frequencies>,
    /// The same for the nearest parallelogram's coordinate.
    by_parallelogram: Vec<Frequencies>,
    /// By kind of axis and length in bits.
    pub(super) escapes: Vec<Counter>,
    /// Those of regular levels.
    pub(super) details: DetailModels,
    twins: TwinModels,
}

const ROUGH: usize = 24;
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
        let error = sign * (target as i64 - middle) + half;
        let low = error & ((1 << plain) - 1);
        let error = error >> plain;
        let wanted = if error.abs() <= NEAR { fold(error) } else { SYMBOLS - 1 };
        let coded = coder.symbol(wanted, frequencies);
        let error = if coded < SYMBOLS - 1 { unfold(coded) } else { escape(coder, escapes, error) };
        let low = if plain > 0 { coder.raw_wide(low as u32, plain) as i64 } else { 0 };
        let value = middle + sign * ((error << plain) + low - half);
        (value.clamp(-(COORDINATE_LIMIT as i64), COORDINATE_LIMIT as i64) as i32, coded)
    }

    /// The least symbols that one of the corners' and one of the parallelograms' coordinates would be, which are
    /// so far `from` the middle.
    #[inline(always)]
    fn least_symbols(self, from: i16x8) -> [usize; 2] {
        let sign = i16x8::splat(-(self.mirrored as i16));
        // Beyond eight bits a unit is coarser than what is kept of the offsets.
        let unit = (((from ^ sign) - sign) + i16x8::splat(self.half.min(1 << 7) as i16)) >> self.plain.min(8);
        let beyond = NEAR as i16 + 1;
        let turned = (-unit).max(i16x8::splat(-beyond)).min(i16x8::splat(beyond));
        let folded = ((turned << 1_i32) ^ (turned >> 15_i32)).to_array();
        let least = |k: usize| folded[k].min(folded[k + 1]).min(folded[k + 2]) as usize;
        [least(0), least(Candidates::HALF)].map(|symbol| symbol.min(SYMBOLS - 1))
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
            cells: vec![ScaleCell::default(); KINDS * ROUGH],
            by_parallelogram: table(SYMBOLS),
            by_neighbour: table(SYMBOLS),
            escapes: vec![Counter::NEW; KINDS * LENGTHS],
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
            let known = Known { virtuals: *virtuals, v, first, positions, rough, estimates };
            let point = match pass.order {
                AxisOrder::NormalFirst => {
                    let told = |vertex| known.is_told(vertex);
                    self.details.code(coder, site, &known, told, &mut self.escapes, target).0
                }
                AxisOrder::NormalLast => match Around::new(site, &known) {
                    None => plain(coder, pass, target),
                    Some(around) => {
                        let expected = around.expected;
                        let twin = twins
                            .as_mut()
                            .and_then(|twins| self.twins.code(coder, twins, expected, target, positions));
                        let (point, off) = match twin {
                            Some(point) => {
                                (point, Roughness::at(point, expected, around.normal, AxisOrder::NormalLast))
                            }
                            None => self.vertex(coder, &around, target),
                        };
                        Roughness::spread(rough, v, off, &site.corners);
                        Roughness::spread(rough, v, off, &site.wings);
                        point
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
    fn vertex<C: Coder>(&mut self, coder: &mut C, around: &Around, target: Point) -> (Point, Roughness) {
        let order = AxisOrder::NormalLast;
        let axes = axes(around.normal, order);
        // Both are known before the first coordinate is.
        let widths = [false, true].map(|across| self.width(around, across));
        let mut point = target;
        let mut sizes = [0u64; 3];
        let mut centres = [around.expected];
        for (step, &axis) in axes.iter().enumerate() {
            let kind = kind(step, order, around.at_boundary);
            let (cell, width) = widths[(kind == NORMAL) as usize];
            let place = centres[0][axis];
            let frame = Frame::new(place, width);
            let relative = frame.middle - around.origin[axis] as i64;
            let symbols = frame.least_symbols(around.candidates.from(axis, relative));
            let value = self.coordinate(coder, (kind, width.bin), symbols, frame, target[axis]);
            point[axis] = value;
            let off = ((value as i64) << FRACTION_BITS) - place;
            sizes[step] = off.unsigned_abs();
            self.cells[cell].learn(sizes[step]);
            shift(&mut centres, [off], around.normal, axes, step, order);
        }
        (point, Roughness::of(sizes, order))
    }

    /// The cell of the coordinates in the surface or `across` it, and how wide their errors are.
    #[inline(always)]
    fn width(&self, around: &Around, across: bool) -> (usize, Width) {
        let kind = kind(if across { 2 } else { 0 }, AxisOrder::NormalLast, around.at_boundary);
        let rough = around.rough.along(kind) as u64;
        let cell = kind * ROUGH + bin(rough + 8, 2, -9, ROUGH);
        (cell, Width::new(self.cells[cell].mean(rough * 3 / 4 + 40)))
    }

    #[inline(always)]
    fn coordinate<C: Coder>(
        &mut self,
        coder: &mut C,
        (kind, bin): (usize, usize),
        [neighbour, parallelogram]: [usize; 2],
        frame: Frame,
        target: i32,
    ) -> i32 {
        let table = (kind * WIDTHS + bin) * SYMBOLS;
        let first = &mut self.by_neighbour[table + neighbour];
        let second = &mut self.by_parallelogram[table + parallelogram];
        let escapes = &mut self.escapes[kind * LENGTHS..(kind + 1) * LENGTHS];
        let (value, symbol) = frame.code(coder, first.mean(second), escapes, target);
        first.learn(symbol);
        second.learn(symbol);
        value
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
