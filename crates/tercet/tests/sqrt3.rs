//! Meshes of √3 subdivision connectivity cost no connectivity bits, however they are numbered.

mod common;

use common::sqrt3::refined;
use common::{holed, levels};
use tercet::shapes::{annulus, grid, icosahedron, join, noisy, scan, shuffled, torus};
use tercet::verify::{Sameness, compare, quantised};
use tercet::{EncodeOptions, Limits, Mesh, Update, decode, encode};

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

#[test]
fn every_step_is_found_in_a_shuffled_noisy_mesh() {
    for (name, base) in bases() {
        for steps in 1..=4 {
            let mesh = shuffled(&noisy(&refined(&base, steps), 0.002, 5), 6);
            let options = EncodeOptions { bits: Some(12), ..Default::default() };
            let file = encode(&mesh, &options).unwrap();
            let kinds: Vec<_> = file.info.levels.iter().rev().take(steps).map(|l| l.kind).collect();
            assert_eq!(kinds, vec!["sqrt3"; steps], "{name}, {steps} steps");
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
    for steps in 0..=5 {
        assert!(bits(steps) < 72, "{} bits after {steps} steps", bits(steps));
    }
}

#[test]
fn updates_are_undone_exactly_and_change_only_coarse_levels() {
    for (name, base) in bases() {
        let mesh = noisy(&refined(&base, 3), 0.01, 8);
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
                assert!(
                    file.info.levels.iter().all(|l| (l.update == update) == (l.kind == "sqrt3")),
                    "{name}"
                );
            }
            assert!(coarse(Update::None) != coarse(Update::Third), "{name}");
        }
    }
}
