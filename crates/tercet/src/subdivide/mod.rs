//! Forward steps: from a coarse surface to a finer one.
//!
//! Every step is the same three answers: which faces are *split* by a new vertex, where
//! that vertex lies, and which edges beside a split face are *flipped*. Where every answer
//! is yes this is the interpolatory √3 step (Kobbelt, "√3-subdivision", 2000; Labsik and
//! Greiner, "Interpolatory √3-subdivision", 2000). The butterfly step (Dyn, Levin and Gregory,
//! 1990; Zorin, Schröder and Sweldens, 1996) inserts a vertex on every edge instead; it is the
//! second of the *regular* steps, which ask for positions only.

mod butterfly;
mod forward;
mod lifting;
mod predict;
mod refine;
mod rings;
mod sqrt3;
mod stencil;
mod weights;

#[cfg(test)]
pub(crate) mod shapes;

pub(crate) use butterfly::cut_edges;
pub use forward::{Scheme, subdivide};
pub use lifting::Update;
pub(crate) use lifting::{lift_positions, unlift_positions};
pub(crate) use predict::{FRACTION_BITS, predict_regular, round, subdivide_surface};
pub(crate) use refine::{Refined, flip_edge, flip_edges, split_faces};
#[cfg(test)]
pub(crate) use refine::{flipped, refine};
pub(crate) use stencil::for_each_stencil;

use crate::mesh::Surface;

/// How a level's connectivity follows from the coarser one's.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum StepKind {
    /// Split and flip bits are stored.
    Adaptive,
    /// Every real face is split and every edge between real faces flipped; boundary edges stay.
    Sqrt3Even,
    /// As `Sqrt3Even`, but a face on the boundary is instead cut in three along its boundary
    /// edge, which receives two vertices.
    Sqrt3Odd,
    /// Every edge of a real face receives a vertex, every real face becomes four.
    Butterfly,
}

/// Whether a step of this kind applies to `coarse`. An adaptive one always does: what it does is
/// told face by face.
pub(crate) fn applies(coarse: &Surface, kind: StepKind) -> bool {
    match kind {
        StepKind::Adaptive | StepKind::Sqrt3Even => true,
        StepKind::Sqrt3Odd => sqrt3::odd_applies(coarse),
        StepKind::Butterfly => butterfly::butterfly_applies(coarse),
    }
}

/// Refines `coarse` by one regular step, in linear time. `None` if `kind` does not apply or is
/// adaptive.
pub(crate) fn refine_regular(coarse: &Surface, kind: StepKind) -> Option<Refined> {
    match kind {
        StepKind::Butterfly => butterfly::refine_butterfly(coarse),
        _ => sqrt3::refine_sqrt3(coarse, kind),
    }
}
