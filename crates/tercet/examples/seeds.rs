//! Writes the files that the fuzz target `decode` starts from into a folder: `cargo xtask seeds`.
//!
//! Few and small, so that the fuzzer can change them often; together they have every kind of section.

use std::path::PathBuf;
use tercet::shapes::{annulus, grid, icosahedron, noisy, scan, soup, torus};
use tercet::{Effort, EncodeOptions, Limits, Mesh, Progressive, Scheme, Update};

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let folder = PathBuf::from(std::env::args_os().nth(1).ok_or("usage: seeds FOLDER")?);
    let exact = EncodeOptions::default();
    let ordered = EncodeOptions { keep_order: true, ..exact };
    let lattice = EncodeOptions { bits: Some(8), ..exact };
    let smallest = EncodeOptions {
        progressive: Progressive::Smallest,
        scheme: tercet::LevelScheme::Adaptive,
        ..lattice
    };
    let fast = EncodeOptions { effort: Effort::Fast, ..lattice };
    let lifted = EncodeOptions { update: Update::Third, ..lattice };
    let steps = |mesh: &Mesh, scheme, steps| tercet::subdivide(mesh, scheme, steps, &Limits::default());
    let refined = |mesh: &Mesh, scheme| steps(mesh, scheme, 2);
    let groups = EncodeOptions { bits: Some(24), groups: true, ..exact };
    // Groups have half a kilobyte at least.
    let grouped = noisy(&steps(&icosahedron(), Scheme::Sqrt3, 4)?, 0.05, 9);
    for (name, mesh, options) in [
        ("closed_adaptive", scan(60, 1), lattice),
        ("closed_fast", scan(60, 1), fast),
        ("closed_sqrt3", refined(&icosahedron(), Scheme::Sqrt3)?, lifted),
        ("boundary_sqrt3", refined(&grid(2, 3), Scheme::Sqrt3)?, lifted),
        ("closed_butterfly", refined(&icosahedron(), Scheme::Butterfly)?, lattice),
        ("boundary_butterfly", refined(&grid(1, 2), Scheme::Butterfly)?, lifted),
        ("closed_groups", grouped, groups),
        ("closed_late", torus(15, 10), smallest),
        ("boundary_on_a_grid", grid(5, 4), exact),
        ("boundaries_exact", annulus(9, 2), exact),
        ("defects_exact_order_kept", soup(24, 2), ordered),
    ] {
        let file = tercet::encode(&mesh, &options)?.bytes;
        println!("{name}: {} bytes", file.len());
        std::fs::write(folder.join(name).with_extension("tct"), file)?;
    }
    Ok(())
}
