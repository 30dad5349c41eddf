//! What a pass over the positions of a surface works on.

use super::ring::Shares;
use super::traversal::Traversal;
use super::vector::{Point, Vector};
use crate::mesh::Surface;
use crate::subdivide::FRACTION_BITS;

/// How far coding has been off around a vertex: in the surface and across it, in 1/256.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Roughness {
    pub tangential: u32,
    pub normal: u32,
}

impl Roughness {
    /// Of vertices about which nothing is known.
    pub const START: Roughness = Roughness { tangential: 8 << 8, normal: 4 << 8 };

    /// Of a vertex whose coordinates, in the order of coding, were `off` by so much.
    pub fn of(off: [u64; 3], order: AxisOrder) -> Self {
        let [first, second, third] = off.map(|off| off.min(u32::MAX as u64 / 16) as u32);
        match order {
            AxisOrder::NormalLast => Roughness { tangential: (first + second) / 2, normal: third },
            AxisOrder::NormalFirst => Roughness { tangential: (second + third) / 2, normal: first },
        }
    }

    pub fn blend(&mut self, other: Roughness) {
        self.tangential = (self.tangential * 7 + other.tangential) / 8;
        self.normal = (self.normal * 7 + other.normal) / 8;
    }
}

/// Which coordinate comes first, and with it in what order vertices are visited: see
/// [`Traversal`].
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

/// How far a pass has come.
pub(crate) struct Progress {
    pub traversal: Traversal,
    /// By how much the estimates of the vertices coded so far were off, in 1/256; an entry for each
    /// vertex that has one.
    pub errors: Vec<[i32; 3]>,
}

impl Progress {
    /// Of a pass that has not begun.
    pub fn new(traversal: Traversal, estimates: usize) -> Self {
        Progress { traversal, errors: vec![[0; 3]; estimates] }
    }

    /// Notes that the vertex at `corner`, the next one and the pass's `i`th, is coded to lie at `point`.
    #[inline(always)]
    pub fn advance(&mut self, pass: &Pass, corner: u32, i: usize, point: Point) {
        if let Some(estimate) = pass.estimates.get(i) {
            self.errors[i] = [0, 1, 2].map(|k| (((point[k] as i64) << FRACTION_BITS) - estimate[k]) as i32);
        }
        self.traversal.reach(pass.surface, corner);
    }
}
