//! One level up: a subdivision step whose new vertices are placed on the original.

use glam::DVec3;

use super::Tally;
use super::creases::{Crease, CreaseVertex, split_creases};
use super::original::{Contact, Original, area_vectors};
use crate::Mesh;
use crate::mesh::{Surface, next, prev};
use crate::subdivide::{Scheme, StepKind, cut_edges, refine_regular, subdivide_surface};

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
    /// The scheme that steps follow.
    pub scheme: Scheme,
    /// Steps from the base.
    pub steps: u32,
    /// Edges on creases of the original.
    pub creases: Vec<Crease>,
    /// For each vertex, whether it must stay on a crease or on the boundary.
    pub bound: Vec<bool>,
    /// For each vertex that the last step inserted, where it would lie, and look, on the coarse faces:
    /// there nothing is folded that was not folded before.
    pub flat: Vec<(DVec3, DVec3)>,
}

impl Level {
    /// The next level. Linear time but for the searches.
    pub fn climb(&self, original: &Original, tally: &mut Tally) -> Option<Level> {
        let kind = self.scheme.kind(self.steps);
        let places: Vec<[f64; 3]> = self.positions.iter().map(|p| p.to_array()).collect();
        let (surface, predicted) = subdivide_surface(&self.surface, &places, kind)?;
        let first = refine_regular(&self.surface, kind)?.first;
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
        let (creases, on_crease) = split_creases(self, kind, &surface, &first);
        let mut flat = self.flat_places(kind);
        for v in old..positions.len() {
            let normal = directions[v].normalize_or_zero();
            // The six faces around a new vertex have the area of two coarse ones; `size` is twice that.
            let reach = REACH * (size[v] / 2.0).sqrt();
            let contact = place(original, positions[v], normal, reach, tally);
            if let Some(contact) = contact {
                positions[v] = contact.at;
                normals[v] = contact.normal;
            } else {
                normals[v] = normal;
            }
        }
        for CreaseVertex { vertex, ends, share } in on_crease {
            let [a, b] = ends.map(|v| self.positions[v as usize]);
            let expected = a.lerp(b, share);
            if let Some((at, distance)) = original.nearest_on_crease(expected)
                && distance <= CREASE_REACH * a.distance(b)
            {
                positions[vertex as usize] = at;
                bound[vertex as usize] = true;
                flat[vertex as usize - old].0 = expected;
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
        Some(Level {
            surface,
            positions,
            normals,
            scheme: self.scheme,
            steps: self.steps + 1,
            creases,
            bound,
            flat,
        })
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
        let areas = area_vectors(&self.surface, &self.positions);
        let ends = |c: u32| [next(c), prev(c)].map(|d| self.positions[self.surface.at(d) as usize]);
        if kind == StepKind::Butterfly {
            let both = |c: u32| areas[(c / 3) as usize] + areas[(self.surface.across(c) / 3) as usize];
            let middle = |c: u32| ends(c)[0].midpoint(ends(c)[1]);
            return cut_edges(&self.surface).map(|c| (middle(c), both(c).normalize_or_zero())).collect();
        }
        let mut flat = Vec::new();
        for f in (0..self.surface.faces()).filter(|&f| !self.surface.is_virtual_face(f)) {
            let normal = areas[f as usize].normalize_or_zero();
            let rim = (3 * f..3 * f + 3).find(|&c| self.surface.is_virtual_face(self.surface.across(c) / 3));
            match rim {
                Some(apex) if kind == StepKind::Sqrt3Odd => {
                    let [a, b] = ends(apex);
                    flat.extend([1.0, 2.0].map(|thirds| (a.lerp(b, thirds / 3.0), normal)));
                }
                _ => {
                    let [a, b, c] = self.surface.face(f).map(|v| self.positions[v as usize]);
                    flat.push(((a + b + c) / 3.0, normal));
                }
            }
        }
        flat
    }
}

/// Where on the original a vertex belongs that is predicted at `p`: along the normal or, where nothing is
/// found there, at the nearest point.
fn place(original: &Original, p: DVec3, normal: DVec3, reach: f64, tally: &mut Tally) -> Option<Contact> {
    let nearest = original.nearest_facing(p, normal, reach);
    tally.rays += 1;
    let limit = nearest.map_or(reach, |n| reach.min(FAR * n.distance + 1e-9 * original.diagonal));
    let hit = original.shoot(p, normal, limit);
    if hit.is_none() {
        tally.ray_failures += 1;
    }
    hit.or(nearest)
}
