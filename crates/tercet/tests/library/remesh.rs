//! Remeshes are near, unfolded, of the original's topology, and of subdivision connectivity.
#![cfg(feature = "remesh")]

use std::collections::{BTreeMap, BTreeSet};
use std::path::Path;

use tercet::remesh::{Goal, Placement, RemeshOptions, Remeshed, remesh};
use tercet::shapes::{annulus, grid, join, noisy, scan, sphere, torus};
use tercet::{EncodeOptions, Error, Limits, Mesh, Scheme, encode, io};

fn run(mesh: &Mesh, options: &RemeshOptions) -> tercet::Result<Remeshed> {
    remesh(mesh, options, &Limits::default(), &mut |_| {})
}

fn within(error: f64) -> RemeshOptions {
    RemeshOptions { goal: Goal::MaxError(error), ..RemeshOptions::default() }
}

/// Euler characteristic, components and boundary loops of a manifold; unreferenced vertices do not count.
fn topology(mesh: &Mesh) -> [i64; 3] {
    let mut edges: BTreeMap<[u32; 2], u32> = BTreeMap::new();
    let mut ends = Vec::new();
    for f in &mesh.faces {
        for (a, b) in [(f[0], f[1]), (f[1], f[2]), (f[2], f[0])] {
            *edges.entry([a.min(b), a.max(b)]).or_default() += 1;
        }
        ends.extend([[f[0], f[1]], [f[1], f[2]]]);
    }
    let used: BTreeSet<u32> = mesh.faces.iter().flatten().copied().collect();
    assert!(edges.values().all(|&n| n <= 2), "an edge has more than two faces");
    let rim: Vec<[u32; 2]> = edges.iter().filter(|(_, n)| **n == 1).map(|(e, _)| *e).collect();
    let rim_vertices: BTreeSet<u32> = rim.iter().flatten().copied().collect();
    let euler = used.len() as i64 - edges.len() as i64 + mesh.faces.len() as i64;
    [euler, components(&used, &ends), components(&rim_vertices, &rim)]
}

fn components(vertices: &BTreeSet<u32>, joined: &[[u32; 2]]) -> i64 {
    let mut parent: BTreeMap<u32, u32> = vertices.iter().map(|&v| (v, v)).collect();
    fn root(parent: &mut BTreeMap<u32, u32>, v: u32) -> u32 {
        let mut at = v;
        while parent[&at] != at {
            let up = parent[&parent[&at]];
            parent.insert(at, up);
            at = up;
        }
        at
    }
    for &[a, b] in joined {
        let (a, b) = (root(&mut parent, a), root(&mut parent, b));
        parent.insert(a, b);
    }
    parent.iter().filter(|(v, p)| v == p).count() as i64
}

/// What must hold of every remesh.
fn check(name: &str, mesh: &Mesh, remeshed: &Remeshed) {
    check_levels(name, mesh, remeshed, "sqrt3");
}

fn check_levels(name: &str, mesh: &Mesh, remeshed: &Remeshed, kind: &str) {
    assert_eq!(topology(mesh), topology(&remeshed.mesh), "{name}");
    assert_eq!(remeshed.folded, 0, "{name}");
    let steps = remeshed.levels as usize;
    let file = encode(&remeshed.mesh, &EncodeOptions { bits: Some(12), ..Default::default() }).unwrap();
    let kinds: Vec<_> = file.info.levels.iter().rev().take(steps).map(|l| l.kind).collect();
    assert_eq!(kinds, vec![kind; steps], "{name}");
    let below = &file.info.levels[file.info.levels.len() - 1 - steps];
    assert!(below.vertices as usize == remeshed.base_vertices, "{name}");
}

/// A cube of side 1 with n squares along each edge: twelve creases.
fn cube(n: usize) -> Mesh {
    let mut mesh = Mesh::default();
    let mut number = BTreeMap::new();
    for (axis, far) in [(0, false), (0, true), (1, false), (1, true), (2, false), (2, true)] {
        let place = |i: usize, j: usize| {
            let mut p = [0; 3];
            p[axis] = if far { n } else { 0 };
            p[(axis + 1) % 3] = i;
            p[(axis + 2) % 3] = j;
            p
        };
        for i in 0..n {
            for j in 0..n {
                let [a, b, c, d] = [place(i, j), place(i + 1, j), place(i + 1, j + 1), place(i, j + 1)];
                for mut triangle in [[a, b, c], [a, c, d]] {
                    if !far {
                        triangle.swap(1, 2);
                    }
                    mesh.faces.push(triangle.map(|p| {
                        *number.entry(p).or_insert_with(|| {
                            mesh.positions.push(p.map(|x| x as f32 / n as f32));
                            mesh.positions.len() as u32 - 1
                        })
                    }));
                }
            }
        }
    }
    mesh
}

