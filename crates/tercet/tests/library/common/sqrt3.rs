//! √3 steps on meshes, written for tests without any of the library's own code.

use std::collections::HashMap;
use tercet::Mesh;

/// Refines `steps` times: even and odd boundary steps in turn, starting with an even one.
pub fn refined(mesh: &Mesh, steps: usize) -> Mesh {
    (0..steps).fold(mesh.clone(), |mesh, i| step(&mesh, i % 2 == 1))
}

/// A new vertex goes into every face and edges between faces are flipped. In an odd step a face
/// with a boundary edge receives two vertices on that edge instead.
fn step(mesh: &Mesh, odd: bool) -> Mesh {
    let mut positions = mesh.positions.clone();
    let edges = |f: [u32; 3]| [(f[0], f[1]), (f[1], f[2]), (f[2], f[0])];
    let inner: HashMap<(u32, u32), ()> = mesh.faces.iter().flat_map(|&f| edges(f)).map(|e| (e, ())).collect();
    let is_boundary = |(a, b): (u32, u32)| !inner.contains_key(&(b, a));
    let mut add = |weights: &[(u32, f32)]| {
        let sum = |k: usize| weights.iter().map(|&(v, w)| w * mesh.positions[v as usize][k]).sum();
        positions.push([0, 1, 2].map(sum));
        positions.len() as u32 - 1
    };
    let mut faces = Vec::new();
    // For each directed edge the new vertex that faces it within its old face.
    let mut facing = HashMap::new();
    for &f in &mesh.faces {
        let boundary = edges(f).iter().position(|&e| is_boundary(e));
        match boundary {
            Some(k) if odd => {
                let [a, b, q] = [f[k], f[(k + 1) % 3], f[(k + 2) % 3]];
                let p = add(&[(a, 2.0 / 3.0), (b, 1.0 / 3.0)]);
                let r = add(&[(a, 1.0 / 3.0), (b, 2.0 / 3.0)]);
                faces.push([p, r, q]);
                facing.extend([((q, a), p), ((b, q), r)]);
            }
            _ => {
                let centre = add(&f.map(|v| (v, 1.0 / 3.0)));
                facing.extend(edges(f).map(|e| (e, centre)));
            }
        }
    }
    // In the order of the faces, not of the map.
    for (a, b) in mesh.faces.iter().flat_map(|&f| edges(f)) {
        let Some(&left) = facing.get(&(a, b)) else { continue };
        match facing.get(&(b, a)) {
            Some(&right) if a < b => faces.extend([[a, right, left], [right, b, left]]),
            Some(_) => {}
            None => faces.push([a, b, left]),
        }
    }
    Mesh { positions, faces }
}
