//! What the bits of a file mean: every model, context and symbol, once for both directions.
//!
//! Each function is generic over a [`Coder`](crate::entropy::Coder). Encoding, it is given what
//! to write; decoding, it ignores that and returns what it reads. In between both run the same
//! lines on the same integers.

mod around;
mod axes;
mod base;
#[cfg(feature = "max")]
mod beyond;
mod coordinate;
mod detail;
#[cfg(feature = "max")]
mod deviation;
#[cfg(feature = "max")]
mod ensemble;
mod flip;
mod group;
mod growth;
#[cfg(feature = "max")]
mod histogram;
mod level;
mod model;
mod opinions;
#[cfg(feature = "max")]
mod panel;
mod pass;
pub(crate) mod payload;
mod position;
mod positions;
mod predict;
mod priors;
mod reciprocal;
mod region;
#[cfg(feature = "max")]
mod regression;
mod relax;
#[cfg(feature = "max")]
mod residual;
mod ring;
mod scale;
mod shape;
mod site;
mod sketch;
mod split;
mod spread;
mod star;
pub(crate) mod supplement;
mod symmetry;
mod tabled;
#[cfg(all(test, feature = "max"))]
mod training;
mod traversal;
mod twin;
mod vector;

pub(crate) use level::{Grouping, Levels};
pub(crate) use symmetry::Symmetry;
pub(crate) use vector::Point;
