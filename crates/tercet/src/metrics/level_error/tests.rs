use super::*;
use crate::mesh::{Cut, cut, refined_grid};
use crate::subdivide::shapes::{self, Random, generation};
use crate::subdivide::{Update, subdivide_surface};
use crate::{EncodeOptions, LevelScheme, encode};

/// A grid of n × n quads on the graph of `height`, its faces split at random for some rounds.
fn graph(n: u32, rounds: u32, height: impl Fn(f32, f32) -> f32) -> Mesh {
    let mut random = Random::new(5);
    let at = |x: f32, y: f32| [x, y, height(x, y)];
    let mut mesh = Mesh::default();
    for i in 0..=n {
        mesh.positions.extend((0..=n).map(|j| at(i as f32, j as f32)));
    }
    for i in 0..n {
        for j in 0..n {
            let [a, b, c, d] = [(i, j), (i + 1, j), (i + 1, j + 1), (i, j + 1)].map(|(i, j)| i * (n + 1) + j);
            mesh.faces.extend([[a, b, c], [a, c, d]]);
        }
    }
    for _ in 0..rounds {
        for f in 0..mesh.faces.len() {
            let [a, b, c] = mesh.faces[f];
            if random.below(3) == 0 {
                let v = mesh.positions.len() as u32;
                let p = [a, b, c].map(|v| mesh.positions[v as usize]);
                let mean = |k: usize| (p[0][k] + p[1][k] + p[2][k]) / 3.0;
                mesh.positions.push(at(mean(0), mean(1)));
                mesh.faces[f] = [a, b, v];
                mesh.faces.extend([[b, c, v], [c, a, v]]);
            }
        }
    }
    mesh
}

fn bumps(x: f32, y: f32) -> f32 {
    2.0 * (0.7 * x).sin() * (0.5 * y).cos() + 0.3 * (2.9 * x + 1.7 * y).sin()
}

/// The error of each level, finest first.
fn errors_of(mesh: &Mesh, options: &EncodeOptions) -> Vec<f32> {
    let mut levels = encode(mesh, options).unwrap().info.levels;
    levels.reverse();
    levels.into_iter().map(|level| level.error).collect()
}

#[test]
fn a_plane_has_no_error_away_from_its_outline() {
    let mesh = graph(12, 2, |_, _| 0.0);
    let inside = |p: Vector| (4.0..8.0).contains(&p[0]) && (4.0..8.0).contains(&p[1]);
    let errors = both_errors(&mesh, Update::None, inside);
    assert!(errors.len() > 4);
    assert!(errors.iter().all(|&(e, _)| e < 1e-9), "{errors:?}");
}

#[test]
fn meshes_without_extent_have_no_error() {
    let triangle = |p: [[f32; 3]; 3]| Mesh { positions: p.to_vec(), faces: vec![[0, 1, 2]] };
    for mesh in [
        Mesh::default(),
        Mesh { positions: vec![[1.0, 2.0, 3.0]], faces: Vec::new() },
        triangle([[7.0; 3]; 3]),
        triangle([[0.0; 3], [1.0, 0.0, 0.0], [0.5, 0.0, 0.0]]),
    ] {
        for bits in [None, Some(8)] {
            let errors = errors_of(&mesh, &EncodeOptions { bits, ..Default::default() });
            assert!(errors.iter().all(|&e| e < 2e-3 && (bits.is_some() || e == 0.0)), "{errors:?}");
        }
    }
}

#[test]
fn the_error_of_a_sphere_falls_by_nearly_three_a_step() {
    let ring = |k: f64, z: f64| {
        let (sin, cos) = (k * std::f64::consts::PI / 5.0).sin_cos();
        [cos, sin, z]
    };
    let mut surface = shapes::icosahedron();
    let mut positions: Vec<Vector> = (0..5).map(|i| ring(2.0 * f64::from(i), 0.5)).collect();
    positions.extend((0..5).map(|i| ring(2.0 * f64::from(i) + 1.0, -0.5)));
    positions.extend([[0.0, 0.0, 1.0], [0.0, 0.0, -1.0]]);
    let onto_sphere = |p: &mut Vector| *p = p.map(|x| x / dot(*p, *p).sqrt());
    for step in 0..6 {
        (surface, positions) = subdivide_surface(&surface, &positions, generation(step))
            .unwrap_or_else(|| subdivide_surface(&surface, &positions, generation(0)).unwrap());
        positions.iter_mut().for_each(onto_sphere);
    }
    let mesh = Mesh {
        positions: positions.iter().map(|p| p.map(|x| x as f32)).collect(),
        faces: (0..surface.faces()).map(|f| surface.face(f)).collect(),
    };
    let errors = errors_of(&mesh, &EncodeOptions::default());
    // The finest level lies on a lattice, which the exactness section refines.
    assert!(errors[0] < 1e-4, "{errors:?}");
    for pair in errors[1..6].windows(2) {
        let ratio = pair[1] / pair[0];
        assert!((1.8..3.5).contains(&ratio), "{ratio} in {errors:?}");
    }
}

