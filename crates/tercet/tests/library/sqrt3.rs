//! Meshes of √3 subdivision connectivity cost no connectivity bits, however they are numbered.

use crate::common::regular::Kind;
use crate::common::sqrt3::refined;

const SQRT3: Kind = Kind { name: "sqrt3", refined };

#[test]
fn every_step_is_found_in_a_shuffled_noisy_mesh() {
    SQRT3.assert_every_step_is_found(4);
}

#[test]
fn steps_cost_no_connectivity_bits() {
    SQRT3.assert_steps_cost_no_connectivity_bits(5);
}

#[test]
fn updates_are_undone_exactly_and_change_only_coarse_levels() {
    SQRT3.assert_updates_are_undone(3);
}
