//! Meshes of 1-to-4 subdivision connectivity cost no connectivity bits, however they are numbered.

use crate::common::butterfly::refined;
use crate::common::regular::Kind;
use tercet::shapes::{noisy, scan, shuffled, sphere};
use tercet::verify::{Sameness, compare};
use tercet::{Effort, EncodeOptions, LevelScheme, Limits, Mesh, Scheme, decode, encode, subdivide};

const BUTTERFLY: Kind = Kind { name: "butterfly", refined };

/// The kinds of the finest `count` levels, finest first.
fn kinds(mesh: &Mesh, scheme: LevelScheme, count: usize) -> Vec<&'static str> {
    // The fast profile names adaptive levels by that name: it makes no late ones.
    let options = EncodeOptions { bits: Some(12), scheme, effort: Effort::Fast, ..Default::default() };
    let info = encode(mesh, &options).unwrap().info;
    info.levels.iter().rev().take(count).map(|level| level.kind).collect()
}

#[test]
fn every_step_is_found_in_a_shuffled_noisy_mesh() {
    BUTTERFLY.assert_every_step_is_found(3);
}

#[test]
fn steps_cost_no_connectivity_bits() {
    BUTTERFLY.assert_steps_cost_no_connectivity_bits(4);
}

#[test]
fn updates_are_undone_exactly_and_change_only_coarse_levels() {
    BUTTERFLY.assert_updates_are_undone(2);
}

#[test]
fn the_option_says_which_levels_are_looked_for() {
    let base = scan(70, 3);
    let noise = |mesh: &Mesh| shuffled(&noisy(mesh, 0.001, 4), 5);
    let quartered = noise(&refined(&base, 2));
    let tripled = noise(&crate::common::sqrt3::refined(&base, 2));
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
