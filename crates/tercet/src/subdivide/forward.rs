//! Forward subdivision of a mesh.

use super::{StepKind, subdivide_surface};
use crate::mesh::{Cut, cut};
use crate::{Error, Limits, Mesh, Result};

/// Memory that one face of the result takes: surface, positions and the mesh itself.
const BYTES_PER_FACE: u64 = 100;

/// A subdivision scheme. Both interpolate: vertices stay where they are, new ones follow.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Scheme {
    /// Interpolatory √3 subdivision: a step triples the faces, and two of them trisect every edge.
    /// Steps alternate in what they do to a boundary: the first leaves its edges alone, the second
    /// cuts each in three, and so on. (Labsik and Greiner, "Interpolatory √3-subdivision", 2000.)
    #[default]
    Sqrt3,
    /// Modified butterfly subdivision: a step halves every edge and quadruples the faces. (Zorin,
    /// Schröder and Sweldens, "Interpolating subdivision for meshes with arbitrary topology", 1996.)
    Butterfly,
}

impl Scheme {
    /// Into how many a step divides a face.
    fn growth(self) -> u64 {
        match self {
            Scheme::Sqrt3 => 3,
            Scheme::Butterfly => 4,
        }
    }

    /// The step with this number, from 0.
    fn kind(self, step: u32) -> StepKind {
        match self {
            Scheme::Sqrt3 if step.is_multiple_of(2) => StepKind::Sqrt3Even,
            Scheme::Sqrt3 => StepKind::Sqrt3Odd,
            Scheme::Butterfly => StepKind::Butterfly,
        }
    }
}

/// Refines `mesh` by `steps` steps of `scheme`.
///
/// The vertices of `mesh` keep their numbers and places, unreferenced ones included; new ones
/// follow. Linear in the result.
///
/// # Errors
/// [`Error::Mesh`] if `mesh` is not an oriented manifold (with or without boundary), names an
/// index out of range or a coordinate that is not finite; [`Error::Limit`] if the result would
/// not fit.
pub fn subdivide(mesh: &Mesh, scheme: Scheme, steps: u32, limits: &Limits) -> Result<Mesh> {
    mesh.check()?;
    let faces = (mesh.faces.len() as u64).saturating_mul(scheme.growth().saturating_pow(steps));
    limits.check("bytes of the subdivided mesh", faces, BYTES_PER_FACE)?;
    let Cut { mut surface, vertex_source, degenerate, .. } = cut(mesh);
    if let Some(f) = degenerate.first() {
        return Err(Error::mesh(format!("face {f}"), "names a vertex twice, so it cannot be subdivided"));
    }
    let mut seen = vec![false; mesh.positions.len()];
    for &v in &vertex_source {
        if std::mem::replace(&mut seen[v as usize], true) {
            let cause = "its faces do not form one fan of the same orientation, so it cannot be subdivided";
            return Err(Error::mesh(format!("vertex {v}"), cause));
        }
    }
    let place = |v: u32| mesh.positions[v as usize].map(f64::from);
    let mut positions = vec![[0.0; 3]; surface.virtuals as usize];
    positions.extend(vertex_source.iter().map(|&v| place(v)));
    for step in 0..steps {
        (surface, positions) = subdivide_surface(&surface, &positions, scheme.kind(step))
            .ok_or_else(|| Error::mesh("boundary", "a step that cuts boundary edges does not apply"))?;
    }
    let old = surface.virtuals as usize + vertex_source.len();
    let number = |v: u32| match (v as usize).checked_sub(old) {
        Some(new) => (mesh.positions.len() + new) as u32,
        None => vertex_source[(v - surface.virtuals) as usize],
    };
    let mut refined = Mesh { positions: mesh.positions.clone(), faces: Vec::new() };
    refined.positions.extend(positions[old..].iter().map(|p| p.map(|x| x as f32)));
    refined.faces = (0..surface.faces())
        .filter(|&f| !surface.is_virtual_face(f))
        .map(|f| surface.face(f).map(number))
        .collect();
    Ok(refined)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::shapes;

    #[test]
    fn each_step_multiplies_the_faces_and_keeps_the_vertices() {
        for (scheme, growth) in [(Scheme::Sqrt3, 3usize), (Scheme::Butterfly, 4)] {
            for mesh in [shapes::icosahedron(), shapes::grid(4, 3), shapes::torus(5, 4)] {
                for steps in 0..4 {
                    let fine = subdivide(&mesh, scheme, steps, &Limits::default()).unwrap();
                    assert_eq!(fine.faces.len(), mesh.faces.len() * growth.pow(steps));
                    assert_eq!(fine.positions[..mesh.positions.len()], mesh.positions);
                    fine.check().unwrap();
                }
            }
        }
    }

    #[test]
    fn butterfly_steps_round_an_icosahedron_to_nearly_a_sphere() {
        let fine = subdivide(&shapes::icosahedron(), Scheme::Butterfly, 4, &Limits::default()).unwrap();
        assert_eq!(fine.positions.len(), 10 * 4usize.pow(4) + 2);
        for p in &fine.positions {
            let radius = p.iter().map(|x| x * x).sum::<f32>().sqrt();
            assert!((0.95..1.05).contains(&radius), "{radius}");
        }
    }

    #[test]
    fn what_is_not_a_manifold_or_too_large_is_refused_by_name() {
        let positions = vec![[0.0; 3]; 5];
        let bow = Mesh { positions: positions.clone(), faces: vec![[0, 1, 2], [0, 3, 4]] };
        let error = subdivide(&bow, Scheme::Sqrt3, 1, &Limits::default()).unwrap_err().to_string();
        assert!(error.starts_with("vertex 0: "), "{error}");
        let thin = Mesh { positions, faces: vec![[0, 1, 2], [3, 3, 4]] };
        let error = subdivide(&thin, Scheme::Butterfly, 1, &Limits::default()).unwrap_err().to_string();
        assert!(error.starts_with("face 1: "), "{error}");
        for scheme in [Scheme::Sqrt3, Scheme::Butterfly] {
            let result = subdivide(&shapes::icosahedron(), scheme, 60, &Limits::default());
            assert!(matches!(result, Err(Error::Limit { .. })));
        }
    }
}
