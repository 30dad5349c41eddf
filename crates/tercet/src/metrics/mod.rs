//! How far surfaces are apart: [`compare()`] two meshes, or ask a [`TriangleTree`] for the point of a
//! mesh that is nearest to another point.

mod compare;
mod distance;
mod greatest;
mod level_error;
mod sampling;
mod triangle_tree;

pub use compare::{Comparison, Deviation, MetricsOptions, Side, compare};
pub use triangle_tree::{Closest, Hit, TriangleTree};

pub(crate) use level_error::LevelErrors;
#[cfg(feature = "remesh")]
pub(crate) use sampling::samples;
