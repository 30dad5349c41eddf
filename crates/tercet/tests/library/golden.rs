//! The files in `spec/golden`: what other decoders of the format are tested with, frozen.
//!
//! A valid file stands beside the mesh that it decodes to, as PLY, to the last bit. The name of an
//! invalid one begins with the kind of error that it is refused with.

use crate::common::file::{File, LOSSY};
use crate::common::{butterfly, sqrt3};
use crate::common::{holed, mirrored};
use std::collections::BTreeSet;
use std::fs;
use std::path::PathBuf;
use tercet::io::{self, Format};
use tercet::shapes::{annulus, grid, icosahedron, join, noisy, soup, torus};
use tercet::{
    Approximation, Decoder, Effort, EncodeOptions, Error, LevelScheme, Limits, Mesh, Precision, Progressive,
    Update, decode, encode,
};

fn folder() -> PathBuf {
    PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("../../spec/golden")
}

/// What each valid file was made of.
fn originals() -> Vec<(&'static str, Mesh, EncodeOptions)> {
    let exact = EncodeOptions::default();
    let ordered = EncodeOptions { keep_order: true, ..exact };
    let lattice = EncodeOptions { bits: Some(10), ..exact };
    let fast = EncodeOptions { effort: Effort::Fast, ..lattice };
    let late = EncodeOptions {
        progressive: Progressive::Smallest,
        scheme: LevelScheme::Adaptive,
        bits: Some(12),
        ..exact
    };
    let twins = EncodeOptions { scheme: LevelScheme::Adaptive, bits: Some(12), ..exact };
    let third = EncodeOptions { update: Update::Third, ..lattice };
    let paper = EncodeOptions { update: Update::Paper, ..lattice };
    let groups = EncodeOptions { bits: Some(24), groups: true, ..exact };
    let mut cut = join(&[torus(6, 5), soup(30, 2)]);
    cut.positions.push([0.5, -0.0, 3.25]);
    cut.faces.push([1, 1, 4]);
    vec![
        ("empty", Mesh::default(), exact),
        ("sqrt3_closed", noisy(&sqrt3::refined(&icosahedron(), 2), 0.01, 1), third),
        ("sqrt3_boundary", noisy(&sqrt3::refined(&grid(2, 3), 2), 0.01, 2), paper),
        ("butterfly_closed", noisy(&butterfly::refined(&icosahedron(), 2), 0.01, 6), third),
        ("butterfly_boundary", noisy(&butterfly::refined(&holed(), 1), 0.01, 7), paper),
        ("adaptive_boundary", noisy(&holed(), 0.01, 3), lattice),
        ("late", torus(30, 20), late),
        ("twins", mirrored([12, 8], 0.01, [9, 9]), twins),
        ("fast_boundary", noisy(&holed(), 0.01, 3), fast),
        ("fast_sqrt3", noisy(&sqrt3::refined(&grid(2, 3), 2), 0.01, 2), fast),
        ("sqrt3_groups", noisy(&sqrt3::refined(&icosahedron(), 4), 0.05, 9), groups),
        ("binary_order_merges_leftovers", quantised(&cut, 64.0), ordered),
        ("lossy", noisy(&torus(6, 5), 0.01, 8), lattice),
        ("decimal", quantised(&noisy(&annulus(11, 3), 0.02, 4), 1000.0), exact),
        // Of an encoder that knew √3 levels only: this torus divides by a butterfly step too.
        ("refined", noisy(&torus(10, 8), 0.02, 5), EncodeOptions { scheme: LevelScheme::Sqrt3, ..exact }),
    ]
}

/// A valid file. That of the name "lossy" bears the mark that the format document prints.
fn valid(name: &str, mesh: &Mesh, options: &EncodeOptions) -> Vec<u8> {
    let bytes = encode(mesh, options).unwrap().bytes;
    if name != "lossy" {
        return bytes;
    }
    let mut file = File::parse(&bytes);
    file.start[0] |= LOSSY;
    file.mark = vec![0xA0, 0x9C, 0x01, 0xBC, 0xB8, 0x02];
    file.mark.extend([0xEF, 0xCD, 0xAB, 0x89, 0x67, 0x45, 0x23, 0x01, 0x00, 0x3F, 0x00, 0x40]);
    file.bytes()
}

