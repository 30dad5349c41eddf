//! Whole files: what comes back, and what the levels on the way are.

use crate::common::{holed, levels, meshes, options};
use proptest::prelude::*;
use tercet::shapes::{annulus, grid, join, noisy, scan, shuffled, soup, sphere, torus};
use tercet::verify::{Sameness, compare, quantised};
use tercet::{
    Effort, EncodeOptions, Level, LevelScheme, Limits, Mesh, Progressive, Scheme, Update, encode, subdivide,
};

/// Encodes, decodes, and checks everything that holds of any mesh.
fn check(mesh: &Mesh, options: &EncodeOptions) -> Result<(), String> {
    let file = encode(mesh, options).map_err(|e| e.to_string())?;
    let levels = levels(&file.bytes);
    let restored = levels.last().filter(|l| l.restored).ok_or("not restored")?;
    let same = compare(&quantised(mesh, &file.info.precision), &restored.mesh);
    match same {
        Sameness::Identical => {}
        Sameness::Renumbered if !options.keep_order => {}
        other => return Err(format!("{other:?}")),
    }
    let info = &file.info;
    if [info.vertices, info.faces] != [mesh.positions.len(), mesh.faces.len()].map(|n| n as u32) {
        return Err("counts of the original".into());
    }
    let finest = &info.levels[info.levels.len() - 1];
    if [finest.vertices, finest.faces] != [info.vertices, info.faces] {
        return Err("the finest level is not stated as it is once restored".into());
    }
    for level in levels.iter().filter(|l| !l.restored) {
        let stated = &info.levels[level.level as usize];
        let found = [level.mesh.positions.len(), level.mesh.faces.len()].map(|n| n as u32);
        if level.level < finest.level && found != [stated.vertices, stated.faces] {
            return Err(format!("level {}: {found:?} differ from its index", level.level));
        }
        check_faces(&level.mesh).map_err(|e| format!("level {}: {e}", level.level))?;
    }
    if info.bytes != file.bytes.len() as u64 || info.levels.iter().any(|l| l.bytes > info.bytes) {
        return Err("byte ranges".into());
    }
    // Late levels move the vertices whose positions are still to come.
    let placed = |level: &&Level| info.levels[level.level as usize].kind != "late";
    let placed: Vec<Level> = levels.iter().filter(placed).cloned().collect();
    if options.update == Update::None { nest(&placed) } else { Ok(()) }
}

/// No level names a vertex twice in a face or one that it lacks.
fn check_faces(mesh: &Mesh) -> Result<(), String> {
    let wrong = mesh.faces.iter().find(|&&[a, b, c]| {
        a == b || b == c || c == a || [a, b, c].iter().any(|&v| v as usize >= mesh.positions.len())
    });
    wrong.map_or(Ok(()), |f| Err(format!("face {f:?}")))
}

/// Every vertex of a level is one of the next finer level, at the same place.
fn nest(levels: &[Level]) -> Result<(), String> {
    let sorted = |level: &Level| {
        let mut positions: Vec<_> = level.mesh.positions.iter().map(|p| p.map(f32::to_bits)).collect();
        positions.sort_unstable();
        positions
    };
    let surfaces: Vec<_> = levels.iter().filter(|l| !l.restored).collect();
    for pair in surfaces.windows(2) {
        let (coarse, fine) = (sorted(pair[0]), sorted(pair[1]));
        let mut rest = fine.iter();
        if !coarse.iter().all(|p| rest.any(|q| q == p)) {
            return Err(format!("level {} is not within the next", pair[0].level));
        }
    }
    Ok(())
}

#[test]
fn a_mesh_that_is_reordered_to_be_coded_comes_back() {
    let mesh = join(&[shuffled(&grid(370, 360), 3), soup(300, 1)]);
    for options in [
        EncodeOptions { keep_order: true, ..EncodeOptions::default() },
        EncodeOptions { bits: Some(10), effort: Effort::Fast, ..EncodeOptions::default() },
    ] {
        check(&mesh, &options).unwrap();
    }
}

