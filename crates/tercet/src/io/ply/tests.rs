use super::*;

fn load(bytes: &[u8]) -> Result<Loaded> {
    super::read(bytes, &Limits::default())
}

fn ascii(elements: &str, body: &str) -> Vec<u8> {
    format!("ply\nformat ascii 1.0\n{elements}end_header\n{body}").into_bytes()
}

const XYZ: &str = "property float x\nproperty float y\nproperty float z\n";
const FACE: &str = "property list uchar int vertex_indices\n";

/// A file with one list, and with properties and elements around those that count.
mod tiny {
    pub const ELEMENTS: &str = "element before 1\nproperty double d\nproperty list short float l\n\
        element vertex 4\nproperty float nx\nproperty short z\nproperty float x\nproperty double y\n\
        property list uchar uint texcoord\nelement face 2\nproperty uchar flag\n\
        property list ushort uchar vertex_index\nproperty int after\nelement behind 1\nproperty char c\n";
    pub const ASCII: &str = "0.5 2 1 2\n9 -3 0.5 1.5 0\n9 0 -0.0 0 1 7\n9 1 1 1 0\n9 2 2 2 0\n\
        1 3 0 1 2 9\n1 4 3 2 1 0 9\n-1\n";

    /// The same numbers in binary, each given as its bytes in big-endian order.
    pub fn binary(big_endian: bool) -> Vec<u8> {
        let mut bytes = Vec::new();
        let mut put = |number: &[u8]| {
            let mut number = number.to_vec();
            if !big_endian {
                number.reverse();
            }
            bytes.extend(number);
        };
        put(&0.5f64.to_be_bytes());
        put(&2i16.to_be_bytes());
        put(&1f32.to_be_bytes());
        put(&2f32.to_be_bytes());
        let vertices = [
            (-3i16, 0.5f32, 1.5f64, None),
            (0, -0.0, 0.0, Some(7u32)),
            (1, 1.0, 1.0, None),
            (2, 2.0, 2.0, None),
        ];
        for (z, x, y, texture) in vertices {
            put(&9f32.to_be_bytes());
            put(&z.to_be_bytes());
            put(&x.to_be_bytes());
            put(&y.to_be_bytes());
            put(&[u8::from(texture.is_some())]);
            if let Some(texture) = texture {
                put(&texture.to_be_bytes());
            }
        }
        for face in [&[0u8, 1, 2][..], &[3, 2, 1, 0]] {
            put(&[1]);
            put(&(face.len() as u16).to_be_bytes());
            face.iter().for_each(|&v| put(&[v]));
            put(&9i32.to_be_bytes());
        }
        put(&[0xff]);
        bytes
    }
}

#[test]
fn all_encodings_are_equal() {
    let text = load(&ascii(tiny::ELEMENTS, tiny::ASCII)).unwrap();
    let positions = [[0.5, 1.5, -3.0], [-0.0, 0.0, 0.0], [1.0; 3], [2.0; 3]];
    assert_eq!(text.mesh.positions, positions);
    assert!(text.mesh.positions[1][0].is_sign_negative());
    assert_eq!(text.mesh.faces, [[0, 1, 2], [3, 2, 1], [3, 1, 0]]);
    let notes = [
        "1 polygon was cut into 2 triangles",
        "element \"before\" is not carried (1 item)",
        "normals are not carried (4 vertices have them)",
        "texture coordinates are not carried (4 vertices have them)",
        "face properties \"flag\", \"after\" are not carried (2 faces have them)",
        "element \"behind\" is not carried (1 item)",
    ];
    assert_eq!(text.notes, notes);
    let crlf = String::from_utf8(ascii(tiny::ELEMENTS, tiny::ASCII)).unwrap().replace('\n', "\r\n");
    assert_eq!(load(crlf.as_bytes()).unwrap(), text);

    for (name, big_endian) in [("binary_little_endian", false), ("binary_big_endian", true)] {
        for newline in ["\n", "\r\n"] {
            let header = format!("ply\nformat {name} 1.0\n{}end_header\n", tiny::ELEMENTS);
            let mut bytes = header.replace('\n', newline).into_bytes();
            bytes.extend(tiny::binary(big_endian));
            assert_eq!(load(&bytes).unwrap(), text, "{name} {newline:?}");
            bytes.push(0);
            let notes = load(&bytes).unwrap().notes;
            assert_eq!(notes.last().unwrap(), "ignored after the last element: 1 byte");
            bytes.truncate(bytes.len() - 2);
            assert!(load(&bytes).is_err());
        }
    }
}

