//! Adaptive binary arithmetic coding with mixed models, in integers only.
//!
//! A decision is coded in three steps. *Counters* and parametric *experts* each give an
//! opinion as a logit; a *mixer* weighs them into one probability; the *coder* spends
//! −log₂ p bits on the outcome. Each model learns from the outcome at once, so that encoder
//! and decoder stay in step. Mixing in the logistic domain follows Mahoney, "Adaptive
//! weighing of context models for lossless data compression", 2005.
//!
//! Probabilities are of a 1, in 1/65536. Logits are in 1/256: 256 means odds of e to 1.

mod coder;
mod counter;
mod logistic;
mod mixer;
#[cfg(feature = "max")]
mod secondary;
mod symbol;
mod table;

pub(crate) use coder::{Coder, Cursor, Decoder, Encoder};
pub(crate) use counter::Counter;
pub(crate) use logistic::{LOGIT_LIMIT, log_expm1, log2_fixed, softplus, squash, stretch};
pub(crate) use mixer::{Mixer, Opinions, error};
#[cfg(feature = "max")]
pub(crate) use secondary::{Knot, Secondary};
pub(crate) use symbol::{Cumulative, Frequencies, SYMBOLS};
pub(crate) use table::table;
