//! One coding of a generated mesh, for what counts instructions: `costs` prints the names of the cases,
//! `costs encode CASE FILE` writes the case's file, `costs decode FILE` decodes it.
//!
//! `cargo xtask test --only costs` compares the sizes and the instructions of all cases with the recorded ones.

use std::error::Error;

use tercet::shapes::{grid, noisy, scan, shuffled, sphere, torus};
use tercet::{Effort, EncodeOptions, Limits, Mesh, Progressive, Scheme};

/// A case's name, its mesh and how it is coded.
type Case = (&'static str, fn() -> tercet::Result<Mesh>, EncodeOptions);

const VERTICES: usize = 4000;

fn cases() -> [Case; 8] {
    let lattice = EncodeOptions { bits: Some(12), ..EncodeOptions::default() };
    let effort = |effort| EncodeOptions { effort, ..lattice };
    [
        ("scan-default", || Ok(scan(VERTICES, 1)), lattice),
        ("scan-fast", || Ok(scan(VERTICES, 1)), effort(Effort::Fast)),
        ("scan-max", || Ok(scan(VERTICES, 1)), effort(Effort::Max)),
        ("scan-exact", || Ok(scan(VERTICES, 1)), EncodeOptions::default()),
        (
            "sphere-late",
            || Ok(noisy(&sphere(4), 0.0005, 2)),
            EncodeOptions { progressive: Progressive::Smallest, ..lattice },
        ),
        ("terrain", || Ok(shuffled(&noisy(&grid(60, 70), 0.01, 3), 4)), lattice),
        ("sqrt3", || refined(Scheme::Sqrt3, 3), lattice),
        ("butterfly", || refined(Scheme::Butterfly, 2), lattice),
    ]
}

/// A torus of some thousands of vertices and the scheme's connectivity.
fn refined(scheme: Scheme, steps: u32) -> tercet::Result<Mesh> {
    let mesh = tercet::subdivide(&noisy(&torus(20, 12), 0.02, 5), scheme, steps, &Limits::default())?;
    Ok(shuffled(&noisy(&mesh, 0.0005, 6), 7))
}

fn main() -> Result<(), Box<dyn Error>> {
    let words: Vec<String> = std::env::args().skip(1).collect();
    match words.iter().map(String::as_str).collect::<Vec<_>>()[..] {
        [] => cases().iter().for_each(|(name, ..)| println!("{name}")),
        ["encode", name, file] => {
            let (_, mesh, options) =
                cases().into_iter().find(|case| case.0 == name).ok_or_else(|| format!("no case {name}"))?;
            std::fs::write(file, tercet::encode(&mesh()?, &options)?.bytes)?;
        }
        ["decode", file] => {
            let mesh = tercet::decode(&std::fs::read(file)?, &Limits::default())?;
            println!("{} vertices", mesh.positions.len());
        }
        _ => return Err("usage: costs [encode CASE FILE | decode FILE]".into()),
    }
    Ok(())
}
