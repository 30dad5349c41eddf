//! How many levels get their positions late: found by coding, not by guessing.

use super::{EncodeOptions, Progressive, Writer};
use crate::coding::Symmetry;
use crate::mesh::{Mesh, NONE, Surface, cut};
use crate::reverse::{Hierarchy, StepKind};
use crate::{Effort, Result};
use std::borrow::Cow;

/// At most so many of the finest levels get their positions late; more hardly pays.
fn most_late(effort: Effort) -> usize {
    if effort.is_max() { 4 } else { 3 }
}

/// Of so many faces a trial for [`Progressive::Best`] codes a part of this size.
fn trial_faces(faces: usize, effort: Effort) -> usize {
    if effort.is_max() { (faces / 3).clamp(16_000, 40_000) } else { (faces / 12).clamp(2000, 5000) }
}

/// A part of a mesh, or all of it, reduced: to be coded more than once.
struct Part<'a> {
    hierarchy: Cow<'a, Hierarchy>,
    symmetry: Option<Symmetry>,
    options: EncodeOptions,
}

/// How many of the finest levels of `hierarchy`, on which nothing is coded yet, get their positions
/// late.
///
/// # Errors
/// None for the hierarchy of a mesh.
pub(super) fn late_levels(
    hierarchy: &Hierarchy,
    symmetry: Option<Symmetry>,
    options: &EncodeOptions,
) -> Result<usize> {
    let adaptive = hierarchy.steps.iter().take_while(|step| step.kind == StepKind::Adaptive).count();
    let most = adaptive.min(most_late(options.effort));
    if most == 0 || options.effort == Effort::Fast {
        return Ok(0);
    }
    let faces = hierarchy.surface(0).faces() as usize;
    match options.progressive {
        Progressive::Best => {
            let faces = trial_faces(faces, options.effort);
            Part::new(hierarchy, faces, symmetry, options).worth_it(most)
        }
        Progressive::Smallest => Part::new(hierarchy, faces, symmetry, options).smallest(most),
    }
}

impl<'a> Part<'a> {
    /// At least `count` connected faces of the finest surface, or all that are connected to them.
    /// All of the surface if it has no more.
    fn new(
        hierarchy: &'a Hierarchy,
        count: usize,
        symmetry: Option<Symmetry>,
        options: &EncodeOptions,
    ) -> Self {
        let (whole, points) = (hierarchy.surface(0), &hierarchy.positions[0]);
        let options = *options;
        if count >= whole.faces() as usize {
            return Part { hierarchy: Cow::Borrowed(hierarchy), symmetry, options };
        }
        let mut mesh = Mesh::default();
        let mut number = vec![NONE; whole.vertices as usize];
        let mut chosen = Vec::new();
        for f in region(whole, count) {
            mesh.faces.push(whole.face(f).map(|v| {
                let number = &mut number[v as usize];
                if *number == NONE {
                    *number = chosen.len() as u32;
                    chosen.push(points[v as usize]);
                }
                *number
            }));
        }
        mesh.positions = vec![[0.0; 3]; chosen.len()];
        let part = cut(&mesh);
        let mut points = vec![[0; 3]; part.surface.virtuals as usize];
        points.extend(part.vertex_source.iter().map(|&v| chosen[v as usize]));
        let hierarchy = Hierarchy::build(part.surface, points, options.scheme, options.update, |_| {});
        Part { hierarchy: Cow::Owned(hierarchy), symmetry, options }
    }

    /// As many as make the part smaller by 2 %, or none; a part of a mesh shows less than the whole does. Most
    /// meshes need two codings to tell.
    fn worth_it(&self, most: usize) -> Result<usize> {
        let none = self.size(0)?;
        let two = self.size(most.min(2))?;
        if !self.options.effort.is_max() && two * 128 > none * 127 {
            return Ok(0);
        }
        let all = self.size(most)?;
        let (least, late) = if all < two { (all, most) } else { (two, most.min(2)) };
        Ok(if least * 100 <= none * 98 { late } else { 0 })
    }

    /// As many as make the part smallest.
    fn smallest(&self, most: usize) -> Result<usize> {
        let mut best = (usize::MAX, 0);
        for late in 0..=most {
            best = best.min((self.size(late)?, late));
        }
        Ok(best.1)
    }

    /// Bytes of all payloads with the positions of `late` levels late.
    fn size(&self, late: usize) -> Result<usize> {
        let hierarchy = Hierarchy::clone(&self.hierarchy);
        let adaptive = hierarchy.steps.iter().take_while(|step| step.kind == StepKind::Adaptive).count();
        let mut writer = Writer::new(hierarchy, &self.options, self.symmetry, None, late.min(adaptive), 1);
        writer.write(|_| {})?;
        let payloads = writer.payloads.iter().chain(&writer.late_payload);
        Ok(payloads.map(Vec::len).sum())
    }
}

/// Real faces around one in the middle of the numbering, the nearest across edges first.
fn region(surface: &Surface, count: usize) -> Vec<u32> {
    let real = |f: u32| !surface.is_virtual_face(f);
    let mut seen = vec![false; surface.faces() as usize];
    let seed = (surface.faces() / 2..surface.faces()).find(|&f| real(f));
    let mut faces: Vec<u32> = seed.into_iter().collect();
    let mut at = 0;
    while at < faces.len() && faces.len() < count {
        let f = faces[at];
        seen[f as usize] = true;
        at += 1;
        for g in (3 * f..3 * f + 3).map(|c| surface.across(c) / 3) {
            if real(g) && !std::mem::replace(&mut seen[g as usize], true) {
                faces.push(g);
            }
        }
    }
    faces
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::shapes::{grid, torus};

    #[test]
    fn a_region_is_connected_and_names_no_face_twice() {
        for (mesh, count) in [(grid(20, 20), 100), (torus(9, 9), 50), (torus(5, 5), 10_000)] {
            let surface = cut(&mesh).surface;
            let mut faces = region(&surface, count);
            assert!(faces.len() >= count.min(mesh.faces.len()), "{} faces", faces.len());
            assert!(faces.iter().all(|&f| !surface.is_virtual_face(f)));
            faces.sort_unstable();
            faces.dedup();
            assert!(faces.len() >= count.min(mesh.faces.len()));
        }
    }
}
