//! What the shape of a fan says of dividing off the vertex in its middle: the static part of a score.
//!
//! Everything asked of a fan is a function of its spokes' squares and of the scalar and vector products of pairs of
//! them that are one or two apart: the corners of a coarse face are. They are computed once; a spoke's flip and a
//! flip set are then sums of a few.
//!
//! Everything is integer: the choice must not depend on the platform. A fan is scaled so that its coordinates fit 15
//! bits with sign; vector products then fit 33 bits and every product below stays within 64.

use super::root::{log2, over_root, root};
use super::score::UNIT;
use super::{Flips, corners_of};

/// Distance of a boundary vertex from the middle of the edge that it divides, in spoke lengths.
const BOUNDARY_OFFSET: i64 = -1000;
/// A new edge longer than the spoke, per doubling of the squared length.
const LONGER_EDGE: i32 = -17;
/// One minus the cosine between the normals of the coarse face and of the fan.
const TILT: i32 = -463;
/// Distance from the barycentre of the coarse face along its normal, in spoke lengths.
const NORMAL_OFFSET: i64 = -1341;
/// The same distance within the plane of the face.
const TANGENTIAL_OFFSET: i64 = -417;
/// Distance to the nearest simple prediction, in spoke lengths.
const MISS: i64 = -52;
/// The same distance in steps of a 12-bit lattice, per doubling.
const MISS_STEPS: i32 = -26;
/// Area of the coarse face against its share of the fan, per doubling …
const AREA: i32 = 142;
/// … counted up to a factor of e, in doublings.
const AREA_LIMIT: i32 = 369;
/// A face turned over against the fan's normal.
pub(super) const FOLD: i32 = -512;

/// Bits of the extent that positions are scaled to.
const EXTENT_BITS: u32 = 20;
/// Bits of a fan's extent at most, sign not counted.
const FAN_BITS: u32 = 14;
/// Bits of a fan's normal.
const NORMAL_BITS: u32 = 16;
/// A step of a 12-bit lattice over the whole extent, after scaling: the noise to expect.
const STEP: i64 = 1 << (EXTENT_BITS - 12);

type Vector = [i64; 3];

/// The positions of a level, to be scaled so that scores do not depend on the lattice's size.
pub(super) struct Scaled<'a> {
    positions: &'a [[i32; 3]],
    /// Bits to shift left, then bits to shift right; one of them is 0.
    shift: [u32; 2],
}

impl<'a> Scaled<'a> {
    /// Measures the extent of the real vertices, those from number `virtuals` on.
    pub fn new(positions: &'a [[i32; 3]], virtuals: u32) -> Self {
        let mut low = [i32::MAX; 3];
        let mut high = [i32::MIN; 3];
        for p in positions.get(virtuals as usize..).unwrap_or_default() {
            low = std::array::from_fn(|a| low[a].min(p[a]));
            high = std::array::from_fn(|a| high[a].max(p[a]));
        }
        let extent = (0..3).map(|a| (high[a] as i64 - low[a] as i64).max(0)).max().unwrap_or(0);
        let bits = i64::BITS - extent.leading_zeros();
        Self { positions, shift: [EXTENT_BITS.saturating_sub(bits), bits.saturating_sub(EXTENT_BITS)] }
    }

    /// The vector from one vertex to another.
    fn between(&self, from: u32, to: u32) -> Vector {
        let (p, q) = (self.positions[from as usize], self.positions[to as usize]);
        std::array::from_fn(|a| (q[a] as i64 - p[a] as i64) << self.shift[0] >> self.shift[1])
    }
}

/// The spokes of a fan around a vertex of valence `D`.
pub(super) struct Spokes<const D: usize> {
    /// From the vertex to its neighbours, zero for a virtual one; coordinates below 2^14.
    spoke: [Vector; D],
    square: [i64; D],
    /// 2^32 over three times the mean length (root mean square) of a spoke and half a step.
    per_size: i64,
    /// A step of a 12-bit lattice, at least 4.
    step: i64,
}

