//! How much a vertex deserves to be divided off, with each of its flip sets.
//!
//! A score has a *static* part, from the shape of the vertex's fan, computed once a level, and
//! a *dynamic* part, from what has been decided about its neighbours, which is a handful of
//! table look-ups. Scores and weights are in units of 1/256 and were tuned, in the prototype
//! that this follows, by coded size on scans and models at 12 bits.
//!
//! Everything is integer: the choice must not depend on the platform. A fan is scaled so that
//! its coordinates fit 15 bits with sign; cross products then fit 31 bits and every product
//! below stays within 64.

use super::{FLIP_SETS, Flips, MAX_VALENCE, corners_of};

/// One, as a score.
pub(super) const UNIT: i32 = 256;

/// A neighbour flips the same spoke already: that flip is paid for.
const SHARED_FLIP: i32 = 719;
/// Flipping a spoke to a virtual vertex.
const VIRTUAL_FLIP: i16 = -145;
/// Flipping a spoke beside a virtual vertex, which moves the boundary inwards. Discouraged
/// rather than forbidden, or boundary loops would shrink no further at coarse levels.
const BOUNDARY_BEND: i16 = -512;
/// Distance of a boundary vertex from the middle of the edge that it divides, in spoke lengths.
const BOUNDARY_OFFSET: i32 = -1000;
/// Flipping a spoke to a candidate, which may then share the flip.
const CANDIDATE_FLIP: i32 = 18;
/// Flipping a spoke to a kept vertex of valence above 6, which lowers it.
const HUB_FLIP: i32 = 51;
/// A new edge longer than the spoke, per doubling of the squared length.
const LONGER_EDGE: i32 = -17;
/// A candidate at a corner of the coarse face: it can no longer be divided off.
const BLOCKED: i32 = -256;
/// Relief of that for a candidate of valence other than 6 …
const BLOCKED_IRREGULAR: i32 = 42;
/// … and its reduction for one of valence below 6.
const BLOCKED_LOW: i32 = -28;
/// One minus the cosine between the normals of the coarse face and of the fan.
const TILT: i32 = -463;
/// Distance from the barycentre of the coarse face along its normal, in spoke lengths.
const NORMAL_OFFSET: i32 = -1341;
/// The same distance within the plane of the face.
const TANGENTIAL_OFFSET: i32 = -417;
/// Distance to the nearest simple prediction, in spoke lengths.
const MISS: i32 = -52;
/// The same distance in steps of a 12-bit lattice, per doubling.
const MISS_STEPS: i32 = -26;
/// Area of the coarse face against its share of the fan, per doubling …
const AREA: i32 = 142;
/// … counted up to a factor of e, in doublings.
const AREA_LIMIT: i32 = 369;
/// A face turned over against the fan's normal.
const FOLD: i32 = -512;

/// A vertex whose best score is lower stays.
pub(super) const THRESHOLD: i32 = -11 * UNIT;
/// Below every possible score.
const IMPOSSIBLE: i32 = -(1 << 24);
/// Mark of a spoke that may not be flipped.
const BANNED: i16 = i16::MIN;

/// Bits of the extent that positions are scaled to.
const EXTENT_BITS: u32 = 20;
/// Bits of a fan's extent at most, sign not counted.
const FAN_BITS: u32 = 14;
/// A step of a 12-bit lattice over the whole extent, after scaling: the noise to expect.
const STEP: i64 = 1 << (EXTENT_BITS - 12);

/// What has been decided about a vertex.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum State {
    /// Undecided, of valence 6.
    Candidate,
    /// Undecided, of lower valence.
    LowCandidate,
    /// Stays.
    Kept,
    /// Stays, and has a valence above 6.
    Hub,
    /// Divided off.
    Odd,
}

impl State {
    pub fn is_candidate(self) -> bool {
        matches!(self, State::Candidate | State::LowCandidate)
    }

