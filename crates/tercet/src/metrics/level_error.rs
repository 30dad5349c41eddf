//! The geometric error of each level of a hierarchy.
//!
//! Measured is the distance of the original's vertices from the level's surface: their root
//! mean square over a fixed sample, as a part of the diagonal of the original's bounding box.
//!
//! A search structure for every level would cost more than coding it. Instead each sample keeps
//! the face that it is nearest to. A reverse step says which coarse face took the place of a
//! fine one; from there the sample walks downhill over edges and vertices to nearer faces. So
//! distances are exact for the face found, which need not be the nearest of all: **the error is
//! an upper bound of the true one**, and equal to it wherever walking downhill finds the nearest
//! face.
//!
//! The error is written into the file, so that only operations which IEEE 754 defines to the
//! last bit are used, `+ − · / √` and conversions, in a fixed order: the same on every platform.

use super::distance::{Feature, Nearest, Vector, dot, sub, to_edge, to_triangle};
use crate::mesh::{Lattice, Mesh, NONE, Surface, bounds, next, prev};
use crate::reverse::{Hierarchy, Reduction, StepKind};

/// One vertex in this many is looked at, within these bounds: more would not make the mean
/// more certain than its own eight bits in the file, but take more time than coding.
const SAMPLING: usize = 16;
const SAMPLES: std::ops::RangeInclusive<usize> = 1 << 10..=1 << 14;
/// A sample moves at most so often a level.
const MOST_MOVES: usize = 16;
/// So many faces around a vertex are looked at.
const MOST_FACES: usize = 32;

/// A vertex of the original on its way down the hierarchy.
struct Sample {
    position: Vector,
    /// The face of the current surface that it is nearest to.
    face: u32,
}

/// Measures the levels of a hierarchy while it is built.
pub(crate) struct LevelErrors {
    lattice: Lattice,
    /// Of the original's bounding box.
    diagonal: f64,
    samples: Vec<Sample>,
    /// Finest level first; finite and not negative.
    errors: Vec<f32>,
    /// The faces that the samples were nearest to, finest level first.
    faces: Vec<Vec<u32>>,
}

impl LevelErrors {
    /// Prepares to measure against `mesh`, which was cut to `surface`; its real vertex i is
    /// vertex `source[i]` of the mesh. Linear time.
    pub fn new(mesh: &Mesh, surface: &Surface, source: &[u32], lattice: &Lattice) -> Self {
        let mut face = vec![NONE; source.len()];
        for f in (0..surface.faces()).rev().filter(|&f| !surface.is_virtual_face(f)) {
            for v in surface.face(f) {
                face[(v - surface.virtuals) as usize] = f;
            }
        }
        let wanted = (source.len() / SAMPLING).clamp(*SAMPLES.start(), *SAMPLES.end());
        let count = wanted.min(source.len());
        let sample = |k: usize| {
            let i = (k as u64 * source.len() as u64 / count as u64) as usize;
            Sample { position: mesh.positions[source[i] as usize].map(f64::from), face: face[i] }
        };
        LevelErrors {
            lattice: lattice.clone(),
            diagonal: diagonal(mesh),
            samples: (0..count).map(sample).collect(),
            errors: Vec::new(),
            faces: Vec::new(),
        }
    }

    /// Measures the coarsest level that `hierarchy` has reached; to be called at each. Its last
    /// positions must be those that the level decodes to.
    ///
    /// Time O(samples), but for one pass over the faces that the step made.
    pub fn measure(&mut self, hierarchy: &Hierarchy) {
        let level = hierarchy.steps.len();
        if let Some(step) = hierarchy.steps.last() {
            let heirs = Heirs::new(hierarchy.surface(level - 1), step);
            self.samples.iter_mut().for_each(|s| s.face = heirs.of(s.face));
        }
        let Some(positions) = hierarchy.positions.last() else { return };
        let shape = Shape { surface: hierarchy.surface(level), positions, lattice: &self.lattice };
        let mut sum = 0.0;
        for sample in &mut self.samples {
            let (face, square) = shape.descend(sample.position, sample.face);
            sample.face = face;
            sum += square;
        }
        self.errors.push(self.root_mean(sum));
        self.faces.push(self.samples.iter().map(|sample| sample.face).collect());
    }

    /// The error of a level, counted from the finest, 0.
    pub fn of(&self, level: usize) -> f32 {
        self.errors[level]
    }

    /// The faces of the decoder's surface that the samples were nearest to at a level, counted from the finest. `map`
    /// gives for each of its faces a corner of the one that it is on the encoder's. Linear time.
    pub fn nearest_on_decoders(&self, level: usize, map: &[u32]) -> Vec<u32> {
        let mut decoders = vec![0; map.len()];
        for (f, &corner) in (0..).zip(map) {
            decoders[(corner / 3) as usize] = f;
        }
        self.faces[level].iter().map(|&f| decoders[f as usize]).collect()
    }

    /// The error of a level whose vertices would lie at `positions`, and whose faces `nearest` to the samples were
    /// those when they did not. Time O(samples).
    pub fn estimated(&self, nearest: &[u32], surface: &Surface, positions: &[[i32; 3]]) -> f32 {
        let shape = Shape { surface, positions, lattice: &self.lattice };
        let starts = self.samples.iter().zip(nearest);
        self.root_mean(starts.map(|(sample, &face)| shape.descend(sample.position, face).1).sum())
    }

