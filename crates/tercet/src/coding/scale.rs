//! How far predictions are off: adaptive scales and their logarithms.

use crate::entropy::{log2_fixed, table};

/// After this many samples a cell's history counts half.
const LIMIT: u32 = 120;

/// 65536 / n.
static RECIPROCAL: [u32; LIMIT as usize + 3] = {
    let mut table = [0; LIMIT as usize + 3];
    let mut n = 1;
    while n < table.len() {
        table[n] = 65536 / n as u32;
        n += 1;
    }
    table
};

/// Magnitudes are held below this.
const FAR: u64 = 1 << 36;

/// A running mean of magnitudes, in 1/256.
#[derive(Clone, Copy, Default)]
pub(crate) struct ScaleCell {
    sum: u64,
    count: u32,
}

impl ScaleCell {
    /// The mean, with `prior` counted as two samples.
    #[inline(always)]
    pub fn mean(self, prior: u64) -> u64 {
        ((self.sum + 2 * prior) * RECIPROCAL[self.count as usize + 2] as u64) >> 16
    }

    #[inline(always)]
    pub fn learn(&mut self, magnitude: u64) {
        self.sum += magnitude.min(FAR);
        self.count += 1;
        if self.count >= LIMIT {
            self.sum /= 2;
            self.count /= 2;
        }
    }
}

/// A mean magnitude that forgets, with eight bits behind its point: each new one counts 2^−`MEMORY` in it.
#[derive(Clone, Copy)]
pub(crate) struct RecentMean<const MEMORY: u32>(u64);

impl<const MEMORY: u32> RecentMean<MEMORY> {
    pub const fn new(magnitude: u64) -> Self {
        RecentMean(magnitude << 8)
    }

    #[inline(always)]
    pub fn get(self) -> u64 {
        self.0 >> 8
    }

    #[inline(always)]
    pub fn learn(&mut self, magnitude: u64) {
        self.0 = self.0 - (self.0 >> MEMORY) + ((magnitude.min(FAR) << 8) >> MEMORY);
    }
}

/// A logistic distribution's scale, one of eight an octave.
#[derive(Clone, Copy)]
pub(crate) struct Scale {
    /// In 1/256 of a lattice step.
    width: i64,
    /// 2⁴⁴ / width.
    inverse: i64,
    /// One lattice step in units of the scale, in 1/256 · 1/65536.
    slope: i64,
    /// log₂ of the mean magnitude (in 1/256), in 1/8.
    #[cfg_attr(not(feature = "max"), expect(dead_code, reason = "only that effort asks for it"))]
    pub log: usize,
}

const LOGS: usize = 8 * 40;

table!(
    /// Width and inverse for each logarithm. The mean magnitude of a logistic variable is 2 ln 2
    /// times its scale; 0.75 rather than 0.72 allows for heavier tails.
    SCALES: [(i64, i64); LOGS] = scales
);

const fn scales() -> [(i64, i64); LOGS] {
    let mut table = [(0, 0); LOGS];
    let mut i = 0;
    while i < LOGS {
        // The middle of the cell: 2^(i/8) · (1 + (i mod 8 + ½)/8), times ¾.
        let magnitude = ((17 + 2 * (i as i64 % 8)) << (i / 8)) / 16;
        let width = magnitude * 3 / 4;
        let width = if width < 31 { 31 } else { width };
        table[i] = (width, (1 << 44) / width);
        i += 1;
    }
    table
}

impl Scale {
    /// The scale for a mean magnitude in 1/256.
    #[inline(always)]
    pub fn new(mean: u64) -> Self {
        let log = (log2_fixed(mean, 3) as usize).min(LOGS - 1);
        let (width, inverse) = SCALES[log];
        Scale { width, inverse, slope: inverse >> 12, log }
    }

    /// `difference` (in 1/256 of a step) in units of the scale, in 1/256; saturates at ±16.
    #[inline(always)]
    pub fn standardise(self, difference: i64) -> i32 {
        let far = 16 * self.width;
        ((difference.clamp(-far, far) * self.inverse) >> 36) as i32
    }

    /// A length of `steps` lattice steps (0..2³⁰) in units of the scale, in 1/256; saturates at 256.
    #[inline(always)]
    pub fn length(self, steps: i64) -> i32 {
        ((steps * self.slope) >> 16).min(1 << 16) as i32
    }

    /// The logarithm of a bin width that suits the scale: the greatest power of two up to 0.9 of the mean
    /// magnitude, at least one step.
    #[inline(always)]
    pub fn unit_bits(self) -> u32 {
        ((self.width * 6 / 5 + 128) >> 8).max(1).ilog2().min(20)
    }

    /// The bin width that suits the scale: 0.9 of the mean magnitude, at least one step.
    #[cfg(feature = "max")]
    #[inline(always)]
    pub fn unit(self) -> i64 {
        ((self.width * 6 / 5 + 128) >> 8).max(1)
    }
}

/// A bin of log₂ `x`, `per_octave` (a power of two) an octave, shifted by `offset` octaves.
pub(crate) fn bin(x: u64, per_octave: i32, offset: i32, bins: usize) -> usize {
    let log = log2_fixed(x, 3) * per_octave / 8;
    (log + offset * per_octave).clamp(0, bins as i32 - 1) as usize
}

/// A bin of log₂ `a` / `b`, one an octave, 1 in the fourth.
pub(crate) fn ratio(a: u64, b: u64, bins: usize) -> usize {
    ((log2_fixed(a, 3) - log2_fixed(b, 3) + 28) >> 3).clamp(0, bins as i32 - 1) as usize
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_cell_follows_the_mean_and_a_scale_standardises() {
        let mut cell = ScaleCell::default();
        assert_eq!(cell.mean(700), 700);
        (0..1000).for_each(|i| cell.learn(1000 + i % 2));
        assert!((cell.mean(1) as i64 - 1000).abs() < 30);
        for mean in [1u64, 100, 256, 3000, 1 << 20, 1 << 35] {
            let scale = Scale::new(mean);
            let expected = (0.75 * mean as f64).max(31.0);
            assert!((scale.width as f64 / expected - 1.0).abs() < 0.1, "{mean}: {}", scale.width);
            assert!((scale.standardise(scale.width) - 256).abs() <= 2, "{mean}");
            assert_eq!(scale.standardise(i64::MAX) / 16, 255);
        }
    }
}