    /// Value of leaving the spoke to such a vertex unflipped, which makes it a corner.
    fn as_corner(self) -> i32 {
        match self {
            State::Candidate => BLOCKED,
            State::LowCandidate => BLOCKED + BLOCKED_IRREGULAR + BLOCKED_LOW,
            State::Kept | State::Hub => 0,
            State::Odd => IMPOSSIBLE,
        }
    }

    /// Value of flipping the spoke to such a vertex, beside the static one.
    fn across_flip(self) -> i32 {
        match self {
            State::Candidate | State::LowCandidate => CANDIDATE_FLIP,
            State::Hub => HUB_FLIP,
            State::Kept | State::Odd => 0,
        }
    }
}

/// The positions of a level, to be scaled so that scores do not depend on the lattice's size.
pub(super) struct Scaled<'a> {
    positions: &'a [[i32; 3]],
    /// Bits to shift left; right if negative.
    shift: i32,
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
        Self { positions, shift: EXTENT_BITS as i32 - bits as i32 }
    }

    /// The vector from one vertex to another.
    fn between(&self, from: u32, to: u32) -> [i64; 3] {
        let (p, q) = (self.positions[from as usize], self.positions[to as usize]);
        std::array::from_fn(|a| {
            let x = q[a] as i64 - p[a] as i64;
            if self.shift < 0 { x >> -self.shift } else { x << self.shift }
        })
    }
}

/// A vertex with a simple ring, as a candidate; 48 bytes.
#[derive(Clone, Copy)]
pub(super) struct Star {
    /// The neighbours, counter-clockwise; `valence` of them.
    pub ring: [u32; MAX_VALENCE],
    /// Static value of flipping each spoke, or `BANNED`.
    flip: [i16; MAX_VALENCE],
    /// Static value of each flip set, apart from its flips.
    set: [i16; 5],
    pub valence: u8,
    /// Spokes whose flip leaves a face turned over.
    turned: u8,
}

impl Star {
    /// A star that cannot be divided off: it has no flip sets.
    pub const NONE: Star =
        Star { ring: [0; MAX_VALENCE], flip: [0; MAX_VALENCE], set: [0; 5], valence: 0, turned: 0 };

    /// Computes the static part; `virtuals` is the surface's.
    pub fn new(v: u32, ring: &[u32], virtuals: u32, positions: &Scaled) -> Self {
        let mut star = Star { valence: ring.len() as u8, ..Star::NONE };
        star.ring[..ring.len()].copy_from_slice(ring);
        let gap = ring.iter().position(|&w| w < virtuals);
        let mut spokes = [[0; 3]; MAX_VALENCE];
        for (i, &w) in ring.iter().enumerate() {
            if gap != Some(i) {
                spokes[i] = positions.between(v, w);
            }
        }
        let fan = Fan::new(&mut spokes[..ring.len()]);
        match gap {
            None => star.judge(&fan),
            Some(gap) => star.judge_on_boundary(&fan, gap),
        }
        star
    }

    /// As `judge` for a vertex whose neighbour at ring position `gap` is virtual. Half of such a
    /// fan has no geometry, so faces are not compared with its normal.
    fn judge_on_boundary(&mut self, fan: &Fan, gap: usize) {
        let d = fan.spokes.len();
        self.flip[(gap + d - 1) % d] = BOUNDARY_BEND;
        self.flip[gap] = VIRTUAL_FLIP;
        self.flip[(gap + 1) % d] = BOUNDARY_BEND;
        for (value, &flips) in self.set.iter_mut().zip(FLIP_SETS[d]) {
            *value = clamped(fan.set_on_boundary(flips, gap));
        }
    }

    fn judge(&mut self, fan: &Fan) {
        for i in 0..fan.spokes.len() {
            let (value, turned) = fan.flip(i);
            self.flip[i] = clamped(value);
            self.turned |= (turned as u8) << i;
        }
        for (value, &flips) in self.set.iter_mut().zip(FLIP_SETS[fan.spokes.len()]) {
            *value = clamped(fan.set(flips));
        }
    }

