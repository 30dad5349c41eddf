//! Real meshes, of the folder that `TERCET_CORPUS` names, through whole files.

use std::path::Path;

use tercet::io::{Format, read};
use tercet::{EncodeOptions, Limits, Mesh, decode, encode};

type Bits = [u32; 3];

/// Positions and oriented faces as sorted lists: equal for meshes that differ in numbering only.
fn contents(mesh: &Mesh) -> (Vec<Bits>, Vec<[Bits; 3]>) {
    let mut vertices: Vec<Bits> = mesh.positions.iter().map(|p| p.map(f32::to_bits)).collect();
    let turned = |[a, b, c]: [Bits; 3]| [[a, b, c], [b, c, a], [c, a, b]].into_iter().min();
    let mut faces: Vec<_> =
        mesh.faces.iter().filter_map(|f| turned(f.map(|v| vertices[v as usize]))).collect();
    vertices.sort_unstable();
    faces.sort_unstable();
    (vertices, faces)
}

/// The greatest distance along an axis between vertices of the same number.
fn farthest(a: &Mesh, b: &Mesh) -> f64 {
    let pairs = a.positions.as_flattened().iter().zip(b.positions.as_flattened());
    pairs.map(|(&x, &y)| (f64::from(x) - f64::from(y)).abs()).fold(0.0, f64::max)
}

fn longest_side(mesh: &Mesh) -> f64 {
    let side = |axis: usize| {
        let values = || mesh.positions.iter().map(|p| f64::from(p[axis]));
        values().fold(f64::MIN, f64::max) - values().fold(f64::MAX, f64::min)
    };
    (0..3).map(side).fold(0.0, f64::max)
}

fn check(name: &str, mesh: &Mesh) {
    let through = |bits: Option<u8>, keep_order: bool| {
        let options = EncodeOptions { bits, keep_order, ..EncodeOptions::default() };
        let file = encode(mesh, &options).unwrap_or_else(|error| panic!("{name}: {error}")).bytes;
        decode(&file, &Limits::default()).unwrap_or_else(|error| panic!("{name}: {error}"))
    };
    let original = contents(mesh);
    assert!(contents(&through(None, false)) == original, "{name}: exact");
    let ordered = through(None, true);
    assert!(ordered.faces == mesh.faces && contents(&ordered) == original, "{name}: exact, ordered");
    assert_eq!(farthest(&ordered, mesh), 0.0, "{name}: exact, ordered");
    for bits in [10, 12, 14] {
        let ordered = through(Some(bits), true);
        assert!(ordered.faces == mesh.faces, "{name} at {bits} bits");
        let half = longest_side(mesh) / f64::from((1 << bits) - 1) / 2.0;
        assert!(farthest(&ordered, mesh) <= half * 1.001, "{name} at {bits} bits");
        if bits == 12 {
            assert!(contents(&through(Some(bits), false)) == contents(&ordered), "{name} at {bits} bits");
        }
    }
}

#[test]
fn real_meshes_come_back_at_every_precision_and_in_either_order() {
    let Some(folder) = std::env::var_os("TERCET_CORPUS") else {
        println!("skipped: TERCET_CORPUS is not set");
        return;
    };
    let mut tried = 0;
    for entry in std::fs::read_dir(Path::new(&folder)).expect("the corpus") {
        let path = entry.expect("an entry of the corpus").path();
        if let Some(format) = Format::from_path(&path) {
            let name = path.display().to_string();
            let bytes = std::fs::read(&path).expect("a mesh of the corpus");
            check(&name, &read(&bytes, format, &Limits::default()).expect("a mesh").mesh);
            tried += 1;
        }
    }
    assert!(tried > 0, "no mesh in the corpus");
}
