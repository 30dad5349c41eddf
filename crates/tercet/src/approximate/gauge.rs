//! The source of an approximation, ready to be compared with many candidates.

use glam::DVec3;

use crate::metrics::{TriangleTree, samples};
use crate::{Error, Mesh, Result};

/// Points on each of two surfaces that are compared.
const SAMPLES: usize = 40_000;
/// Seed of the samples: not that of the comparison which is stated in the end.
const SEED: u64 = 1;

/// A surface to stay near to.
pub(super) struct Gauge {
    pub tree: TriangleTree,
    /// Points on it, spread by area.
    pub samples: Vec<DVec3>,
    /// The diagonal of its bounding box.
    pub diagonal: f64,
}

impl Gauge {
    /// # Errors
    /// [`Error::Mesh`] if there is no surface.
    pub fn new(mesh: &Mesh) -> Result<Self> {
        let tree = TriangleTree::new(mesh)?;
        let points = samples(&tree, SAMPLES, SEED);
        let Some((low, high)) = tree.bounds().filter(|_| !points.is_empty()) else {
            return Err(Error::mesh("faces", "none has an area, so there is no surface to come near to"));
        };
        let extent = glam::Vec3::from_array(high).as_dvec3() - glam::Vec3::from_array(low).as_dvec3();
        Ok(Gauge {
            tree,
            samples: points.into_iter().map(DVec3::from_array).collect(),
            diagonal: extent.length(),
        })
    }

    /// The root mean square distance between it and `mesh`, the larger of both directions, as a part of
    /// the diagonal; infinite if `mesh` has no surface.
    pub fn error(&self, mesh: &Mesh) -> Result<f64> {
        let tree = TriangleTree::new(mesh)?;
        let square =
            |tree: &TriangleTree, p: [f64; 3]| tree.closest(p).map_or(f64::INFINITY, |c| c.distance.powi(2));
        let points = samples(&tree, SAMPLES, SEED);
        let forth: f64 = self.samples.iter().map(|p| square(&tree, p.to_array())).sum();
        let back: f64 = points.iter().map(|&p| square(&self.tree, p)).sum();
        let means = [forth / self.samples.len() as f64, back / points.len().max(1) as f64];
        Ok(means[0].max(means[1]).sqrt() / self.diagonal)
    }
}