impl<const D: usize> Spokes<D> {
    /// `gap` is the ring position of a virtual neighbour.
    pub fn new(v: u32, ring: &[u32; D], gap: Option<usize>, positions: &Scaled) -> Self {
        let mut spoke = ring.map(|w| positions.between(v, w));
        if let Some(gap) = gap {
            spoke[gap] = [0; 3];
        }
        let reach = spoke.iter().flatten().fold(0, |m, x| m | x.unsigned_abs());
        let excess = (u64::BITS - reach.leading_zeros()).saturating_sub(FAN_BITS);
        let spoke = spoke.map(|s| s.map(|x| x >> excess));
        let square = spoke.map(|s| dot(s, s));
        let step = STEP >> excess.min(6);
        let size = root(square.iter().sum::<i64>() / D as i64) + step / 2;
        Self { spoke, square, per_size: (1 << 32) / (3 * size), step }
    }

    /// A weight times a third of `part` over the size.
    fn scaled(&self, weight: i64, part: i64) -> i32 {
        ((weight * ((part * self.per_size) >> 16)) >> 16) as i32
    }

    /// Value of a flip set apart from its flips where the spoke at `gap` is virtual (and zero).
    pub fn set_on_boundary(&self, flips: Flips, gap: usize) -> i32 {
        let offset = corners_of(flips).map(|i| self.spoke[i]).into_iter().fold([0; 3], add);
        let square = if flips >> gap & 1 == 1 {
            // A real face is split: its barycentre, or the middle of its boundary edge.
            let middle = add(self.spoke[(gap + D - 1) % D], self.spoke[(gap + 1) % D]);
            (4 * dot(offset, offset)).min(9 * dot(middle, middle))
        } else {
            // A virtual face is split: the middle of its boundary edge.
            9 * dot(offset, offset)
        };
        self.scaled(BOUNDARY_OFFSET, root(square) / 2)
    }
}

/// Two spokes, the first before the second.
#[derive(Clone, Copy)]
struct Pair {
    product: i64,
    /// Their vector product: twice the area between them, along its normal.
    area: Vector,
    /// How much of that faces as the fan does: its scalar product with the fan's normal.
    facing: i64,
}

/// The geometry of a fan without a virtual neighbour.
pub(super) struct Fan<'a, const D: usize> {
    spokes: &'a Spokes<D>,
    /// Each spoke and the one after it, then the one after that.
    near: [Pair; D],
    wide: [Pair; D],
    /// Squared length of the normal: the sum of the areas between neighbouring spokes, cut to `NORMAL_BITS` bits.
    normal_square: u64,
    /// Twice the fan's area, as a logarithm to base 2.
    area: i32,
}

impl<'a, const D: usize> Fan<'a, D> {
    pub fn new(spokes: &'a Spokes<D>) -> Self {
        let pair = |i: usize, j: usize| {
            let (a, b) = (spokes.spoke[i], spokes.spoke[j % D]);
            Pair { product: dot(a, b), area: cross(a, b), facing: 0 }
        };
        let mut fan = Self {
            spokes,
            near: std::array::from_fn(|i| pair(i, i + 1)),
            wide: std::array::from_fn(|i| pair(i, i + 2)),
            normal_square: 0,
            area: 0,
        };
        let sum = fan.near.iter().fold([0; 3], |sum, pair| add(sum, pair.area));
        let reach = sum.iter().fold(0, |m, x| m | x.unsigned_abs());
        let surplus = (u64::BITS - reach.leading_zeros()).saturating_sub(NORMAL_BITS);
        let normal = sum.map(|x| x >> surplus);
        for pair in fan.near.iter_mut().chain(&mut fan.wide) {
            pair.facing = dot(pair.area, normal);
        }
        fan.normal_square = dot(normal, normal) as u64;
        fan.area = log2(3 * (root(fan.normal_square as i64) << surplus) as u64 + 1);
        fan
    }

