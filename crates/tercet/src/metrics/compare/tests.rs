use super::*;
use crate::shapes;

const SOME: MetricsOptions = MetricsOptions { samples: 20_000, seed: 7 };

fn measure(a: &Mesh, b: &Mesh) -> Comparison {
    compare(a, b, &SOME).unwrap()
}

/// A square of side 1 at a height, cut in two.
fn square(height: f32) -> Mesh {
    let positions = [[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]].map(|[x, y]| [x, y, height]).to_vec();
    Mesh { positions, faces: vec![[0, 1, 2], [0, 2, 3]] }
}

fn moved(mesh: &Mesh, by: impl Fn([f32; 3]) -> [f32; 3]) -> Mesh {
    Mesh { positions: mesh.positions.iter().map(|&p| by(p)).collect(), faces: mesh.faces.clone() }
}

fn near(found: f64, expected: f64, part: f64) {
    assert!((found - expected).abs() <= part * expected, "{found}, not {expected}");
}

#[test]
fn a_surface_has_no_distance_from_itself_whatever_its_triangles() {
    for mesh in [shapes::scan(500, 1), shapes::soup(300, 1), shapes::torus(30, 20), square(0.1)] {
        let same = measure(&mesh, &shapes::shuffled(&mesh, 3));
        assert_eq!([same.rms(), same.mean(), same.hausdorff(), same.hausdorff_at_most()], [0.0; 4]);
        assert_eq!(same.psnr(), f64::INFINITY);
    }
}

#[test]
fn parallel_squares_are_everywhere_as_far_apart_as_their_planes() {
    let found = measure(&square(0.0), &square(0.25));
    for side in [found.a_to_b, found.b_to_a] {
        assert_eq!([side.mean, side.max, side.max_at_most], [0.25; 3]);
        near(side.rms, 0.25, 1e-12);
    }
    near(found.diagonal, 2f64.sqrt(), 1e-12);
    near(found.psnr(), 20.0 * (2f64.sqrt() / 0.25).log10(), 1e-12);
    assert_eq!((found.a.area, found.b.area), (1.0, 1.0));
}

#[test]
fn a_tilted_square_deviates_linearly() {
    // z = x/2 over the unit square, and the plane z = 0 far beyond it: distances x/2.
    let tilted = moved(&square(0.0), |[x, y, _]| [x, y, x / 2.0]);
    let plane = moved(&square(0.0), |[x, y, z]| [20.0 * x - 10.0, 20.0 * y - 10.0, z]);
    let found = measure(&tilted, &plane).a_to_b;
    near(found.mean, 0.25, 2e-3);
    near(found.rms, (1.0 / 12.0f64).sqrt(), 2e-3);
    assert_eq!([found.max, found.max_at_most], [0.5; 2]);
}

#[test]
fn a_small_square_is_near_a_large_one_but_not_the_reverse() {
    // The reverse distance is |p| beyond the small square, greatest at the corners: √2 · 9.5.
    let large = moved(&square(0.0), |[x, y, z]| [20.0 * x - 9.5, 20.0 * y - 9.5, z]);
    let found = measure(&square(0.0), &large);
    assert_eq!([found.a_to_b.rms, found.a_to_b.max_at_most], [0.0; 2]);
    near(found.b_to_a.max, 9.5 * 2f64.sqrt(), 1e-12);
    near(found.b_to_a.max_at_most, 9.5 * 2f64.sqrt(), 1e-3);
    assert_eq!(found.hausdorff(), found.b_to_a.max);
    assert_eq!(found.rms(), found.b_to_a.rms);
}

#[test]
fn spheres_of_two_radii_differ_by_the_difference() {
    let (inner, outer) = (shapes::sphere(5), moved(&shapes::sphere(5), |p| p.map(|x| 1.1 * x)));
    let found = measure(&inner, &outer);
    for side in [found.a_to_b, found.b_to_a] {
        near(side.mean, 0.1, 0.01);
        near(side.rms, 0.1, 0.01);
        near(side.max, 0.1, 0.01);
        assert!(side.max <= side.max_at_most && side.max_at_most <= 0.1 * 1.01, "{side:?}");
    }
}