#[test]
fn every_kind_of_mesh_comes_back() {
    for (name, mesh) in meshes() {
        for options in options() {
            check(&mesh, &options).unwrap_or_else(|e| panic!("{name}, {options:?}: {e}"));
        }
    }
}

#[test]
fn encoding_twice_gives_the_same_bytes() {
    for (name, mesh) in meshes() {
        for options in options() {
            assert_eq!(
                encode(&mesh, &options).unwrap().bytes,
                encode(&mesh, &options).unwrap().bytes,
                "{name}"
            );
        }
    }
}

#[test]
fn the_base_of_a_larger_mesh_is_small_and_errors_fall_towards_the_finest_level() {
    for (name, mesh) in
        [("scan", scan(4000, 1)), ("sphere", sphere(4)), ("grid", noisy(&grid(50, 50), 1e-3, 1))]
    {
        let info = encode(&mesh, &EncodeOptions { bits: Some(12), ..Default::default() }).unwrap().info;
        assert!(info.levels[0].vertices * 10 <= info.vertices, "{name}: base of {}", info.levels[0].vertices);
        let errors: Vec<f32> = info.levels.iter().map(|l| l.error).collect();
        assert!(errors.windows(2).all(|e| e[1] < 1.1 * e[0]), "{name}: {errors:?}");
        let finest = errors[errors.len() - 1];
        assert!(finest > 0.0 && finest < 2e-4 && errors[0] > 20.0 * finest, "{name}: {errors:?}");
    }
}

/// Subdivision steps, any scheme after any other.
fn any_steps() -> impl Strategy<Value = Vec<Scheme>> {
    prop::collection::vec(prop::sample::select(vec![Scheme::Sqrt3, Scheme::Butterfly]), 0..3)
}

fn refined(base: Mesh, steps: &[Scheme]) -> Mesh {
    steps.iter().fold(base, |mesh, &scheme| subdivide(&mesh, scheme, 1, &Limits::default()).unwrap())
}

fn any_mesh() -> impl Strategy<Value = Mesh> {
    let shape = prop_oneof![
        (4usize..200, any::<u64>()).prop_map(|(n, seed)| scan(n, seed)),
        (3usize..12, 3usize..12).prop_map(|(n, m)| torus(n, m)),
        (1usize..9, 1usize..9).prop_map(|(n, m)| grid(n, m)),
        (3usize..12, 1usize..5).prop_map(|(n, m)| annulus(n, m)),
        (1usize..60, any::<u64>()).prop_map(|(n, seed)| soup(n, seed)),
        (4usize..30, any::<u64>(), any_steps()).prop_map(|(n, seed, steps)| refined(scan(n, seed), &steps)),
        (1usize..5, 1usize..5, any_steps()).prop_map(|(n, m, steps)| refined(grid(n, m), &steps)),
        Just(holed()),
    ];
    let parts = prop::collection::vec(shape, 1..4).prop_map(|parts| join(&parts));
    (parts, any::<u64>(), 0..3usize).prop_map(|(mesh, seed, kind)| match kind {
        0 => mesh,
        1 => shuffled(&mesh, seed),
        _ => noisy(&shuffled(&mesh, seed), 0.01, seed),
    })
}

fn any_options() -> impl Strategy<Value = EncodeOptions> {
    use LevelScheme::{Adaptive, Auto, Butterfly, Sqrt3};
    let update = prop::sample::select(vec![Update::None, Update::Third, Update::Paper]);
    let scheme = prop::sample::select(vec![Auto, Sqrt3, Butterfly, Adaptive]);
    let effort = prop::sample::select(vec![Effort::Fast, Effort::Default, Effort::Max]);
    let all = (prop::option::of(4u8..=24), any::<bool>(), update, scheme, effort);
    all.prop_map(|(bits, keep_order, update, scheme, effort)| EncodeOptions {
        bits,
        keep_order,
        update,
        scheme,
        effort,
        progressive: if keep_order { Progressive::Best } else { Progressive::Smallest },
        groups: keep_order,
    })
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(96))]
    #[test]
    fn any_mesh_comes_back(mesh in any_mesh(), options in any_options()) {
        check(&mesh, &options).map_err(TestCaseError::fail)?;
    }
}