    /// The error for the sum of the samples' squared distances.
    fn root_mean(&self, sum: f64) -> f32 {
        let degenerate = self.samples.is_empty() || self.diagonal == 0.0;
        let mean = if degenerate { 0.0 } else { (sum / self.samples.len() as f64).sqrt() / self.diagonal };
        // Rounding to f32 cannot leave its range: no distance is much beyond the diagonal.
        mean.min(f32::MAX.into()) as f32
    }
}

/// The diagonal of the bounding box; 0 without vertices.
fn diagonal(mesh: &Mesh) -> f64 {
    let (low, high) = bounds(mesh);
    let extent = sub(high.map(f64::from), low.map(f64::from));
    dot(extent, extent).sqrt()
}

/// Which coarse face took the place of each fine face.
struct Heirs<'a> {
    fine: &'a Surface,
    /// For each fine vertex that refinement inserts, the coarse face that it inserts it in.
    of_vertex: Vec<u32>,
    /// For each fine face that refinement leaves alone, itself on the coarse surface; for each that
    /// a butterfly step makes, the coarse face that it is a part of.
    of_face: Vec<u32>,
}

impl<'a> Heirs<'a> {
    fn new(fine: &'a Surface, step: &Reduction) -> Self {
        let mut of_vertex = vec![NONE; fine.vertices as usize];
        let mut of_face = vec![NONE; fine.faces() as usize];
        if step.kind == StepKind::Butterfly {
            for (f, &anchor) in (0..).zip(&step.anchor) {
                for part in quarters(fine, anchor) {
                    of_face[(part / 3) as usize] = f;
                }
            }
            return Heirs { fine, of_vertex, of_face };
        }
        for (f, (&anchor, &split)) in (0..).zip(step.anchor.iter().zip(&step.split)) {
            match anchor {
                NONE => {}
                _ if split || step.kind == StepKind::Sqrt3Odd => of_vertex[fine.at(anchor) as usize] = f,
                _ => of_face[anchor as usize / 3] = f,
            }
        }
        Heirs { fine, of_vertex, of_face }
    }

    /// A coarse face where fine face `f` was.
    ///
    /// There is one: a face around a vertex that the step removed belongs to the coarse face that
    /// the vertex splits, and any other face is left alone. Of the two vertices on a cut boundary
    /// edge one stands for the real face before it, the other for the virtual face behind it.
    fn of(&self, f: u32) -> u32 {
        let removed = self.fine.face(f).map(|v| self.of_vertex[v as usize]);
        removed.into_iter().find(|&heir| heir != NONE).unwrap_or(self.of_face[f as usize])
    }
}

/// Corners of the faces that a butterfly step made of the coarse face with this anchor; of a virtual
/// one, which has two, each twice.
fn quarters(fine: &Surface, anchor: u32) -> [u32; 4] {
    match fine.is_virtual(fine.at(anchor)) {
        true => [anchor, anchor, fine.swing(anchor), fine.swing(anchor)],
        false => [anchor, fine.across(anchor), fine.across(next(anchor)), fine.across(prev(anchor))],
    }
}

/// The surface of a level in space.
struct Shape<'a> {
    surface: &'a Surface,
    positions: &'a [[i32; 3]],
    lattice: &'a Lattice,
}

impl Shape<'_> {
    /// Walks from face `start` downhill; returns the face where that ends and the squared
    /// distance of `p` from it.
    ///
    /// If the nearest point of a face lies on an edge or a corner of it, another face there may
    /// be nearer; if not, no point of the surface around is.
    fn descend(&self, p: Vector, start: u32) -> (u32, f64) {
        let mut face = start;
        let mut nearest = self.nearest(p, start);
        for _ in 0..MOST_MOVES {
            let square = nearest.square;
            let found = match nearest.feature {
                Feature::Inside => None,
                Feature::Edge(k) => self.nearer(p, square, [self.surface.across(3 * face + k)]),
                Feature::Corner(k) => self.nearer(p, square, self.surface.fan(3 * face + k).take(MOST_FACES)),
            };
            let Some(found) = found else { break };
            (face, nearest) = found;
        }
        (face, nearest.square)
    }

    /// The nearest of the faces of some corners, if one is nearer than `square`.
    fn nearer(
        &self,
        p: Vector,
        square: f64,
        corners: impl IntoIterator<Item = u32>,
    ) -> Option<(u32, Nearest)> {
        let mut best = None;
        let mut least = square;
        for c in corners {
            let nearest = self.nearest(p, c / 3);
            if nearest.square < least {
                least = nearest.square;
                best = Some((c / 3, nearest));
            }
        }
        best
    }

    /// Squared distance of `p` from face `f`. Of a virtual face, at most one of whose corners is
    /// virtual, what counts is its real edge: the real face beyond has it too.
    fn nearest(&self, p: Vector, f: u32) -> Nearest {
        let vertices = self.surface.face(f);
        let [a, b, c] = vertices.map(|v| self.lattice.value(self.positions[v as usize]).map(f64::from));
        match vertices.map(|v| self.surface.is_virtual(v)) {
            [false, false, false] => to_triangle(p, [a, b, c]),
            [true, ..] => to_edge(p, b, c, 0),
            [_, true, _] => to_edge(p, c, a, 1),
            _ => to_edge(p, a, b, 2),
        }
    }
}

#[cfg(test)]
mod tests;