    /// Forbids flipping a spoke.
    pub fn ban(&mut self, spoke: usize) {
        self.flip[spoke] = BANNED;
    }

    /// The possible flip set of highest score with that score, if there is one.
    pub fn best(&self, state: &[State]) -> Option<(i32, Flips)> {
        let valence = self.valence as usize;
        let mut unflipped = 0;
        let mut gain = [0; MAX_VALENCE];
        for i in 0..valence {
            let neighbour = state[self.ring[i] as usize];
            let corner = neighbour.as_corner();
            unflipped += corner;
            gain[i] = self.flip_value(i, neighbour) - corner;
        }
        let mut best = (IMPOSSIBLE / 2, None);
        for (&set, &flips) in self.set.iter().zip(FLIP_SETS[valence]) {
            let flipped: i32 = (0..valence).filter(|i| flips >> i & 1 == 1).map(|i| gain[i]).sum();
            let score = set as i32 + unflipped + flipped;
            if score > best.0 {
                best = (score, Some(flips));
            }
        }
        best.1.map(|flips| (best.0, flips))
    }

    fn flip_value(&self, i: usize, neighbour: State) -> i32 {
        if neighbour == State::Odd {
            return SHARED_FLIP;
        }
        if self.flip[i] == BANNED {
            return IMPOSSIBLE;
        }
        let left_turned = self.turned >> i & 1 == 1 && !neighbour.is_candidate();
        self.flip[i] as i32 + neighbour.across_flip() + if left_turned { 2 * FOLD } else { 0 }
    }
}

/// A static value: far outside the range that matters it need not be exact.
fn clamped(value: i32) -> i16 {
    value.clamp(-(1 << 14), 1 << 14) as i16
}

/// The geometry of a fan.
struct Fan<'a> {
    /// From the vertex to its neighbours, zero for a virtual one; coordinates below 2^14.
    spokes: &'a [[i64; 3]],
    /// Direction of the fan's normal: below 2^20.
    normal: [i64; 3],
    /// Length of `normal`.
    normal_length: i64,
    /// Double the fan's area: the length of the summed cross products.
    area: i64,
    /// Mean length (root mean square) of a spoke, and half a step.
    size: i64,
    /// A step of a 12-bit lattice, at least 4.
    step: i64,
}

impl<'a> Fan<'a> {
    fn new(spokes: &'a mut [[i64; 3]]) -> Self {
        let reach = spokes.iter().flatten().fold(0, |m, x| m | x.unsigned_abs());
        let excess = (u64::BITS - reach.leading_zeros()).saturating_sub(FAN_BITS);
        for x in spokes.iter_mut().flatten() {
            *x >>= excess;
        }
        let spokes = &*spokes;
        let n = spokes.len();
        let sum = (0..n).map(|i| cross(spokes[i], spokes[(i + 1) % n])).fold([0; 3], add);
        let reach = sum.iter().fold(0, |m, x| m | x.unsigned_abs());
        let surplus = (u64::BITS - reach.leading_zeros()).saturating_sub(20);
        let normal = sum.map(|x| x >> surplus);
        let normal_length = length(normal);
        let square: i64 = spokes.iter().map(|&s| dot(s, s)).sum::<i64>() / n as i64;
        let step = STEP >> excess.min(6);
        let size = root(square) + step / 2;
        Self { spokes, normal, normal_length, area: normal_length << surplus, size, step }
    }

    fn spoke(&self, i: usize) -> [i64; 3] {
        self.spokes[i % self.spokes.len()]
    }

    /// The neighbours before, at and after ring position i.
    fn around(&self, i: usize) -> [[i64; 3]; 3] {
        [self.spoke(i + self.spokes.len() - 1), self.spoke(i), self.spoke(i + 1)]
    }