/// The mesh with its coordinates rounded to multiples of 1/`parts`, −0 kept.
fn quantised(mesh: &Mesh, parts: f64) -> Mesh {
    let round = |x: f32| ((f64::from(x) * parts).round() / parts) as f32;
    Mesh { positions: mesh.positions.iter().map(|p| p.map(round)).collect(), faces: mesh.faces.clone() }
}

/// Invalid files, each named by the error that it is refused with and its cause.
fn damaged(valid: &[u8]) -> Vec<(&'static str, Vec<u8>)> {
    let changed = |change: fn(&mut File)| {
        let mut file = File::parse(valid);
        change(&mut file);
        file.bytes()
    };
    let flipped = |at: usize| {
        let mut bytes = valid.to_vec();
        bytes[at] ^= 0x10;
        bytes
    };
    vec![
        ("checksum_of_a_header", flipped(12)),
        ("checksum_of_the_last_section", flipped(valid.len() - 1)),
        ("unsupported_version", [&valid[..4], &[99], &valid[5..]].concat()),
        ("unsupported_section_type", changed(|file| file.sections.push(section(7)))),
        ("truncated_in_a_level", valid[..valid.len() - 3].to_vec()),
        ("format_vertices_of_a_level", changed(|file| file.level(0).vertices += 1)),
        ("format_faces_of_the_mesh", changed(|file| file.faces -= 1)),
        ("format_levels_without_bytes", changed(|file| file.sections[1].payload.clear())),
        ("format_bytes_after_the_end", [valid, &[0]].concat()),
    ]
}

fn section(kind: u8) -> crate::common::file::Section {
    crate::common::file::Section { kind, level: None, payload: Vec::new() }
}

fn kind(error: &Error) -> &'static str {
    match error {
        Error::Format { .. } => "format",
        Error::Checksum { .. } => "checksum",
        Error::Truncated { .. } => "truncated",
        Error::Unsupported(_) => "unsupported",
        Error::Limit { .. } => "limit",
        _ => "other",
    }
}

/// The names, without it, of the files with this suffix.
fn stored(subfolder: &str, suffix: &str) -> BTreeSet<String> {
    let entries = fs::read_dir(folder().join(subfolder)).unwrap();
    let paths = entries.map(|entry| entry.unwrap().path());
    let wanted = paths.filter(|path| path.extension().is_some_and(|s| s == suffix));
    wanted.map(|path| path.file_stem().unwrap().to_str().unwrap().to_owned()).collect()
}

fn read(name: &str) -> Vec<u8> {
    fs::read(folder().join(name)).unwrap_or_else(|error| panic!("{name}: {error}"))
}

/// A mesh to the last bit.
fn bits(mesh: &Mesh) -> (Vec<[u32; 3]>, &[[u32; 3]]) {
    (mesh.positions.iter().map(|p| p.map(f32::to_bits)).collect(), &mesh.faces)
}

#[test]
fn valid_files_decode_to_the_bits_beside_them() {
    let names = stored("valid", "tct");
    assert!(!names.is_empty());
    assert_eq!(names, stored("valid", "ply"));
    for name in names {
        let mesh = decode(&read(&format!("valid/{name}.tct")), &Limits::default());
        let mesh = mesh.unwrap_or_else(|error| panic!("{name}: {error}"));
        let ply = read(&format!("valid/{name}.ply"));
        let expected = io::read(&ply, Format::Ply, &Limits::default()).unwrap().mesh;
        assert_eq!(bits(&mesh), bits(&expected), "{name}");
    }
}

