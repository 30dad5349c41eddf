//! Meshes that may stand for the source.

use super::Method;
use super::fit::fit;
use super::gauge::Gauge;
use crate::remesh::{Remesher, simplified};
use crate::{Error, LevelScheme, Mesh, Result, Scheme};

/// Vertices that the base of a remesh may have.
const BASES: std::ops::RangeInclusive<usize> = 12..=6000;
/// A simplified mesh has at most this part of the source's vertices: with more, it is as well to keep all.
const LEAST_REDUCTION: f64 = 0.9;
/// Vertices that any candidate has at least …
const LEAST_VERTICES: f64 = 8.0;
/// … and at most, for each of the source.
const MOST_VERTICES: f64 = 4.0;

/// A kind of mesh that comes in all sizes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Family {
    Simplified,
    /// A base refined by so many steps.
    Remeshed(Scheme, u32),
}

impl Family {
    pub fn method(self) -> Method {
        match self {
            Family::Simplified => Method::Simplified,
            Family::Remeshed(scheme, steps) => Method::Remeshed(scheme, steps),
        }
    }

    /// See [`fit`].
    fn friction(self) -> f64 {
        match self {
            Family::Simplified => 0.1,
            Family::Remeshed(..) => 0.3,
        }
    }
}

/// A mesh near to the source.
pub(super) struct Shape {
    pub mesh: Mesh,
    /// How far it is from the source, as a part of the diagonal.
    pub error: f64,
}

/// The source, ready to be simplified and remeshed many times.
pub(super) struct Source<'a> {
    pub mesh: &'a Mesh,
    gauge: Gauge,
    /// The longest side of its bounding box, as a part of the diagonal.
    pub side: f64,
    /// Why it cannot be remeshed, if it was tried.
    remesher: Option<Result<Remesher>>,
}

impl<'a> Source<'a> {
    /// # Errors
    /// [`Error::Mesh`] if the mesh has no surface.
    pub fn new(mesh: &'a Mesh, scheme: LevelScheme) -> Result<Self> {
        let gauge = Gauge::new(mesh)?;
        let (low, high) = crate::mesh::bounds(mesh);
        let side = (0..3).map(|k| f64::from(high[k]) - f64::from(low[k])).fold(0.0, f64::max);
        let remesher = (scheme != LevelScheme::Adaptive).then(|| Remesher::new(mesh));
        Ok(Source { mesh, side: side / gauge.diagonal, gauge, remesher })
    }

    /// Why it cannot be remeshed.
    pub fn not_remeshed(&self) -> Option<&Error> {
        self.remesher.as_ref()?.as_ref().err()
    }

    /// The schemes that it may be remeshed by.
    pub fn schemes(&self, wanted: LevelScheme) -> &'static [Scheme] {
        match wanted {
            _ if !matches!(self.remesher, Some(Ok(_))) => &[],
            LevelScheme::Auto => &[Scheme::Sqrt3, Scheme::Butterfly],
            LevelScheme::Sqrt3 => &[Scheme::Sqrt3],
            LevelScheme::Butterfly => &[Scheme::Butterfly],
            LevelScheme::Adaptive => &[],
        }
    }

    /// The number of vertices nearest to this that a candidate may have.
    pub fn possible_size(&self, size: f64) -> usize {
        let most = (MOST_VERTICES * self.mesh.positions.len() as f64).max(LEAST_VERTICES);
        size.clamp(LEAST_VERTICES, most) as usize
    }

    /// The candidate of about so many vertices, its vertices moved to where its triangles are nearest to the
    /// source. `None` if there is none.
    pub fn shape(&self, family: Family, size: usize) -> Result<Option<Shape>> {
        let Some(mut mesh) = self.mesh_of(family, size) else { return Ok(None) };
        if mesh.faces.is_empty() {
            return Ok(None);
        }
        fit(&mut mesh, &self.gauge.tree, &self.gauge.samples, family.friction())?;
        let error = self.gauge.error(&mesh)?;
        Ok(error.is_finite().then_some(Shape { mesh, error }))
    }

    fn mesh_of(&self, family: Family, size: usize) -> Option<Mesh> {
        match family {
            Family::Simplified => {
                let most = (LEAST_REDUCTION * self.mesh.positions.len() as f64) as usize;
                Some(simplified(self.mesh, size.min(most)))
            }
            Family::Remeshed(scheme, steps) => {
                let base = size / usize::try_from(scheme.growth().checked_pow(steps)?).ok()?;
                let Some(Ok(remesher)) = &self.remesher else { return None };
                let possible = BASES.contains(&base) && base <= self.mesh.positions.len();
                possible.then(|| remesher.remesh(scheme, base, steps)).flatten()
            }
        }
    }
}
