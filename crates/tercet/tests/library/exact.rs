//! Whole files: the original comes back, bit for bit, through every kind of exception.

use proptest::prelude::*;
use tercet::{Decoder, EncodeOptions, Limits, Mesh, decode, encode};

fn bits(mesh: &Mesh) -> Vec<[u32; 3]> {
    mesh.positions.iter().map(|p| p.map(f32::to_bits)).collect()
}

/// The positions and the oriented faces, as sorted lists: equal for meshes that differ in numbering only.
fn contents(mesh: &Mesh) -> (Vec<[u32; 3]>, Vec<[[u32; 3]; 3]>) {
    let mut vertices = bits(mesh);
    let turned = |[a, b, c]: [[u32; 3]; 3]| [[a, b, c], [b, c, a], [c, a, b]].into_iter().min();
    let mut faces: Vec<_> =
        mesh.faces.iter().filter_map(|f| turned(f.map(|v| vertices[v as usize]))).collect();
    vertices.sort_unstable();
    faces.sort_unstable();
    (vertices, faces)
}

fn through(mesh: &Mesh, bits: Option<u8>, keep_order: bool) -> Mesh {
    let options = EncodeOptions { bits, keep_order, ..EncodeOptions::default() };
    let file = encode(mesh, &options).unwrap().bytes;
    decode(&file, &Limits::default()).unwrap()
}

fn check(mesh: &Mesh) {
    let ordered = through(mesh, None, true);
    assert_eq!((bits(&ordered), &ordered.faces), (bits(mesh), &mesh.faces));
    assert_eq!(contents(&through(mesh, None, false)), contents(mesh));
    let (rounded, ordered) = (through(mesh, Some(6), false), through(mesh, Some(6), true));
    assert_eq!(contents(&rounded), contents(&ordered));
    assert_eq!(ordered.faces, mesh.faces);
    assert_eq!(ordered.positions.len(), mesh.positions.len());
}

/// A wavy sheet with a hole, a second sheet along one of its edges, and stray vertices and faces.
fn patchwork(side: u32) -> Mesh {
    let mut positions: Vec<[f32; 3]> = (0..side * side)
        .map(|v| {
            let (x, y) = ((v / side) as f32, (v % side) as f32);
            [x * 0.1, y / 7.0, (x * 0.3).sin() * (y * 0.2).cos() - 0.5]
        })
        .collect();
    let mut faces = Vec::new();
    for v in (0..side * (side - 1)).filter(|v| v % side != side - 1 && *v != side * 3 + 4) {
        faces.extend([[v, v + side, v + side + 1], [v + side + 1, v + 1, v]]);
    }
    for v in 0..side - 1 {
        let below = positions.len() as u32;
        positions.push([v as f32 * 0.1, -1.0, -0.0]);
        faces.extend([[v + side, v + side + 1, below], [below, below, v]]);
    }
    positions.extend([[0.0, -0.0, 1e-40], [0.3, 0.3, 0.3], [0.3, 0.3, 0.3]]);
    faces.extend([[0, 1, 2], [0, 1, 2], [2, 1, 0], [5, 5, 5], [8, 5, 8]]);
    Mesh { positions, faces }
}

#[test]
fn a_patchwork_of_every_exception_comes_back() {
    check(&patchwork(12));
    check(&patchwork(40));
}

#[test]
fn meshes_of_next_to_nothing_come_back() {
    check(&Mesh::default());
    check(&Mesh { positions: vec![[-0.0; 3]], faces: vec![] });
    check(&Mesh { positions: vec![[-0.0; 3]], faces: vec![[0; 3]; 2] });
    check(&Mesh { positions: vec![[1.0; 3], [f32::MIN; 3], [f32::MAX; 3]], faces: vec![[2, 1, 0]] });
}

#[test]
fn every_float_around_zero_comes_back() {
    let tiny = |i: i32| f32::from_bits(i.unsigned_abs() | if i < 0 { 1 << 31 } else { 0 });
    let positions: Vec<[f32; 3]> =
        (-40..40).map(|i| [tiny(i), if i % 2 == 0 { 0.0 } else { -0.0 }, 1.0 + tiny(i << 23)]).collect();
    let faces = (0..78).map(|v| [v, v + 1, v + 2]).collect();
    check(&Mesh { positions, faces });
}

#[test]
fn the_original_follows_the_finest_level_when_its_sections_have_arrived() {
    let mesh = patchwork(12);
    let encoded = encode(&mesh, &EncodeOptions { keep_order: true, ..EncodeOptions::default() }).unwrap();
    let finest = encoded.info.levels.last().unwrap();
    let (levels, rest) = encoded.bytes.split_at(finest.bytes as usize);
    let mut decoder = Decoder::new(Limits::default());
    decoder.push(levels);
    let mut last = None;
    while let Some(level) = decoder.next_level().unwrap() {
        assert!(!level.restored);
        last = Some(level);
    }
    let last = last.unwrap();
    assert_eq!(last.level, finest.level);
    let (most, end) = rest.split_at(rest.len() - 1);
    decoder.push(most);
    // With late positions the level comes once more before it is restored.
    while let Some(level) = decoder.next_level().unwrap() {
        assert!(!level.restored && level.level == finest.level);
    }
    assert!(decoder.finish().is_err());
    decoder.push(end);
    let restored = decoder.next_level().unwrap().unwrap();
    assert!(restored.restored && restored.level == finest.level);
    assert_eq!(restored.mesh.positions.len(), finest.vertices as usize);
    assert_eq!((bits(&restored.mesh), restored.mesh.faces), (bits(&mesh), mesh.faces));
    assert!(decoder.next_level().unwrap().is_none());
    decoder.finish().unwrap();
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(200))]
    #[test]
    fn any_soup_comes_back(
        positions in prop::collection::vec(prop::array::uniform3(-300i32..300), 1..40),
        faces in prop::collection::vec(prop::array::uniform3(any::<prop::sample::Index>()), 0..80),
        scale in prop::sample::select(vec![1.0f32, 0.01, 0.3, 1e-43, 1e36]),
    ) {
        let value = |x: i32| if x % 5 == 0 { 0.0f32.copysign(x as f32) } else { x as f32 * scale };
        let n = positions.len();
        check(&Mesh {
            positions: positions.into_iter().map(|p| p.map(value)).collect(),
            faces: faces.into_iter().map(|f| f.map(|v| v.index(n) as u32)).collect(),
        });
    }
}
