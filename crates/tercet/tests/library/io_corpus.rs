//! Reads the real meshes in the folder that `TERCET_CORPUS` names.
//!
//! The folder's README.md has a table whose first columns are a file and its number of
//! vertices; the third says "closed" of a closed, consistently oriented surface.

use std::collections::HashSet;
use std::path::Path;

use tercet::io::{Format, read, write};
use tercet::{Limits, Mesh};

/// Rows of the table: file name, vertices ("48 485"), and whether it is said to be closed.
fn table(readme: &str) -> Vec<(&str, usize, bool)> {
    readme
        .lines()
        .filter_map(|line| {
            let mut cells = line.split('|').map(str::trim).skip(1);
            let (name, count, remark) = (cells.next()?, cells.next()?, cells.next()?);
            Some((name, count.replace(' ', "").parse().ok()?, remark.starts_with("closed")))
        })
        .collect()
}

/// Whether every edge is used once in each direction.
fn is_closed(mesh: &Mesh) -> bool {
    let edges = || mesh.faces.iter().flat_map(|&[a, b, c]| [(a, b), (b, c), (c, a)]);
    let directed: HashSet<(u32, u32)> = edges().collect();
    directed.len() == 3 * mesh.faces.len() && edges().all(|(a, b)| directed.contains(&(b, a)))
}

fn load(bytes: &[u8], format: Format, name: &str) -> Mesh {
    let loaded = read(bytes, format, &Limits::default()).unwrap_or_else(|error| panic!("{name}: {error}"));
    for note in &loaded.notes {
        println!("{name}: {note}");
    }
    loaded.mesh
}

#[test]
fn real_meshes_have_the_vertices_their_table_says_and_survive_every_writer() {
    let Some(folder) = std::env::var_os("TERCET_CORPUS") else {
        println!("skipped: TERCET_CORPUS is not set");
        return;
    };
    let folder = Path::new(&folder);
    let readme = std::fs::read_to_string(folder.join("README.md")).expect("README.md of the corpus");
    let table = table(&readme);
    assert!(!table.is_empty(), "no table of meshes in README.md");
    for (name, vertices, closed) in table {
        let path = folder.join(name);
        let format = Format::from_path(&path).expect("a known suffix");
        let mesh = load(&std::fs::read(&path).expect("the mesh"), format, name);
        assert_eq!(mesh.positions.len(), vertices, "{name}");
        assert!(!mesh.faces.is_empty(), "{name}");
        assert!(!closed || is_closed(&mesh), "{name} is not closed");
        for format in [Format::Obj, Format::Ply, Format::Off] {
            let mut bytes = Vec::new();
            write(&mesh, format, &mut bytes).expect("memory takes it");
            assert!(load(&bytes, format, name) == mesh, "{name} as {}", format.name());
        }
    }
}
