//! What holds for every format: bits survive, and no bytes do harm.

use super::*;
use crate::Error;

const FORMATS: [Format; 4] = [Format::Obj, Format::Ply, Format::Stl, Format::Off];

/// Coordinates at the edges of what `f32` can say, in a mesh that uses its vertices in
/// order (so that STL can carry it).
fn extreme() -> Mesh {
    let positions = vec![
        [-0.0, 0.0, f32::MAX],
        [f32::MIN, f32::MIN_POSITIVE, f32::from_bits(1)],
        [0.1, -1.0 / 3.0, 16_777_216.0],
        [f32::EPSILON, -f32::from_bits(0x007f_ffff), 1e-20],
        [0.0, 0.0, f32::MAX],
    ];
    Mesh { positions, faces: vec![[0, 1, 2], [2, 1, 3], [3, 3, 4], [0, 1, 2]] }
}

fn bits(mesh: &Mesh) -> Vec<[u32; 3]> {
    mesh.positions.iter().map(|p| p.map(f32::to_bits)).collect()
}

fn written(mesh: &Mesh, format: Format) -> Vec<u8> {
    let mut bytes = Vec::new();
    write(mesh, format, &mut bytes).unwrap();
    bytes
}

fn load(bytes: &[u8], format: Format) -> Result<Loaded> {
    read(bytes, format, &Limits::default())
}

/// Small files of every kind, with most of what each format can say.
fn samples() -> Vec<(Format, Vec<u8>)> {
    let mut samples: Vec<_> = FORMATS.map(|format| (format, written(&extreme(), format))).into();
    let ascii = "ply\nformat ascii 1.0\ncomment c\nelement vertex 4\nproperty double x\nproperty float y\n\
        property int z\nproperty uchar red\nelement other 1\nproperty list uchar short l\n\
        element tristrips 1\nproperty list int int vertex_indices\nend_header\n\
        0.1 0 0 9\n1 0 0 9\n0 1 0 9\n1 1 0 9\n2 5 6\n8 0 1 2 3 -1 3 2 0\n";
    let obj = "# c\nmtllib m\no name\nv 0 0 0\nv 1 0 0 2\nv 1 1 0 1 0 0\nv 0 1 \\\n0\nvt 0 0\nvn 0 0 1\n\
        usemtl m\ns off\nf 1/1/1 2//1 3/1 -1\nl 1 2\np 1\ncurv 0 1\n";
    let off = "COFF # c\n4 2 0\n0 0 0 1 0 0 1\n1 0 0\n1 1 0\n0 1 0\n4 0 1 2 3 0.5\n2 0 1\n";
    let stl = "solid s\nfacet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex 1 0 0\nvertex 0 1 0\n\
        endloop\nendfacet\nendsolid s\n";
    let texts = [(Format::Ply, ascii), (Format::Obj, obj), (Format::Off, off), (Format::Stl, stl)];
    samples.extend(texts.map(|(format, text)| (format, text.as_bytes().to_vec())));
    samples
}

#[test]
fn formats_are_found_by_suffix_and_name_in_any_case() {
    for format in FORMATS {
        assert_eq!(Format::from_name(&format.name().to_uppercase()), Some(format));
        let path = format!("folder.ply/mesh.{}", format.name());
        assert_eq!(Format::from_path(Path::new(&path)), Some(format));
    }
    assert_eq!(Format::from_path(Path::new("mesh.tct")), None);
    assert_eq!(Format::from_path(Path::new("obj")), None);
}

#[test]
fn every_format_restores_every_bit() {
    let mesh = extreme();
    for format in FORMATS {
        assert_eq!(losses(&mesh, format), Vec::<String>::new());
        let loaded = load(&written(&mesh, format), format).unwrap();
        assert_eq!(bits(&loaded.mesh), bits(&mesh), "{format:?}");
        assert_eq!(loaded.mesh.faces, mesh.faces, "{format:?}");
    }
}

#[test]
fn what_is_written_needs_no_remark() {
    for format in [Format::Obj, Format::Ply, Format::Off] {
        assert_eq!(load(&written(&extreme(), format), format).unwrap().notes, Vec::<String>::new());
    }
}

#[test]
fn every_format_carries_the_empty_mesh() {
    for format in FORMATS {
        let loaded = load(&written(&Mesh::default(), format), format).unwrap();
        assert_eq!(loaded, Loaded::default(), "{format:?}");
    }
}

#[test]
fn writers_refuse_what_is_not_a_mesh() {
    let nan = Mesh { positions: vec![[0.0, f32::NAN, 0.0]], faces: vec![] };
    let range = Mesh { positions: vec![], faces: vec![[0, 0, 0]] };
    for format in FORMATS {
        for mesh in [&nan, &range] {
            assert!(matches!(write(mesh, format, &mut Vec::new()), Err(Error::Mesh { .. })));
        }
    }
}