#[test]
fn remeshes_of_every_topology_are_near_and_unfolded() {
    let wavy = noisy(&sphere(3), 0.002, 1);
    for (name, mesh) in [
        ("scan", scan(3000, 1)),
        ("sphere", wavy.clone()),
        ("torus", torus(40, 20)),
        ("grid", grid(30, 20)),
        ("annulus", annulus(40, 6)),
        ("components", join(&[wavy, torus(30, 16)])),
        ("cube", cube(12)),
    ] {
        let remeshed = run(&mesh, &within(0.002)).unwrap();
        assert!(remeshed.comparison.rms() <= 0.002 * remeshed.comparison.diagonal, "{name}");
        assert!(remeshed.base_vertices < mesh.positions.len() / 2, "{name}: {}", remeshed.base_vertices);
        check(name, &mesh, &remeshed);
    }
}

#[test]
fn creases_are_kept_where_a_step_can_show_them() {
    let mesh = cube(12);
    let goal = Goal::Levels(4);
    let remeshed = run(&mesh, &RemeshOptions { goal, ..RemeshOptions::default() }).unwrap();
    check("cube", &mesh, &remeshed);
    // A rounded crease between vertices a thirtieth apart would be 0.005 of the diagonal off.
    let hausdorff = remeshed.comparison.hausdorff() / remeshed.comparison.diagonal;
    assert!(hausdorff < 0.002, "{hausdorff}");
}

#[test]
fn levels_placements_and_repetition() {
    let mesh = scan(3000, 2);
    for placement in [Placement::Normal, Placement::Relaxed] {
        let options = RemeshOptions { goal: Goal::Levels(3), placement, ..RemeshOptions::default() };
        let first = run(&mesh, &options).unwrap();
        assert_eq!(first.levels, 3);
        check("scan", &mesh, &first);
        assert_eq!(first.mesh, run(&mesh, &options).unwrap().mesh);
    }
}

#[test]
fn butterfly_connectivity_is_made_by_the_same_means() {
    for (name, mesh) in [("scan", scan(3000, 3)), ("cube", cube(12)), ("annulus", annulus(40, 6))] {
        let options = RemeshOptions { scheme: Scheme::Butterfly, ..within(0.002) };
        let remeshed = run(&mesh, &options).unwrap();
        assert!(remeshed.comparison.rms() <= 0.002 * remeshed.comparison.diagonal, "{name}");
        check_levels(name, &mesh, &remeshed, "butterfly");
    }
}

#[test]
fn goals_out_of_range_or_reach_are_refused() {
    let mesh = scan(300, 1);
    for goal in [0.0, -1.0, f64::NAN] {
        assert!(matches!(run(&mesh, &within(goal)), Err(Error::Parameter(_))));
    }
    let tight = RemeshOptions { max_faces: Some(500), ..within(1e-6) };
    assert!(matches!(run(&mesh, &tight), Err(Error::Parameter(_))));
    let huge = RemeshOptions { max_faces: Some(usize::MAX), ..within(0.01) };
    assert!(matches!(run(&mesh, &huge), Err(Error::Limit { .. })));
    let point = Mesh { positions: vec![[1.0; 3]; 3], faces: vec![[0, 1, 2]] };
    assert!(matches!(run(&point, &within(0.01)), Err(Error::Mesh { .. })));
}

/// Two meshes of the folder that `TERCET_CORPUS` names, one with creases and one with ears; the
/// bench's table `remesh` has more and takes minutes.
#[test]
fn the_corpus_is_remeshed_within_half_a_thousandth() {
    let Some(folder) = std::env::var_os("TERCET_CORPUS") else { return };
    for file in ["spot.obj", "fandisk.obj"] {
        let path = Path::new(&folder).join(file);
        let Ok(bytes) = std::fs::read(&path) else { continue };
        let format = io::Format::from_path(&path).unwrap();
        let mesh = io::read(&bytes, format, &Limits::default()).unwrap().mesh;
        let remeshed = run(&mesh, &within(0.0005)).unwrap();
        assert!(remeshed.comparison.rms() <= 0.0005 * remeshed.comparison.diagonal, "{file}");
        check(file, &mesh, &remeshed);
    }
}
