//! Forward steps: from a coarse surface to a finer one.
//!
//! Every step is the same three answers: which faces are *split* by a new vertex, where
//! that vertex lies, and which edges beside a split face are *flipped*. Where every answer
//! is yes this is the interpolatory √3 step (Kobbelt, "√3-subdivision", 2000; Labsik and
//! Greiner, "Interpolatory √3-subdivision", 2000).

mod refine;

pub(crate) use refine::{Refined, refine};
