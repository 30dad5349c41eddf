//! How far the first expert is off: what its place tells, in two tables.

use super::axes::{KINDS, NORMAL};
use super::ring::Neighbourhood;
use super::scale::{ScaleCell, bin};

const SIZES: usize = 64;
pub(super) const ROUGH: usize = 24;
const CLASSES: usize = 8;
const CERTAINTIES: usize = 3;

/// Mean errors of the first expert by kind of axis, class and size of the neighbourhood; they live as long as
/// the file.
#[derive(Clone)]
pub(crate) struct Spread(Vec<ScaleCell>);

/// The same, refined by roughness: what the `max` profile knows.
#[cfg(feature = "max")]
#[derive(Clone)]
pub(crate) struct FineSpread {
    coarse: Spread,
    /// By kind of axis, size of the neighbourhood, roughness and how well it is known.
    by_roughness: Vec<ScaleCell>,
}

/// The entries for one coordinate.
pub(crate) struct Cells {
    #[cfg_attr(not(feature = "max"), expect(dead_code, reason = "only that effort asks for it"))]
    by_roughness: usize,
    by_class: usize,
    /// What to expect of entries that have learnt nothing, in 1/256.
    prior: u64,
    /// The bin of the roughness around.
    pub roughness: usize,
}

impl Cells {
    pub fn new(around: &Neighbourhood, kind: usize) -> Self {
        let size = around.size.min(SIZES - 1);
        let rough = around.rough.along(kind) as u64;
        let roughness = bin(rough + 8, 2, -9, ROUGH);
        let certainty = match around.parallelograms {
            0 | 1 => 0,
            2..=4 => 1,
            _ => 2,
        };
        Cells {
            by_roughness: ((kind * SIZES + size) * ROUGH + roughness) * CERTAINTIES + certainty,
            by_class: (kind * CLASSES + around.class) * SIZES + size,
            prior: rough / 2 + (around.edge >> if kind == NORMAL { 6 } else { 4 }) + 40,
            roughness,
        }
    }
}

impl Spread {
    pub fn new() -> Self {
        Spread(vec![ScaleCell::default(); KINDS * CLASSES * SIZES])
    }

    /// The mean error to be expected, in 1/256.
    pub fn mean(&self, cells: &Cells) -> u64 {
        self.0[cells.by_class].mean(cells.prior)
    }

    /// Learns an error, in 1/256.
    pub fn learn(&mut self, cells: &Cells, off: u64) {
        self.0[cells.by_class].learn(off);
    }
}

#[cfg(feature = "max")]
impl FineSpread {
    pub fn new() -> Self {
        let by_roughness = vec![ScaleCell::default(); KINDS * SIZES * ROUGH * CERTAINTIES];
        FineSpread { coarse: Spread::new(), by_roughness }
    }

    /// As [`Spread::mean`].
    pub fn mean(&self, cells: &Cells) -> u64 {
        self.by_roughness[cells.by_roughness].mean(self.coarse.mean(cells))
    }

    /// As [`Spread::learn`].
    pub fn learn(&mut self, cells: &Cells, off: u64) {
        self.coarse.learn(cells, off);
        self.by_roughness[cells.by_roughness].learn(off);
    }
}
