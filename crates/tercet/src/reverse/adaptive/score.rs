//! How much a vertex deserves to be divided off, with each of its flip sets.
//!
//! A score has a *static* part, from the shape of the vertex's [fan](super::fan), computed once a level, and
//! a *dynamic* part, from what has been decided about its neighbours, which is a handful of
//! table look-ups. Scores and weights are in units of 1/256 and were tuned, in the prototype
//! that this follows, by coded size on scans and models at 12 bits.

use super::fan::{FOLD, Fan, Scaled, Spokes};
use super::{FLIP_SETS, Flips, MAX_VALENCE};
use crate::mesh::NONE;

/// One, as a score.
pub(super) const UNIT: i32 = 256;

/// A neighbour flips the same spoke already: that flip is paid for.
const SHARED_FLIP: i32 = 719;
/// Flipping a spoke to a virtual vertex.
const VIRTUAL_FLIP: i16 = -145;
/// Flipping a spoke beside a virtual vertex, which moves the boundary inwards. Discouraged
/// rather than forbidden, or boundary loops would shrink no further at coarse levels.
const BOUNDARY_BEND: i16 = -512;
/// Flipping a spoke to a candidate, which may then share the flip.
const CANDIDATE_FLIP: i32 = 18;
/// Flipping a spoke to a kept vertex of valence above 6, which lowers it.
const HUB_FLIP: i32 = 51;
/// A candidate at a corner of the coarse face: it can no longer be divided off.
const BLOCKED: i32 = -256;
/// Relief of that for a candidate of valence other than 6 …
const BLOCKED_IRREGULAR: i32 = 42;
/// … and its reduction for one of valence below 6.
const BLOCKED_LOW: i32 = -28;

/// A vertex whose best score is lower stays.
pub(super) const THRESHOLD: i32 = -11 * UNIT;
/// Below every possible score.
const IMPOSSIBLE: i32 = -(1 << 24);
/// Value of flipping a spoke that may not be flipped: any score with it is below the threshold.
const BANNED: i16 = i16::MIN;

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

    /// What a neighbour in this state adds: of a table, because which it is nobody could predict.
    fn effect(self) -> &'static Effect {
        &EFFECTS[self as usize]
    }
}

/// What a neighbour adds to the static values of its spoke.
struct Effect {
    /// Left unflipped, which makes the neighbour a corner.
    corner: i32,
    /// Flipped.
    flip: i32,
    /// Flipped, where that leaves a face turned over.
    turned: i32,
    /// All bits, or none where the flip is the neighbour's, and its static value does not count.
    fresh: i32,
}

/// By state.
static EFFECTS: [Effect; 5] = [
    Effect { corner: BLOCKED, flip: CANDIDATE_FLIP, turned: 0, fresh: -1 },
    Effect { corner: BLOCKED + BLOCKED_IRREGULAR + BLOCKED_LOW, flip: CANDIDATE_FLIP, turned: 0, fresh: -1 },
    Effect { corner: 0, flip: 0, turned: 2 * FOLD, fresh: -1 },
    Effect { corner: 0, flip: HUB_FLIP, turned: 2 * FOLD, fresh: -1 },
    Effect { corner: IMPOSSIBLE, flip: SHARED_FLIP, turned: 0, fresh: 0 },
];

/// A vertex with a simple ring, as a candidate; 48 bytes.
#[derive(Clone, Copy)]
pub(super) struct Star {
    /// The neighbours, counter-clockwise: `valence` of them, then `NONE`.
    pub ring: [u32; MAX_VALENCE],
    /// Static value of flipping each spoke, or `BANNED`.
    flip: [i16; MAX_VALENCE],
    /// Static value of each flip set, apart from its flips.
    set: [i16; MOST_SETS],
    pub valence: u8,
    /// Spokes whose flip leaves a face turned over.
    turned: u8,
}

impl Star {
    /// A star that cannot be divided off: it has no flip sets.
    pub const NONE: Star = Star {
        ring: [NONE; MAX_VALENCE],
        flip: [0; MAX_VALENCE],
        set: [0; MOST_SETS],
        valence: 0,
        turned: 0,
    };

    /// Computes the static part; `virtuals` is the surface's. The ring has `valence` members, 3 to 6, then `NONE`.
    pub fn new(v: u32, ring: [u32; MAX_VALENCE], valence: u8, virtuals: u32, positions: &Scaled) -> Self {
        let mut star = Star { ring, valence, ..Star::NONE };
        let gap = ring.iter().position(|&w| w < virtuals);
        match valence {
            3 => star.judge::<3>(v, gap, positions),
            4 => star.judge::<4>(v, gap, positions),
            5 => star.judge::<5>(v, gap, positions),
            _ => star.judge::<6>(v, gap, positions),
        }
        star
    }

