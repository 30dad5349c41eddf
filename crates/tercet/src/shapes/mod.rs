//! Generated meshes for demonstrations, tests and measurements.
//!
//! Every function gives the same bits on every platform: coordinates come from `+ − · / √`
//! alone, and circles from the rational parametrisation ((1 − t²)/(1 + t²), 2t/(1 + t²)).
//! All take linear time.

mod geodesic;
mod random;
mod scan;

pub(crate) use random::Random;
pub use scan::scan;

use crate::Mesh;
use geodesic::geodesic;

/// The regular icosahedron in the unit sphere: 12 vertices of valence 5, 20 faces.
pub fn icosahedron() -> Mesh {
    sphere(0)
}

/// An icosahedron whose faces were quartered `subdivisions` times, on the unit sphere:
/// 10 · 4^`subdivisions` + 2 vertices. At most 12 subdivisions are made.
pub fn sphere(subdivisions: u32) -> Mesh {
    let (points, faces) = geodesic(1 << subdivisions.min(12));
    Mesh { positions: points.iter().map(|p| p.map(|x| x as f32)).collect(), faces }
}

/// A torus of `around` times `across` squares, each cut in two, with a tube 0.4 times as
/// thick as the ring is wide. Every vertex has valence 6. Counts below 3 are raised to 3.
pub fn torus(around: usize, across: usize) -> Mesh {
    let (n, m) = (around.max(3), across.max(3));
    let mut positions = Vec::with_capacity(n * m);
    for i in 0..n {
        let (cos_u, sin_u) = circle(i, n);
        for j in 0..m {
            let (cos_v, sin_v) = circle(j, m);
            let radius = 1.0 + 0.4 * cos_v;
            positions.push([radius * cos_u, radius * sin_u, 0.4 * sin_v].map(|x| x as f32));
        }
    }
    let index = |i: usize, j: usize| ((i % n) * m + j % m) as u32;
    Mesh { positions, faces: squares(n, m, index) }
}

/// An open saddle of `columns` times `rows` squares, each cut in two, with one boundary.
pub fn grid(columns: usize, rows: usize) -> Mesh {
    let (n, m) = (columns.max(1), rows.max(1));
    let mut positions = Vec::with_capacity((n + 1) * (m + 1));
    for j in 0..=m {
        for i in 0..=n {
            let (x, y) = (i as f64, j as f64);
            positions.push([x, y, (x * x - y * y) / (2 * (n + m)) as f64].map(|x| x as f32));
        }
    }
    Mesh { positions, faces: squares(n, m, |i, j| (j * (n + 1) + i) as u32) }
}

/// An open flat ring of `around` times `across` squares, each cut in two, with two boundaries.
/// Counts below 3 around and 1 across are raised to these.
pub fn annulus(around: usize, across: usize) -> Mesh {
    let (n, m) = (around.max(3), across.max(1));
    let mut positions = Vec::with_capacity(n * (m + 1));
    for i in 0..n {
        let (cos, sin) = circle(i, n);
        for j in 0..=m {
            // Outside first: counter-clockwise seen from above.
            let radius = 1.0 - 0.5 * j as f64 / m as f64;
            positions.push([radius * cos, radius * sin, 0.0].map(|x| x as f32));
        }
    }
    Mesh { positions, faces: squares(n, m, |i, j| ((i % n) * (m + 1) + j) as u32) }
}

/// The given meshes as one, in their order; they keep their vertices for themselves.
pub fn join(parts: &[Mesh]) -> Mesh {
    let mut whole = Mesh::default();
    for part in parts {
        let first = whole.positions.len() as u32;
        whole.positions.extend_from_slice(&part.positions);
        whole.faces.extend(part.faces.iter().map(|f| f.map(|v| v + first)));
    }
    whole
}