#[test]
fn a_failing_writer_is_reported() {
    for format in FORMATS {
        let mut full: &mut [u8] = &mut [0; 8];
        assert!(matches!(write(&extreme(), format, &mut full), Err(Error::Io(_))), "{format:?}");
    }
}

#[test]
fn the_samples_can_be_read() {
    for (format, bytes) in samples() {
        let loaded = load(&bytes, format).unwrap();
        assert!(!loaded.mesh.faces.is_empty(), "{format:?}");
    }
}

#[test]
fn every_truncation_gives_an_error_or_a_mesh() {
    for (format, bytes) in samples() {
        for length in 0..bytes.len() {
            if let Ok(loaded) = load(&bytes[..length], format) {
                loaded.mesh.check().unwrap();
            }
        }
    }
}

#[test]
fn a_truncated_binary_file_is_an_error() {
    for format in [Format::Ply, Format::Stl] {
        let bytes = written(&extreme(), format);
        for length in 0..bytes.len() {
            assert!(load(&bytes[..length], format).is_err(), "{format:?} {length}");
        }
    }
}

#[test]
fn every_changed_byte_gives_an_error_or_a_mesh() {
    for (format, mut bytes) in samples() {
        for at in 0..bytes.len() {
            let old = bytes[at];
            for new in [0, b'\n', b'\r', b' ', b'-', b'/', b'9', b'\\', 0x7f, 0xff, old ^ 1, old ^ 0x80] {
                bytes[at] = new;
                if let Ok(loaded) = load(&bytes, format) {
                    loaded.mesh.check().unwrap();
                }
            }
            bytes[at] = old;
        }
    }
}

#[test]
fn noise_gives_an_error_or_a_mesh() {
    let mut state = 1u32;
    let mut noise = [0u8; 300];
    for _ in 0..500 {
        for byte in &mut noise {
            state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            *byte = (state >> 24) as u8;
        }
        for format in FORMATS {
            if let Ok(loaded) = load(&noise, format) {
                loaded.mesh.check().unwrap();
            }
        }
    }
}

#[test]
fn counts_that_the_bytes_cannot_hold_are_refused() {
    let ply =
        |counts: &str| format!("ply\nformat binary_little_endian 1.0\n{counts}end_header\n").into_bytes();
    let xyz = "property uchar x\nproperty uchar y\nproperty uchar z\n";
    let mut stl = vec![0; 84];
    stl[80..].fill(0xff);
    let files = [
        (Format::Ply, ply(&format!("element vertex 4000000000\n{xyz}"))),
        (Format::Ply, ply("element vertex 4000000000\n")),
        (Format::Ply, ply("element vertex 9223372036854775807\nproperty double x\n")),
        (Format::Ply, ply(&format!("element vertex 0\n{xyz}element face 4000000000\n"))),
        (
            Format::Ply,
            b"ply\nformat ascii 1.0\nelement vertex 4000000000\nproperty int x\nend_header\n".into(),
        ),
        (Format::Off, b"OFF 4000000000 0 0\n".into()),
        (Format::Off, b"OFF 0 9223372036854775807 0\n".into()),
        (Format::Stl, stl),
    ];
    for (format, bytes) in files {
        let error = load(&bytes, format).unwrap_err();
        assert!(matches!(error, Error::Syntax { .. }), "{error}");
    }
}

#[test]
fn a_mesh_beyond_the_memory_limit_is_refused() {
    let mut mesh = Mesh { positions: vec![[0.5; 3]; 1000], faces: vec![[0, 1, 2]; 1000] };
    for (i, position) in mesh.positions.iter_mut().enumerate() {
        position[0] = i as f32;
    }
    mesh.faces.extend((0..333).map(|i| [3 * i, 3 * i + 1, 3 * i + 2]));
    for format in FORMATS {
        let bytes = written(&mesh, format);
        assert!(read(&bytes, format, &Limits { max_memory: 100_000 }).is_ok(), "{format:?}");
        let error = read(&bytes, format, &Limits { max_memory: 20_000 }).unwrap_err();
        assert!(matches!(error, Error::Limit { .. }), "{format:?}: {error}");
    }
}

#[test]
fn a_file_of_another_kind_is_refused() {
    let png = b"\x89PNG\r\n\x1a\n\0\0\0\rIHDR\0\0\0\x01\0\0\0\x01";
    for format in FORMATS {
        assert!(load(png, format).is_err(), "{format:?}");
    }
}
