//! The distance between two surfaces, in the measures that the literature on simplification and
//! compression uses (Cignoni, Rocchini and Scopigno, "Metro: measuring error on simplified surfaces",
//! 1998; Aspert, Santa-Cruz and Ebrahimi, "MESH: measuring errors between surfaces using the
//! Hausdorff distance", 2002).

use super::TriangleTree;
use super::distance::{Vector, dot, sub};
use super::greatest::{Greatest, bound_greatest};
use super::sampling::{Areas, for_each_sample};
use crate::mesh::NONE;
use crate::{Error, Mesh, Result};

/// Distances below this part of the largest coordinate count as 0.
const GRAIN: f64 = 1.0 / (1u64 << 40) as f64;

/// How closely to measure.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct MetricsOptions {
    /// Points sampled on each of the two surfaces, evenly by area; not 0. Default: 200 000.
    ///
    /// Root mean square and mean come from these; the standard error of the mean is below 1 % of it
    /// for any surface that is not all spikes. As many queries at most are spent on narrowing down
    /// the greatest distance.
    pub samples: usize,
    /// The samples' seed: the same one gives the same figures. Default: 0.
    pub seed: u64,
}

impl Default for MetricsOptions {
    fn default() -> Self {
        MetricsOptions { samples: 200_000, seed: 0 }
    }
}

/// How far two surfaces, A and B, are apart. Lengths are in the units of the meshes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Comparison {
    /// The diagonal of A's bounding box, unreferenced vertices left out.
    pub diagonal: f64,
    /// The distances of A's points from B.
    pub a_to_b: Deviation,
    /// The distances of B's points from A.
    pub b_to_a: Deviation,
    /// What of A was measured.
    pub a: Side,
    /// What of B was measured.
    pub b: Side,
}

/// The distances of one surface's points from the other surface.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Deviation {
    /// Root mean square over the area, by sampling.
    pub rms: f64,
    /// Mean over the area, by sampling.
    pub mean: f64,
    /// The greatest distance found, of all vertices, samples and points looked at while bounding it:
    /// the one-sided Hausdorff distance is this at least …
    pub max: f64,
    /// … and this at most: proved for every point of the surface, not only for those looked at.
    pub max_at_most: f64,
}

/// What of a mesh counts as its surface.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Side {
    /// Vertices of the mesh.
    pub vertices: usize,
    /// Vertices that no face refers to: they are no part of the surface.
    pub unreferenced: usize,
    /// Faces of the mesh.
    pub faces: usize,
    /// Faces without area: they count as segments or points, and receive no samples.
    pub degenerate: usize,
    /// The area of all faces.
    pub area: f64,
}

impl Comparison {
    /// The larger root mean square of both directions.
    pub fn rms(&self) -> f64 {
        self.a_to_b.rms.max(self.b_to_a.rms)
    }

    /// The larger mean of both directions.
    pub fn mean(&self) -> f64 {
        self.a_to_b.mean.max(self.b_to_a.mean)
    }

    /// The Hausdorff distance is this at least.
    pub fn hausdorff(&self) -> f64 {
        self.a_to_b.max.max(self.b_to_a.max)
    }

    /// The Hausdorff distance is this at most.
    pub fn hausdorff_at_most(&self) -> f64 {
        self.a_to_b.max_at_most.max(self.b_to_a.max_at_most)
    }

    /// The peak signal-to-noise ratio in decibels, 20 log₁₀(diagonal / RMS) with the larger RMS of
    /// both directions; infinite where that is 0.
    pub fn psnr(&self) -> f64 {
        20.0 * (self.diagonal / self.rms()).log10()
    }
}