    /// Value of flipping spoke i, and whether the face that it leaves is turned over.
    fn flip(&self, i: usize) -> (i32, bool) {
        let [x, w, y] = self.around(i);
        let xy = sub(y, x);
        let noise = (self.step * self.step) as u64;
        let longer = log2(dot(xy, xy) as u64 + noise) - log2(dot(w, w) as u64 + noise);
        let mut value = LONGER_EDGE * longer.max(0) / UNIT;
        if dot(cross(x, y), self.normal) < 0 {
            value += FOLD;
        }
        let turned = dot(cross(sub(w, x), xy), self.normal) <= 0;
        if turned {
            value += FOLD;
        }
        (value, turned)
    }

    /// Value of a flip set apart from its flips: how well the coarse face lies and how nearly
    /// it predicts the vertex.
    fn set(&self, flips: Flips) -> i32 {
        let [a, b, c] = corners_of(flips).map(|i| self.spoke(i));
        let normal = cross(sub(b, a), sub(c, a));
        let area = length(normal);
        // Three times the vector from the vertex to the barycentre, and its normal part.
        let offset = add(add(a, b), c);
        let along = if area == 0 { 0 } else { dot(offset, normal).abs() / area };
        let within = root(dot(offset, offset) - along * along);
        let cosine = dot(normal, self.normal) * UNIT as i64 / (area * self.normal_length).max(1);
        let share = log2((area * self.spokes.len() as i64) as u64 + 1) - log2(3 * self.area as u64 + 1);
        let miss = self.miss(flips, [a, b, c], offset);

        let mut value = scaled(TILT, UNIT as i64 - cosine, UNIT as i64);
        if cosine <= 0 {
            value += 2 * FOLD;
        }
        value += AREA * share.clamp(-AREA_LIMIT, AREA_LIMIT) / UNIT;
        value += scaled(NORMAL_OFFSET, along, 3 * self.size);
        value += scaled(TANGENTIAL_OFFSET, within, 3 * self.size);
        value += scaled(MISS, miss, 6 * self.size);
        value + MISS_STEPS * (log2((miss + 6 * self.step) as u64) - log2(6 * self.step as u64)) / UNIT
    }

    /// Value of a flip set apart from its flips where the spoke at `gap` is virtual (and zero).
    fn set_on_boundary(&self, flips: Flips, gap: usize) -> i32 {
        let offset = corners_of(flips).map(|i| self.spoke(i)).into_iter().fold([0; 3], add);
        let square = if flips >> gap & 1 == 1 {
            // A real face is split: its barycentre, or the middle of its boundary edge.
            let [x, _, y] = self.around(gap);
            let middle = add(x, y);
            (4 * dot(offset, offset)).min(9 * dot(middle, middle))
        } else {
            // A virtual face is split: the middle of its boundary edge.
            9 * dot(offset, offset)
        };
        scaled(BOUNDARY_OFFSET, root(square), 6 * self.size)
    }

    /// Six times the distance from the vertex to the nearest of these: the barycentre, the
    /// corner that completes a parallelogram across a flipped edge, the middle of an edge.
    fn miss(&self, flips: Flips, [a, b, c]: [[i64; 3]; 3], offset: [i64; 3]) -> i64 {
        let middles = [add(a, b), add(b, c), add(c, a)];
        let mut least = 4 * dot(offset, offset);
        for m in middles {
            least = least.min(9 * dot(m, m));
        }
        for i in (0..self.spokes.len()).filter(|i| flips >> i & 1 == 1) {
            let [x, w, y] = self.around(i);
            let p = sub(add(x, y), w);
            least = least.min(36 * dot(p, p));
        }
        root(least)
    }
}

/// A weight times the ratio of two lengths; the ratio is capped where the score is hopeless.
fn scaled(weight: i32, part: i64, whole: i64) -> i32 {
    ((weight as i64 * part / whole.max(1)).clamp(-(1 << 20), 1 << 20)) as i32
}

