//! `tercet render`.

use crate::Folder;
use tercet::{Mesh, shapes};

/// A folder with a mesh that is not its own coarse level, and its file.
fn sphere(test: &str) -> Folder {
    let folder = Folder::new(test);
    folder.write_mesh("sphere.ply", &shapes::sphere(3));
    folder.good("encode sphere.ply --bits 12");
    folder
}

/// Width and height from a PNG file's header.
fn dimensions(png: &[u8]) -> [u32; 2] {
    assert_eq!(png[..8], [137, 80, 78, 71, 13, 10, 26, 10]);
    [16, 20].map(|at| u32::from_be_bytes(png[at..at + 4].try_into().unwrap()))
}

#[test]
fn every_mode_draws_meshes_and_files() {
    let folder = sphere("render-modes");
    for mode in ["shaded", "wireframe", "division"] {
        for file in ["sphere.ply", "sphere.tct"] {
            folder.good(&format!("render {file} -o out.png --mode {mode} --size 120x90"));
            assert_eq!(dimensions(&folder.read("out.png")), [120, 90]);
        }
    }
    let said = folder.good("render sphere.tct -o error.png --mode error --level 2 --size 200x90");
    assert!(said.starts_with("error.png: level 2 of 0 to "), "{said}");
    folder.good("render sphere.ply -o error.png --mode error --reference sphere.tct --size 200x90");
    folder.good("render sphere.tct -o bare.png --mode error --without-details --size 200x90 --scale 0.01");
    folder.good("render sphere.tct -o view.png --azimuth -40 --elevation 5 --up z --flat --background none --size 64x64");
}

#[test]
fn the_same_command_draws_the_same_bytes_and_levels_differ() {
    let folder = sphere("render-same");
    let draw = |level: u32| {
        folder.good(&format!("render sphere.tct -o out.png --level {level} --size 100x100"));
        folder.read("out.png")
    };
    assert_eq!(draw(0), draw(0));
    assert_ne!(draw(0), draw(3));
}

#[test]
fn a_picture_goes_to_standard_output() {
    let folder = sphere("render-stdout");
    let run = folder.run_with("render - --format ply -o - --size 64x48", folder.read("sphere.ply"));
    assert_eq!(run.status, 0, "{}", run.err);
    assert_eq!(dimensions(&run.out), [64, 48]);
}

#[test]
fn what_cannot_be_drawn_is_said() {
    let folder = sphere("render-fails");
    folder.write_mesh("points.ply", &Mesh { positions: vec![[0.0; 3]; 5], faces: vec![] });
    for (arguments, cause) in [
        ("points.ply -o out.png", "no faces to draw"),
        ("sphere.tct -o out.png --level 99", "there is no level 99: the finest is "),
        ("sphere.tct -o out.png --level 0 --without-details", "nothing is below it"),
        ("sphere.ply -o out.png --mode error", "--reference"),
        ("sphere.ply -o out.png --reference sphere.tct", "--mode error"),
        ("sphere.ply -o absent/out.png", "absent/out.png"),
    ] {
        let message = folder.failed(&format!("render {arguments}"));
        assert!(message.contains(cause), "{message}");
    }
    assert!(!folder.exists("out.png"));
}
