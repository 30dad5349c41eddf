//! Forward subdivision of a mesh.

use super::{StepKind, subdivide_surface};
use crate::mesh::{Cut, cut};
use crate::{Error, Limits, Mesh, Result};

/// Memory that one face of the result takes: surface, positions and the mesh itself.
const BYTES_PER_FACE: u64 = 100;

/// Refines `mesh` by `steps` interpolating √3 steps: each triples the faces, and two of them
/// trisect every edge. Steps alternate in what they do to a boundary: the first leaves its edges
/// alone, the second cuts each in three, and so on.
///
/// The vertices of `mesh` keep their numbers and places, unreferenced ones included; new ones
/// follow. Stencils as in Labsik and Greiner, "Interpolatory √3-subdivision", 2000. Linear in
/// the result.
///
/// # Errors
/// [`Error::Mesh`] if `mesh` is not an oriented manifold (with or without boundary), names an
/// index out of range or a coordinate that is not finite; [`Error::Limit`] if the result would
/// not fit.
pub fn subdivide(mesh: &Mesh, steps: u32, limits: &Limits) -> Result<Mesh> {
    mesh.check()?;
    let faces = (mesh.faces.len() as u64).saturating_mul(3u64.saturating_pow(steps));
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
        let kind = if step % 2 == 0 { StepKind::Sqrt3Even } else { StepKind::Sqrt3Odd };
        (surface, positions) = subdivide_surface(&surface, &positions, kind)
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
    fn each_step_triples_the_faces_and_keeps_the_vertices() {
        for mesh in [shapes::icosahedron(), shapes::grid(4, 3), shapes::torus(5, 4)] {
            for steps in 0..4 {
                let fine = subdivide(&mesh, steps, &Limits::default()).unwrap();
                assert_eq!(fine.faces.len(), mesh.faces.len() * 3usize.pow(steps));
                assert_eq!(fine.positions[..mesh.positions.len()], mesh.positions);
                fine.check().unwrap();
            }
        }
    }

    #[test]
    fn what_is_not_a_manifold_or_too_large_is_refused_by_name() {
        let positions = vec![[0.0; 3]; 5];
        let bow = Mesh { positions: positions.clone(), faces: vec![[0, 1, 2], [0, 3, 4]] };
        let error = subdivide(&bow, 1, &Limits::default()).unwrap_err().to_string();
        assert!(error.starts_with("vertex 0: "), "{error}");
        let thin = Mesh { positions, faces: vec![[0, 1, 2], [3, 3, 4]] };
        let error = subdivide(&thin, 1, &Limits::default()).unwrap_err().to_string();
        assert!(error.starts_with("face 1: "), "{error}");
        let result = subdivide(&shapes::icosahedron(), 60, &Limits::default());
        assert!(matches!(result, Err(Error::Limit { .. })));
    }
}