#[test]
fn the_finest_level_shows_the_rounding_to_the_lattice() {
    let mesh = graph(24, 0, |x, y| 3.0 * bumps(x, y));
    let errors = errors_of(&mesh, &EncodeOptions { bits: Some(10), ..Default::default() });
    // Rounding moves a point by step/√12 across a surface that is anything but rough.
    let (low, high) = bounds(&mesh);
    let longest = (0..3).map(|k| high[k] - low[k]).fold(0.0, f32::max);
    let expected = f64::from(longest) / 1023.0 / 12f64.sqrt() / diagonal(&mesh);
    let ratio = f64::from(errors[0]) / expected;
    assert!((0.7..1.3).contains(&ratio), "{ratio}");
    assert!(errors[1..].iter().all(|&e| e > errors[0]), "{errors:?}");
}

/// The error of each level at vertices that `counts`, as measured and with every face looked at.
fn both_errors(mesh: &Mesh, rule: Update, counts: impl Fn(Vector) -> bool) -> Vec<(f64, f64)> {
    let precision = refined_grid(mesh);
    let lattice = Lattice::new(&precision);
    let Cut { surface, vertex_source, .. } = cut(mesh);
    let mut positions = vec![[0; 3]; surface.virtuals as usize];
    positions.extend(vertex_source.iter().map(|&v| lattice.quantise(mesh.positions[v as usize])));
    let mut measured = LevelErrors::new(mesh, &surface, &vertex_source, &lattice);
    measured.samples.retain(|s| counts(s.position));
    let points: Vec<Vector> = measured.samples.iter().map(|s| s.position).collect();
    let mut exact = Vec::new();
    Hierarchy::build(surface, positions, LevelScheme::Auto, rule, |reached| {
        measured.measure(reached);
        let surface = reached.surface(reached.steps.len());
        surface.validate().unwrap();
        let shape = Shape { surface, positions: reached.positions.last().unwrap(), lattice: &lattice };
        let nearest = |p: Vector| {
            let faces = (0..surface.faces()).filter(|&f| !surface.is_virtual_face(f));
            faces.map(|f| shape.nearest(p, f).square).fold(f64::INFINITY, f64::min)
        };
        let sum: f64 = points.iter().map(|&p| nearest(p)).sum();
        exact.push((sum / points.len() as f64).sqrt() / diagonal(mesh));
    });
    (0..exact.len()).map(|level| f64::from(measured.of(level))).zip(exact).collect()
}

/// The mesh of `surface`, whose real vertex i lies `at(i)`, refined by these steps, with noise.
fn refined(surface: &Surface, at: impl Fn(u32) -> [f64; 2], steps: &[StepKind]) -> Mesh {
    let mut random = Random::new(9);
    let mut noisy = |x: f64| x + f64::from(random.below(1000)) / 3000.0;
    let mut positions = vec![[0.0; 3]; surface.virtuals as usize];
    positions.extend((0..surface.vertices - surface.virtuals).map(|v| {
        let [x, y] = at(v);
        [x, y, 0.0].map(&mut noisy)
    }));
    let mut surface = surface.clone();
    for &kind in steps {
        (surface, positions) = subdivide_surface(&surface, &positions, kind).unwrap();
    }
    let virtuals = surface.virtuals;
    let real = |f: &u32| !surface.is_virtual_face(*f);
    Mesh {
        positions: positions[virtuals as usize..]
            .iter()
            .map(|p| p.map(|x| (x + noisy(0.0) / 99.0) as f32))
            .collect(),
        faces: (0..surface.faces()).filter(real).map(|f| surface.face(f).map(|v| v - virtuals)).collect(),
    }
}

fn disk() -> (Surface, impl Fn(u32) -> [f64; 2]) {
    (shapes::disk(4), |v| [f64::from(v / 5), f64::from(v % 5)])
}

