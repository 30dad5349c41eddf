//! The coarsest level.

use glam::DVec3;

use super::climb::Level;
use super::creases::Crease;
use super::decimate::decimate;
use super::fair::fair;
use super::input::Input;
use super::original::Original;
use crate::Scheme;
use crate::mesh::{next, prev};

/// A base vertex lies on a crease if it is this near, in lengths of the edge.
pub(super) const ON_CREASE: f64 = 0.02;
/// The middle of an edge along a crease is this near to it.
const ALONG_CREASE: f64 = 0.1;

/// Makes a base of about `size` vertices.
pub(super) fn make_base(
    input: &Input,
    original: &Original,
    weight: &[f64],
    size: usize,
    scheme: Scheme,
) -> Level {
    let mut base = decimate(&input.surface, &input.positions, weight, size);
    let mut positions: Vec<DVec3> = base.source.iter().map(|&v| input.positions[v as usize]).collect();
    fair(&mut base, &mut positions, original);
    let normal = |(&at, &source): (&DVec3, &u32)| match original.nearest(at) {
        Some((contact, _)) if at != input.positions[source as usize] => contact.normal,
        _ => original.vertex_normals[source as usize],
    };
    let mut level = Level {
        normals: positions.iter().zip(&base.source).map(normal).collect(),
        bound: vec![false; positions.len()],
        surface: base.surface,
        positions,
        scheme,
        steps: 0,
        creases: Vec::new(),
        flat: Vec::new(),
    };
    tag_creases(&mut level, original);
    level
}

/// Finds the edges that run along creases of the original.
fn tag_creases(level: &mut Level, original: &Original) {
    let surface = &level.surface;
    let inside = |c: u32| !surface.is_virtual_face(c / 3);
    for c in (0..surface.vertex.len() as u32).filter(|&c| c < surface.across(c)) {
        if !inside(c) || !inside(surface.across(c)) {
            continue;
        }
        let ends = [surface.at(next(c)), surface.at(prev(c))];
        let [a, b] = ends.map(|v| level.positions[v as usize]);
        let near = |p: DVec3, share: f64| {
            original.nearest_on_crease(p).is_some_and(|(_, distance)| distance <= share * a.distance(b))
        };
        if near(a, ON_CREASE) && near(b, ON_CREASE) && near(a.midpoint(b), ALONG_CREASE) {
            level.creases.push(Crease::new(ends));
        }
    }
    for crease in &level.creases {
        crease.ends.iter().for_each(|&v| level.bound[v as usize] = true);
    }
}
