//! The surface to come near to: its nearest points, where lines meet it, its creases and its rim.

use glam::DVec3;

use super::input::{Input, point};
use crate::mesh::{Surface, next, prev};
use crate::metrics::TriangleTree;
use crate::{Mesh, Result};

/// Edges whose faces turn by more than this (as a cosine) are creases.
const CREASE: f64 = 0.77;

/// The original, ready to be asked.
pub(super) struct Original {
    pub mesh: Mesh,
    tree: TriangleTree,
    /// Unit normals of faces; zero for those without area.
    normals: Vec<DVec3>,
    /// Unit normals of the surface's vertices, weighted by area.
    pub vertex_normals: Vec<DVec3>,
    /// Creases, as triangles without area.
    creases: TriangleTree,
    /// Boundary edges, as triangles without area.
    rim: TriangleTree,
    /// Diagonal of the bounding box.
    pub diagonal: f64,
}

/// A point of the original.
#[derive(Clone, Copy, Debug)]
pub(super) struct Contact {
    pub at: DVec3,
    /// The unit normal there.
    pub normal: DVec3,
    pub distance: f64,
}

impl Original {
    pub fn new(input: &Input) -> Result<Self> {
        let mesh = input.mesh.clone();
        let tree = TriangleTree::new(&mesh)?;
        let surface = &input.surface;
        let area_vector = |f: &[u32; 3]| {
            let [a, b, c] = f.map(|v| point(mesh.positions[v as usize]));
            (b - a).cross(c - a)
        };
        let areas: Vec<DVec3> = mesh.faces.iter().map(area_vector).collect();
        let normals: Vec<DVec3> = areas.iter().map(|n| n.normalize_or_zero()).collect();
        let mut vertex_normals = vec![DVec3::ZERO; surface.vertices as usize];
        for (f, &area) in (0..).zip(&areas) {
            surface.face(f).into_iter().for_each(|v| vertex_normals[v as usize] += area);
        }
        vertex_normals.iter_mut().for_each(|n| *n = n.normalize_or_zero());
        let (mut creases, mut rim) = (Vec::new(), Vec::new());
        for c in (0..3 * mesh.faces.len() as u32).filter(|&c| c < surface.across(c)) {
            let (f, g) = (c / 3, surface.across(c) / 3);
            let ends = [surface.at(next(c)), surface.at(prev(c))];
            if surface.is_virtual_face(g) {
                rim.push(ends);
            } else if normals[f as usize].dot(normals[g as usize]) < CREASE {
                creases.push(ends);
            }
        }
        let lines = |edges: &[[u32; 2]]| {
            let source = |v: u32| {
                let p = input.positions[v as usize];
                p.to_array().map(|x| x as f32)
            };
            let positions = edges.iter().flatten().map(|&v| source(v)).collect();
            let faces = (0..edges.len() as u32).map(|i| [2 * i, 2 * i + 1, 2 * i + 1]).collect();
            TriangleTree::new(&Mesh { positions, faces })
        };
        let (creases, rim) = (lines(&creases)?, lines(&rim)?);
        let (low, high) = tree.bounds().unwrap_or_default();
        let diagonal = (point(high) - point(low)).length();
        Ok(Original { mesh, tree, normals, vertex_normals, creases, rim, diagonal })
    }

    /// The nearest point and the face that it lies on.
    pub fn nearest(&self, p: DVec3) -> Option<(Contact, u32)> {
        let found = self.tree.closest(p.to_array())?;
        let at = DVec3::from_array(found.point);
        Some((
            Contact { at, normal: self.normals[found.face as usize], distance: found.distance },
            found.face,
        ))
    }

    /// The nearest point within `reach` where the surface looks the way of unit vector `normal`.
    pub fn nearest_facing(&self, p: DVec3, normal: DVec3, reach: f64) -> Option<Contact> {
        let facing = |face: u32| self.normals[face as usize].dot(normal) > FACING;
        let found = self.tree.closest_among(p.to_array(), reach, facing)?;
        let at = DVec3::from_array(found.point);
        Some(Contact { at, normal: self.normals[found.face as usize], distance: found.distance })
    }

    /// Whether within `reach` the surface looks less than a right angle off `normal`.
    pub fn looks(&self, p: DVec3, normal: DVec3, reach: f64) -> bool {
        let facing = |face: u32| self.normals[face as usize].dot(normal) > 0.0;
        self.tree.closest_among(p.to_array(), reach, facing).is_some()
    }

    /// The nearer of the first points where the line through `p` along unit vector `normal` meets
    /// the surface, ahead and behind, if the surface looks that way there and it is within `reach`.
    pub fn shoot(&self, p: DVec3, normal: DVec3, reach: f64) -> Option<Contact> {
        let mut best: Option<Contact> = None;
        for sign in [1.0, -1.0] {
            let reach = best.map_or(reach, |b| b.distance);
            // From a little behind, so that a start on the surface counts.
            let direction = sign * normal;
            let Some(hit) = self.tree.ray(p.to_array(), direction.to_array(), -1e-9 * self.diagonal..reach)
            else {
                continue;
            };
            let towards = self.normals[hit.face as usize];
            if towards.dot(normal) > FACING {
                let at = p + hit.along * direction;
                best = Some(Contact { at, normal: towards, distance: hit.along.abs() });
            }
        }
        best
    }

    /// The nearest point of a crease, and its distance.
    pub fn nearest_on_crease(&self, p: DVec3) -> Option<(DVec3, f64)> {
        nearest_on(&self.creases, p)
    }

    /// The nearest point of the boundary, and its distance.
    pub fn nearest_on_rim(&self, p: DVec3) -> Option<(DVec3, f64)> {
        nearest_on(&self.rim, p)
    }
}

fn nearest_on(lines: &TriangleTree, p: DVec3) -> Option<(DVec3, f64)> {
    let found = lines.closest(p.to_array())?;
    Some((DVec3::from_array(found.point), found.distance))
}

/// The least cosine between a face of the original and the direction that it shall look in.
const FACING: f64 = 0.3;

/// Twice the area of each face times its normal; virtual faces get zero.
pub(super) fn area_vectors(surface: &Surface, positions: &[DVec3]) -> Vec<DVec3> {
    (0..surface.faces())
        .map(|f| {
            if surface.is_virtual_face(f) {
                return DVec3::ZERO;
            }
            let [a, b, c] = surface.face(f).map(|v| positions[v as usize]);
            (b - a).cross(c - a)
        })
        .collect()
}
