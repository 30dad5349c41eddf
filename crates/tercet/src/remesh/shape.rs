//! Coarse meshes of sizes that are asked for, whatever their error: what the search for lossy files
//! chooses from.

use super::Tally;
use super::base::make_base;
use super::decimate::decimate;
use super::folds::unfold;
use super::input::Input;
use super::original::Original;
use crate::mesh::{Cut, cut};
use crate::{Mesh, Result, Scheme};

/// A mesh simplified to about `vertices` vertices, which are some of its own: any mesh, cut into
/// manifolds. O(n log n) time.
pub(crate) fn simplified(mesh: &Mesh, vertices: usize) -> Mesh {
    let Cut { surface, vertex_source, .. } = cut(mesh);
    let virtuals = surface.virtuals as usize;
    let place = |v: u32| glam::Vec3::from_array(mesh.positions[v as usize]).as_dvec3();
    let mut positions = vec![glam::DVec3::ZERO; virtuals];
    positions.extend(vertex_source.iter().map(|&v| place(v)));
    let base = decimate(&surface, &positions, &vec![1.0; positions.len()], vertices);
    let real = (0..base.surface.faces()).filter(|&f| !base.surface.is_virtual_face(f));
    Mesh {
        positions: base.source[virtuals..]
            .iter()
            .map(|&v| mesh.positions[vertex_source[v as usize - virtuals] as usize])
            .collect(),
        faces: real.map(|f| base.surface.face(f).map(|v| v - virtuals as u32)).collect(),
    }
}

/// A mesh that can be remeshed, ready for many attempts.
pub(crate) struct Remesher {
    input: Input,
    original: Original,
}

impl Remesher {
    /// # Errors
    /// As [`remesh`](super::remesh()): for what is not an orientable manifold.
    pub fn new(mesh: &Mesh) -> Result<Self> {
        let input = Input::new(mesh)?;
        let original = Original::new(&input)?;
        Ok(Remesher { input, original })
    }

    /// The remesh that `steps` steps of a scheme make of a base of about `base` vertices, its new vertices
    /// along the predicted normals. `None` if the steps cannot be made.
    pub fn remesh(&self, scheme: Scheme, base: usize, steps: u32) -> Option<Mesh> {
        let weight = vec![1.0; self.input.positions.len()];
        let mut level = make_base(&self.input, &self.original, &weight, base, scheme);
        unfold(&mut level, &self.original);
        for _ in 0..steps {
            level = level.climb(&self.original, &mut Tally::default())?;
            unfold(&mut level, &self.original);
        }
        Some(level.mesh())
    }
}
