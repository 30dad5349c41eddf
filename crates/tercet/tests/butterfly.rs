//! Meshes of 1-to-4 subdivision connectivity cost no connectivity bits, however they are numbered.

mod common;

use common::butterfly::refined;
use common::{holed, levels};
use tercet::shapes::{annulus, grid, icosahedron, join, noisy, scan, shuffled, sphere, torus};
use tercet::verify::{Sameness, compare, quantised};
use tercet::{Effort, EncodeOptions, LevelScheme, Limits, Mesh, Scheme, Update, decode, encode, subdivide};

fn bases() -> Vec<(&'static str, Mesh)> {
    vec![
        ("icosahedron", icosahedron()),
        ("scan", scan(80, 7)),
        ("torus", torus(5, 4)),
        ("grid", grid(4, 3)),
        ("annulus", annulus(7, 2)),
        ("holed", holed()),
        ("components", join(&[icosahedron(), grid(3, 3), scan(40, 2), annulus(5, 1)])),
    ]
}

/// The kinds of the finest `count` levels, finest first.
fn kinds(mesh: &Mesh, scheme: LevelScheme, count: usize) -> Vec<&'static str> {
    // The fast profile names adaptive levels by that name: it makes no late ones.
    let options = EncodeOptions { bits: Some(12), scheme, effort: Effort::Fast, ..Default::default() };
    let info = encode(mesh, &options).unwrap().info;
    info.levels.iter().rev().take(count).map(|level| level.kind).collect()
}

#[test]
fn every_step_is_found_in_a_shuffled_noisy_mesh() {
    for (name, base) in bases() {
        for steps in 1..=3 {
            let mesh = shuffled(&noisy(&refined(&base, steps), 0.002, 5), 6);
            let options = EncodeOptions { bits: Some(12), ..Default::default() };
            let file = encode(&mesh, &options).unwrap();
            let kinds: Vec<_> = file.info.levels.iter().rev().take(steps).map(|l| l.kind).collect();
            assert_eq!(kinds, vec!["butterfly"; steps], "{name}, {steps} steps");
            let below = &file.info.levels[file.info.levels.len() - 1 - steps];
            let used: std::collections::BTreeSet<_> = base.faces.iter().flatten().collect();
            assert_eq!(below.vertices as usize, used.len(), "{name}, {steps} steps");
            assert_eq!(below.faces as usize, base.faces.len(), "{name}, {steps} steps");
            let decoded = decode(&file.bytes, &Limits::default()).unwrap();
            let expected = quantised(&mesh, &file.info.precision);
            assert!(!matches!(compare(&expected, &decoded), Sameness::Different(_)), "{name}, {steps} steps");
        }
    }
}

#[test]
fn steps_cost_no_connectivity_bits() {
    let bits = |steps| {
        let mesh = shuffled(&noisy(&refined(&icosahedron(), steps), 0.002, 5), 6);
        encode(&mesh, &Default::default()).unwrap().connectivity_bits
    };
    // Twelve vertices of a base, in whichever order: less than six bits each.
    for steps in 0..=4 {
        assert!(bits(steps) < 72, "{} bits after {steps} steps", bits(steps));
    }
}

#[test]
fn updates_are_undone_exactly_and_change_only_coarse_levels() {
    for (name, base) in bases() {
        let mesh = noisy(&refined(&base, 2), 0.01, 8);
        for bits in [None, Some(10)] {
            let file = |update| encode(&mesh, &EncodeOptions { bits, update, ..Default::default() }).unwrap();
            let expected = quantised(&mesh, &file(Update::None).info.precision);
            let coarse = |update| {
                let file = file(update);
                levels(&file.bytes)[file.info.levels.len() - 2].mesh.clone()
            };
            for update in [Update::Third, Update::Paper] {
                let file = file(update);
                let decoded = decode(&file.bytes, &Limits::default()).unwrap();
                let same = compare(&expected, &decoded);
                assert!(!matches!(same, Sameness::Different(_)), "{name}, {update:?}: {same:?}");
                let regular = |kind| kind == "butterfly" || kind == "sqrt3";
                assert!(file.info.levels.iter().all(|l| (l.update == update) == regular(l.kind)), "{name}");
            }
            assert!(coarse(Update::None) != coarse(Update::Third), "{name}");
        }
    }
}

#[test]
fn the_option_says_which_levels_are_looked_for() {
    let base = scan(70, 3);
    let noise = |mesh: &Mesh| shuffled(&noisy(mesh, 0.001, 4), 5);
    let quartered = noise(&refined(&base, 2));
    let tripled = noise(&common::sqrt3::refined(&base, 2));
    let irregular = scan(600, 9);
    for (mesh, scheme, expected) in [
        (&quartered, LevelScheme::Auto, "butterfly"),
        (&quartered, LevelScheme::Butterfly, "butterfly"),
        (&quartered, LevelScheme::Sqrt3, "adaptive"),
        (&quartered, LevelScheme::Adaptive, "adaptive"),
        (&tripled, LevelScheme::Auto, "sqrt3"),
        (&tripled, LevelScheme::Sqrt3, "sqrt3"),
        (&tripled, LevelScheme::Butterfly, "adaptive"),
        (&tripled, LevelScheme::Adaptive, "adaptive"),
        (&irregular, LevelScheme::Auto, "adaptive"),
        (&irregular, LevelScheme::Butterfly, "adaptive"),
    ] {
        assert_eq!(kinds(mesh, scheme, 2), [expected; 2], "{scheme:?}");
        let file = encode(mesh, &EncodeOptions { scheme, ..Default::default() }).unwrap();
        let same = compare(mesh, &decode(&file.bytes, &Limits::default()).unwrap());
        assert!(!matches!(same, Sameness::Different(_)), "{scheme:?}");
    }
}

#[test]
fn a_sphere_made_by_quartering_is_butterfly_levels_down_to_its_icosahedron() {
    assert_eq!(kinds(&shuffled(&sphere(5), 1), LevelScheme::Auto, 6)[..5], ["butterfly"; 5]);
}

#[test]
fn steps_of_both_schemes_in_turn_are_found_in_that_order() {
    let step = |mesh: &Mesh, scheme| subdivide(mesh, scheme, 1, &Limits::default()).unwrap();
    let base = scan(60, 8);
    let mesh = step(&step(&step(&base, Scheme::Butterfly), Scheme::Sqrt3), Scheme::Butterfly);
    assert_eq!(kinds(&shuffled(&mesh, 2), LevelScheme::Auto, 3), ["butterfly", "sqrt3", "butterfly"]);
    let mesh = step(&step(&step(&base, Scheme::Sqrt3), Scheme::Butterfly), Scheme::Sqrt3);
    assert_eq!(kinds(&shuffled(&mesh, 2), LevelScheme::Auto, 3), ["sqrt3", "butterfly", "sqrt3"]);
}