#[test]
fn invalid_files_are_refused_with_the_error_in_their_name() {
    let names = stored("invalid", "tct");
    assert!(!names.is_empty());
    for name in names {
        let refused = decode(&read(&format!("invalid/{name}.tct")), &Limits::default());
        let error = refused.expect_err(&name);
        assert!(name.starts_with(kind(&error)), "{name}: {error}");
    }
}

#[test]
fn the_encoder_still_writes_the_valid_files() {
    let originals = originals();
    let names: BTreeSet<String> = originals.iter().map(|(name, ..)| (*name).to_owned()).collect();
    assert_eq!(names, stored("valid", "tct"));
    for (name, mesh, options) in originals {
        let same = valid(name, &mesh, &options) == read(&format!("valid/{name}.tct"));
        assert!(same, "{name}: after a change of the format write it anew: cargo xtask seeds");
    }
}

#[test]
fn the_valid_files_have_every_kind_of_level_section_and_precision() {
    let (mut levels, mut sections, mut precisions) = (BTreeSet::new(), BTreeSet::new(), BTreeSet::new());
    for (name, mesh, options) in originals() {
        let file = File::parse(&read(&format!("valid/{name}.tct")));
        for section in file.sections {
            sections.insert(section.kind);
            levels.extend(section.level.map(|level| level.kind));
        }
        precisions.insert(match encode(&mesh, &options).unwrap().info.precision {
            Precision::Lattice { .. } => "lattice",
            Precision::Decimal { .. } => "decimal",
            Precision::Binary { .. } => "binary",
            Precision::Refined { .. } => "refined",
        });
    }
    // Base, adaptive and late; √3 of both generations under both updates, and butterfly; √3 in groups.
    assert!(
        [0x00, 0x01, 0x05, 0x12, 0x22, 0x23, 0x14, 0x24, 0x06].iter().all(|kind| levels.contains(kind)),
        "{levels:02x?}"
    );
    assert!((1..=6).all(|kind| sections.contains(&kind)), "{sections:?}");
    assert_eq!(precisions.len(), 4, "{precisions:?}");
}

#[test]
fn the_mark_of_a_lossy_file_is_told_and_decodes_nothing() {
    let mesh = noisy(&torus(6, 5), 0.01, 8);
    let options = EncodeOptions { bits: Some(10), ..EncodeOptions::default() };
    let (plain, marked) = (valid("plain", &mesh, &options), valid("lossy", &mesh, &options));
    let info = |bytes: &[u8]| {
        let mut decoder = Decoder::new(Limits::default());
        decoder.push(bytes);
        decoder.info().unwrap().approximation
    };
    assert_eq!(info(&plain), None);
    let printed = Approximation {
        vertices: 20_000,
        faces: 39_996,
        digest: 0x0123_4567_89AB_CDEF,
        rms: 0.5,
        greatest: 2.0,
    };
    assert_eq!(info(&marked), Some(printed));
    let [plain, marked] = [plain, marked].map(|bytes| decode(&bytes, &Limits::default()).unwrap());
    assert_eq!(plain, marked);
}

#[test]
#[ignore = "replaces the golden files: cargo xtask seeds"]
fn write_the_golden_files() {
    for subfolder in ["valid", "invalid"] {
        let subfolder = folder().join(subfolder);
        let _ = fs::remove_dir_all(&subfolder);
        fs::create_dir_all(&subfolder).unwrap();
    }
    for (name, mesh, options) in originals() {
        let bytes = valid(name, &mesh, &options);
        let mut ply = Vec::new();
        io::write(&decode(&bytes, &Limits::default()).unwrap(), Format::Ply, &mut ply).unwrap();
        fs::write(folder().join("valid").join(name).with_extension("ply"), ply).unwrap();
        fs::write(folder().join("valid").join(name).with_extension("tct"), &bytes).unwrap();
        println!("{name}: {} bytes", bytes.len());
        if name == "sqrt3_closed" {
            for (name, bytes) in damaged(&bytes) {
                fs::write(folder().join("invalid").join(name).with_extension("tct"), bytes).unwrap();
            }
        }
    }
}
