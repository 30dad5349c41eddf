//! Making the base's triangles well shaped: valence flips and tangential relaxation.
//!
//! The fewer and milder its extraordinary vertices and the more even its triangles, the smoother is
//! what subdivision predicts, and the smaller the details. Neither may leave the surface: a flip
//! is refused where its edge would, a move where the vertex's quadric says so.

use glam::DVec3;

use super::base::ON_CREASE;
use super::decimate::{Base, EVENNESS, shape};
use super::original::Original;
use crate::mesh::{Surface, next, prev};
use crate::subdivide::flip_edge;

/// Rounds of flips and moves.
const ROUNDS: usize = 5;
/// Passes of flips in a round, at most.
const FLIP_PASSES: usize = 6;
/// Steps of relaxation in a round, and how far each goes towards the mean of the neighbours.
const RELAX_STEPS: usize = 2;
const RELAX_SHARE: f64 = 0.4;
/// A new edge may be this much farther from the original than the old one, or …
const FARTHER: f64 = 1.25;
/// … this far, in lengths of the old edge.
const NEAR: f64 = 0.03;
/// Cosine by which a flip or a move may turn a face at most.
const LEAST_TURN: f64 = 0.5;

/// Flips edges and moves vertices of a base, whose vertices lie at `positions`.
pub(super) fn fair(base: &mut Base, positions: &mut [DVec3], original: &Original) {
    for round in 0..=ROUNDS {
        let mut flips = Flips::new(&mut base.surface, positions, original);
        for _ in 0..FLIP_PASSES {
            if flips.pass() == 0 {
                break;
            }
        }
        if round < ROUNDS {
            for _ in 0..RELAX_STEPS {
                relax(base, positions, original);
            }
        }
    }
}

struct Flips<'a> {
    surface: &'a mut Surface,
    positions: &'a [DVec3],
    original: &'a Original,
    valence: Vec<i32>,
    /// What a vertex's valence should be; a virtual vertex does not mind.
    wanted: Vec<i32>,
}

/// The valence of a vertex inside, and of one on a boundary with its two virtual faces.
const INNER_VALENCE: i32 = 6;
const RIM_VALENCE: i32 = 5;

impl<'a> Flips<'a> {
    fn new(surface: &'a mut Surface, positions: &'a [DVec3], original: &'a Original) -> Self {
        let valence = surface.valences().into_iter().map(|n| n as i32).collect();
        let mut wanted = vec![INNER_VALENCE; surface.vertices as usize];
        for f in (0..surface.faces()).filter(|&f| surface.is_virtual_face(f)) {
            surface.face(f).into_iter().for_each(|v| wanted[v as usize] = RIM_VALENCE);
        }
        Flips { surface, positions, original, valence, wanted }
    }

    /// Looks at every edge once, flips those that should be, and returns how many.
    fn pass(&mut self) -> usize {
        let mut count = 0;
        for c in 0..self.surface.vertex.len() as u32 {
            if c < self.surface.across(c) && self.should_flip(c) {
                let o = self.surface.across(c);
                for (v, change) in self.diamond(c).into_iter().zip([1, 1, -1, -1]) {
                    self.valence[v as usize] += change;
                }
                flip_edge(self.surface, c, o);
                count += 1;
            }
        }
        count
    }

    /// The two tips across the edge opposite to `c`, then its ends.
    fn diamond(&self, c: u32) -> [u32; 4] {
        let s = &self.surface;
        [s.at(c), s.at(s.across(c)), s.at(next(c)), s.at(prev(c))]
    }

    /// ```text
    ///        p                 p
    ///      /   \             / | \
    ///     a --- b     →     a  |  b
    ///      \   /             \ | /
    ///        q                 q
    /// ```
    fn should_flip(&self, c: u32) -> bool {
        let [p, q, a, b] = self.diamond(c);
        if [p, q, a, b].into_iter().any(|v| self.surface.is_virtual(v))
            || p == q
            || self.valence[a as usize] <= 3
            || self.valence[b as usize] <= 3
            || self.surface.fan(c).any(|d| self.surface.at(next(d)) == q)
        {
            return false;
        }
        let off = |change: [i32; 4]| -> i32 {
            let each = [p, q, a, b].into_iter().zip(change);
            each.map(|(v, d)| (self.valence[v as usize] + d - self.wanted[v as usize]).pow(2)).sum()
        };
        let gain = off([0; 4]) - off([1, 1, -1, -1]);
        let [p, q, a, b] = [p, q, a, b].map(|v| self.positions[v as usize]);
        let old = shape(p, a, b).min(shape(q, b, a));
        let new = shape(p, a, q).min(shape(q, b, p));
        let better = (gain >= 2 && (new > 0.7 * old || new > 0.5))
            || (gain >= 0 && new > 1.3 * old)
            || (gain >= -2 && old < 0.3 && new > 1.5 * old);
        better && self.stays_on_surface([p, q, a, b])
    }

