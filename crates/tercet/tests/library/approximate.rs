//! Lossy files keep to their bounds, measured on what they decode to.
#![cfg(feature = "remesh")]

use tercet::approximate::{Approximated, Bound, Method, approximate};
use tercet::metrics::{MetricsOptions, compare};
use tercet::shapes::{annulus, icosahedron, join, noisy, scan, soup, sphere, torus};
use tercet::{EncodeOptions, Error, Limits, Mesh, decode};

fn run(mesh: &Mesh, bound: Bound) -> tercet::Result<Approximated> {
    approximate(mesh, bound, &EncodeOptions::default(), &Limits::default(), &mut |_| {})
}

/// The distance of the decoded file from the mesh, as a part of the diagonal.
fn distance(mesh: &Mesh, file: &[u8]) -> f64 {
    let found =
        compare(mesh, &decode(file, &Limits::default()).unwrap(), &MetricsOptions::default()).unwrap();
    found.rms() / found.diagonal
}

#[test]
fn the_error_asked_for_is_kept_on_shapes_of_all_kinds() {
    for (name, mesh, error) in [
        ("scan", scan(2500, 1), 1e-2),
        ("scan", scan(2500, 1), 5e-4),
        ("sphere", sphere(4), 5e-4),
        ("torus", noisy(&torus(50, 30), 0.002, 1), 2e-3),
        ("boundaries", annulus(60, 8), 5e-3),
        ("soup", soup(60, 3), 1e-2),
        ("parts", join(&[scan(800, 2), torus(12, 9)]), 2e-3),
        ("tiny", icosahedron(), 5e-4),
    ] {
        let found = run(&mesh, Bound::MaxError(error)).unwrap();
        let measured = distance(&mesh, &found.encoded.bytes);
        assert!(measured <= error, "{name}: {measured} > {error}");
        let told = found.encoded.info.approximation.map_or(0.0, |of| f64::from(of.rms));
        assert!(told >= measured && told <= 1.01 * measured, "{name}: {told}, {measured}");
    }
}

#[test]
fn a_size_is_kept_and_more_bytes_are_no_worse() {
    let mesh = scan(3000, 3);
    let mut before = f64::INFINITY;
    for bytes in [800, 4000] {
        let found = run(&mesh, Bound::MaxBytes(bytes)).unwrap();
        assert!(found.encoded.bytes.len() as u64 <= bytes);
        let measured = distance(&mesh, &found.encoded.bytes);
        assert!(measured < before, "{bytes} bytes: {measured} after {before}");
        before = measured;
    }
}

#[test]
fn the_file_says_of_what_it_is_an_approximation() {
    let mesh = scan(1000, 4);
    let found = run(&mesh, Bound::MaxError(0.002)).unwrap();
    let told = found.encoded.info.approximation.unwrap();
    assert_eq!([told.vertices as usize, told.faces as usize], [mesh.positions.len(), mesh.faces.len()]);
    assert_eq!(told.digest, mesh.digest());
    assert!(f64::from(told.greatest) * found.comparison.diagonal >= found.comparison.hausdorff());
    let levels = &found.encoded.info.levels;
    assert!(levels.iter().all(|level| level.error >= told.rms), "errors are those from the source");
}

#[test]
fn a_smooth_surface_is_remeshed_and_a_defective_one_simplified() {
    let found = run(&scan(8000, 5), Bound::MaxError(0.001)).unwrap();
    assert!(matches!(found.method, Method::Remeshed(..)), "{:?}", found.method);
    assert_eq!(found.not_remeshed, None);
    let mut book = scan(3000, 6);
    let [a, b, _] = book.faces[0];
    book.positions.push([0.0; 3]);
    book.faces.push([a, b, book.positions.len() as u32 - 1]);
    let found = run(&book, Bound::MaxError(0.001)).unwrap();
    assert!(found.not_remeshed.unwrap().contains("not a manifold"));
    assert_eq!(found.method, Method::Simplified);
}

#[test]
fn what_no_lattice_reaches_is_coded_exactly_and_without_a_mark() {
    let mesh = scan(100, 7);
    let found = run(&mesh, Bound::MaxError(1e-12)).unwrap();
    assert_eq!(found.method, Method::Exact);
    assert_eq!(found.encoded.info.approximation, None);
    assert_eq!(distance(&mesh, &found.encoded.bytes), 0.0);
    assert_eq!(run(&mesh, Bound::MaxBytes(100_000)).unwrap().method, Method::Exact);
}

#[test]
fn bounds_that_cannot_be_kept_are_refused() {
    let mesh = scan(200, 8);
    for bound in [Bound::MaxBytes(20), Bound::MaxBytes(0), Bound::MaxError(0.0), Bound::MaxError(f64::NAN)] {
        assert!(matches!(run(&mesh, bound), Err(Error::Parameter(_))), "{bound:?}");
    }
    let flat = Mesh { positions: vec![[0.0; 3]; 3], faces: vec![[0, 1, 2]] };
    for mesh in [Mesh::default(), flat] {
        assert!(matches!(run(&mesh, Bound::MaxError(0.1)), Err(Error::Mesh { .. })));
    }
    let options = EncodeOptions { keep_order: true, ..EncodeOptions::default() };
    let bound = Bound::MaxError(0.1);
    let refused = approximate(&mesh, bound, &options, &Limits::default(), &mut |_| {});
    assert!(matches!(refused, Err(Error::Parameter(_))));
}