fn annulus() -> (Surface, impl Fn(u32) -> [f64; 2]) {
    let at = |v: u32| {
        let (sin, cos) = (f64::from(v / 3) * std::f64::consts::PI / 4.0).sin_cos();
        let radius = f64::from(v % 3 + 1);
        [cos * radius, sin * radius]
    };
    (shapes::annulus(8), at)
}

fn assert_close(name: &str, mesh: &Mesh, rule: Update, factor: f64) {
    let errors = both_errors(mesh, rule, |_| true);
    assert!(errors.len() > 2, "{name}");
    for &(measured, exact) in &errors {
        assert!(measured >= exact * (1.0 - 1e-6), "{name}: {errors:?}");
        assert!(measured <= exact * factor + 1e-9, "{name}, {rule:?}: {errors:?}");
    }
}

#[test]
fn walking_from_level_to_level_finds_nearly_the_nearest_faces() {
    assert_close("graph", &graph(12, 2, bumps), Update::None, 1.2);
    for steps in [[0, 1, 2].map(generation), [StepKind::Butterfly; 3]] {
        for rule in [Update::None, Update::Third, Update::Paper] {
            let (surface, at) = disk();
            assert_close("disk", &refined(&surface, at, &steps), rule, 1.2);
            let (surface, at) = annulus();
            assert_close("annulus", &refined(&surface, at, &steps), rule, 1.2);
        }
    }
}

#[test]
fn every_fine_face_has_a_coarse_one_in_its_place() {
    let mut meshes = vec![graph(9, 2, bumps)];
    for (_, surface) in shapes::all() {
        for steps in [[0, 1].map(generation), [StepKind::Butterfly; 2]] {
            meshes.push(refined(&surface, |v| [v.into(), 0.0], &steps));
        }
    }
    for mesh in meshes {
        let Cut { surface, vertex_source, .. } = cut(&mesh);
        let lattice = Lattice::new(&refined_grid(&mesh));
        let mut positions = vec![[0; 3]; surface.virtuals as usize];
        positions.extend(vertex_source.iter().map(|&v| lattice.quantise(mesh.positions[v as usize])));
        Hierarchy::build(surface, positions, LevelScheme::Auto, Update::None, |reached| {
            let Some(step) = reached.steps.last() else { return };
            let fine = reached.surface(reached.steps.len() - 1);
            let heirs = Heirs::new(fine, step);
            for f in 0..fine.faces() {
                assert!(heirs.of(f) < step.coarse.faces(), "{:?}", step.kind);
            }
        });
    }
}

#[test]
fn the_decoders_surface_has_the_same_error_whatever_its_numbers() {
    let mesh = graph(20, 2, bumps);
    let Cut { surface, vertex_source, .. } = cut(&mesh);
    let lattice = Lattice::new(&crate::mesh::box_lattice(&mesh, 16));
    let mut points = vec![[0; 3]; surface.virtuals as usize];
    points.extend(vertex_source.iter().map(|&v| lattice.quantise(mesh.positions[v as usize])));
    let mut errors = LevelErrors::new(&mesh, &surface, &vertex_source, &lattice);
    let hierarchy = crate::reverse::Hierarchy::build(
        surface.clone(),
        points.clone(),
        LevelScheme::default(),
        Update::None,
        |reached| errors.measure(reached),
    );
    assert!(hierarchy.steps.len() > 2);
    // Faces from the last to the first, each turned by one corner.
    let faces = surface.faces();
    let corner = |c: u32| 3 * (faces - 1 - c / 3) + (c + 2) % 3;
    let mut decoders = surface.clone();
    let mut map = vec![0; faces as usize];
    for c in 0..3 * faces {
        decoders.vertex[corner(c) as usize] = surface.at(c);
        decoders.opposite[corner(c) as usize] = corner(surface.across(c));
        if corner(c) % 3 == 0 {
            map[(corner(c) / 3) as usize] = c;
        }
    }
    let nearest = errors.nearest_on_decoders(0, &map);
    let error = errors.estimated(&nearest, &decoders, &points);
    assert!((error - errors.of(0)).abs() <= 1e-6 * errors.of(0), "{error} {}", errors.of(0));
    points.iter_mut().for_each(|p| p[2] += 400);
    assert!(errors.estimated(&nearest, &decoders, &points) > 10.0 * errors.of(0));
}
