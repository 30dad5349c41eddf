//! The order in which a pass visits vertices.
//!
//! Where details are normal ones, on √3 levels, it is that of their numbers. Elsewhere the vertex
//! about which most is known comes next: it is *supported* by its known neighbours, more by two of
//! them in one face, and most by a parallelogram, three known vertices that predict it. Support
//! never shrinks, so that a queue with a bucket for each degree of support finds the best supported
//! vertex in constant time (Dial, "Algorithm 360: Shortest-path forest with topological ordering",
//! 1969).

use super::star::{Members, Star, places};
use crate::mesh::Surface;
use std::iter::once;
use std::ops::Range;
use std::sync::Arc;

/// What a known neighbour, two of them in one face, and a parallelogram are worth.
const NEIGHBOUR: u8 = 1;
const PAIR: u8 = 2;
const PARALLELOGRAM: u8 = 8;

/// Degrees of support; any above the highest counts as that.
const DEGREES: u32 = u128::BITS;
const HIGHEST: u8 = DEGREES as u8 - 1;

/// How well each vertex of a pass is supported before it: what the visits of all its shares begin with.
#[derive(Clone)]
pub(crate) struct Support {
    known: Vec<bool>,
    first: u32,
    corner: Arc<Vec<u32>>,
    /// For each vertex from `first` on.
    degree: Vec<u8>,
}

impl Support {
    /// Of the vertices from `first` on by the real ones before, which are known. Time O(n).
    pub fn new(surface: &Surface, first: u32) -> Self {
        let Traversal { known, corner, .. } = Traversal::by_number(surface, first);
        let count = surface.vertices - first;
        // Those that are known share one more entry: a processor could not guess which are.
        let mut degree = vec![0u8; count as usize + 1];
        let is_known = |v: u32| (surface.virtuals..first).contains(&v) as u8;
        let faces = surface.vertex.as_chunks::<3>().0.iter().zip(surface.opposite.as_chunks::<3>().0);
        for (t, o) in faces {
            let known = t.map(is_known);
            for k in 0..3 {
                let knows_a = known[(k + 1) % 3];
                let pair = knows_a & known[(k + 2) % 3];
                let parallelogram = pair & is_known(surface.at(o[k]));
                // The face after this one adds what the other of its neighbours is worth.
                let by = NEIGHBOUR * knows_a + PAIR * pair + PARALLELOGRAM * parallelogram;
                let degree = &mut degree[t[k].wrapping_sub(first).min(count) as usize];
                *degree = degree.saturating_add(by);
            }
        }
        degree.truncate(count as usize);
        degree.iter_mut().for_each(|degree| *degree = HIGHEST.min(*degree));
        Support { known, first, corner, degree }
    }

    /// Visits the best supported vertex first, of several the one that became so last. Time O(n).
    pub fn visit_all(self) -> Traversal {
        self.visit(|_| true)
    }

    /// The same for those of the vertices whose corners of the smallest numbers are among these.
    pub fn visit_share(self, corners: Range<u32>) -> Traversal {
        self.visit(|corner| corners.contains(&corner))
    }

    /// The corners at which so many `shares` begin, and where the last one ends: of the vertices, in the order of their
    /// corners of the smallest numbers, each has as many. There are more vertices than shares. Time O(n).
    pub fn bounds(&self, surface: &Surface, shares: u32) -> Vec<u32> {
        let is_smallest =
            |c: &u32| surface.at(*c).checked_sub(self.first).is_some_and(|i| self.corner[i as usize] == *c);
        let mut in_order = (0u64..).zip((0..surface.vertex.len() as u32).filter(is_smallest));
        let begins = (0..shares as u64).map(|share| {
            let start = self.corner.len() as u64 * share / shares as u64;
            in_order.find(|&(rank, _)| rank >= start).map_or(u32::MAX, |(_, corner)| corner)
        });
        begins.chain(once(u32::MAX)).collect()
    }

    fn visit(self, mine: impl Fn(u32) -> bool) -> Traversal {
        let Support { known, first, corner, degree } = self;
        let queue = Some(Queue::new(degree, |i| mine(corner[i as usize])));
        Traversal { known, first, corner, visited: 0, queue }
    }
}

/// Which vertices of a pass are known, and which one comes next.
pub(crate) struct Traversal {
    /// Real vertices whose positions are known.
    known: Vec<bool>,
    /// The pass's first vertex.
    first: u32,
    /// For each vertex from `first` on its corner of the smallest number.
    corner: Arc<Vec<u32>>,
    /// Vertices visited so far: in the order of numbers the next one, counted from `first`.
    visited: u32,
    /// The vertices still to be visited, if they are visited by their support.
    queue: Option<Queue>,
}

impl Traversal {
    /// Visits the vertices from `first` on in the order of their numbers; the real ones before are
    /// known. Time O(n).
    pub fn by_number(surface: &Surface, first: u32) -> Self {
        let mut known = vec![false; surface.vertices as usize];
        known[surface.virtuals as usize..first as usize].fill(true);
        let corner = Arc::new(surface.any_corner_from(first));
        Traversal { known, first, corner, visited: 0, queue: None }
    }

