//! The greedy choice of the odd vertices.

use super::fan::Scaled;
use super::queue::BucketQueue;
use super::score::{Star, State, THRESHOLD, UNIT};
use super::{Flips, MAX_VALENCE, corners_of};
use crate::mesh::{NONE, Surface, next};

/// Buckets for each unit of score, from one unit below the threshold up.
const BUCKETS_PER_UNIT: i32 = 12;
/// That of the threshold.
const LEAST_BUCKET: usize = BUCKETS_PER_UNIT as usize;
/// Buckets in all; their range covers the scores that occur.
const BUCKETS: usize = 320;
/// No edge is made between two vertices both of higher valence than this, so that looking for
/// an edge takes constant time.
const LARGEST_WALK: u8 = 30;

/// Vertices that compete at a time. Going through a large surface in order of score alone
/// visits memory at random and takes twice the time; blocks of neighbouring numbers stay in
/// the cache, and their seams cost less than 0.2 % of the positions' bits.
pub(crate) const BLOCK: usize = 1 << 17;

/// Chooses odd vertices with their flip sets, in each block of vertices by descending score.
///
/// `corner` holds the first corner of each vertex; ring positions count from it. `valence` is right up to 254.
pub(super) fn select(
    fine: &Surface,
    corner: &[u32],
    valence: &[u8],
    positions: &[[i32; 3]],
) -> Vec<Option<Flips>> {
    let mut selector = Selector::new(fine, corner, valence, positions);
    for first in (0..fine.vertices).step_by(BLOCK) {
        selector.compete(first);
    }
    let Selector { state, flips, .. } = selector;
    state.into_iter().zip(flips).map(|(state, flips)| (state == State::Odd).then_some(flips)).collect()
}

struct Selector<'a> {
    fine: &'a Surface,
    corner: &'a [u32],
    valence: &'a [u8],
    /// Meaningful for vertices that are or were candidates.
    star: Vec<Star>,
    state: Vec<State>,
    /// The best flip set of a candidate when it was last scored; that of an odd vertex.
    flips: Vec<Flips>,
    planned: PlannedEdges,
    queue: BucketQueue,
    /// Number of the commitment that last re-scored a vertex.
    stamp: Vec<u32>,
    commitments: u32,
    /// Vertices from this number on are not to be decided yet.
    end: u32,
}

impl<'a> Selector<'a> {
    fn new(fine: &'a Surface, corner: &'a [u32], valence: &'a [u8], positions: &[[i32; 3]]) -> Self {
        let n = fine.vertices as usize;
        let scaled = Scaled::new(positions, fine.virtuals);
        let mut star = vec![Star::NONE; n];
        let mut state = vec![State::Kept; n];
        for v in 0..fine.vertices {
            let i = v as usize;
            if valence[i] as usize > MAX_VALENCE {
                state[i] = State::Hub;
            } else if let Some(ring) = simple_ring(fine, corner[i], valence[i]) {
                star[i] = Star::new(v, ring, valence[i], fine.virtuals, &scaled);
                let is_low = (valence[i] as usize) < MAX_VALENCE;
                state[i] = if is_low { State::LowCandidate } else { State::Candidate };
            }
        }
        state[..fine.virtuals as usize].fill(State::Kept);
        Self {
            fine,
            corner,
            valence,
            star,
            state,
            flips: vec![0; n],
            planned: PlannedEdges::new(n),
            queue: BucketQueue::new(BUCKETS, n),
            stamp: vec![0; n],
            commitments: 0,
            end: 0,
        }
    }

    /// Decides the block that begins with vertex `first`.
    fn compete(&mut self, first: u32) {
        self.end = self.fine.vertices.min(first.saturating_add(BLOCK as u32));
        for v in (first..self.end).rev() {
            self.enqueue(v);
        }
        while let Some((v, bucket)) = self.queue.pop() {
            if !self.state[v as usize].is_candidate() {
                continue;
            }
            if bucket < LEAST_BUCKET {
                self.state[v as usize] = State::Kept;
            } else {
                self.decide(v);
            }
        }
    }

    /// Puts a candidate where its score belongs, or keeps it if it has no flip set left.
    fn enqueue(&mut self, v: u32) {
        let i = v as usize;
        if v >= self.end || !self.state[i].is_candidate() {
            return;
        }
        match self.star[i].best(&self.state) {
            Some((score, flips)) => {
                self.flips[i] = flips;
                let bucket = (score - THRESHOLD) * BUCKETS_PER_UNIT / UNIT + LEAST_BUCKET as i32;
                self.queue.put(v, bucket.clamp(0, BUCKETS as i32 - 1) as usize);
            }
            None => self.state[i] = State::Kept,
        }
    }

    /// Divides v off with its best flip set, or keeps it, or finds a flip impossible and puts
    /// it back. Edges are looked up here only: most candidates never come so far.
    ///
    /// The set is as good as possible: whenever a neighbour is divided off or blocked, v is scored again.
    fn decide(&mut self, v: u32) {
        let i = v as usize;
        let flips = self.flips[i];
        if let Some(spoke) = self.obstructed(v, flips) {
            self.star[i].ban(spoke);
            self.enqueue(v);
        } else if self.repeats_a_face(v, flips) {
            self.state[i] = State::Kept;
        } else {
            self.commit(v, flips);
        }
    }

