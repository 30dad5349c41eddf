//! `tercet compare`.

use crate::Folder;
use serde_json::Value;
use tercet::{Limits, Scheme, shapes, subdivide};

fn compared(folder: &Folder, arguments: &str) -> Value {
    serde_json::from_str(&folder.good(&format!("compare {arguments} --samples 2000 --json"))).unwrap()
}

/// By how many percent the vertices and faces decrease at each step of a scheme.
fn rates(scheme: &Value) -> Vec<[f64; 2]> {
    let steps = scheme["steps"].as_array().unwrap();
    let count = |step: &Value, what: &str| step[what].as_f64().unwrap();
    let rate = |pair: &[Value], what: &str| 100.0 * (count(&pair[1], what) / count(&pair[0], what) - 1.0);
    steps.windows(2).map(|pair| ["vertices", "faces"].map(|what| rate(pair, what))).collect()
}

#[test]
fn a_refined_base_shows_the_rates_of_the_papers_table() {
    let folder = Folder::new("compare-table");
    // The paper's base has 389 vertices.
    let base = shapes::scan(389, 1);
    for (i, (scheme, range)) in
        [(Scheme::Sqrt3, -66.7..-66.5), (Scheme::Butterfly, -75.01..-74.85)].into_iter().enumerate()
    {
        folder.write_mesh("fine.ply", &subdivide(&base, scheme, 2, &Limits::default()).unwrap());
        let found = compared(&folder, "fine.ply");
        // The scheme that fits takes the mesh as it is, and the other one a resampled one.
        for (k, found) in found["schemes"].as_array().unwrap().iter().enumerate() {
            assert_eq!(found["resampled"], k != i, "{found}");
            assert_eq!(found["steps"].as_array().unwrap().len(), 3, "{found}");
        }
        let steps = &found["schemes"][i]["steps"];
        assert_eq!(steps[2]["vertices"], 389);
        let rates = rates(&found["schemes"][i]);
        assert!(rates.iter().flatten().all(|rate| range.contains(rate)), "{rates:?}");
    }
}

#[test]
fn any_mesh_is_resampled_and_it_is_said() {
    let folder = Folder::new("compare-any");
    folder.write_mesh("scan.ply", &shapes::scan(3000, 1));
    let text = folder.good("compare scan.ply --samples 2000");
    for part in ["√3: resampled", "butterfly: resampled", "after 2", "bits per vertex", "paper, as printed"]
    {
        assert!(text.contains(part), "{part} is not in:\n{text}");
    }
    let found = compared(&folder, "scan.ply --levels 1");
    for (i, rate) in [(0, -66.6), (1, -75.0)] {
        let scheme = &found["schemes"][i];
        let rates = rates(scheme);
        assert_eq!(rates.len(), 1);
        assert!(rates[0].iter().all(|r| (r - rate).abs() < 0.3), "{rates:?}");
        // Nothing is spent on the connectivity of the scheme's levels.
        let bits =
            scheme["connectivity_bits"].as_f64().unwrap() / scheme["steps"][0]["vertices"].as_f64().unwrap();
        assert!(bits < 1.5, "{bits}");
    }
    let errors = found["equal_bytes"].as_array().unwrap();
    let last = |i: usize| errors.last().unwrap()["errors"][i].as_f64().unwrap();
    assert!((0..2).all(|i| last(i) < 0.01), "{errors:?}");
}

#[test]
fn the_printed_update_does_not_invert_and_the_corrected_ones_do() {
    let folder = Folder::new("compare-updates");
    folder.write_mesh("scan.ply", &shapes::scan(3000, 2));
    let found = compared(&folder, "scan.ply");
    for scheme in found["schemes"].as_array().unwrap() {
        let printed = &scheme["as_printed"];
        assert!(printed["wrong_even"].as_f64().unwrap() > 0.5, "{printed}");
        assert!(printed["wrong_odd"].as_f64().unwrap() > 0.5, "{printed}");
        assert!(printed["rms"].as_f64().unwrap() > 1e-4, "{printed}");
        let updates = scheme["updates"].as_array().unwrap();
        let bytes = |i: usize| updates[i]["bytes"].as_u64().unwrap();
        assert!(
            updates[0]["update"] == "none"
                && updates[1]["update"] == "third"
                && updates[2]["update"] == "paper"
        );
        assert!(bytes(0) < bytes(2), "{updates:?}");
        assert!(updates.iter().all(|update| update["errors"].as_array().unwrap().len() == 2), "{updates:?}");
    }
}

#[test]
fn what_cannot_be_compared_is_said() {
    let folder = Folder::new("compare-fails");
    folder.write("points.obj", "v 0 0 0\nv 1 0 0\n");
    assert!(folder.failed("compare points.obj").starts_with("error: points.obj: "));
    assert!(folder.failed("compare absent.obj").contains("absent.obj"));
}