    /// Value of flipping each spoke, and whether the face that it leaves is turned over.
    pub fn flips(&self) -> [(i32, bool); D] {
        let Spokes { square, step, .. } = self.spokes;
        let noise = step * step;
        std::array::from_fn(|i| {
            let before = (i + D - 1) % D;
            let wide = &self.wide[before];
            let new = square[before] + square[(i + 1) % D] - 2 * wide.product;
            let longer = log2((new + noise) as u64) - log2((square[i] + noise) as u64);
            let mut value = LONGER_EDGE * longer.max(0) / UNIT;
            if wide.facing < 0 {
                value += FOLD;
            }
            // What the two faces at the spoke have and the one between their outer spokes has not.
            let turned = self.near[before].facing + self.near[i].facing <= wide.facing;
            if turned {
                value += FOLD;
            }
            (value, turned)
        })
    }

    /// Value of a flip set apart from its flips: how well the coarse face lies and how nearly
    /// it predicts the vertex. Where the set is a constant, so are all places of the ring.
    #[inline(always)]
    pub fn set(&self, flips: Flips) -> i32 {
        let spokes = self.spokes;
        let corners = corners_of(flips);
        // The edges of the coarse face: each from a corner to the next one.
        let edges =
            corners.map(|i| if flips >> ((i + 1) % D) & 1 == 1 { &self.wide[i] } else { &self.near[i] });
        let normal = edges.iter().fold([0; 3], |sum, pair| add(sum, pair.area));
        let facing = edges.iter().fold(0, |sum, pair| sum + pair.facing);
        let square = dot(normal, normal) as u64;
        // Three times the vector from the vertex to the barycentre: its square, and its normal part.
        let squares = corners.iter().fold(0, |sum, &i| sum + spokes.square[i]);
        let offset = squares + 2 * edges.iter().fold(0, |sum, pair| sum + pair.product);
        let along = over_root(3 * dot(spokes.spoke[corners[0]], edges[1].area).abs(), square);
        let within = root(offset - along * along);
        let cosine = over_root(over_root(facing, square) * i64::from(UNIT), self.normal_square) as i32;
        let share = log2(root(square as i64) as u64 * D as u64 + 1) - self.area;
        let miss = self.miss(flips, corners, edges, offset);

        let mut value = TILT * (UNIT - cosine) / UNIT;
        if cosine <= 0 {
            value += 2 * FOLD;
        }
        value += AREA * share.clamp(-AREA_LIMIT, AREA_LIMIT) / UNIT;
        value += spokes.scaled(NORMAL_OFFSET, along) + spokes.scaled(TANGENTIAL_OFFSET, within);
        value += spokes.scaled(MISS, miss / 2);
        let steps = log2((miss + 6 * spokes.step) as u64) - log2(6 * spokes.step as u64);
        value + MISS_STEPS * steps / UNIT
    }

    /// Six times the distance from the vertex to the nearest of these: the barycentre, the
    /// corner that completes a parallelogram across a flipped edge, the middle of an edge.
    ///
    /// `edges` lead from each corner to the next, `offset` is the square of three times the vector to the barycentre.
    #[inline(always)]
    fn miss(&self, flips: Flips, corners: [usize; 3], edges: [&Pair; 3], offset: i64) -> i64 {
        let square = &self.spokes.square;
        let mut least = 4 * offset;
        for (k, &x) in corners.iter().enumerate() {
            let y = corners[(k + 1) % 3];
            // |x + y|², and |x + y − w|² where w lies between.
            let sum = square[x] + square[y] + 2 * edges[k].product;
            least = least.min(9 * sum);
            let w = (x + 1) % D;
            if flips >> w & 1 == 1 {
                let across = sum + square[w] - 2 * (self.near[x].product + self.near[w].product);
                least = least.min(36 * across);
            }
        }
        root(least)
    }
}

fn add(a: Vector, b: Vector) -> Vector {
    std::array::from_fn(|k| a[k] + b[k])
}

fn dot(a: Vector, b: Vector) -> i64 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

fn cross(a: Vector, b: Vector) -> Vector {
    [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
}