/// The same mesh with its vertices and faces in random order and random first corners.
pub fn shuffled(mesh: &Mesh, seed: u64) -> Mesh {
    let mut random = Random::new(seed);
    let mut order: Vec<u32> = (0..mesh.positions.len() as u32).collect();
    random.shuffle(&mut order);
    let mut number = vec![0; order.len()];
    for (new, &old) in order.iter().enumerate() {
        number[old as usize] = new as u32;
    }
    let positions = order.iter().map(|&old| mesh.positions[old as usize]).collect();
    let mut faces: Vec<[u32; 3]> = mesh.faces.iter().map(|f| f.map(|v| number[v as usize])).collect();
    random.shuffle(&mut faces);
    for f in &mut faces {
        f.rotate_left(random.below(3));
    }
    Mesh { positions, faces }
}

/// The same mesh with every coordinate moved by up to `amplitude` times the diagonal of the
/// bounding box.
pub fn noisy(mesh: &Mesh, amplitude: f64, seed: u64) -> Mesh {
    let mut random = Random::new(seed);
    let mut square = 0.0;
    for axis in 0..3 {
        let along = || mesh.positions.iter().map(|p| f64::from(p[axis]));
        let side = along().fold(f64::MIN, f64::max) - along().fold(f64::MAX, f64::min);
        square += side.max(0.0) * side.max(0.0);
    }
    let reach = amplitude * square.sqrt();
    let positions =
        mesh.positions.iter().map(|p| p.map(|x| (f64::from(x) + reach * random.signed()) as f32)).collect();
    Mesh { positions, faces: mesh.faces.clone() }
}

/// A mesh that breaks every rule of a surface: edges of many faces, faces of either
/// orientation, repeated and degenerate faces, coincident and unreferenced vertices, −0.
pub fn soup(faces: usize, seed: u64) -> Mesh {
    let mut random = Random::new(seed);
    let vertices = faces / 2 + 4;
    let mut mesh = Mesh::default();
    for v in 0..vertices {
        let position = match random.below(12) {
            0 if v > 0 => mesh.positions[random.below(v)],
            1 => [-0.0, random.signed() as f32, 0.0],
            _ => std::array::from_fn(|_| (random.signed() * 4.0) as f32),
        };
        mesh.positions.push(position);
    }
    for f in 0..faces {
        // Vertices of near numbers, so that faces share edges.
        let first = random.below(vertices);
        let mut near = || ((first + random.below(5)) % vertices) as u32;
        let mut face = [near(), near(), near()];
        match random.below(10) {
            0 if f > 0 => face = mesh.faces[random.below(f)],
            1 if f > 0 => {
                let [a, b, c] = mesh.faces[random.below(f)];
                face = [b, a, c];
            }
            _ => {}
        }
        mesh.faces.push(face);
    }
    mesh
}

/// Point `i` of `n` on the unit circle, nearly evenly spaced, as (cosine, sine).
fn circle(i: usize, n: usize) -> (f64, f64) {
    let quarter = 4 * (i % n) / n;
    let x = (4 * (i % n) - quarter * n) as f64 / n as f64;
    // Near tan(x π/4), which would make the spacing even; exact at both ends of the quarter.
    let t = x * (1.0 - 0.2146 * (1.0 - x * x));
    let (cos, sin) = ((1.0 - t * t) / (1.0 + t * t), 2.0 * t / (1.0 + t * t));
    match quarter {
        0 => (cos, sin),
        1 => (-sin, cos),
        2 => (-cos, -sin),
        _ => (sin, -cos),
    }
}