    /// For each vertex whether its position is known.
    pub fn known(&self) -> &[bool] {
        &self.known
    }

    /// How many vertices have been visited.
    pub fn visited(&self) -> usize {
        self.visited as usize
    }

    /// The vertex to be visited and a corner of it, if one is left.
    pub fn next(&self) -> Option<(u32, u32)> {
        let i = match &self.queue {
            Some(queue) => queue.best()?,
            None => self.visited,
        };
        self.corner.get(i as usize).map(|&corner| (self.first + i, corner))
    }

    /// Notes that `v`, which was next, is known; `star` is what was around it before. Time O(1).
    pub fn reach(&mut self, v: u32, star: &Star) {
        self.known[v as usize] = true;
        self.visited += 1;
        let Some(queue) = &mut self.queue else { return };
        queue.remove(v - self.first);
        // Of a member that is still to be visited both faces at the vertex are worth what their other members are,
        // which have the ones after them for wings.
        let (after, before) = (star.after(1), star.before(1));
        let (wing_after, wing_before) = (after & star.after(2), before & star.before(2));
        let wings = star.unknown_wings();
        for i in places(star.unknown() | wings) {
            let bit = |some: Members| (some >> i & 1) as u8;
            let (raised, by) = match bit(wings) {
                0 => {
                    let pairs = PAIR * (bit(after) + bit(before));
                    let parallelograms = PARALLELOGRAM * (bit(wing_after) + bit(wing_before));
                    (star.members()[i], NEIGHBOUR + pairs + parallelograms)
                }
                _ => (star.wing(i), PARALLELOGRAM),
            };
            // Virtual vertices are never visited; and where faces lie back to back the vertex is around itself.
            if let Some(i) = raised.checked_sub(self.first).filter(|_| !self.known[raised as usize]) {
                queue.raise(i, by);
            }
        }
    }
}

/// Items by their degree, those of one degree in the order in which they reached it.
struct Queue {
    degree: Vec<u8>,
    /// Each degree's items as a doubly linked ring, which is closed by the entry behind the items
    /// that stands for the degree.
    after: Vec<u32>,
    before: Vec<u32>,
    /// Bit by bit, the degrees that have items.
    occupied: u128,
}

impl Queue {
    /// Items by their degrees, as far as they are `mine`.
    fn new(degree: Vec<u8>, mine: impl Fn(u32) -> bool) -> Self {
        let count = degree.len() as u32;
        // Entries of items that are not mine are never asked for, so that their memory need not be there.
        let [mut after, mut before] = [(); 2].map(|()| vec![0; (count + DEGREES) as usize]);
        for head in count..count + DEGREES {
            (after[head as usize], before[head as usize]) = (head, head);
        }
        let mut queue = Queue { degree, after, before, occupied: 0 };
        for i in 0..count {
            match mine(i) {
                true => queue.append(i),
                // Never raised, so never in a ring.
                false => queue.degree[i as usize] = HIGHEST,
            }
        }
        queue
    }

    /// The last item of the highest degree: what lies near it has just been looked at.
    fn best(&self) -> Option<u32> {
        let degree = self.occupied.checked_ilog2()?;
        Some(self.before[self.degree.len() + degree as usize])
    }

    fn raise(&mut self, i: u32, by: u8) {
        let degree = self.degree[i as usize];
        let raised = (degree + by).min(HIGHEST);
        if raised > degree {
            self.remove(i);
            self.degree[i as usize] = raised;
            self.append(i);
        }
    }

    /// Puts an item that is in no ring at the end of that of its degree.
    fn append(&mut self, i: u32) {
        let degree = self.degree[i as usize];
        let head = self.degree.len() as u32 + degree as u32;
        let last = self.before[head as usize];
        self.before[i as usize] = last;
        self.after[i as usize] = head;
        self.after[last as usize] = i;
        self.before[head as usize] = i;
        self.occupied |= 1 << degree;
    }

