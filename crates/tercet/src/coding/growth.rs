//! Growth: which vertices of a regular level make a group, and in which order they are coded.
//!
//! A vertex is coded by how far its wings were off, and a group knows nothing of the wings beyond its border. So a
//! group should be round: it grows from where groups before it have left off, nearest first. Numbers do not tell what
//! is near: in a √3 level the wings of a vertex are often all of them groups away.

use super::site::Site;
use std::collections::VecDeque;

/// The vertices of a pass in groups, as far as those have grown. Vertices are counted from the first of the pass.
pub(super) struct Growth {
    /// The number of the first vertex of the pass.
    first: u32,
    pub sites: Vec<Site>,
    /// Vertices in the order of coding: of closed groups, and of the one that grows.
    pub order: Vec<u32>,
    /// Of each vertex, where in that order it stands; [`NOWHERE`] if it does not.
    place: Vec<u32>,
    /// Of each vertex, whether no group has taken it: neither a closed one nor the one that grows.
    free: Vec<bool>,
    /// Places of closed groups.
    closed: usize,
    /// Vertices beside the group that grows; some belong to it by now.
    front: VecDeque<u32>,
    /// Vertices beside closed groups, those of the first ones first; some belong to others by now.
    seeds: VecDeque<u32>,
    /// How many of the seeds the group that grows has gone through.
    tried: usize,
    /// The next vertex to try when there are no seeds.
    next: u32,
    /// The one when the group began.
    next_before: u32,
}

/// The place of a vertex that has none.
const NOWHERE: u32 = u32::MAX;

impl Growth {
    /// No group, of the vertices at `sites`, whose numbers begin with `first`.
    pub fn new(first: u32, sites: Vec<Site>) -> Self {
        Growth {
            first,
            order: Vec::with_capacity(sites.len()),
            place: vec![NOWHERE; sites.len()],
            free: vec![true; sites.len()],
            sites,
            closed: 0,
            front: VecDeque::new(),
            seeds: VecDeque::new(),
            tried: 0,
            next: 0,
            next_before: 0,
        }
    }

    /// Begins anew.
    pub fn restart(&mut self) {
        *self = Growth::new(self.first, std::mem::take(&mut self.sites));
    }

    /// Whether the vertex of that number is coded before the place `own` in the group that begins at `start`.
    #[inline(always)]
    pub fn is_between(&self, number: u32, start: usize, own: usize) -> bool {
        let place = self.place.get(number.wrapping_sub(self.first) as usize);
        place.is_some_and(|&place| (start..own).contains(&(place as usize)))
    }

    /// Adds a vertex to the group that grows, if one is left.
    pub fn grow(&mut self) -> bool {
        let Some(v) = self.nearest() else { return false };
        self.free[v as usize] = false;
        for wing in self.sites[v as usize].wings {
            let wing = wing.wrapping_sub(self.first);
            if self.is_free(wing) {
                self.front.push_back(wing);
            }
        }
        self.place[v as usize] = self.order.len() as u32;
        self.order.push(v);
        true
    }

    /// Ends the group before the place `end`: what had grown from there on is free again.
    pub fn close(&mut self, end: usize) {
        for v in self.order.drain(end..) {
            self.free[v as usize] = true;
            self.place[v as usize] = NOWHERE;
        }
        self.front.clear();
        for &v in &self.order[self.closed..] {
            for wing in self.sites[v as usize].wings {
                let wing = wing.wrapping_sub(self.first);
                if self.is_free(wing) {
                    self.seeds.push_back(wing);
                }
            }
        }
        self.closed = end;
        // The next group begins where this one would have if only what it keeps had ever grown.
        while self.seeds.front().is_some_and(|&seed| !self.is_free(seed)) {
            self.seeds.pop_front();
        }
        self.tried = 0;
        self.next = self.next_before;
        while self.next < self.free.len() as u32 && !self.is_free(self.next) {
            self.next += 1;
        }
        self.next_before = self.next;
    }

    /// The vertex that has been beside the group for longest; or else beside a group before; or else any.
    fn nearest(&mut self) -> Option<u32> {
        while let Some(v) = self.front.pop_front() {
            if self.is_free(v) {
                return Some(v);
            }
        }
        while let Some(&v) = self.seeds.get(self.tried) {
            self.tried += 1;
            if self.is_free(v) {
                return Some(v);
            }
        }
        while self.next < self.free.len() as u32 {
            self.next += 1;
            if self.is_free(self.next - 1) {
                return Some(self.next - 1);
            }
        }
        None
    }

    fn is_free(&self, v: u32) -> bool {
        self.free.get(v as usize) == Some(&true)
    }
}

#[cfg(test)]
mod tests {
    use super::super::site::{in_faces, in_rings};
    use super::*;
    use crate::mesh::cut;
    use crate::shapes::{Random, grid, torus};
    use crate::subdivide::{StepKind, refine_regular};

    /// Of the vertices that a √3 step adds.
    fn in_a_torus() -> Growth {
        let coarse = cut(&torus(30, 20)).surface;
        let refined = refine_regular(&coarse, StepKind::Sqrt3Even).unwrap();
        Growth::new(coarse.vertices, in_faces(&coarse, &refined.first, &refined.surface))
    }

    /// Of all vertices of a surface with a boundary, whose wings do not always have one another as wings.
    fn in_a_grid() -> Growth {
        let surface = cut(&grid(20, 15)).surface;
        Growth::new(surface.virtuals, in_rings(&surface, surface.virtuals))
    }

    #[test]
    fn every_vertex_belongs_to_one_group_whatever_had_grown_beyond_others() {
        let mut random = Random::new(4);
        for shape in [in_a_torus, in_a_grid] {
            let (mut growth, mut tried) = (shape(), shape());
            let all = growth.sites.len();
            let mut end = 0;
            while end < all {
                end = all.min(end + 1 + random.below(150));
                while growth.order.len() < end {
                    assert!(growth.grow());
                }
                while tried.order.len() < end + random.below(200) && tried.grow() {}
                growth.close(end);
                tried.close(end);
                assert_eq!(growth.order, tried.order);
            }
            assert!(!growth.grow());
            assert!(growth.order.iter().zip(0..).all(|(&v, place)| growth.place[v as usize] == place));
            growth.order.sort_unstable();
            assert!(growth.order.iter().copied().eq(0..all as u32));
        }
    }

    #[test]
    fn groups_are_round() {
        let mut growth = in_a_torus();
        (0..216).for_each(|_| assert!(growth.grow()));
        // A hexagon of 6 · 6² triangles has 36 edges at its border, and 306 others.
        let told = |place: usize| {
            let wings = growth.sites[growth.order[place] as usize].wings;
            wings.iter().filter(|&&wing| growth.is_between(wing, 0, place)).count()
        };
        let known: usize = (0..216).map(told).sum();
        assert!((290..=306).contains(&known), "{known}");
    }
}
