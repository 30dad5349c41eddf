//! How near a level is to the original.

mod distance;
mod level_error;

pub(crate) use level_error::LevelErrors;
