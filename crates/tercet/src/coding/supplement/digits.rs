//! The last digits of decimal coordinates.
//!
//! Text with so many *significant* digits has more decimals the smaller a coordinate is. The levels
//! lie on the grid of the greatest coordinates; the digits below it follow here, where the
//! magnitude of a coordinate tells how many of them are zeros. Planes across an axis repeat a
//! coordinate, and symmetric shapes repeat it with the other sign: the digits of the vertex that
//! was last at the same place on the axis, or at its mirror image, are tried first.

use crate::coding::model::BitModel;
use crate::entropy::Coder;
use crate::mesh::{decimal_index, decimal_step, decimal_value};

/// Numbers of digits that an index can have.
pub(super) const DECADES: usize = 20;
/// Most digits that the levels can lack.
pub(super) const MAX_DIGITS: u8 = 5;
/// Binary logarithms of the least and greatest number of places on an axis that are remembered.
const PLACES: [u32; 2] = [8, 16];

/// Digits that the levels lack, of every coordinate of a mesh.
pub(super) struct Digits {
    exponent: u8,
    digits: u8,
    step: i64,
    origin: [i64; 3],
    places: usize,
    /// By axis and the low bits of the place: a place without its sign and its rest.
    seen: Vec<Option<(u64, u32)>>,
    same: BitModel<2>,
    digit: BitModel<2>,
}

impl Digits {
    pub fn new(exponent: u8, digits: u8, origin: [i64; 3], vertices: usize) -> Self {
        let places = 1 << (usize::BITS - vertices.leading_zeros()).clamp(PLACES[0], PLACES[1]);
        let nodes = usize::from(digits) << 4;
        Digits {
            exponent,
            digits,
            step: decimal_step(digits),
            origin,
            places,
            seen: vec![None; if digits == 0 { 0 } else { 3 * places }],
            same: BitModel::new([DECADES, 3], 1, 300),
            digit: BitModel::new([DECADES * nodes, 3 * nodes], MAX_DIGITS.into(), 200),
        }
    }

    /// Codes the digits of a coordinate at `q` of an axis; returns what the whole index stands for.
    pub fn code<C: Coder>(&mut self, coder: &mut C, axis: usize, q: i32, known: Option<f32>) -> f32 {
        let index = self.origin[axis].saturating_add(i64::from(q) * self.step);
        let rest = known.map_or(0, |x| {
            decimal_index(x, self.exponent).wrapping_sub(self.origin[axis]).rem_euclid(self.step)
        });
        let rest = i64::from(if self.digits == 0 { 0 } else { self.rest(coder, axis, index, rest as u32) });
        // The lattice point is the nearest one: the upper half of the rests lies below it.
        let rest = if 2 * rest < self.step { rest } else { rest - self.step };
        decimal_value(index.saturating_add(rest), self.exponent)
    }

    fn rest<C: Coder>(&mut self, coder: &mut C, axis: usize, index: i64, wanted: u32) -> u32 {
        let decade = decade(index);
        let magnitude = index.unsigned_abs();
        let slot = axis * self.places + (magnitude / self.step as u64) as usize % self.places;
        if let Some((at, rest)) = self.seen[slot]
            && at == magnitude
        {
            let rest = mirrored(rest.into(), index, self.step) as u32;
            if self.same.code(coder, rest == wanted, 0, [decade, axis]) {
                return rest;
            }
        }
        let mut rest = 0;
        for k in (0..usize::from(self.digits)).rev() {
            let digit = wanted / decimal_step(k as u8) as u32 % 10;
            let mut node = 1;
            for bit in (0..4).rev() {
                let nodes = [decade, axis].map(|c| (c * usize::from(self.digits) + k) << 4 | node);
                node = node << 1 | self.digit.code(coder, digit >> bit & 1 == 1, k, nodes) as usize;
            }
            // Only a damaged file has digits above 9.
            rest = rest * 10 + (node as u32 & 15).min(9);
        }
        self.seen[slot] = Some((magnitude, mirrored(rest.into(), index, self.step) as u32));
        rest
    }
}

/// From the rest at a lattice point to that at the point without its sign, or back.
pub(super) fn mirrored(rest: i64, index: i64, step: i64) -> i64 {
    if index < 0 { (step - rest) % step } else { rest }
}

/// The number of decimal digits of an index; 0 for 0.
pub(super) fn decade(index: i64) -> usize {
    index.unsigned_abs().checked_ilog10().map_or(0, |digits| digits as usize + 1)
}
