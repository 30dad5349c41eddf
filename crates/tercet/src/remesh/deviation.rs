//! Where a remesh is off, by the original's vertices.

use glam::DVec3;

use super::input::point;
use super::original::Original;
use crate::metrics::TriangleTree;
use crate::shapes::Random;
use crate::{Mesh, Result};

/// Samples on each of the two surfaces.
const SAMPLES: usize = 30_000;

/// The distance between remesh and original.
pub(super) struct Deviation {
    /// Root mean square of the distances, the larger of both directions.
    pub rms: f64,
    /// For each vertex of the original's mesh, the largest squared distance of the samples around it.
    pub squares: Vec<f64>,
}

/// Points on the original, spread by area, with their faces.
pub(super) struct Samples(Vec<(DVec3, u32)>);

impl Samples {
    pub fn new(original: &Original) -> Self {
        Samples(sample(&original.mesh))
    }

    /// Measures `remesh` against the original, by samples on both.
    pub fn measure(&self, original: &Original, remesh: &Mesh) -> Result<Deviation> {
        let mut squares = vec![0.0f64; original.mesh.positions.len()];
        let mut note = |face: u32, square: f64| {
            for v in original.mesh.faces[face as usize] {
                let worst = &mut squares[v as usize];
                *worst = worst.max(square);
            }
        };
        let tree = TriangleTree::new(remesh)?;
        let mut forth = Mean::default();
        for &(p, face) in &self.0 {
            if let Some(found) = tree.closest(p.to_array()) {
                let square = found.distance * found.distance;
                forth.add(square);
                note(face, square);
            }
        }
        let mut back = Mean::default();
        for (p, _) in sample(remesh) {
            if let Some((contact, face)) = original.nearest(p) {
                let square = contact.distance * contact.distance;
                back.add(square);
                note(face, square);
            }
        }
        Ok(Deviation { rms: forth.mean().max(back.mean()).sqrt(), squares })
    }
}

#[derive(Default)]
struct Mean {
    sum: f64,
    count: u32,
}

impl Mean {
    fn add(&mut self, value: f64) {
        self.sum += value;
        self.count += 1;
    }

    fn mean(&self) -> f64 {
        self.sum / f64::from(self.count.max(1))
    }
}

/// Points of a mesh, one in each part of equal area.
fn sample(mesh: &Mesh) -> Vec<(DVec3, u32)> {
    let corners = |f: &[u32; 3]| f.map(|v| point(mesh.positions[v as usize]));
    let area = |f: &[u32; 3]| {
        let [a, b, c] = corners(f);
        (b - a).cross(c - a).length()
    };
    let total: f64 = mesh.faces.iter().map(area).sum();
    let mut random = Random::new(1);
    let mut points = Vec::with_capacity(SAMPLES);
    let mut passed = 0.0;
    for (i, f) in (0..).zip(&mesh.faces) {
        passed += area(f);
        while (points.len() as f64 + 0.5) * total < passed * SAMPLES as f64 {
            let [a, b, c] = corners(f);
            let (u, v) = (random.unit(), random.unit());
            let (u, v) = if u + v > 1.0 { (1.0 - u, 1.0 - v) } else { (u, v) };
            points.push((a + u * (b - a) + v * (c - a), i));
        }
    }
    points
}