    /// One copy for each valence `D`, in which all loops are straight lines. `gap` is the ring position of a virtual
    /// neighbour: half of such a fan has no geometry, so faces are not compared with its normal.
    fn judge<const D: usize>(&mut self, v: u32, gap: Option<usize>, positions: &Scaled) {
        let ring = std::array::from_fn(|i| self.ring[i]);
        let spokes = Spokes::<D>::new(v, &ring, gap, positions);
        if let Some(gap) = gap {
            for (value, &flips) in self.set.iter_mut().zip(FLIP_SETS[D]) {
                *value = clamped(spokes.set_on_boundary(flips, gap));
            }
            self.flip[(gap + D - 1) % D] = BOUNDARY_BEND;
            self.flip[gap] = VIRTUAL_FLIP;
            self.flip[(gap + 1) % D] = BOUNDARY_BEND;
            return;
        }
        let fan = Fan::new(&spokes);
        self.set = [set(&fan, 0), set(&fan, 1), set(&fan, 2), set(&fan, 3), set(&fan, 4)];
        if D > 3 {
            for (i, (value, turned)) in fan.flips().into_iter().enumerate() {
                self.flip[i] = clamped(value);
                self.turned |= u8::from(turned) << i;
            }
        }
    }

    /// Forbids flipping a spoke.
    pub fn ban(&mut self, spoke: usize) {
        self.flip[spoke] = BANNED;
    }

    /// The flip set of highest score with that score, if one is possible beside odd neighbours.
    pub fn best(&self, state: &[State]) -> Option<(i32, Flips)> {
        match self.valence {
            0 => None,
            3 => self.best_of::<3>(state),
            4 => self.best_of::<4>(state),
            5 => self.best_of::<5>(state),
            _ => self.best_of::<6>(state),
        }
    }

    /// As `best` for valence `D`: see `judge`.
    fn best_of<const D: usize>(&self, state: &[State]) -> Option<(i32, Flips)> {
        let mut unflipped = 0;
        // What flipping each spoke adds.
        let mut gain = [0; D];
        for i in 0..D {
            let effect = state[self.ring[i] as usize].effect();
            unflipped += effect.corner;
            let turned = i32::from(self.turned >> i & 1) * effect.turned;
            gain[i] = ((i32::from(self.flip[i]) + turned) & effect.fresh) + effect.flip - effect.corner;
        }
        let mut best = (IMPOSSIBLE / 2, None);
        for (k, &flips) in FLIP_SETS[D].iter().enumerate() {
            let flipped: i32 = (0..D).filter(|i| flips >> i & 1 == 1).map(|i| gain[i]).sum();
            let score = i32::from(self.set[k]) + unflipped + flipped;
            if score > best.0 {
                best = (score, Some(flips));
            }
        }
        best.1.map(|flips| (best.0, flips))
    }
}

/// Most flip sets of a vertex.
const MOST_SETS: usize = 5;
/// The static value of the `k`-th flip set, if there are so many.
#[inline(always)]
fn set<const D: usize>(fan: &Fan<D>, k: usize) -> i16 {
    if k < FLIP_SETS[D].len() { clamped(fan.set(FLIP_SETS[D][k])) } else { 0 }
}

/// A static value: far outside the range that matters it need not be exact.
fn clamped(value: i32) -> i16 {
    value.clamp(-(1 << 14), 1 << 14) as i16
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A flat regular fan of radius r with its centre lifted by h.
    fn hexagon(r: i32, h: i32) -> Vec<[i32; 3]> {
        let (s, c) = (r * 866 / 1000, r / 2);
        vec![[0, 0, h], [r, 0, 0], [c, s, 0], [-c, s, 0], [-r, 0, 0], [-c, -s, 0], [c, -s, 0]]
    }

    /// Vertex 0 with all others around it.
    fn star(positions: &[[i32; 3]]) -> Star {
        let valence = positions.len() - 1;
        let ring = std::array::from_fn(|i| if i < valence { i as u32 + 1 } else { NONE });
        Star::new(0, ring, valence as u8, 0, &Scaled::new(positions, 0))
    }

    fn score(positions: &[[i32; 3]], state: State) -> i32 {
        star(positions).best(&vec![state; positions.len()]).unwrap().0
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
        let star = star(&positions);
        let mut state = [State::Candidate; 7];
        state[2] = State::Odd;
        assert_eq!(star.best(&state).unwrap().1, 0b101010);
        state[3] = State::Odd;
        assert!(star.best(&state).is_none(), "neighbouring spokes cannot both be flipped");
    }
}
