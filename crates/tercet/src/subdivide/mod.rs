//! Forward steps: from a coarse surface to a finer one.
//!
//! Every step is the same three answers: which faces are *split* by a new vertex, where
//! that vertex lies, and which edges beside a split face are *flipped*. Where every answer
//! is yes this is the interpolatory √3 step (Kobbelt, "√3-subdivision", 2000; Labsik and
//! Greiner, "Interpolatory √3-subdivision", 2000).

mod forward;
mod lifting;
mod predict;
mod refine;
mod sqrt3;
mod stencil;
mod weights;

#[cfg(test)]
pub(crate) mod shapes;

pub use forward::subdivide;
pub use lifting::Update;
pub(crate) use lifting::{lift_positions, unlift_positions};
pub(crate) use predict::{FRACTION_BITS, predict_sqrt3, round, subdivide_surface};
pub(crate) use refine::{Refined, flip_edge, refine};
pub(crate) use sqrt3::{odd_applies, refine_sqrt3};
pub(crate) use stencil::for_each_stencil;

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
}
