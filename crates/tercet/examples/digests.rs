//! Prints one line per generated mesh and set of options: digests that must not depend on the platform.
//!
//! The first is of the file that the mesh is encoded to, the second of the bits of the mesh that the file
//! decodes to. `cargo xtask test` builds this program for the host and for a platform
//! with another word size, runs both, and fails unless they print the same lines.

use tercet::shapes::{annulus, grid, icosahedron, join, noisy, scan, shuffled, soup, sphere, torus};
use tercet::{Effort, EncodeOptions, Limits, Mesh, Result, Scheme, Update};

fn main() -> Result<()> {
    let exact = EncodeOptions::default();
    let ordered = EncodeOptions { keep_order: true, ..exact };
    let bits = |bits| EncodeOptions { bits: Some(bits), ..exact };
    let effort = |effort| EncodeOptions { effort, ..bits(12) };
    let general = [
        ("12 bits, fast", effort(Effort::Fast)),
        ("12 bits, max", effort(Effort::Max)),
        ("10 bits", bits(10)),
        ("12 bits, order kept", EncodeOptions { keep_order: true, ..bits(12) }),
        ("exact", exact),
        ("exact, order kept", ordered),
    ];
    for (name, mesh) in meshes() {
        print_digests(name, &mesh, &general)?;
    }
    let lifted = |update| EncodeOptions { update, ..bits(12) };
    let updates = [
        ("12 bits", bits(12)),
        ("12 bits, update third", lifted(Update::Third)),
        ("12 bits, update paper", lifted(Update::Paper)),
        ("exact", exact),
    ];
    for (name, mesh) in refined()? {
        print_digests(name, &mesh, &updates)?;
    }
    Ok(())
}

/// Meshes of every kind.
fn meshes() -> [(&'static str, Mesh); 9] {
    let triangle =
        Mesh { positions: vec![[0.0; 3], [1.0, 0.0, -0.0], [0.25, 0.75, 0.1]], faces: vec![[0, 1, 2]] };
    [
        ("empty", Mesh::default()),
        ("triangle", triangle),
        ("sphere", sphere(2)),
        ("noisy torus", noisy(&torus(16, 9), 0.01, 1)),
        ("grid", shuffled(&grid(14, 11), 2)),
        ("annulus", annulus(20, 4)),
        ("components", join(&[noisy(&icosahedron(), 0.02, 3), grid(3, 4), scan(150, 5)])),
        ("soup", soup(120, 4)),
        ("scan", scan(2000, 6)),
    ]
}

/// Meshes of either scheme's connectivity: closed, with a boundary, and under noise.
fn refined() -> Result<[(&'static str, Mesh); 6]> {
    let refined = |mesh: &Mesh, scheme| tercet::subdivide(mesh, scheme, 2, &Limits::default());
    let twice = |mesh: &Mesh| refined(mesh, Scheme::Sqrt3);
    let quartered = |mesh: &Mesh| refined(mesh, Scheme::Butterfly);
    let closed = twice(&icosahedron())?;
    Ok([
        ("closed √3", shuffled(&closed, 7)),
        ("open √3", shuffled(&twice(&grid(4, 3))?, 8)),
        ("noisy √3", noisy(&twice(&scan(60, 9))?, 0.002, 10)),
        ("closed butterfly", shuffled(&quartered(&icosahedron())?, 7)),
        ("open butterfly", shuffled(&quartered(&grid(4, 3))?, 8)),
        ("noisy butterfly", noisy(&quartered(&scan(60, 9))?, 0.002, 10)),
    ])
}

fn print_digests(name: &str, mesh: &Mesh, options: &[(&str, EncodeOptions)]) -> Result<()> {
    for (how, options) in options {
        let file = tercet::encode(mesh, options)?.bytes;
        let decoded = tercet::decode(&file, &Limits::default())?;
        println!("{:016x} {:016x}  {name}, {how}", digest(file), digest(bits(&decoded)));
    }
    Ok(())
}

/// A mesh as bytes.
fn bits(mesh: &Mesh) -> impl Iterator<Item = u8> {
    let positions = mesh.positions.as_flattened().iter().flat_map(|x| x.to_le_bytes());
    positions.chain(mesh.faces.as_flattened().iter().flat_map(|v| v.to_le_bytes()))
}

/// FNV-1a in 64 bits. A CRC-32 would not do: what ends in its own CRC-32, as a file's header does,
/// leaves the same remainder whatever it says.
fn digest(bytes: impl IntoIterator<Item = u8>) -> u64 {
    bytes.into_iter().fold(0xCBF2_9CE4_8422_2325, |hash, byte| {
        (hash ^ u64::from(byte)).wrapping_mul(0x0000_0100_0000_01B3)
    })
}
