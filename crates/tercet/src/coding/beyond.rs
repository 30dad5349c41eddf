//! What lies beyond the ring of a vertex: the rings of its known neighbours.

use super::vector::{Point, Vector, add_to};
use crate::mesh::{Surface, next};
use crate::subdivide::FRACTION_BITS;

/// Corners of a fan that are looked at, as for the ring itself.
const MOST: usize = 32;

/// Neighbours of a higher valence are passed over.
const MOST_VALENCE: usize = 11;

/// Points and values that the rings of a vertex's known neighbours suggest.
#[derive(Default)]
pub(crate) struct Beyond {
    /// Vertices opposite to this one in the rings of neighbours of even valence, mirrored at those
    /// neighbours; in 1/256.
    pub reflections: Vec<Vector>,
    /// Known vertices across the edges of the ring.
    pub across: Vec<Point>,
    /// Sum of the neighbours' Laplacians, in 1/256: of each one's distance from the mean of its own ring.
    laplacian: Vector,
    laplacians: i64,
}

impl Beyond {
    /// Looks around the vertex at `corner`. Time O(1).
    pub fn gather(&mut self, surface: &Surface, corner: u32, known: &[bool], positions: &[Point]) {
        self.reflections.clear();
        self.across.clear();
        self.laplacian = [0; 3];
        self.laplacians = 0;
        for c in surface.fan(corner).take(MOST) {
            let across = surface.at(surface.across(c));
            if known[across as usize] {
                self.across.push(positions[across as usize]);
            }
            if known[surface.at(next(c)) as usize] {
                self.neighbour(surface, next(c), known, positions);
            }
        }
    }

    /// Looks at the ring of the neighbour at corner `c`, of which the vertex itself is the second member.
    fn neighbour(&mut self, surface: &Surface, c: u32, known: &[bool], positions: &[Point]) {
        let mut ring = [0; MOST_VALENCE + 1];
        let mut valence = 0;
        for (member, d) in ring.iter_mut().zip(surface.fan(c)) {
            *member = surface.at(next(d));
            valence += 1;
        }
        if valence > MOST_VALENCE {
            return;
        }
        let centre = positions[surface.at(c) as usize].map(|x| x as i64);
        let mut sum = [0; 3];
        let mut count = 0;
        for &x in ring[..valence].iter().filter(|&&x| known[x as usize]) {
            add_to(&mut sum, positions[x as usize].map(|x| x as i64));
            count += 1;
        }
        if count > 0 && count + 1 >= valence {
            let mean = sum.map(|x| (x << FRACTION_BITS) / count as i64);
            add_to(&mut self.laplacian, [0, 1, 2].map(|k| (centre[k] << FRACTION_BITS) - mean[k]));
            self.laplacians += 1;
        }
        let opposite = ring[(valence / 2 + 1) % valence.max(1)] as usize;
        if valence % 2 == 0 && known[opposite] {
            let far = positions[opposite];
            self.reflections.push([0, 1, 2].map(|k| (2 * centre[k] - far[k] as i64) << FRACTION_BITS));
        }
    }

    /// The reflection nearest to a point, and their mean.
    pub fn reflected(&self, to: Vector) -> Option<[Vector; 2]> {
        let distance = |p: &&Vector| (0..3).map(|k| (p[k] - to[k]).abs()).sum::<i64>();
        let nearest = *self.reflections.iter().min_by_key(distance)?;
        let mut sum = [0; 3];
        self.reflections.iter().for_each(|&r| add_to(&mut sum, r));
        Some([nearest, sum.map(|x| x / self.reflections.len() as i64)])
    }

    /// The mean of the neighbours' Laplacians: of those whose rings lack this vertex at most.
    pub fn laplacian(&self) -> Option<Vector> {
        (self.laplacians > 0).then(|| self.laplacian.map(|x| x / self.laplacians))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::cut;
    use crate::shapes::torus;

    #[test]
    fn reflections_and_laplacians_need_known_rings() {
        let surface = cut(&torus(12, 12)).surface;
        let at = |v: u32| (v as i32 / 12, v as i32 % 12);
        let positions: Vec<Point> = (0..144).map(|v| [100 * at(v).0, 100 * at(v).1, 0]).collect();
        let v = 6 * 12 + 6;
        let mut known = vec![true; 144];
        known[v] = false;
        let corner = surface.any_corner_from(v as u32)[0];
        let mut beyond = Beyond::default();
        beyond.gather(&surface, corner, &known, &positions);
        let expected = positions[v].map(|x| (x as i64) << FRACTION_BITS);
        assert_eq!(beyond.reflected(expected), Some([expected; 2]));
        assert_eq!(beyond.across.len(), 6);
        assert!(beyond.laplacian().is_some());
        known.fill(false);
        beyond.gather(&surface, corner, &known, &positions);
        assert!(beyond.reflected(expected).is_none() && beyond.laplacian().is_none());
    }
}