#[test]
fn a_shift_bounds_the_distance_and_samples_agree_with_brute_force() {
    let mesh = shapes::scan(400, 2);
    let shifted = moved(&mesh, |[x, y, z]| [x + 0.0625, y, z]);
    let found = measure(&mesh, &shifted);
    assert!(found.hausdorff() <= 0.0625 + 1e-6 && found.hausdorff() > 0.05, "{found:?}");
    assert!(found.mean() < found.rms() && found.rms() < found.hausdorff());

    // A lattice of points on every face, weighted by area, each against every triangle.
    let (a, b) = (Measured::new(&mesh).unwrap(), Measured::new(&shifted).unwrap());
    let (mut sum, mut squares, mut weights) = (0.0, 0.0, 0.0);
    for t in 0..a.tree.len() {
        let [p, q, r] = a.tree.corners(t);
        let normal = super::super::distance::cross(sub(q, p), sub(r, p));
        let area = dot(normal, normal).sqrt();
        for [u, v] in [[1, 1], [4, 1], [1, 4], [2, 2]].map(|w| w.map(|w| f64::from(w) / 6.0)) {
            let at = std::array::from_fn(|k| p[k] + u * (q[k] - p[k]) + v * (r[k] - p[k]));
            let squared = (0..b.tree.len()).map(|t| b.tree.nearest_on(at, t).square);
            let square = squared.fold(f64::INFINITY, f64::min);
            sum += area * square.sqrt();
            squares += area * square;
            weights += area;
        }
    }
    near(found.a_to_b.mean, sum / weights, 0.01);
    near(found.a_to_b.rms, (squares / weights).sqrt(), 0.01);
}

#[test]
fn a_peak_between_the_vertices_is_bounded_and_found() {
    // A roof over the square: its ridge is above the square's middle, where no vertex of the square
    // lies; seen from the square, the roof is farthest along the middle line.
    let roof = Mesh {
        positions: vec![
            [0.0, 0.0, 0.0],
            [1.0, 0.0, 0.0],
            [1.0, 1.0, 0.0],
            [0.0, 1.0, 0.0],
            [0.5, 0.0, 0.5],
            [0.5, 1.0, 0.5],
        ],
        faces: vec![[0, 4, 5], [0, 5, 3], [4, 1, 2], [4, 2, 5]],
    };
    let found = measure(&square(0.0), &roof).a_to_b;
    // From (1/2, y, 0) to either side of the roof, which rises by one in one.
    let exact = 0.5 / 2f64.sqrt();
    assert!(found.max <= exact && exact <= found.max_at_most, "{found:?}");
    near(found.max, exact, 2e-3);
    near(found.max_at_most, exact, 2e-3);
}

#[test]
fn a_seed_repeats_and_samples_converge() {
    let (a, b) = (shapes::scan(400, 2), shapes::scan(350, 2));
    let at = |samples, seed| compare(&a, &b, &MetricsOptions { samples, seed }).unwrap();
    assert_eq!(at(1000, 1), at(1000, 1));
    assert_ne!(at(1000, 1).rms(), at(1000, 2).rms());
    near(at(100_000, 1).rms(), at(100_000, 2).rms(), 2e-3);
    near(at(100_000, 1).mean(), at(100_000, 2).mean(), 2e-3);
}

#[test]
fn what_is_no_surface_is_said() {
    let whole = square(0.0);
    let cause = |a: &Mesh, b: &Mesh| compare(a, b, &SOME).unwrap_err().to_string();
    assert_eq!(
        cause(&Mesh::default(), &whole),
        "mesh A, faces: there are none, so there is no surface to measure"
    );
    let needle = Mesh { faces: vec![[0, 1, 0]], ..whole.clone() };
    assert!(cause(&whole, &needle).starts_with("mesh B, faces: none has an area"));
    let wild = Mesh { faces: vec![[0, 1, 9]], ..whole.clone() };
    assert!(cause(&whole, &wild).starts_with("mesh B, face 0: index 9"));
    let none = MetricsOptions { samples: 0, seed: 0 };
    assert!(matches!(compare(&whole, &whole, &none), Err(Error::Parameter(_))));
}

#[test]
fn loose_vertices_do_not_count_and_needles_count_as_segments() {
    let mut other = square(0.0);
    other.positions.extend([[50.0; 3], [0.5, 0.5, 3.0]]);
    other.faces.push([0, 5, 5]);
    let found = measure(&square(0.0), &other);
    assert_eq!((found.b.unreferenced, found.b.degenerate, found.a.degenerate), (1, 1, 0));
    assert_eq!((found.a_to_b.max, found.b_to_a.rms), (0.0, 0.0));
    // The needle's tip is a point of B.
    assert_eq!(found.b_to_a.max, 3.0);
    near(measure(&other, &square(0.0)).diagonal, (1.0f64 + 1.0 + 9.0).sqrt(), 1e-12);
}
