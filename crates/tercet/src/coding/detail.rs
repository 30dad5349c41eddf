//! Positions of regular levels, of √3 and butterfly steps, by tables.
//!
//! Their details are nearly noise along the normal. So none of what the [tables](super::tabled) of other levels
//! are chosen by pays here: a coordinate that repeats one nearby does so by chance, vertices are equally far
//! apart, and how far coding is off changes slowly from vertex to vertex, as one is mostly near the one coded
//! before. What is left is the estimate, corrected along the normal by the errors of the wings that are known;
//! mean magnitudes that forget, chosen by how large those errors are; and where between two lattice points the
//! expectation lies.

use super::around::{Correction, Known};
use super::axes::{AxisOrder, KINDS, axes, kind, shift};
use super::scale::RecentMean;
use super::site::Site;
use super::tabled::{Frame, LENGTHS, WIDTHS, Width};
use super::vector::Point;
use crate::entropy::{Coder, Counter, Frequencies};
use crate::subdivide::{FRACTION_BITS, round};

/// The models of details; they live as long as the file.
#[derive(Clone)]
pub(super) struct DetailModels {
    /// By kind of axis and how far the wings were off, of the last errors.
    means: [[RecentMean<MEMORY>; CLASSES]; KINDS],
    /// By kind of axis, width and how far the expectation is from the lattice point nearest to it.
    tables: Vec<Frequencies>,
}

/// Each error counts 2^−this in the mean.
const MEMORY: u32 = 4;

/// What means begin with: errors of a step and a half.
const START: u64 = 400;

/// No wing is known, or their errors are of a magnitude: two octaves each from 1/16 of a step on.
const CLASSES: usize = 8;
const LEAST: u32 = 4;

/// Distances of the expectation from the nearest lattice point that are told apart, and the width of each, in 1/256.
pub(super) const FRACTIONS: usize = 4;
const FRACTION_WIDTH: usize = 128 / FRACTIONS;

impl DetailModels {
    /// Begins with these `tables`, by kind, width and fraction.
    pub fn new(tables: Vec<Frequencies>) -> Self {
        DetailModels { means: [[RecentMean::new(START); CLASSES]; KINDS], tables }
    }

    /// Codes where the vertex at `site` lies, which is `target` when encoding; `told` are the vertices of the pass that
    /// are known, `escapes` are by kind of axis. The point, and what was learnt of each coordinate.
    #[inline(always)]
    pub fn code<C: Coder>(
        &mut self,
        coder: &mut C,
        site: &Site,
        known: &Known,
        told: impl Fn(u32) -> bool,
        escapes: &mut [Counter],
        target: Point,
    ) -> (Point, [Lesson; 3]) {
        const ORDER: AxisOrder = AxisOrder::NormalFirst;
        // Details are along the normal of the surface that is expected, not of the one that is noisy.
        let estimated = |w: u32| match known.estimates.get(w.wrapping_sub(known.first) as usize) {
            Some(&estimate) => round(estimate),
            None => known.positions[w as usize],
        };
        let normal = site.normal(known.virtuals, estimated);
        let at_boundary = site.corners.iter().any(|&a| a < known.virtuals);
        let axes = axes(normal, ORDER);
        let correction = Correction::new(site, known, told);
        let class = class(&correction);
        let widths = [0, 1].map(|step| {
            let kind = kind(step, ORDER, at_boundary);
            (kind, Width::new(self.means[kind][class].get() + 8))
        });
        let mut point = target;
        let mut lessons = [Lesson::default(); 3];
        let mut centres = [correction.expected_along(normal)];
        for (step, &axis) in axes.iter().enumerate() {
            let (kind, width) = widths[step.min(1)];
            let place = centres[0][axis];
            let frame = Frame::new(place, width);
            let table = (kind * WIDTHS + width.bin) * FRACTIONS + fraction(frame, place);
            let escapes = &mut escapes[kind * LENGTHS..(kind + 1) * LENGTHS];
            let frequencies = &mut self.tables[table];
            let (value, symbol) = frame.code(coder, frequencies.cumulative(), escapes, target[axis]);
            point[axis] = value;
            let off = ((value as i64) << FRACTION_BITS) - place;
            let size = off.unsigned_abs();
            frequencies.learn(symbol);
            self.means[kind][class].learn(size);
            lessons[step] =
                Lesson { size, cell: [kind as u8, class as u8], table: table as u16, symbol: symbol as u8 };
            shift(&mut centres, [off], normal, axes, step, ORDER);
        }
        (point, lessons)
    }

    /// Learns of a coordinate that others have coded.
    pub fn learn(&mut self, &Lesson { size, cell: [kind, class], table, symbol }: &Lesson) {
        self.tables[table as usize].learn(symbol as usize);
        self.means[kind as usize][class as usize].learn(size);
    }
}

/// What models learn of a coordinate: its distribution and symbol; the kind of its axis, the class of its wings, and
/// how large the error was.
#[derive(Clone, Copy, Default)]
pub(crate) struct Lesson {
    size: u64,
    cell: [u8; 2],
    table: u16,
    symbol: u8,
}

/// How far the expectation is from the middle of the frame, in [`FRACTION_WIDTH`]s.
#[inline(always)]
fn fraction(frame: Frame, place: i64) -> usize {
    let distance = (place - (frame.middle << FRACTION_BITS)).unsigned_abs() as usize;
    (distance / FRACTION_WIDTH).min(FRACTIONS - 1)
}

/// How far the wings were off.
#[inline(always)]
fn class(&Correction { magnitude, count, .. }: &Correction) -> usize {
    let octaves = ((magnitude + (1 << LEAST)).ilog2() - LEAST) as usize;
    if count == 0 { 0 } else { (1 + octaves / 2).min(CLASSES - 1) }
}
