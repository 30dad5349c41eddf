//! A pass over the positions of a surface: what it works on, and its walk from vertex to vertex, which all
//! profiles share.

use super::axes::{AxisOrder, NORMAL, axes};
use super::ring::Shares;
use super::star::Star;
use super::symmetry::Symmetry;
use super::traversal::Traversal;
use super::twin::Twins;
use super::vector::{COORDINATE_LIMIT, Point, Vector};
use crate::entropy::Coder;
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

    /// Either part is at most this, so that [`blend`](Roughness::blend) stays within 32 bits.
    const MOST: u32 = u32::MAX / 16;

    /// Of a vertex whose coordinates, in the order of coding, were `off` by so much.
    pub fn of(off: [u64; 3], order: AxisOrder) -> Self {
        let [first, second, third] = off.map(|off| off.min(Self::MOST.into()) as u32);
        match order {
            AxisOrder::NormalLast => Roughness { tangential: (first + second) / 2, normal: third },
            AxisOrder::NormalFirst => Roughness { tangential: (second + third) / 2, normal: first },
        }
    }

    /// Of a vertex at `point` that was expected at `expected`, in 1/256, on a surface with this `normal`.
    pub fn at(point: Point, expected: Vector, normal: Vector, order: AxisOrder) -> Self {
        let off = |axis: usize| ((point[axis] as i64) << FRACTION_BITS).abs_diff(expected[axis]);
        Roughness::of(axes(normal, order).map(off), order)
    }

    /// Notes in `rough`, which has an entry a vertex, that `v` was `off` by so much: its `neighbours` tend to it.
    pub fn spread(rough: &mut [Roughness], v: u32, off: Roughness, neighbours: &[u32]) {
        rough[v as usize] = off;
        for &y in neighbours {
            rough[y as usize].blend(off);
        }
    }

    /// Of a kind of axis.
    #[inline(always)]
    pub fn along(self, kind: usize) -> u32 {
        if kind == NORMAL { self.normal } else { self.tangential }
    }

    /// Adds what another account of the same vertex has changed. Sums of several do not depend on their
    /// order, and are modulo 2^32 and not in range until they are [`settle`](Roughness::settle)d.
    pub fn add_change(&mut self, before: Roughness, after: Roughness) {
        self.tangential = self.tangential.wrapping_add(after.tangential).wrapping_sub(before.tangential);
        self.normal = self.normal.wrapping_add(after.normal).wrapping_sub(before.normal);
    }

    /// After the last change: signed sums into the range, which those of hostile files leave at both ends.
    pub fn settle(&mut self) {
        for part in [&mut self.tangential, &mut self.normal] {
            *part = (*part as i32).clamp(0, Self::MOST as i32) as u32;
        }
    }

    /// Tends to what a neighbour was off by.
    pub fn blend(&mut self, other: Roughness) {
        self.tangential = (self.tangential * 7 + other.tangential) / 8;
        self.normal = (self.normal * 7 + other.normal) / 8;
    }
}

/// What a pass works on.
pub(crate) struct Pass<'a> {
    pub surface: &'a Surface,
    /// Real vertices from here on are coded; those before are known.
    pub first: u32,
    /// Estimates of the vertices to be coded, in 1/256; empty if there are none.
    pub estimates: &'a [Vector],
    pub order: AxisOrder,
    /// Whether the best supported vertex comes next, or that of the next number.
    pub by_support: bool,
    /// How the expectations of a vertex make its first one.
    pub shares: &'static Shares,
    /// Width of a coordinate where nothing near is known, and what is subtracted from it.
    pub bits: u32,
    pub origin: Point,
    /// The plane that vertices may have twins by, if there is one.
    pub symmetry: Option<Symmetry>,
}

impl Pass<'_> {
    /// What the pass begins to look for twins in, if it does. Of `positions` only those that were known before it are
    /// looked at: other regions may have changed the rest.
    pub fn twins(&self, positions: &[Point]) -> Option<Twins> {
        self.symmetry.map(|symmetry| Twins::new(symmetry, self, positions))
    }
}

