//! Resampling of a mesh to subdivision connectivity, so that its connectivity costs nothing.
//!
//! A base with few vertices is made (`base`) by edge collapses (`decimate`) and given a good shape (`fair`);
//! every level then inserts its vertices where interpolatory subdivision predicts them, and moves
//! them along the predicted normal onto the original (`climb`; after Guskov, Vidimče, Sweldens and
//! Schröder, "Normal meshes", 2000), so that most of a detail is one number. What folds on the way
//! is smoothed (`folds`). Where the result stays too far off, the base is made finer there, and all
//! is done again (`search`).

mod base;
mod climb;
mod creases;
mod decimate;
mod deviation;
mod fair;
mod folds;
mod input;
mod original;
mod quadric;
mod ring;
mod search;
mod shape;

pub use input::Repairs;

pub(crate) use shape::{Remesher, simplified};

use crate::metrics::Comparison;
use crate::{Error, Limits, Mesh, Progress, Result, Scheme};
use input::Input;
use original::Original;

/// What a remesh shall be like.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RemeshOptions {
    /// Which subdivision connectivity it shall have.
    pub scheme: Scheme,
    /// When to stop.
    pub goal: Goal,
    /// Where new vertices go.
    pub placement: Placement,
    /// Faces of the result, at most. `None`: four times as many as the mesh has, at least 200 000.
    pub max_faces: Option<usize>,
}

/// When a remesh is good enough.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Goal {
    /// The root mean square of the distances between the surfaces, the larger of both directions, is at
    /// most this part of the diagonal of the mesh's bounding box.
    MaxError(f64),
    /// So many steps lead to it, from a base that makes it about as fine as the mesh, or finer where
    /// the error would otherwise be above [`LEVELS_ERROR`].
    Levels(u32),
}

/// The error allowed where only levels are asked for, as a part of the diagonal.
pub const LEVELS_ERROR: f64 = 0.001;

/// Where new vertices go.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Placement {
    /// From their prediction along the predicted normal onto the mesh: the smallest details.
    Normal,
    /// There too, but evened out within the surface at the end: the most regular triangles.
    Relaxed,
}

impl Default for RemeshOptions {
    fn default() -> Self {
        RemeshOptions {
            scheme: Scheme::Sqrt3,
            goal: Goal::MaxError(0.0005),
            placement: Placement::Normal,
            max_faces: None,
        }
    }
}

/// A mesh of subdivision connectivity, and how it came about.
#[derive(Clone, Debug)]
pub struct Remeshed {
    /// Base vertices first, then each level's.
    pub mesh: Mesh,
    /// Vertices of the base.
    pub base_vertices: usize,
    /// Steps that lead from the base to the mesh.
    pub levels: u32,
    /// How far it is from the original, which is A.
    pub comparison: Comparison,
    /// Vertices that were looked for along a ray, and for how many of them none was found there.
    pub rays: Tally,
    /// Triangles that were folded and could be smoothed.
    pub unfolded: usize,
    /// Triangles that look against the original.
    pub folded: usize,
    /// What had to be done to the original first.
    pub repairs: Repairs,
}

/// How rays fared.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Tally {
    /// Rays shot.
    pub rays: usize,
    /// Rays that found no plausible point.
    pub ray_failures: usize,
}

/// Remeshes `mesh`, an orientable manifold with or without boundary, keeping its topology.
///
/// The same input gives the same result. O(n log n) time for each base that is tried.
///
/// # Errors
/// [`Error::Mesh`] with the place if `mesh` is not an orientable manifold with finite positions, or has
/// no area; [`Error::Parameter`] for a goal that is no number above 0, or that could not be reached
/// with `max_faces`; [`Error::Limit`] if these would not fit.
pub fn remesh(
    mesh: &Mesh,
    options: &RemeshOptions,
    limits: &Limits,
    progress: &mut dyn FnMut(Progress),
) -> Result<Remeshed> {
    if let Goal::MaxError(error) = options.goal
        && (error.is_nan() || error <= 0.0)
    {
        return Err(Error::Parameter("the error to reach must be above 0".into()));
    }
    if options.goal == Goal::Levels(0) {
        return Err(Error::Parameter("without levels there is no subdivision connectivity".into()));
    }
    let max_faces = options.max_faces.unwrap_or_else(|| LEAST_MOST_FACES.max(4 * mesh.faces.len()));
    limits.check("bytes of the remesh", max_faces as u64, BYTES_PER_FACE)?;
    let input = Input::new(mesh)?;
    let original = Original::new(&input)?;
    if original.diagonal == 0.0 {
        return Err(Error::mesh("faces", "all lie in one point, so there is no surface to remesh"));
    }
    let found = search::search(&input, &original, options, max_faces, progress)?;
    Ok(Remeshed {
        mesh: found.level.mesh(),
        base_vertices: found.base_vertices,
        levels: found.level.steps,
        comparison: found.comparison,
        rays: found.rays,
        unfolded: found.unfolded,
        folded: folds::folded(&found.level, &original).len(),
        repairs: input.repairs,
    })
}

/// Unless said otherwise, a remesh may have so many faces.
const LEAST_MOST_FACES: usize = 200_000;
/// Memory that a face of the remesh takes: surfaces and positions of two levels, search structures.
const BYTES_PER_FACE: u64 = 400;
