//! Supplements: what turns the finest level into the original.
//!
//! The sections are applied in this order, which is not that of the file:
//!
//! 1. [`merges`] joins the copies of vertices that were cut apart. Vertices keep the order in
//!    which they first appear.
//! 2. [`leftovers`] appends vertices and faces that no surface can hold.
//! 3. [`exactness`] replaces lattice points by the original's coordinates.
//! 4. [`order`] brings vertices and faces into the order of the original.
//!
//! A section is written only if without it the mesh would be another.

mod digits;
mod estimate;
mod exactness;
mod graph;
mod leftovers;
mod merges;
mod number;
mod order;
mod ranks;

#[cfg(test)]
mod tests;

use super::{Levels, Point};
use crate::entropy::{Coder, Decoder, Encoder};
use crate::mesh::{Lattice, Mesh, Surface};
use crate::{Error, Limits, Precision, Result};
pub(crate) use estimate::exact_lattice;
use merges::Merged;
use number::NumberModel;

/// The bytes of each section that a file has.
#[derive(Default)]
pub(crate) struct Supplements {
    pub exactness: Option<Vec<u8>>,
    pub merges: Option<Vec<u8>>,
    pub leftovers: Option<Vec<u8>>,
    pub order: Option<Vec<u8>>,
}

/// What the encoder knows of the original beside the finest level.
pub(crate) struct Original<'a> {
    pub mesh: &'a Mesh,
    /// For each real vertex of the finest level, in its numbering, the vertex of the mesh.
    pub source: Vec<u32>,
    /// Vertices of the mesh that the surface lacks.
    pub loose: &'a [u32],
    /// Faces of the mesh that the surface lacks.
    pub degenerate: &'a [u32],
    pub keep_order: bool,
}

/// Bytes that completing a mesh takes for each of its vertices and faces.
const BYTES_PER_ELEMENT: u64 = 24;
/// The same with their order, for which neighbours are listed: six a vertex, three a face.
const BYTES_PER_ORDERED_ELEMENT: u64 = 80;

/// Writes the sections that lead from the finest of `levels` to the original. Time O(n log n).
///
/// # Errors
/// None for levels that are the original's.
pub(crate) fn write(levels: &Levels, precision: &Precision, original: Original) -> Result<Supplements> {
    let mesh = original.mesh;
    let lattice = Lattice::new(precision);
    let mut sections = Supplements::default();
    let mut draft = Draft::new(&levels.surface, &levels.field.positions);
    let mut source = original.source;
    if source.len() + original.loose.len() > mesh.positions.len() {
        let mut coder = Encoder::new();
        let merged = draft.code_merges(&mut coder, levels, &source, mesh.positions.len());
        source = merged.first.iter().map(|&v| source[v as usize]).collect();
        sections.merges = Some(coder.finish());
    }
    if !original.loose.is_empty() || !original.degenerate.is_empty() {
        let mut coder = Encoder::new();
        let loose: Vec<Point> =
            original.loose.iter().map(|&v| lattice.quantise(mesh.positions[v as usize])).collect();
        let order = draft.code_loose(&mut coder, loose.len() as u32, &loose)?;
        source.extend(order.iter().map(|&i| original.loose[i as usize]));
        let number = order::inverse(&source);
        let mut faces: Vec<[u32; 3]> = original
            .degenerate
            .iter()
            .map(|&f| leftovers::turned(mesh.faces[f as usize].map(|v| number[v as usize])))
            .collect();
        faces.sort_unstable();
        draft.code_degenerate(&mut coder, faces.len() as u32, &faces)?;
        sections.leftovers = Some(coder.finish());
    }
    let positions: Vec<[f32; 3]> = source.iter().map(|&v| mesh.positions[v as usize]).collect();
    let exact = !matches!(precision, Precision::Lattice { .. });
    if exact && !draft.lies_at(&lattice, &positions) {
        let mut coder = Encoder::new();
        exactness::code(&mut coder, precision, &draft.points, &positions)?;
        sections.exactness = Some(coder.finish());
    }
    let in_order = || source.iter().copied().eq(0..source.len() as u32) && draft.faces == mesh.faces;
    if original.keep_order && !in_order() {
        let mut coder = Encoder::new();
        order::code(&mut coder, Mesh { positions, faces: draft.faces }, &source, Some(mesh))?;
        sections.order = Some(coder.finish());
    }
    Ok(sections)
}