/// Width and origin above the base, where a vertex rarely knows no neighbour, as when all are other regions'.
pub(crate) const ANYWHERE: (u32, Point) = (2 + COORDINATE_LIMIT.ilog2(), [-COORDINATE_LIMIT; 3]);

/// How far a pass has come.
pub(crate) struct Progress {
    pub traversal: Traversal,
    twins: Option<Twins>,
}

impl Progress {
    /// Of a pass, or a region of it, that has not begun.
    pub fn new(traversal: Traversal, twins: Option<Twins>) -> Self {
        Progress { traversal, twins }
    }

    /// Codes the vertices of the pass that are left, those of `targets` when encoding, until all are coded or
    /// bytes are missing; whether all are. `positions` has an entry a vertex: of those to be coded the
    /// estimate, rounded, if there are any.
    ///
    /// `code` codes the vertex whose turn it is.
    #[inline(always)]
    pub fn run<C: Coder>(
        &mut self,
        coder: &mut C,
        pass: &Pass,
        targets: &[Point],
        positions: &mut [Point],
        mut code: impl FnMut(&mut C, &Turn, &mut Option<Twins>) -> Point,
    ) -> bool {
        let mut star = Star::default();
        while let Some((v, corner)) = self.traversal.next() {
            if coder.exhausted() {
                // The caller refuses the level; what follows would only take time.
                break;
            }
            if !coder.is_ready() {
                return false;
            }
            let i = (v - pass.first) as usize;
            star.gather(pass.surface, corner, self.traversal.known());
            let turn = Turn {
                v,
                corner,
                star: &star,
                target: targets.get(i).copied().unwrap_or_default(),
                estimate: pass.estimates.get(i),
                known: self.traversal.known(),
                positions,
            };
            let point = code(coder, &turn, &mut self.twins);
            positions[v as usize] = point;
            if let Some(twins) = &mut self.twins {
                twins.note(v, point);
            }
            self.traversal.reach(v, &star);
        }
        true
    }
}

/// The vertex whose turn it is, and what is known when it comes.
pub(crate) struct Turn<'a> {
    pub v: u32,
    /// A corner of it.
    #[cfg_attr(not(feature = "max"), expect(dead_code, reason = "only that effort asks for it"))]
    pub corner: u32,
    /// What is around it.
    pub star: &'a Star,
    /// Where it lies; meaningless when decoding.
    pub target: Point,
    /// Where it was expected before the pass, if it was.
    pub estimate: Option<&'a Vector>,
    /// For each vertex whether its position is known.
    #[cfg_attr(not(feature = "max"), expect(dead_code, reason = "only that effort asks for it"))]
    pub known: &'a [bool],
    pub positions: &'a [Point],
}

/// A vertex without a known neighbour: its coordinates as they are.
#[cold]
pub(super) fn plain<C: Coder>(coder: &mut C, pass: &Pass, target: Point) -> Point {
    [0, 1, 2].map(|k| {
        let offset = coder.raw_wide(target[k].wrapping_sub(pass.origin[k]) as u32, pass.bits);
        pass.origin[k].wrapping_add(offset as i32).clamp(-COORDINATE_LIMIT, COORDINATE_LIMIT)
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn both(part: u32) -> Roughness {
        Roughness { tangential: part, normal: part }
    }

    #[test]
    fn sums_of_changes_settle_where_they_may_be_blended() {
        let most = Roughness::of([u64::MAX; 3], AxisOrder::NormalLast);
        for (before, after, changes) in
            [(both(0), most, 7), (most, both(0), 7), (both(0), most, 16), (most, most, 16)]
        {
            let mut sum = before;
            (0..changes).for_each(|_| sum.add_change(before, after));
            sum.settle();
            sum.blend(most);
            assert!(sum.tangential <= most.tangential && sum.normal <= most.normal, "{sum:?}");
        }
    }
}