/// Measures how far two surfaces are apart.
///
/// Each sample's distance from the other surface is exact; below 2^−40 of the largest coordinate it
/// counts as 0: near slivers `f64` ends there, and the coordinates themselves end at 2^−24. The same seed
/// gives the same figures. O((n + samples) log n) time, about 200 bytes a face and no memory for samples.
///
/// # Errors
/// [`Error::Mesh`] if a mesh has no area, names an index out of range or a coordinate that is not
/// finite; [`Error::Parameter`] if no samples are asked for.
pub fn compare(a: &Mesh, b: &Mesh, options: &MetricsOptions) -> Result<Comparison> {
    if options.samples == 0 {
        return Err(Error::Parameter("samples: there must be one at least".into()));
    }
    let a = Measured::new(a).map_err(|error| of_mesh("A", error))?;
    let b = Measured::new(b).map_err(|error| of_mesh("B", error))?;
    let grain = a.largest.max(b.largest) * GRAIN;
    Ok(Comparison {
        diagonal: a.diagonal,
        a_to_b: deviation(&a, &b, options, grain),
        b_to_a: deviation(&b, &a, options, grain),
        a: a.side,
        b: b.side,
    })
}

/// Says which of the two meshes an error is about.
fn of_mesh(which: &str, error: Error) -> Error {
    match error {
        Error::Mesh { place, cause } => Error::mesh(format!("mesh {which}, {place}"), cause),
        other => other,
    }
}

/// A mesh made ready to be measured.
struct Measured<'a> {
    mesh: &'a Mesh,
    tree: TriangleTree,
    areas: Areas,
    side: Side,
    /// Of the bounding box of its faces.
    diagonal: f64,
    /// The largest absolute coordinate there.
    largest: f64,
}

impl<'a> Measured<'a> {
    fn new(mesh: &'a Mesh) -> Result<Self> {
        let tree = TriangleTree::new(mesh)?;
        let Some((low, high)) = tree.bounds() else {
            return Err(Error::mesh("faces", "there are none, so there is no surface to measure"));
        };
        let areas = Areas::new(&tree);
        if areas.total() == 0.0 {
            return Err(Error::mesh("faces", "none has an area, so there is no surface to measure"));
        }
        let mut referenced = vec![false; mesh.positions.len()];
        mesh.faces.iter().flatten().for_each(|&v| referenced[v as usize] = true);
        let extent = sub(high.map(f64::from), low.map(f64::from));
        let largest = low.iter().chain(&high).fold(0f32, |largest, x| largest.max(x.abs()));
        let side = Side {
            vertices: mesh.positions.len(),
            unreferenced: referenced.iter().filter(|&&r| !r).count(),
            faces: mesh.faces.len(),
            degenerate: areas.degenerate(),
            area: areas.total(),
        };
        Ok(Measured {
            mesh,
            tree,
            areas,
            side,
            diagonal: dot(extent, extent).sqrt(),
            largest: largest.into(),
        })
    }
}

/// The distances of `from`'s points from `to`; those below `grain` count as 0.
fn deviation(from: &Measured, to: &Measured, options: &MetricsOptions, grain: f64) -> Deviation {
    let above_grain = |square: f64| if square > grain * grain { square } else { 0.0 };
    // Points follow each other in the order of the tree's leaves, so that the triangle nearest to the
    // one before is a good first guess.
    let mut guess = 0;
    let mut nearest = |p: Vector| {
        let Some((triangle, found)) = to.tree.search(p, Some(guess)) else { return (guess, 0.0) };
        guess = triangle;
        (triangle, above_grain(found.square))
    };

    let mut greatest = 0.0f64;
    let mut of_vertex = vec![NONE; from.mesh.positions.len()];
    for &v in from.tree.faces().iter().flat_map(|&f| &from.mesh.faces[f as usize]) {
        if of_vertex[v as usize] == NONE {
            let (triangle, square) = nearest(from.mesh.positions[v as usize].map(f64::from));
            of_vertex[v as usize] = triangle;
            greatest = greatest.max(square);
        }
    }
    let (mut sum, mut squares) = (0.0, 0.0);
    for_each_sample(&from.tree, &from.areas, options.samples, options.seed, |p| {
        let (_, square) = nearest(p);
        sum += square.sqrt();
        squares += square;
        greatest = greatest.max(square);
    });
    let Greatest { found, at_most } =
        bound_greatest(from.mesh, &from.tree, &to.tree, &of_vertex, greatest.sqrt(), options.samples, grain);
    let count = options.samples as f64;
    Deviation { rms: (squares / count).sqrt(), mean: sum / count, max: found, max_at_most: at_most }
}

#[cfg(test)]
mod tests;
