//! Prints one line per generated mesh and set of options: a digest that must not depend on the platform.
//!
//! `cargo xtask test` builds this program for the host and for a platform with another word
//! size, runs both, and fails unless they print the same lines.

use tercet::Mesh;

fn main() {
    let mesh = Mesh {
        positions: vec![[0.0, 0.0, 0.0], [1.0, 0.0, -0.0], [0.25, 0.75, 0.1]],
        faces: vec![[0, 1, 2]],
    };
    let bytes: Vec<u8> = mesh
        .positions
        .iter()
        .flatten()
        .flat_map(|x| x.to_le_bytes())
        .chain(mesh.faces.iter().flatten().flat_map(|v| v.to_le_bytes()))
        .collect();
    println!("{:08x}  one triangle", crc32fast::hash(&bytes));
}