    fn remove(&mut self, i: u32) {
        let (before, after) = (self.before[i as usize], self.after[i as usize]);
        self.after[before as usize] = after;
        self.before[after as usize] = before;
        // Only the entry of the degree is left, next to itself.
        if before == after && after as usize >= self.degree.len() {
            self.occupied &= !(1 << self.degree[i as usize]);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Mesh;
    use crate::mesh::{cut, next, prev};
    use crate::shapes::{grid, shuffled, sphere, torus};

    /// All vertices in the order of their visits.
    fn visits(surface: &Surface, mut traversal: Traversal) -> Vec<u32> {
        let mut order = Vec::new();
        let mut star = Star::default();
        while let Some((v, corner)) = traversal.next() {
            assert_eq!(surface.at(corner), v);
            assert!(!traversal.known()[v as usize]);
            order.push(v);
            star.gather(surface, corner, traversal.known());
            traversal.reach(v, &star);
        }
        order
    }

    /// The support of `v`, counted afresh.
    fn support(surface: &Surface, corner: u32, known: &[bool]) -> u32 {
        let is = |c: u32| known[surface.at(c) as usize];
        let of_face = |c: u32| {
            let pair = is(next(c)) && is(prev(c));
            let parallelogram = pair && is(surface.across(c));
            is(next(c)) as u32 * NEIGHBOUR as u32
                + pair as u32 * PAIR as u32
                + parallelogram as u32 * PARALLELOGRAM as u32
        };
        surface.fan(corner).map(of_face).sum::<u32>().min(DEGREES - 1)
    }

    #[test]
    fn every_vertex_is_visited_once_and_none_is_better_supported() {
        for mesh in [grid(9, 7), torus(8, 9), sphere(2)] {
            let surface = cut(&mesh).surface;
            for first in [surface.virtuals, surface.virtuals + 20] {
                let corners = surface.any_corner();
                let mut traversal = Support::new(&surface, first).visit_all();
                let (mut seen, mut star) = (0, Star::default());
                while let Some((v, corner)) = traversal.next() {
                    let of = |v: u32| support(&surface, corners[v as usize], traversal.known());
                    let best = (first..surface.vertices).filter(|&v| !traversal.known()[v as usize]).map(of);
                    assert_eq!(Some(of(v)), best.max());
                    star.gather(&surface, corner, traversal.known());
                    traversal.reach(v, &star);
                    seen += 1;
                    assert_eq!(traversal.visited(), seen as usize);
                }
                assert_eq!(seen, surface.vertices - first);
            }
        }
    }

    /// A globe of so many meridians, with three rows of vertices between its poles.
    fn globe(meridians: u32) -> Mesh {
        let vertices = 3 * meridians + 2;
        let at = |row: u32, i: u32| row * meridians + i % meridians;
        let mut mesh = Mesh { positions: vec![[0.0; 3]; vertices as usize], faces: Vec::new() };
        for i in 0..meridians {
            mesh.faces.push([vertices - 2, at(0, i), at(0, i + 1)]);
            mesh.faces.push([vertices - 1, at(2, i + 1), at(2, i)]);
            for row in 0..2 {
                let quad = [at(row, i), at(row + 1, i), at(row + 1, i + 1), at(row, i + 1)];
                mesh.faces.extend([[quad[0], quad[1], quad[2]], [quad[0], quad[2], quad[3]]]);
            }
        }
        mesh
    }

    #[test]
    fn around_hubs_and_back_to_back_every_vertex_is_visited_once() {
        let two_sided =
            |faces: &[[u32; 3]]| faces.iter().flat_map(|&[a, b, c]| [[a, b, c], [a, c, b]]).collect();
        let triangle = Mesh { positions: vec![[0.0; 3]; 3], faces: two_sided(&[[0, 1, 2]]) };
        let sheet = Mesh { faces: two_sided(&grid(6, 5).faces), ..grid(6, 5) };
        let mut fin = grid(6, 5);
        fin.faces.extend([[7, 8, 9], [9, 8, 7]]);
        let globes = (31..36).flat_map(|n| (0..40).map(move |seed| shuffled(&globe(n), seed)));
        for mesh in [triangle, sheet, fin].into_iter().chain(globes) {
            let surface = cut(&mesh).surface;
            for known in [0, 1, 5, 11, 20, 40] {
                let first = (surface.virtuals + known).min(surface.vertices);
                let mut order = visits(&surface, Support::new(&surface, first).visit_all());
                order.sort_unstable();
                assert!(order.into_iter().eq(first..surface.vertices));
            }
        }
    }

    #[test]
    fn by_number_the_order_is_that_of_numbers() {
        let surface = cut(&grid(5, 4)).surface;
        let first = surface.virtuals + 3;
        let order = visits(&surface, Traversal::by_number(&surface, first));
        assert!(order.into_iter().eq(first..surface.vertices));
    }

    #[test]
    fn shares_are_equal_parts_of_the_whole() {
        let surface = cut(&grid(9, 7)).surface;
        let first = surface.virtuals + 20;
        let support = Support::new(&surface, first);
        let mut all: Vec<u32> = Vec::new();
        for bounds in support.bounds(&surface, 3).windows(2) {
            let part = visits(&surface, support.clone().visit_share(bounds[0]..bounds[1]));
            assert!(part.len().abs_diff((surface.vertices - first) as usize / 3) < 2);
            all.extend(part);
        }
        all.sort_unstable();
        assert!(all.into_iter().eq(first..surface.vertices));
    }

    #[test]
    fn a_hub_takes_linear_time() {
        // A fan of triangles around one vertex: a step that walked the hub's ring would make it quadratic.
        let count = 200_000u32;
        let mut mesh = Mesh { positions: vec![[0.0; 3]; count as usize + 1], faces: Vec::new() };
        mesh.faces.extend((1..count).map(|v| [0, v, v + 1]));
        let surface = cut(&mesh).surface;
        let order = visits(&surface, Support::new(&surface, surface.virtuals).visit_all());
        assert_eq!(order.len(), count as usize + 1);
    }
}