/// Two faces for each of `n` · `m` squares with corners `index(i, j)`, 0 ≤ i ≤ n, 0 ≤ j ≤ m.
fn squares(n: usize, m: usize, index: impl Fn(usize, usize) -> u32) -> Vec<[u32; 3]> {
    let mut faces = Vec::with_capacity(2 * n * m);
    for i in 0..n {
        for j in 0..m {
            let [a, b] = [index(i, j), index(i + 1, j)];
            let [c, d] = [index(i + 1, j + 1), index(i, j + 1)];
            faces.extend([[a, b, c], [a, c, d]]);
        }
    }
    faces
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::{Cut, cut};
    use std::collections::BTreeSet;

    /// The surface of a mesh that needs no cutting, and its Euler characteristic.
    fn surface(mesh: &Mesh) -> (Cut, i64) {
        mesh.check().unwrap();
        let cut = cut(mesh);
        cut.surface.validate().unwrap();
        assert_eq!(cut.vertex_source.len(), mesh.positions.len());
        assert!(cut.degenerate.is_empty() && cut.loose.is_empty());
        let (v, f) = (i64::from(cut.surface.vertices), i64::from(cut.surface.faces()));
        (cut, v - f / 2)
    }

    /// Six times the signed volume; positive if faces are counter-clockwise seen from outside.
    fn volume(mesh: &Mesh) -> f64 {
        let at = |v: u32| mesh.positions[v as usize].map(f64::from);
        let product = |f: &[u32; 3]| {
            let ([a, b, c], [d, e, g], [h, i, j]) = (at(f[0]), at(f[1]), at(f[2]));
            a * (e * j - g * i) + b * (g * h - d * j) + c * (d * i - e * h)
        };
        mesh.faces.iter().map(product).sum()
    }

    fn distinct(mesh: &Mesh) -> usize {
        mesh.positions.iter().map(|p| p.map(f32::to_bits)).collect::<BTreeSet<_>>().len()
    }

    #[test]
    fn spheres_are_closed_regular_outside_twelve_vertices_and_on_the_unit_sphere() {
        for subdivisions in 0..4 {
            let mesh = sphere(subdivisions);
            let (cut, euler) = surface(&mesh);
            assert_eq!((euler, cut.surface.virtuals), (2, 0));
            assert_eq!(mesh.positions.len(), 10 * 4usize.pow(subdivisions) + 2);
            let valences = cut.surface.valences();
            assert_eq!(valences.iter().filter(|&&n| n == 5).count(), 12);
            assert!(valences.iter().all(|&n| n == 5 || n == 6));
            let length = |p: &[f32; 3]| p.iter().map(|x| x * x).sum::<f32>().sqrt();
            assert!(mesh.positions.iter().all(|p| (length(p) - 1.0).abs() < 1e-6));
            assert!(volume(&mesh) > 15.0);
            assert_eq!(distinct(&mesh), mesh.positions.len());
        }
    }

    #[test]
    fn a_torus_is_regular_and_closed() {
        for (n, m) in [(3, 3), (4, 7), (9, 5)] {
            let mesh = torus(n, m);
            let (cut, euler) = surface(&mesh);
            assert_eq!((euler, cut.surface.virtuals), (0, 0));
            assert!(cut.surface.valences().iter().all(|&n| n == 6));
            assert!(volume(&mesh) > 0.0);
            assert_eq!(distinct(&mesh), n * m);
        }
        assert_eq!(torus(0, 1), torus(3, 3));
    }

    #[test]
    fn circles_are_round_and_nearly_evenly_spaced() {
        for n in 3..40 {
            let points: Vec<_> = (0..=n).map(|i| circle(i, n)).collect();
            assert!(points.iter().all(|(x, y)| (x * x + y * y - 1.0).abs() < 1e-15));
            let even = 2.0 * (std::f64::consts::PI / n as f64).sin();
            for pair in points.windows(2) {
                let chord = (pair[0].0 - pair[1].0).hypot(pair[0].1 - pair[1].1);
                assert!((0.9..1.1).contains(&(chord / even)), "{n}: {}", chord / even);
            }
        }
    }

    #[test]
    fn open_shapes_have_the_boundaries_they_claim() {
        let (cut, euler) = surface(&grid(5, 3));
        assert_eq!((cut.surface.virtuals, euler, cut.vertex_source.len()), (1, 2, 24));
        let ring = annulus(6, 2);
        let (cut, euler) = surface(&ring);
        assert_eq!((cut.surface.virtuals, euler, cut.vertex_source.len()), (2, 2, 18));
        for mesh in [grid(5, 3), ring] {
            for f in &mesh.faces {
                let [a, b, c] = f.map(|v| mesh.positions[v as usize]);
                let area = (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0]);
                assert!(area > 0.0, "a face is clockwise seen from above");
            }
        }
    }

    #[test]
    fn joining_adds_and_shuffling_keeps() {
        let parts = [icosahedron(), grid(2, 2), torus(3, 4)];
        let whole = join(&parts);
        assert_eq!(whole.positions.len(), 12 + 9 + 12);
        let (_, euler) = surface(&whole);
        assert_eq!(euler, 2 + 2);
        let other = shuffled(&whole, 7);
        assert_eq!(surface(&other).1, euler);
        assert_ne!(other, whole);
        assert_eq!(other, shuffled(&whole, 7));
        assert_ne!(other, shuffled(&whole, 8));
        let sorted = |mesh: &Mesh| {
            let mut p: Vec<_> = mesh.positions.iter().map(|p| p.map(f32::to_bits)).collect();
            p.sort_unstable();
            p
        };
        assert_eq!(sorted(&other), sorted(&whole));
    }

    #[test]
    fn noise_stays_within_its_amplitude() {
        let mesh = grid(30, 40);
        let other = noisy(&mesh, 0.01, 3);
        let moved: Vec<f32> =
            mesh.positions.iter().zip(&other.positions).map(|(p, q)| (p[0] - q[0]).abs()).collect();
        assert!(moved.iter().all(|&d| d < 0.55));
        assert!(moved.iter().any(|&d| d > 0.4));
        assert_eq!(noisy(&Mesh::default(), 0.5, 1), Mesh::default());
    }

    #[test]
    fn a_soup_has_every_defect_and_valid_indices() {
        let mesh = soup(400, 9);
        mesh.check().unwrap();
        assert_eq!(mesh.faces.len(), 400);
        let cut = cut(&mesh);
        assert!(!cut.degenerate.is_empty() && !cut.loose.is_empty());
        assert!(cut.vertex_source.len() > mesh.positions.len());
        assert!(distinct(&mesh) < mesh.positions.len());
        assert!(mesh.faces.iter().collect::<BTreeSet<_>>().len() < 400);
        assert!(mesh.positions.iter().any(|p| p[0] == 0.0 && p[0].is_sign_negative()));
        soup(0, 1).check().unwrap();
    }

    #[test]
    fn a_scan_is_a_closed_irregular_surface_of_the_size_asked_for() {
        for (vertices, seed) in [(12, 1), (13, 2), (57, 3), (500, 4), (5000, 5)] {
            let mesh = scan(vertices, seed);
            assert_eq!(mesh.positions.len(), vertices);
            let (cut, euler) = surface(&mesh);
            assert_eq!((euler, cut.surface.virtuals), (2, 0));
            assert!(volume(&mesh) > 0.0);
            assert_eq!(distinct(&mesh), vertices);
            if vertices >= 500 {
                let valences = cut.surface.valences();
                let regular = valences.iter().filter(|&&n| n == 6).count();
                assert!((32..92).contains(&(100 * regular / vertices)), "{regular} of {vertices}");
                assert!(valences.iter().all(|&n| n >= 3));
            }
        }
        assert_eq!(scan(0, 1).positions.len(), 12);
        assert_eq!(scan(300, 6), scan(300, 6));
        assert_ne!(scan(300, 6), scan(300, 7));
    }

    #[test]
    fn generated_bits_are_the_same_everywhere() {
        let digest = |mesh: &Mesh| {
            let mut crc = crc32fast::Hasher::new();
            mesh.positions.as_flattened().iter().for_each(|x| crc.update(&x.to_le_bytes()));
            mesh.faces.as_flattened().iter().for_each(|v| crc.update(&v.to_le_bytes()));
            crc.finalize()
        };
        let meshes = [scan(1000, 1), sphere(3), torus(9, 7), soup(100, 1), shuffled(&grid(5, 5), 1)];
        let expected = [3873209170, 1769440828, 4049154589, 1745498783, 2952659412];
        assert_eq!(meshes.map(|mesh| digest(&mesh)), expected);
    }
}