    /// The spokes that a flip set flips first, each with its ring position and new edge; those
    /// shared with an odd neighbour are left out.
    fn new_edges(&self, v: u32, flips: Flips) -> impl Iterator<Item = (usize, u32, u32)> + 'a {
        let star = self.star[v as usize];
        let d = star.valence as usize;
        let mut fresh = flips;
        for i in (0..d).filter(|i| flips >> i & 1 == 1) {
            if self.state[star.ring[i] as usize] == State::Odd {
                fresh &= !(1 << i);
            }
        }
        let before = move |i: usize| if i == 0 { d - 1 } else { i - 1 };
        let after = move |i: usize| if i + 1 == d { 0 } else { i + 1 };
        (0..d)
            .filter(move |i| fresh >> i & 1 == 1)
            .map(move |i| (i, star.ring[before(i)], star.ring[after(i)]))
    }

    /// A spoke of the set whose flip would make an edge that exists or is planned.
    fn obstructed(&self, v: u32, flips: Flips) -> Option<usize> {
        self.new_edges(v, flips).find(|&(_, x, y)| self.edge_exists(x, y)).map(|(i, _, _)| i)
    }

    /// Orders the ends of an edge by valence, so that the first has a short ring.
    fn by_valence(&self, x: u32, y: u32) -> (u32, u32) {
        let key = |v: u32| (self.valence[v as usize], v);
        if key(x) <= key(y) { (x, y) } else { (y, x) }
    }

    fn edge_exists(&self, x: u32, y: u32) -> bool {
        let (near, far) = self.by_valence(x, y);
        if self.valence[near as usize] > LARGEST_WALK || self.planned.contains(near, far) {
            return true;
        }
        let star = &self.star[near as usize];
        match star.valence {
            0 => self.fine.fan(self.corner[near as usize]).any(|c| self.fine.at(next(c)) == far),
            _ => star.ring.contains(&far),
        }
    }

    /// Whether the coarse face of v would have the same corners as another face.
    ///
    /// New edges are unique, so this can only be a face across an edge that is old or shared.
    fn repeats_a_face(&self, v: u32, flips: Flips) -> bool {
        let star = &self.star[v as usize];
        let corners = corners_of(flips).map(|i| star.ring[i]);
        let same = |w: u32| {
            self.state[w as usize] == State::Odd
                && corners_of(self.flips[w as usize])
                    .iter()
                    .all(|&i| corners.contains(&self.star[w as usize].ring[i]))
        };
        if star.ring.iter().enumerate().any(|(i, &w)| flips >> i & 1 == 1 && same(w)) {
            return true;
        }
        let d = star.valence;
        // Edges across from v that its flips leave alone: none if d is 6.
        let old = |i: u8| (flips | flips << d) >> i & 3 == 0;
        let corner = self.corner[v as usize];
        d < 6
            && (0..d).zip(self.fine.fan(corner)).filter(|&(i, _)| old(i)).any(|(_, c)| {
                let apex = self.fine.at(self.fine.across(c));
                same(apex) || (d == 3 && corners.contains(&apex))
            })
    }

    fn commit(&mut self, v: u32, flips: Flips) {
        let i = v as usize;
        let star = self.star[i];
        for (_, x, y) in self.new_edges(v, flips) {
            let (near, far) = self.by_valence(x, y);
            self.planned.insert(near, far);
        }
        self.state[i] = State::Odd;
        self.commitments += 1;
        let mut settled = [NONE; 3];
        for (k, corner) in corners_of(flips).into_iter().enumerate() {
            let w = star.ring[corner];
            if self.state[w as usize].is_candidate() {
                self.state[w as usize] = State::Kept;
                settled[k] = w;
            }
        }
        for spoke in (0..star.valence as usize).filter(|i| flips >> i & 1 == 1) {
            self.rescore(star.ring[spoke]);
        }
        for w in settled.into_iter().filter(|&w| w != NONE) {
            let around = self.star[w as usize];
            for &u in &around.ring[..around.valence as usize] {
                self.rescore(u);
            }
        }
    }

    /// Moves a candidate whose surroundings changed, once a commitment.
    fn rescore(&mut self, v: u32) {
        let stamp = &mut self.stamp[v as usize];
        if *stamp != self.commitments {
            *stamp = self.commitments;
            self.enqueue(v);
        }
    }
}

/// The ring of the vertex at `corner` if its valence is 3 to 6, its members differ from each
/// other and from it, and at most one is virtual.
fn simple_ring(fine: &Surface, corner: u32, valence: u8) -> Option<[u32; MAX_VALENCE]> {
    let d = valence as usize;
    if !(3..=MAX_VALENCE).contains(&d) {
        return None;
    }
    let v = fine.at(corner);
    let mut ring = [NONE; MAX_VALENCE];
    let mut virtuals = 0;
    for (i, c) in fine.fan(corner).enumerate() {
        let w = fine.at(next(c));
        if w == v || ring[..i].contains(&w) {
            return None;
        }
        virtuals += fine.is_virtual(w) as u32;
        ring[i] = w;
    }
    (virtuals <= 1).then_some(ring)
}

/// The edges that flips will make, listed at one end each.
///
/// An edge is listed at its end of lower fine valence. Every flip that makes an edge at x
/// turns another edge facing x, so a list is never longer than that valence.
struct PlannedEdges {
    /// First entry of each vertex's list.
    head: Vec<u32>,
    /// The other end and the next entry.
    entry: Vec<(u32, u32)>,
}

impl PlannedEdges {
    fn new(vertices: usize) -> Self {
        Self { head: vec![NONE; vertices], entry: Vec::new() }
    }

    fn contains(&self, near: u32, far: u32) -> bool {
        let mut at = self.head[near as usize];
        while at != NONE {
            let (end, following) = self.entry[at as usize];
            if end == far {
                return true;
            }
            at = following;
        }
        false
    }

    fn insert(&mut self, near: u32, far: u32) {
        let head = &mut self.head[near as usize];
        self.entry.push((far, *head));
        *head = self.entry.len() as u32 - 1;
    }
}
