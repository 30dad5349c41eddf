//! What a pass over the positions of a surface works on.

use super::ring::Shares;
use super::vector::{Point, Vector};
use crate::mesh::Surface;

/// How far coding has been off around a vertex: in the surface and across it, in 1/256.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Roughness {
    pub tangential: u32,
    pub normal: u32,
}

impl Roughness {
    /// Of vertices about which nothing is known.
    pub const START: Roughness = Roughness { tangential: 8 << 8, normal: 4 << 8 };

    pub fn blend(&mut self, other: Roughness) {
        self.tangential = (self.tangential * 7 + other.tangential) / 8;
        self.normal = (self.normal * 7 + other.normal) / 8;
    }
}

/// Which coordinate comes first, and with it in what order vertices are visited: see
/// [`Traversal`](super::traversal::Traversal).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum AxisOrder {
    /// The one along the normal: where details are normal ones.
    NormalFirst,
    /// The one along the normal comes last: where the surface is known better than the place.
    NormalLast,
}

/// What a pass works on.
pub(crate) struct Pass<'a> {
    pub surface: &'a Surface,
    /// Real vertices from here on are coded; those before are known.
    pub first: u32,
    /// Estimates of the vertices to be coded, in 1/256; empty if there are none.
    pub estimates: &'a [Vector],
    pub order: AxisOrder,
    /// How the expectations of a vertex make its first one.
    pub shares: &'static Shares,
    /// Width of a coordinate where nothing near is known, and what is subtracted from it.
    pub bits: u32,
    pub origin: Point,
}
