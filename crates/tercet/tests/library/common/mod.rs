//! Small meshes of every kind, what holds of regular levels, files taken apart and put together again.

pub mod butterfly;
pub mod file;
pub mod regular;
pub mod sqrt3;

use tercet::shapes::{annulus, grid, icosahedron, join, noisy, scan, shuffled, soup, torus};
use tercet::{Decoder, Effort, EncodeOptions, Error, Level, Limits, Mesh, Progressive, Update};

/// A grid whose middle is missing.
pub fn holed() -> Mesh {
    let mut mesh = grid(8, 7);
    mesh.faces.retain(|f| !f.iter().any(|&v| v == 29 || v == 30));
    mesh
}

/// A torus, `rough` and beside the plane x = 0, and its mirror image by that, each with noise of its own seed: the same
/// seed makes them twins.
pub fn mirrored([around, across]: [usize; 2], rough: f64, seeds: [u64; 2]) -> Mesh {
    let [left, mut right] = seeds.map(|seed| {
        let mut mesh = noisy(&torus(around, across), rough, seed);
        mesh.positions.iter_mut().for_each(|p| p[0] += 2.0);
        mesh
    });
    right.positions.iter_mut().for_each(|p| p[0] = -p[0]);
    right.faces.iter_mut().for_each(|f| f.swap(1, 2));
    join(&[left, right])
}

/// Small meshes that are oriented manifolds of whole surfaces, each vertex in some face.
pub fn manifolds() -> Vec<(&'static str, Mesh)> {
    vec![
        (
            "triangle",
            Mesh { positions: vec![[0.0; 3], [1.0, 0.0, -0.5], [0.25, 0.75, 0.1]], faces: vec![[0, 1, 2]] },
        ),
        ("icosahedron", icosahedron()),
        ("scan", scan(90, 3)),
        ("torus", noisy(&torus(7, 6), 0.01, 1)),
        ("grid", shuffled(&grid(6, 5), 2)),
        ("annulus", annulus(9, 2)),
        ("components", join(&[noisy(&icosahedron(), 0.02, 3), grid(3, 4), scan(70, 5)])),
    ]
}

/// Small meshes of every kind.
pub fn meshes() -> Vec<(&'static str, Mesh)> {
    let mut all = manifolds();
    all.extend([
        ("empty", Mesh::default()),
        ("point", Mesh { positions: vec![[1.0, -0.0, 3.5]], faces: Vec::new() }),
        ("holed", holed()),
        ("soup", soup(40, 11)),
        ("coincident", Mesh { positions: vec![[2.0; 3]; 9], faces: vec![[0, 1, 2], [3, 4, 5], [6, 7, 8]] }),
    ]);
    all
}

/// Options that lead to every kind of section.
pub fn options() -> Vec<EncodeOptions> {
    let plain = EncodeOptions::default();
    vec![
        plain,
        EncodeOptions { keep_order: true, ..plain },
        EncodeOptions { bits: Some(9), ..plain },
        EncodeOptions { effort: Effort::Fast, ..plain },
        EncodeOptions {
            bits: Some(7),
            keep_order: true,
            update: Update::Third,
            effort: Effort::Fast,
            ..plain
        },
        EncodeOptions { bits: Some(10), progressive: Progressive::Smallest, ..plain },
    ]
}

/// All levels that `decoder` has, then what it says instead of a further one.
pub fn drain(decoder: &mut Decoder) -> (Vec<Level>, Option<Error>) {
    let mut levels = Vec::new();
    loop {
        match decoder.next_level() {
            Ok(Some(level)) => levels.push(level),
            Ok(None) => return (levels, None),
            Err(error) => return (levels, Some(error)),
        }
    }
}

/// The levels of a file that is expected to be whole.
pub fn levels(bytes: &[u8]) -> Vec<Level> {
    let mut decoder = Decoder::new(Limits::default());
    decoder.push(bytes);
    let (levels, error) = drain(&mut decoder);
    assert!(error.is_none(), "{error:?}");
    decoder.finish().unwrap();
    levels
}

/// What distinguishes levels, to the last bit of every coordinate.
pub fn contents(level: &Level) -> (u32, bool, Vec<[u32; 3]>, &[[u32; 3]]) {
    let positions = level.mesh.positions.iter().map(|p| p.map(f32::to_bits)).collect();
    (level.level, level.restored, positions, &level.mesh.faces)
}

/// Asserts that `found` are the first of `all`.
pub fn assert_prefix(found: &[Level], all: &[Level], what: &str) {
    assert!(found.len() <= all.len(), "{what}: {} levels of {}", found.len(), all.len());
    for (found, level) in found.iter().zip(all) {
        assert_eq!(contents(found), contents(level), "{what}");
    }
}

/// A generator of repeatable random numbers (Vigna's SplitMix64).
pub struct Random(pub u64);

impl Random {
    pub fn next(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9E37_79B9_7F4A_7C15);
        let mut x = self.0;
        x = (x ^ x >> 30).wrapping_mul(0xBF58_476D_1CE4_E5B9);
        x = (x ^ x >> 27).wrapping_mul(0x94D0_49BB_1331_11EB);
        x ^ x >> 31
    }

    pub fn below(&mut self, n: usize) -> usize {
        (self.next() % n as u64) as usize
    }

    pub fn bytes(&mut self, count: usize) -> Vec<u8> {
        (0..count).map(|_| self.next() as u8).collect()
    }
}