#[test]
fn strips_alternate_and_restart() {
    let elements =
        format!("element vertex 6\n{XYZ}element tristrips 2\nproperty list int int vertex_indices\n");
    let vertices = "0 0 0\n1 0 0\n0 1 0\n1 1 0\n0 2 0\n1 2 0\n";
    let strips = "11 0 1 2 3 4 -1 2 3 4 5 -1\n2 0 1\n";
    let loaded = load(&ascii(&elements, &format!("{vertices}{strips}"))).unwrap();
    assert_eq!(loaded.mesh.faces, [[0, 1, 2], [2, 1, 3], [2, 3, 4], [2, 3, 4], [4, 3, 5]]);
    assert_eq!(loaded.notes, ["3 triangle strips were cut into 5 triangles"]);
}

#[test]
fn stitches_of_strips_are_left_out_and_keep_the_turn() {
    let elements =
        format!("element vertex 6\n{XYZ}element tristrips 1\nproperty list int int vertex_indices\n");
    let body = "0 0 0\n".repeat(6) + "9 0 1 2 2 2 3 3 4 5\n";
    let loaded = load(&ascii(&elements, &body)).unwrap();
    assert_eq!(loaded.mesh.faces, [[0, 1, 2], [3, 4, 5]]);
    assert_eq!(
        loaded.notes[1],
        "5 degenerate triangles within strips, which only join their parts, left out"
    );
}

#[test]
fn degenerate_faces_and_unreferenced_vertices_stay() {
    let elements = format!("element vertex 3\n{XYZ}element face 2\n{FACE}");
    let loaded = load(&ascii(&elements, "0 0 0\n0 0 0\n1 1 1\n3 0 0 1\n3 0 0 1\n")).unwrap();
    assert_eq!(loaded.mesh.positions.len(), 3);
    assert_eq!(loaded.mesh.faces, [[0, 0, 1], [0, 0, 1]]);
    assert_eq!(loaded.notes, Vec::<String>::new());
}

#[test]
fn faces_may_come_before_vertices() {
    let elements = format!("element face 1\n{FACE}element vertex 3\n{XYZ}");
    let loaded = load(&ascii(&elements, "3 2 1 0\n0 0 0\n1 0 0\n0 1 0\n")).unwrap();
    assert_eq!(loaded.mesh.faces, [[2, 1, 0]]);
}

#[test]
fn rounding_is_noted_only_where_bits_are_lost() {
    let load = |kind: &str, x: &str| {
        let elements = format!("element vertex 1\n{}", XYZ.replace("float", kind));
        load(&ascii(&elements, &format!("{x} 0 0\n"))).unwrap()
    };
    let noted = ["coordinates were rounded to 32-bit floats"];
    assert_eq!(load("double", "0.1").notes, noted);
    assert_eq!(load("double", "0.1").mesh.positions[0][0], 0.1);
    assert_eq!(load("int", "16777217").notes, noted);
    for (kind, x) in [("float", "0.1"), ("double", "0.5"), ("int", "16777216")] {
        assert!(load(kind, x).notes.is_empty(), "{kind} {x}");
    }
}

#[test]
fn a_double_beyond_the_floats_is_refused_with_its_vertex() {
    let header = format!(
        "ply\nformat binary_little_endian 1.0\nelement vertex 2\n{}end_header\n",
        XYZ.replace("float", "double")
    );
    let mut bytes = header.into_bytes();
    for x in [0.0, 0.0, 0.0, 0.0, 1e300f64, 0.0] {
        bytes.extend(x.to_le_bytes());
    }
    assert!(load(&bytes).unwrap_err().to_string().starts_with("vertex 1: y is inf"));
}

#[test]
fn errors_name_the_place() {
    let both = format!("element vertex 3\n{XYZ}element face 1\n{FACE}");
    let body = "0 0 0\n1 0 0\n0 1 0\n";
    let plain = format!("element vertex 3\n{XYZ}");
    let cases = [
        (both.clone(), format!("{body}3 0 1 3\n"), "face 0: index 3 is out of range"),
        (both.clone(), format!("{body}3 0 1 -1\n"), "face 0: index -1 is out of range"),
        (both.clone(), format!("{body}-3 0 1 2\n"), "line 13: -3 is not the length of a list"),
        (both.clone(), format!("{body}4 0 1 2\n"), "line 13: an integer is missing"),
        (both.clone(), format!("{body}3 0 1 2 0\n"), "line 13: \"0\" is one number too many"),
        (both, body.replace("1 0 0", "1.00000 0 0"), "line 13: the text ends too early"),
        (plain.clone(), body.replace("1 0 0", "1 nan 0"), "line 9, vertex 1: \"nan\" is not a finite"),
        (plain.replace("float y", "list int float y"), body.into(), "element \"vertex\": x, y and z"),
        (plain.replace("property float z\n", ""), body.into(), "element \"vertex\": x, y and z"),
        (format!("element face 1\n{FACE}"), "0\n".into(), "header: no element \"vertex\""),
        (plain + "element face 1\nproperty int flag\n", format!("{body}0\n"), "element \"face\": a list"),
    ];
    for (elements, body, expected) in cases {
        let error = load(&ascii(&elements, &body)).unwrap_err().to_string();
        assert!(error.starts_with(expected), "{error}");
    }
}
