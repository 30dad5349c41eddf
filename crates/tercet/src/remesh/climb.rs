//! One level up: a √3 step whose new vertices are placed on the original.

use std::collections::HashMap;

use glam::DVec3;

use super::original::{Contact, Original, area_vectors};
use super::{Placement, Tally};
use crate::Mesh;
use crate::mesh::{NONE, Surface, next, prev};
use crate::subdivide::{StepKind, refine_sqrt3, subdivide_surface};

/// How far a new vertex may be from its prediction, in square roots of twice the coarse face's area.
const REACH: f64 = 0.8;
/// A ray that goes this many times as far as the nearest point has missed it.
const FAR: f64 = 3.0;
/// How far a vertex on a crease may be from its prediction, in lengths of its edge.
const CREASE_REACH: f64 = 0.35;

/// A remesh as far as it has come.
#[derive(Clone)]
pub(super) struct Level {
    pub surface: Surface,
    /// One a vertex; those of virtual vertices mean nothing.
    pub positions: Vec<DVec3>,
    /// The original's unit normal at each vertex.
    pub normals: Vec<DVec3>,
    /// Steps from the base.
    pub steps: u32,
    /// Edges on creases of the original. A √3 step flips them, so that on odd levels they are
    /// hidden: an entry is then the flipped edge between the two vertices beside the crease.
    pub creases: Vec<Crease>,
    /// For each vertex, whether it must stay on a crease or on the boundary.
    pub bound: Vec<bool>,
    /// For each vertex that the last step inserted, where it would lie, and look, on the coarse faces:
    /// there nothing is folded that was not folded before.
    pub flat: Vec<(DVec3, DVec3)>,
}

/// An edge on a crease, and the edge that hides it on odd levels.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Crease {
    pub ends: [u32; 2],
    pub beside: [u32; 2],
}

impl Level {
    /// The next level. Linear time but for the searches.
    pub fn climb(&self, original: &Original, placement: Placement, tally: &mut Tally) -> Option<Level> {
        let kind = if self.steps.is_multiple_of(2) { StepKind::Sqrt3Even } else { StepKind::Sqrt3Odd };
        let places: Vec<[f64; 3]> = self.positions.iter().map(|p| p.to_array()).collect();
        let (surface, predicted) = subdivide_surface(&self.surface, &places, kind)?;
        let first = refine_sqrt3(&self.surface, kind)?.first;
        let mut positions: Vec<DVec3> = predicted.into_iter().map(DVec3::from_array).collect();
        let mut directions = vec![DVec3::ZERO; positions.len()];
        let areas = area_vectors(&surface, &positions);
        let mut size = vec![0.0; positions.len()];
        for (f, &area) in (0..).zip(&areas) {
            for v in surface.face(f) {
                directions[v as usize] += area;
                size[v as usize] += area.length();
            }
        }
        let old = self.positions.len();
        let mut normals = self.normals.clone();
        let mut bound = self.bound.clone();
        normals.resize(positions.len(), DVec3::ZERO);
        bound.resize(positions.len(), false);
        let (creases, on_crease) = self.split_creases(&surface, &first);
        let mut flat = self.flat_places(kind);
        for v in old..positions.len() {
            let normal = directions[v].normalize_or_zero();
            // The six faces around a new vertex have the area of two coarse ones; `size` is twice that.
            let reach = REACH * (size[v] / 2.0).sqrt();
            let contact = place(original, placement, positions[v], normal, reach, tally);
            if let Some(contact) = contact {
                positions[v] = contact.at;
                normals[v] = contact.normal;
            } else {
                normals[v] = normal;
            }
        }
        for (v, ends) in on_crease {
            let [a, b] = ends.map(|v| self.positions[v as usize]);
            let third = (2.0 * a + b) / 3.0;
            if let Some((at, distance)) = original.nearest_on_crease(third)
                && distance <= CREASE_REACH * a.distance(b)
            {
                positions[v as usize] = at;
                bound[v as usize] = true;
                flat[v as usize - old].0 = third;
            }
        }
        for f in (0..surface.faces()).filter(|&f| surface.is_virtual_face(f)) {
            for v in surface.face(f).into_iter().filter(|&v| v as usize >= old) {
                if let Some((at, _)) = original.nearest_on_rim(positions[v as usize]) {
                    positions[v as usize] = at;
                    bound[v as usize] = true;
                }
            }
        }
        Some(Level { surface, positions, normals, steps: self.steps + 1, creases, bound, flat })
    }