/// Completes the finest of `levels` to the original, which has `vertices` and `faces`.
/// Time O(n log n).
///
/// # Errors
/// [`Error::Format`] for sections that do not lead there, [`Error::Limit`] for too large a mesh.
pub(crate) fn read(
    levels: &Levels,
    precision: &Precision,
    [vertices, faces]: [u32; 2],
    sections: &Supplements,
    limits: &Limits,
) -> Result<Mesh> {
    let bytes_each = if sections.order.is_some() { BYTES_PER_ORDERED_ELEMENT } else { BYTES_PER_ELEMENT };
    limits.check("bytes of the mesh", vertices as u64 + faces as u64, bytes_each)?;
    let mut draft = Draft::new(&levels.surface, &levels.field.positions);
    if let Some(bytes) = &sections.merges {
        draft.code_merges(&mut Decoder::new(bytes), levels, &[], 0);
    }
    if let Some(bytes) = &sections.leftovers {
        let mut coder = Decoder::new(bytes);
        let missing = |all: u32, have: usize| all.saturating_sub(have as u32);
        let loose = missing(vertices, draft.points.len());
        draft.code_loose(&mut coder, loose, &[])?;
        let degenerate = missing(faces, draft.faces.len());
        draft.code_degenerate(&mut coder, degenerate, &[])?;
    }
    for (what, have, announced) in
        [("vertices", draft.points.len(), vertices), ("faces", draft.faces.len(), faces)]
    {
        if have != announced as usize {
            return Err(Error::format("mesh", format!("{have} {what}, but {announced} are announced")));
        }
    }
    let positions = match &sections.exactness {
        Some(bytes) => exactness::code(&mut Decoder::new(bytes), precision, &draft.points, &[])?,
        None => coordinates(draft.points, precision),
    };
    let mesh = Mesh { positions, faces: draft.faces };
    match &sections.order {
        Some(bytes) => order::code(&mut Decoder::new(bytes), mesh, &[], None),
        None => Ok(mesh),
    }
}

/// What `points` of the lattice stand for; in their memory.
pub(crate) fn coordinates(points: Vec<Point>, precision: &Precision) -> Vec<[f32; 3]> {
    let lattice = Lattice::new(precision);
    points.into_iter().map(|q| lattice.value(q)).collect()
}

/// The real part of a level as it is, with these `positions`.
pub(crate) fn surface_mesh(surface: &Surface, positions: &[Point], precision: &Precision) -> Mesh {
    let draft = Draft::new(surface, positions);
    Mesh { positions: coordinates(draft.points, precision), faces: draft.faces }
}

/// The mesh on the way from the finest level to the original, in the decoder's order.
struct Draft {
    points: Vec<Point>,
    faces: Vec<[u32; 3]>,
}

impl Draft {
    /// The real vertices and faces of a level.
    fn new(surface: &Surface, positions: &[Point]) -> Self {
        let virtuals = surface.virtuals;
        let all = surface.vertex.as_chunks().0;
        let faces = if virtuals == 0 {
            all.to_vec()
        } else {
            let real = all.iter().filter(|face| !surface.any_virtual(face));
            // A filter does not know how many it lets pass, and the vector would grow to twice as many.
            let mut faces = Vec::with_capacity(surface.real_faces() as usize);
            faces.extend(real.map(|face| face.map(|v| v.wrapping_sub(virtuals))));
            faces
        };
        Draft { points: positions[virtuals as usize..].to_vec(), faces }
    }

    /// Codes which vertices are one, and joins them.
    fn code_merges<C: Coder>(
        &mut self,
        coder: &mut C,
        levels: &Levels,
        source: &[u32],
        sources: usize,
    ) -> Merged {
        let merged = merges::code(coder, &levels.surface, &self.points, source, sources);
        self.points = merged.first.iter().map(|&v| self.points[v as usize]).collect();
        self.faces.iter_mut().flatten().for_each(|v| *v = merged.number[*v as usize]);
        merged
    }

    /// Codes and appends vertices without faces; returns their order in `points`.
    fn code_loose<C: Coder>(&mut self, coder: &mut C, count: u32, points: &[Point]) -> Result<Vec<u32>> {
        let (found, order) = leftovers::code_points(coder, [&self.points, points], &self.faces, count)?;
        self.points.extend(found);
        Ok(order)
    }

    /// Codes and appends faces that name a vertex twice.
    fn code_degenerate<C: Coder>(&mut self, coder: &mut C, count: u32, faces: &[[u32; 3]]) -> Result<()> {
        let vertices = self.points.len() as u32;
        self.faces.extend(leftovers::code_degenerate(coder, vertices, count, faces)?);
        Ok(())
    }

    /// Whether the lattice holds every bit of `positions`.
    fn lies_at(&self, lattice: &Lattice, positions: &[[f32; 3]]) -> bool {
        let bits = |p: [f32; 3]| p.map(f32::to_bits);
        self.points.iter().zip(positions).all(|(&q, &p)| bits(lattice.value(q)) == bits(p))
    }
}
