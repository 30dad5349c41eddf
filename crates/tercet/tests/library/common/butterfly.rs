//! 1-to-4 steps on meshes, written for tests without any of the library's own code.

use std::collections::HashMap;
use tercet::Mesh;

/// Refines `steps` times, with each new vertex in the middle of its edge.
pub fn refined(mesh: &Mesh, steps: usize) -> Mesh {
    (0..steps).fold(mesh.clone(), |mesh, _| step(&mesh))
}

fn step(mesh: &Mesh) -> Mesh {
    let mut positions = mesh.positions.clone();
    let mut on_edge = HashMap::new();
    let mut faces = Vec::new();
    for &[a, b, c] in &mesh.faces {
        let [x, y, z] = [(a, b), (b, c), (c, a)].map(|(u, v)| {
            *on_edge.entry((u.min(v), u.max(v))).or_insert_with(|| {
                let (p, q) = (mesh.positions[u as usize], mesh.positions[v as usize]);
                positions.push([0, 1, 2].map(|k| 0.5 * (p[k] + q[k])));
                positions.len() as u32 - 1
            })
        });
        faces.extend([[a, x, z], [x, b, y], [z, y, c], [x, y, z]]);
    }
    Mesh { positions, faces }
}
