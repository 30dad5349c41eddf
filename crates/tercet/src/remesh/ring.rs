//! A vertex among its neighbours, and where they would have it.

use glam::DVec3;

use super::climb::Level;
use super::original::Original;
use crate::mesh::next;

/// The neighbours of a vertex, in order.
pub(super) struct Ring {
    vertex: u32,
    pub around: Vec<u32>,
    /// Whether the vertex is on the boundary.
    pub on_rim: bool,
}

impl Ring {
    /// The ring of the vertex at `corner`.
    pub fn new(level: &Level, corner: u32) -> Self {
        let surface = &level.surface;
        let around: Vec<u32> = surface.fan(corner).map(|d| surface.at(next(d))).collect();
        let on_rim = around.iter().any(|&w| surface.is_virtual(w));
        Ring { vertex: surface.at(corner), around, on_rim }
    }

    /// The mean of the neighbours' places; of a vertex inside.
    pub fn mean(&self, level: &Level) -> DVec3 {
        let sum: DVec3 = self.around.iter().map(|&w| level.positions[w as usize]).sum();
        sum / self.around.len() as f64
    }

    /// Moves a vertex inside this share of the way to the mean of its neighbours, then to the nearest
    /// point of the original that looks as its neighbours do.
    pub fn smooth(&self, level: &mut Level, share: f64, original: &Original) {
        let here = level.positions[self.vertex as usize];
        let mean = self.mean(level);
        let reach: f64 = self.around.iter().map(|&w| level.positions[w as usize].distance(mean)).sum();
        let normal: DVec3 = self.around.iter().map(|&w| level.normals[w as usize]).sum();
        let (target, normal) = (here.lerp(mean, share), normal.normalize_or_zero());
        let reach = reach / self.around.len() as f64;
        if let Some(contact) = original.nearest_facing(target, normal, reach) {
            level.positions[self.vertex as usize] = contact.at;
            level.normals[self.vertex as usize] = contact.normal;
        }
    }
}
