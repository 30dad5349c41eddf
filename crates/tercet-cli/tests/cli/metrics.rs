//! `tercet metrics`.

use crate::Folder;
use serde_json::Value;
use tercet::{Mesh, shapes};

/// A folder with two unit squares, one 1/4 above the other.
fn squares(test: &str) -> Folder {
    let folder = Folder::new(test);
    let square = "v 0 0 Z\nv 1 0 Z\nv 1 1 Z\nv 0 1 Z\nf 1 2 3\nf 1 3 4\n";
    folder.write("low.obj", square.replace('Z', "0"));
    folder.write("high.obj", square.replace('Z', "0.25"));
    folder
}

#[test]
fn two_squares_are_as_far_apart_as_they_were_put() {
    let folder = squares("metrics-squares");
    let text = folder.good("metrics low.obj high.obj --samples 1000");
    let lines: Vec<&str> = text.lines().collect();
    assert_eq!(lines[0], "A: low.obj, 4 vertices, 2 faces");
    assert_eq!(lines[3], "distance        RMS    mean  greatest  at most");
    assert_eq!(lines[6], "of both      17.7 %  17.7 %    17.7 %   17.7 %");
    assert_eq!(lines.last().unwrap(), &"PSNR 15.05 dB");
}

#[test]
fn json_holds_lengths_and_repeats_for_a_seed() {
    let folder = squares("metrics-json");
    let run = |seed: u32| {
        folder.write_mesh("scan.ply", &shapes::scan(300, 1));
        folder.write_mesh("other.ply", &shapes::scan(250, 1));
        folder.good(&format!("metrics scan.ply other.ply --samples 1000 --seed {seed} --json"))
    };
    assert_eq!(run(1), run(1));
    assert_ne!(run(1), run(2));
    let found: Value = serde_json::from_str(&folder.good("metrics low.obj high.obj --json")).unwrap();
    assert_eq!((&found["hausdorff"], &found["hausdorff_at_most"]), (&0.25.into(), &0.25.into()));
    assert_eq!((&found["a_to_b"]["max"], &found["samples"]), (&0.25.into(), &200_000.into()));
    assert!((found["diagonal"].as_f64().unwrap() - 2f64.sqrt()).abs() < 1e-12);
    let same: Value = serde_json::from_str(&folder.good("metrics low.obj low.obj --json")).unwrap();
    assert_eq!((&same["rms"], &same["psnr"]), (&0.0.into(), &Value::Null));
}

#[test]
fn a_file_stands_for_its_mesh_and_its_beginning_for_what_it_holds() {
    let folder = Folder::new("metrics-file");
    folder.write_mesh("scan.ply", &shapes::scan(500, 1));
    folder.good("encode scan.ply");
    let text = folder.good("metrics scan.ply scan.tct");
    assert!(text.ends_with("PSNR infinite: no difference\n"), "{text}");
    let whole = folder.read("scan.tct");
    folder.write("cut.tct", &whole[..whole.len() / 2]);
    let run = folder.run("metrics scan.ply cut.tct");
    assert_eq!(run.status, 0);
    assert!(run.err.starts_with("warning: cut.tct: incomplete: level "), "{}", run.err);
    assert!(run.text().contains(" dB"), "{}", run.text());
}

#[test]
fn what_cannot_be_measured_is_said() {
    let folder = squares("metrics-fails");
    folder.write_mesh("points.ply", &Mesh { positions: vec![[0.0; 3]; 5], faces: vec![] });
    let message = folder.failed("metrics low.obj points.ply");
    assert!(message.contains("mesh B, faces: there are none"), "{message}");
    assert!(folder.failed("metrics low.obj high.obj --samples 0").contains("there must be one at least"));
    assert!(folder.failed("metrics - - --format obj").contains("only one"));
    assert!(folder.failed("metrics low.obj absent.ply").contains("absent.ply"));
}
