//! Who is around a vertex, and which of them are known: gathered once for what is expected of the vertex and for
//! what its visit tells of others.

use crate::mesh::{NONE, Surface, next};

/// Rings are looked at this far: a hub's further neighbours add nothing but time.
pub(crate) const MOST: usize = 32;

/// Some members of a ring, a bit each.
pub(crate) type Members = u32;

/// The ring of a vertex and what lies behind it.
pub(crate) struct Star {
    members: [u32; MOST],
    /// Of each face at the vertex, by its first member, the vertex across from it.
    wings: [u32; MOST],
    count: usize,
    known: Members,
    known_wings: Members,
    /// Those that have a face with the one after them: all, or all but the last if the ring goes on.
    faces: Members,
}

impl Default for Star {
    fn default() -> Self {
        Star { members: [NONE; MOST], wings: [NONE; MOST], count: 0, known: 0, known_wings: 0, faces: 0 }
    }
}

impl Star {
    /// Gathers what is around the vertex at `corner`; `known` has an entry a vertex.
    #[inline(always)]
    pub fn gather(&mut self, surface: &Surface, corner: u32, known: &[bool]) {
        let (mut c, mut count) = (corner, 0);
        (self.known, self.known_wings, self.faces) = (0, 0, Members::MAX);
        loop {
            let (member, wing) = (surface.at(next(c)), surface.at(surface.across(c)));
            (self.members[count], self.wings[count]) = (member, wing);
            self.known |= (known[member as usize] as Members) << count;
            self.known_wings |= (known[wing as usize] as Members) << count;
            count += 1;
            c = surface.swing(c);
            if c == corner {
                break;
            }
            if count == MOST {
                self.faces = Members::MAX >> 1;
                break;
            }
        }
        self.count = count;
    }

    /// The members, counter-clockwise.
    pub fn members(&self) -> &[u32] {
        &self.members[..self.count]
    }

    /// Across from the face of a member and the one after it.
    pub fn wing(&self, i: usize) -> u32 {
        self.wings[i & (MOST - 1)]
    }

    pub fn known(&self) -> Members {
        self.known
    }

    pub fn unknown(&self) -> Members {
        !self.known & self.all()
    }

    /// Members whose faces, with the ones after them, are known but for the vertex, and the wings across too.
    pub fn parallelograms(&self) -> Members {
        self.pairs() & self.known_wings
    }

    /// The same where the wings are not known.
    pub fn unknown_wings(&self) -> Members {
        self.pairs() & !self.known_wings
    }

    fn pairs(&self) -> Members {
        self.known & self.after(1) & self.faces
    }

    fn all(&self) -> Members {
        Members::MAX >> (MOST - self.count)
    }

    /// Members of which the one so many places, at most all, later is known.
    #[inline(always)]
    pub fn after(&self, places: usize) -> Members {
        let twice = self.known as u64 | (self.known as u64) << self.count;
        (twice >> places) as Members & self.all()
    }

    /// Members of which the one so many places before is known.
    #[inline(always)]
    pub fn before(&self, places: usize) -> Members {
        self.after(self.count.saturating_sub(places))
    }
}

/// The places of the members that are among `some`.
#[inline(always)]
pub(crate) fn places(mut some: Members) -> impl Iterator<Item = usize> {
    std::iter::from_fn(move || {
        let place = some.trailing_zeros() as usize;
        let any = some != 0;
        some &= some.wrapping_sub(1);
        any.then_some(place)
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::{cut, prev};
    use crate::shapes::{sphere, torus};

    #[test]
    fn members_wings_and_those_around_them_are_those_of_the_fan() {
        for mesh in [torus(8, 9), sphere(1)] {
            let surface = cut(&mesh).surface;
            let known: Vec<bool> = (0..surface.vertices).map(|v| v % 3 != 1).collect();
            let is = |c: u32| known[surface.at(c) as usize];
            let mut star = Star::default();
            for corner in surface.any_corner() {
                star.gather(&surface, corner, &known);
                let fan: Vec<u32> = surface.fan(corner).collect();
                let n = fan.len();
                let by = |f: &dyn Fn(usize) -> bool| (0..n).filter(|&i| f(i)).collect::<Vec<_>>();
                assert_eq!(star.members(), fan.iter().map(|&c| surface.at(next(c))).collect::<Vec<_>>());
                let after = |places: usize| by(&|i| is(next(fan[(i + places) % n])));
                assert!(places(star.known()).eq(after(0)) && places(star.after(2)).eq(after(2)));
                assert!(places(star.before(2)).eq(after(n - 2)) && places(star.before(1)).eq(after(n - 1)));
                let both = |i: usize| is(next(fan[i])) && is(prev(fan[i]));
                assert!(places(star.parallelograms()).eq(by(&|i| both(i) && is(surface.across(fan[i])))));
                assert!(places(star.unknown_wings()).eq(by(&|i| both(i) && !is(surface.across(fan[i])))));
            }
        }
    }

    #[test]
    fn of_a_hub_the_first_neighbours_count() {
        let count = 100u32;
        let mut mesh = crate::Mesh { positions: vec![[0.0; 3]; count as usize + 1], faces: Vec::new() };
        mesh.faces.extend((1..count).map(|v| [0, v, v + 1]));
        let surface = cut(&mesh).surface;
        let corner = surface.any_corner()[surface.virtuals as usize];
        let mut star = Star::default();
        star.gather(&surface, corner, &vec![true; surface.vertices as usize]);
        assert_eq!((star.members().len(), star.known()), (MOST, Members::MAX));
        assert_eq!((star.parallelograms(), star.unknown_wings()), (Members::MAX >> 1, 0));
        let ring = star.members().to_vec();
        let of_ring: Vec<bool> = (0..surface.vertices).map(|v| ring.contains(&v)).collect();
        star.gather(&surface, corner, &of_ring);
        assert_eq!((star.parallelograms(), star.unknown_wings()), (0, Members::MAX >> 1));
    }
}