    fn stays_on_surface(&self, [p, q, a, b]: [DVec3; 4]) -> bool {
        let normal = |x: DVec3, y: DVec3, z: DVec3| (y - x).cross(z - x).normalize_or_zero();
        let before = [normal(p, a, b), normal(q, b, a)];
        let after = [normal(p, a, q), normal(q, b, p)];
        let mean = (before[0] + before[1]).normalize_or_zero();
        if after.into_iter().any(|n| n.dot(mean) < LEAST_TURN) {
            return false;
        }
        let distance =
            |x: DVec3, y: DVec3| self.original.nearest((x + y) / 2.0).map_or(0.0, |(c, _)| c.distance);
        distance(p, q) <= (FARTHER * distance(a, b)).max(NEAR * a.distance(b))
    }
}

/// Moves each vertex inside, but those on creases, towards the mean of its neighbours, along the surface.
fn relax(base: &Base, positions: &mut [DVec3], original: &Original) {
    let surface = &base.surface;
    for (v, c) in (0..).zip(surface.any_corner()).filter(|&(v, _)| !surface.is_virtual(v)) {
        let ring: Vec<u32> = surface.fan(c).map(|d| surface.at(next(d))).collect();
        if ring.iter().any(|&w| surface.is_virtual(w)) {
            continue;
        }
        let here = positions[v as usize];
        let mean = ring.iter().map(|&w| positions[w as usize]).sum::<DVec3>() / ring.len() as f64;
        let edge =
            ring.iter().map(|&w| positions[w as usize].distance(here)).sum::<f64>() / ring.len() as f64;
        if original.nearest_on_crease(here).is_some_and(|(_, distance)| distance <= ON_CREASE * edge) {
            continue;
        }
        let normal = ring_normal(&ring, here, positions);
        let step = mean - here;
        let target = here + RELAX_SHARE * (step - normal * step.dot(normal));
        let Some(contact) = original.nearest_facing(target, normal, edge) else { continue };
        let quadric = &base.quadrics[v as usize];
        let allowed = quadric.at(here).max(0.0) * 1.1 + EVENNESS * quadric.weight * edge * edge;
        if quadric.at(contact.at) <= allowed && improves(&ring, here, contact.at, positions) {
            positions[v as usize] = contact.at;
        }
    }
}

/// The unit normal of the faces between a vertex and its ring, weighted by area.
fn ring_normal(ring: &[u32], at: DVec3, positions: &[DVec3]) -> DVec3 {
    sides(ring, positions).map(|(a, b)| (a - at).cross(b - at)).sum::<DVec3>().normalize_or_zero()
}

/// The edges of a ring.
fn sides<'a>(ring: &'a [u32], positions: &'a [DVec3]) -> impl Iterator<Item = (DVec3, DVec3)> + 'a {
    let place = |v: u32| positions[v as usize];
    ring.iter().zip(ring.iter().cycle().skip(1)).map(move |(&a, &b)| (place(a), place(b)))
}

/// Whether moving a vertex from `from` to `to` turns no face far, nor makes the worst one worse.
fn improves(ring: &[u32], from: DVec3, to: DVec3, positions: &[DVec3]) -> bool {
    let (mut before, mut after) = (f64::INFINITY, f64::INFINITY);
    for (a, b) in sides(ring, positions) {
        let (old, new) = ((a - from).cross(b - from), (a - to).cross(b - to));
        if new.dot(old) < LEAST_TURN * new.length() * old.length() {
            return false;
        }
        before = before.min(shape(from, a, b));
        after = after.min(shape(to, a, b));
    }
    after >= 0.9 * before || after > 0.5
}
