//! How far the centre of a coordinate's decisions is off, from all that hints at it.
//!
//! Which of the hints matter differs from mesh to mesh, and there are too many for a table. So the logarithm
//! of the error is a linear function of theirs, learnt by least squares; a table of what errors have been
//! where it said so turns the mean of logarithms into a mean.

use super::axes::KINDS;
use super::regression::Regression;
use super::scale::ScaleCell;
use crate::entropy::log2_fixed;

/// Magnitudes that hint at the error.
pub(super) const HINTS: usize = 5;
/// With them come the errors of the two earlier axes, and a constant.
const FEATURES: usize = HINTS + 3;

/// Logarithms are in 1/256 octaves, cells eight an octave.
const OCTAVE_BITS: u32 = 8;
const CELL_BITS: u32 = OCTAVE_BITS - 3;
const CELLS: usize = 48 << 3;

/// Differences of logarithms are held within ± 8 octaves.
const MOST: i64 = 8 << OCTAVE_BITS;

/// Errors that are small against a lattice step, in 1/256 of it, count as equal.
const SMALL: u64 = 32;

/// What has been learnt of errors.
#[derive(Clone)]
pub(super) struct Deviation {
    by_kind: [Regression<FEATURES>; KINDS],
    /// By kind of axis and predicted logarithm.
    means: Vec<ScaleCell>,
}

/// An error before it is known.
pub(super) struct Forecast {
    /// Its mean, in 1/256 of a lattice step.
    pub mean: u64,
    kind: usize,
    cell: usize,
    base: i64,
    features: [i64; FEATURES],
}

/// The logarithm of a magnitude in 1/256.
fn log(magnitude: u64) -> i64 {
    log2_fixed(magnitude + SMALL, OCTAVE_BITS) as i64
}

/// By how much one magnitude is larger than another, in 1/256 octaves.
pub(super) fn octaves(magnitude: u64, than: u64) -> i64 {
    log(magnitude) - log(than)
}

fn held(octaves: i64) -> i64 {
    octaves.clamp(-MOST, MOST)
}

impl Deviation {
    pub fn new() -> Self {
        Deviation {
            by_kind: [const { Regression::NEW }; KINDS],
            means: vec![ScaleCell::default(); KINDS * CELLS],
        }
    }

    /// The error on an axis of the given kind where it should be about `spread`, by `hints`, all in 1/256, and
    /// by how many [`octaves`] those of the `earlier` axes were larger than that.
    pub fn forecast(&self, kind: usize, spread: u64, hints: [u64; HINTS], earlier: [i64; 2]) -> Forecast {
        let base = log(spread);
        let mut features = [1 << OCTAVE_BITS; FEATURES];
        let known = hints.map(|hint| log(hint) - base).into_iter().chain(earlier);
        for (feature, octaves) in features.iter_mut().zip(known) {
            *feature = held(octaves);
        }
        let log = (base + held(self.by_kind[kind].predict(&features) >> 8)).max(0);
        let (whole, part) = (log >> OCTAVE_BITS, log & ((1 << OCTAVE_BITS) - 1));
        let prior = (((1 << OCTAVE_BITS) + part) << whole) as u64 >> OCTAVE_BITS;
        let cell = kind * CELLS + ((log >> CELL_BITS) as usize).min(CELLS - 1);
        let mean = self.means[cell].mean(prior.saturating_sub(SMALL));
        Forecast { mean, kind, cell, base, features }
    }

    /// Learns the error, in 1/256.
    pub fn learn(&mut self, forecast: &Forecast, off: u64) {
        self.means[forecast.cell].learn(off);
        self.by_kind[forecast.kind].learn(&forecast.features, held(log(off) - forecast.base));
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_hint_that_knows_is_found_and_extremes_hold() {
        let mut deviation = Deviation::new();
        let spread = 4000;
        for i in 0..5000u64 {
            let off = 500 << (i % 6);
            let forecast = deviation.forecast(0, spread, [spread, off / 2, 900, 77, 5], [0; 2]);
            if i > 4000 {
                assert!(forecast.mean.abs_diff(off) < off / 4, "{} instead of {off}", forecast.mean);
            }
            deviation.learn(&forecast, off);
        }
        for extreme in [0, 1 << 40] {
            let octaves = octaves(extreme, 1 << 20);
            let forecast = deviation.forecast(2, (1 << 40) - extreme, [extreme; HINTS], [octaves; 2]);
            deviation.learn(&forecast, extreme);
        }
    }
}