/// The logarithm to base 2 of a positive number in units of 1/256; between powers of two it
/// is linear, which is at most 0.09 too low.
fn log2(x: u64) -> i32 {
    let zeros = x.leading_zeros();
    let mantissa = (x << zeros) >> 55 & 0xff;
    ((63 - zeros as i32) << 8) + mantissa as i32
}

fn root(square: i64) -> i64 {
    square.max(0).isqrt()
}

fn length(a: [i64; 3]) -> i64 {
    root(dot(a, a))
}

fn add(a: [i64; 3], b: [i64; 3]) -> [i64; 3] {
    std::array::from_fn(|k| a[k] + b[k])
}

fn sub(a: [i64; 3], b: [i64; 3]) -> [i64; 3] {
    std::array::from_fn(|k| a[k] - b[k])
}

fn dot(a: [i64; 3], b: [i64; 3]) -> i64 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

fn cross(a: [i64; 3], b: [i64; 3]) -> [i64; 3] {
    [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_logarithm_is_exact_at_powers_of_two_and_never_falls() {
        for k in 0..64 {
            assert_eq!(log2(1 << k), 256 * k);
        }
        assert!((1..5000).all(|x| log2(x) <= log2(x + 1)));
    }

    /// A flat regular fan of radius r with its centre lifted by h.
    fn hexagon(r: i32, h: i32) -> Vec<[i32; 3]> {
        let (s, c) = (r * 866 / 1000, r / 2);
        vec![[0, 0, h], [r, 0, 0], [c, s, 0], [-c, s, 0], [-r, 0, 0], [-c, -s, 0], [c, -s, 0]]
    }

    fn score(positions: &[[i32; 3]], state: State) -> i32 {
        let ring: Vec<u32> = (1..positions.len() as u32).collect();
        let star = Star::new(0, &ring, 0, &Scaled::new(positions, 0));
        star.best(&vec![state; positions.len()]).unwrap().0
    }

    #[test]
    fn a_vertex_in_the_middle_of_a_flat_fan_scores_higher_than_a_lifted_one() {
        let flat = score(&hexagon(1000, 0), State::Kept);
        let lifted = score(&hexagon(1000, 400), State::Kept);
        assert!(flat > lifted + UNIT, "{flat} {lifted}");
    }

    #[test]
    fn scores_hardly_change_with_the_resolution_of_the_lattice() {
        let coarse = score(&hexagon(1000, 300), State::Kept);
        for bits in [2, 6, 13] {
            let scaled: Vec<_> = hexagon(1000, 300).iter().map(|p| p.map(|x| x << bits)).collect();
            let fine = score(&scaled, State::Kept);
            assert_eq!(fine, coarse, "{bits} bits more");
        }
    }

    #[test]
    fn the_largest_coordinates_do_not_overflow() {
        let far = (1 << 26) - 1;
        for sign in [1, -1] {
            let corner = |i: i32| [0, 1, 2].map(|k| if (i >> k) & 1 == 1 { sign * far } else { -sign * far });
            let positions: Vec<_> = (0..7).map(corner).collect();
            score(&positions, State::Candidate);
        }
        assert_eq!(score(&[[5; 3]; 4], State::Kept), score(&[[-5; 3]; 4], State::Kept));
    }

    #[test]
    fn sharing_a_flip_is_the_only_way_beside_an_odd_vertex() {
        let positions = hexagon(1000, 0);
        let ring: Vec<u32> = (1..7).collect();
        let star = Star::new(0, &ring, 0, &Scaled::new(&positions, 0));
        let mut state = [State::Candidate; 7];
        state[2] = State::Odd;
        assert_eq!(star.best(&state).unwrap().1, 0b101010);
        state[3] = State::Odd;
        assert!(star.best(&state).is_none(), "neighbouring spokes cannot both be flipped");
    }
}
