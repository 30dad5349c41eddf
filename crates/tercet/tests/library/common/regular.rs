//! What holds of every kind of level that costs no connectivity bits.

use super::{holed, levels};
use std::collections::BTreeSet;
use tercet::shapes::{annulus, grid, icosahedron, join, noisy, scan, shuffled, torus};
use tercet::verify::{Sameness, compare, quantised};
use tercet::{EncodeOptions, Limits, Mesh, Update, decode, encode};

/// A kind of level, and its refinement `steps` times over, written without the library's own code.
pub struct Kind {
    pub name: &'static str,
    pub refined: fn(mesh: &Mesh, steps: usize) -> Mesh,
}

/// Meshes to refine, of every topology.
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

impl Kind {
    /// The refined mesh with noise, by other numbers.
    fn hidden(&self, base: &Mesh, steps: usize) -> Mesh {
        shuffled(&noisy(&(self.refined)(base, steps), 0.002, 5), 6)
    }

    /// Asserts that 1 to `most` steps are found in shuffled, noisy meshes, down to the bases, and that
    /// these meshes come back.
    pub fn assert_every_step_is_found(&self, most: usize) {
        for (name, base) in bases() {
            for steps in 1..=most {
                let what = format!("{name}, {steps} steps");
                let mesh = self.hidden(&base, steps);
                let options = EncodeOptions { bits: Some(12), ..Default::default() };
                let file = encode(&mesh, &options).unwrap();
                let kinds: Vec<_> = file.info.levels.iter().rev().take(steps).map(|l| l.kind).collect();
                assert_eq!(kinds, vec![self.name; steps], "{what}");
                let below = &file.info.levels[file.info.levels.len() - 1 - steps];
                let used: BTreeSet<_> = base.faces.iter().flatten().collect();
                assert_eq!(below.vertices as usize, used.len(), "{what}");
                assert_eq!(below.faces as usize, base.faces.len(), "{what}");
                let decoded = decode(&file.bytes, &Limits::default()).unwrap();
                let expected = quantised(&mesh, &file.info.precision);
                assert!(!matches!(compare(&expected, &decoded), Sameness::Different(_)), "{what}");
            }
        }
    }

    /// Asserts that up to `most` steps cost no connectivity bits.
    pub fn assert_steps_cost_no_connectivity_bits(&self, most: usize) {
        for steps in 0..=most {
            let mesh = self.hidden(&icosahedron(), steps);
            let bits = encode(&mesh, &Default::default()).unwrap().connectivity_bits;
            // Twelve vertices of a base, in whichever order: less than six bits each.
            assert!(bits < 72, "{bits} bits after {steps} steps");
        }
    }

    /// Asserts that updates change coarse levels only, and are undone exactly, after `steps` steps.
    pub fn assert_updates_are_undone(&self, steps: usize) {
        for (name, base) in bases() {
            let mesh = noisy(&(self.refined)(&base, steps), 0.01, 8);
            for bits in [None, Some(10)] {
                let file =
                    |update| encode(&mesh, &EncodeOptions { bits, update, ..Default::default() }).unwrap();
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
                    // Below them there may be regular levels of the other kind.
                    let regular = |kind| kind == "butterfly" || kind == "sqrt3";
                    assert!(
                        file.info.levels.iter().all(|l| (l.update == update) == regular(l.kind)),
                        "{name}"
                    );
                }
                assert!(coarse(Update::None) != coarse(Update::Third), "{name}");
            }
        }
    }
}