    /// The mesh that it is.
    pub fn mesh(&self) -> Mesh {
        let virtuals = self.surface.virtuals;
        let real = (0..self.surface.faces()).filter(|&f| !self.surface.is_virtual_face(f));
        Mesh {
            positions: self.positions[virtuals as usize..].iter().map(|p| p.as_vec3().to_array()).collect(),
            faces: real.map(|f| self.surface.face(f).map(|v| v - virtuals)).collect(),
        }
    }

    /// See [`Level::flat`].
    fn flat_places(&self, kind: StepKind) -> Vec<(DVec3, DVec3)> {
        let mut flat = Vec::new();
        for f in (0..self.surface.faces()).filter(|&f| !self.surface.is_virtual_face(f)) {
            let [a, b, c] = self.surface.face(f).map(|v| self.positions[v as usize]);
            let normal = (b - a).cross(c - a).normalize_or_zero();
            let rim = (3 * f..3 * f + 3).find(|&c| self.surface.is_virtual_face(self.surface.across(c) / 3));
            match rim {
                Some(apex) if kind == StepKind::Sqrt3Odd => {
                    let [x, y] =
                        [next(apex), prev(apex)].map(|c| self.positions[self.surface.at(c) as usize]);
                    flat.extend([((2.0 * x + y) / 3.0, normal), ((x + 2.0 * y) / 3.0, normal)]);
                }
                _ => flat.push(((a + b + c) / 3.0, normal)),
            }
        }
        flat
    }

    /// The creases of the next level, and which of its new vertices lie on one: at a third of the
    /// edge given by its ends, near the first.
    ///
    /// ```text
    ///        y                y                y
    ///       /|\              / \               |
    ///      / | \            /   \              n
    ///     /  |  \          p --- q           p | q      a crease x–y hides behind p–q
    ///      \ | /            \   /              m        and comes back as x–m–n–y
    ///       \|/              \ /               |
    ///        x                x                x
    /// ```
    fn split_creases(&self, fine: &Surface, first: &[u32]) -> (Vec<Crease>, Vec<(u32, [u32; 2])>) {
        let mut edges: HashMap<(u32, u32), u32> = HashMap::new();
        let wanted = |crease: &Crease| if self.steps.is_multiple_of(2) { crease.ends } else { crease.beside };
        for crease in &self.creases {
            let [a, b] = wanted(crease);
            edges.insert((a.min(b), a.max(b)), NONE);
        }
        if edges.is_empty() {
            return Default::default();
        }
        for c in 0..self.surface.vertex.len() as u32 {
            let (a, b) = (self.surface.at(next(c)), self.surface.at(prev(c)));
            if let Some(corner) = edges.get_mut(&(a.min(b), a.max(b))) {
                *corner = c;
            }
        }
        // The vertex that the step inserts in the face of a corner, if it is one.
        let centre = |c: u32| {
            let f = c / 3;
            let at_rim = (3 * f..3 * f + 3).any(|c| self.surface.is_virtual_face(self.surface.across(c) / 3));
            let whole = !self.surface.is_virtual_face(f) && !at_rim;
            whole.then(|| fine.at(3 * first[f as usize] + 8))
        };
        let (mut creases, mut placed) = (Vec::new(), Vec::new());
        for crease in &self.creases {
            let [a, b] = wanted(crease);
            let c = edges[&(a.min(b), a.max(b))];
            if c == NONE {
                continue;
            }
            let o = self.surface.across(c);
            let (Some(m), Some(n)) = (centre(c), centre(o)) else { continue };
            if self.steps.is_multiple_of(2) {
                creases.push(Crease { ends: crease.ends, beside: [m, n] });
            } else {
                // The corners across the hiding edge are the crease's ends.
                let [x, y] = [self.surface.at(c), self.surface.at(o)];
                placed.extend([(m, [x, y]), (n, [y, x])]);
                creases.extend([[x, m], [m, n], [n, y]].map(|ends| Crease { ends, beside: [NONE; 2] }));
            }
        }
        (creases, placed)
    }
}

/// Where on the original a vertex belongs that is predicted at `p`.
fn place(
    original: &Original,
    placement: Placement,
    p: DVec3,
    normal: DVec3,
    reach: f64,
    tally: &mut Tally,
) -> Option<Contact> {
    let nearest = original.nearest_facing(p, normal, reach);
    if placement == Placement::Relaxed {
        return nearest;
    }
    tally.rays += 1;
    let limit = nearest.map_or(reach, |n| reach.min(FAR * n.distance + 1e-9 * original.diagonal));
    let hit = original.shoot(p, normal, limit);
    if hit.is_none() {
        tally.ray_failures += 1;
    }
    hit.or(nearest)
}
