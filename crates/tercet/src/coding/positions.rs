//! The mixed models of positions, by profile.

use super::axes::AxisOrder;
#[cfg(feature = "max")]
use super::ensemble::EnsembleModels;
use super::pass::{Pass, Progress, Roughness};
use super::position::PositionModels;
use super::vector::Point;
use crate::Effort;
use crate::entropy::Coder;

/// The models of positions; they live as long as the file, those of late positions as long as their pass.
#[derive(Clone)]
pub(crate) enum Positions {
    Mixed(Box<PositionModels>),
    #[cfg(feature = "max")]
    Ensemble(Box<EnsembleModels>),
}

impl Positions {
    pub fn new(effort: Effort) -> Self {
        match effort {
            #[cfg(feature = "max")]
            Effort::Max => Positions::Ensemble(Box::new(EnsembleModels::new())),
            _ => Positions::Mixed(Box::new(PositionModels::new())),
        }
    }

    /// Whether these models are not asked, but tables: in the fast profile, and where details are normal ones,
    /// so that mixing saves too little for its time.
    pub fn tabled(effort: Effort, order: AxisOrder) -> bool {
        effort == Effort::Fast || order == AxisOrder::NormalFirst && !effort.is_max()
    }

    /// Whether a pass visits the best supported vertex first, not that of the next number.
    pub fn visit_by_support(effort: Effort, order: AxisOrder) -> bool {
        order == AxisOrder::NormalLast && effort != Effort::Fast
    }

    /// Begins a pass, of whose vertices nothing is coded yet. `positions` and `rough` have an entry a vertex.
    pub fn begin(&mut self, pass: &Pass, positions: &[Point], rough: &[Roughness]) {
        match self {
            #[cfg(feature = "max")]
            Positions::Ensemble(models) => models.begin(pass.surface, pass.first, positions, rough),
            _ => {
                let _ = (pass, positions, rough);
            }
        }
    }

    /// Codes the positions of the vertices of a pass that are left, those of `targets` when encoding, until
    /// all are coded or bytes are missing; whether all are. `positions` and `rough` have an entry a vertex.
    /// Time O(n).
    pub fn code<C: Coder>(
        &mut self,
        coder: &mut C,
        pass: &Pass,
        progress: &mut Progress,
        targets: &[Point],
        positions: &mut [Point],
        rough: &mut [Roughness],
    ) -> bool {
        match self {
            Positions::Mixed(models) => models.code(coder, pass, progress, targets, positions, rough),
            #[cfg(feature = "max")]
            Positions::Ensemble(models) => models.code(coder, pass, progress, targets, positions, rough),
        }
    }
}
