//! Stereolithography: triangles without indices, as text or binary.
//!
//! Binary layout, little endian: 80 bytes of anything, `u32` triangles, then 50 bytes a
//! triangle: normal and three corners as 3 × `f32` each, `u16` attribute bytes.

use std::collections::{HashMap, HashSet};
use std::io::Write;

use super::Loaded;
use super::builder::Builder;
use super::text::{Text, count, quote};
use crate::{Error, Limits, Mesh, Result};

/// Bytes before the first triangle of a binary file, and of each triangle.
const HEADER: usize = 84;
const TRIANGLE: usize = 50;

/// Reads an STL file of either kind.
///
/// A binary file may start with "solid" like a text, so its length decides first.
pub(super) fn read(bytes: &[u8], limits: &Limits) -> Result<Loaded> {
    let declared = bytes.get(80..HEADER).map(|b| u64::from(u32::from_le_bytes([b[0], b[1], b[2], b[3]])));
    let length = declared.map(|n| HEADER as u64 + n * TRIANGLE as u64);
    let exact = length == Some(bytes.len() as u64);
    let mut corners = Corners::new(limits);
    let mut notes = Vec::new();
    if !exact && bytes.trim_ascii_start().starts_with(b"solid") {
        read_text(bytes, &mut corners, &mut notes)?;
    } else {
        let Some(length) = length else {
            let cause = format!("a binary STL file has {HEADER} bytes or more, this one {}", bytes.len());
            return Err(Error::syntax("header", cause));
        };
        if length > bytes.len() as u64 {
            let cause =
                format!("{length} bytes declared by the number of triangles, {} are there", bytes.len());
            return Err(Error::syntax("byte 80", cause));
        }
        let (triangles, rest) = bytes[HEADER..].split_at(length as usize - HEADER);
        read_binary(triangles, &mut corners, &mut notes)?;
        if !rest.is_empty() {
            let bytes = count(rest.len() as u64, "byte", "bytes");
            notes.push(format!("ignored after the last triangle: {bytes}"));
        }
    }
    corners.finish(notes)
}

/// Gives corners their vertices: one for all bit-identical positions, in order of first
/// appearance.
struct Corners<'a> {
    mesh: Builder<'a>,
    limits: &'a Limits,
    corners: u64,
    /// Vertices by the bits of their positions; only looked up, so its order is of no effect.
    known: HashMap<[u32; 3], u32>,
}

impl<'a> Corners<'a> {
    /// Bytes a vertex takes in `known` at worst: a table that has just doubled beside the
    /// one it replaces.
    const KNOWN: u64 = 64;

    fn new(limits: &'a Limits) -> Self {
        Corners { mesh: Builder::new(limits), limits, corners: 0, known: HashMap::new() }
    }

    fn vertex(&mut self, position: [f32; 3]) -> Result<u32> {
        self.corners += 1;
        let bits = position.map(f32::to_bits);
        if let Some(&vertex) = self.known.get(&bits) {
            return Ok(vertex);
        }
        let vertex = self.mesh.vertices();
        self.limits.check("search for equal corners", u64::from(vertex) + 1, Self::KNOWN)?;
        self.mesh.vertex(position)?;
        self.known.insert(bits, vertex);
        Ok(vertex)
    }

    fn finish(self, mut notes: Vec<String>) -> Result<Loaded> {
        if self.corners > 0 {
            let corners = count(self.corners, "corner", "corners");
            let vertices = count(self.mesh.vertices().into(), "vertex", "vertices");
            notes.insert(0, format!("bit-identical corners were merged: {corners}, {vertices}"));
        }
        drop(self.known);
        self.mesh.finish(notes)
    }
}

fn read_binary(triangles: &[u8], corners: &mut Corners, notes: &mut Vec<String>) -> Result<()> {
    corners.mesh.reserve(0, (triangles.len() / TRIANGLE) as u64)?;
    let mut attributed = 0;
    for (i, triangle) in triangles.chunks_exact(TRIANGLE).enumerate() {
        let mut face = [0; 3];
        for (k, vertex) in face.iter_mut().enumerate() {
            let bytes = &triangle[12 * (k + 1)..12 * (k + 2)];
            let position = [0, 4, 8].map(|at| float(&bytes[at..at + 4]));
            if let Some(x) = position.iter().find(|x| !x.is_finite()) {
                return Err(Error::mesh(format!("face {i}"), format!("{x} is not a finite coordinate")));
            }
            *vertex = corners.vertex(position)?;
        }
        corners.mesh.face(face)?;
        attributed += u64::from(triangle[48..] != [0, 0]);
    }
    if attributed > 0 {
        let faces = count(attributed, "triangle has", "triangles have");
        notes.push(format!("attribute bytes are not carried ({faces} them)"));
    }
    Ok(())
}

fn float(bytes: &[u8]) -> f32 {
    f32::from_le_bytes([bytes[0], bytes[1], bytes[2], bytes[3]])
}

/// Where a text is: what it may say next follows from it.
#[derive(Clone, Copy, PartialEq)]
enum State {
    Outside,
    Solid,
    Facet,
    Loop,
    LoopDone,
}

/// Reads the text form, one statement a line, in any letter case. Normals are not looked
/// at: the corners' order gives them.
fn read_text(bytes: &[u8], corners: &mut Corners, notes: &mut Vec<String>) -> Result<()> {
    use State::*;
    let mut text = Text::new(bytes);
    let mut state = Outside;
    let mut solids = 0;
    while text.seek_word() {
        let word = text.word().unwrap_or_default();
        let is = |keyword: &str| word.eq_ignore_ascii_case(keyword.as_bytes());
        state = match state {
            Outside if is("solid") => {
                solids += 1;
                Solid
            }
            Solid if is("facet") => Facet,
            Solid if is("endsolid") => Outside,
            Facet if is("outer") => Loop,
            Loop if is("vertex") => {
                let vertex = corners.vertex([text.number()?, text.number()?, text.number()?])?;
                corners.mesh.corner(vertex)?;
                Loop
            }
            Loop if is("endloop") => {
                corners.mesh.end_polygon();
                LoopDone
            }
            LoopDone if is("endfacet") => Solid,
            _ => return Err(text.error(format!("{} is out of place", quote(word)))),
        };
        text.next_line();
    }
    if state != Outside {
        return Err(text.error("the text ends inside a solid"));
    }
    if solids > 1 {
        notes.push(format!("{solids} solids were joined into one mesh"));
    }
    Ok(())
}

/// Writes a binary STL file with computed normals.
pub(super) fn write(mesh: &Mesh, out: &mut impl Write) -> Result<()> {
    let triangles = u32::try_from(mesh.faces.len())
        .map_err(|_| Error::Parameter("STL cannot count more than 4294967295 triangles".into()))?;
    let mut header = [0; 80];
    header[..10].copy_from_slice(b"binary STL");
    out.write_all(&header)?;
    out.write_all(&triangles.to_le_bytes())?;
    for face in &mesh.faces {
        let corners = face.map(|v| mesh.positions[v as usize]);
        let mut triangle = [0; TRIANGLE];
        let floats = normal(corners).into_iter().chain(corners.into_iter().flatten());
        for (bytes, x) in triangle.chunks_exact_mut(4).zip(floats) {
            bytes.copy_from_slice(&x.to_le_bytes());
        }
        out.write_all(&triangle)?;
    }
    Ok(())
}

/// The unit normal; zero where there is none. In `f64`, in which neither the products of the
/// largest floats overflow nor those of the smallest vanish.
fn normal(corners: [[f32; 3]; 3]) -> [f32; 3] {
    let [a, b, c] = corners.map(|p| p.map(f64::from));
    let u = [b[0] - a[0], b[1] - a[1], b[2] - a[2]];
    let v = [c[0] - a[0], c[1] - a[1], c[2] - a[2]];
    let n = [u[1] * v[2] - u[2] * v[1], u[2] * v[0] - u[0] * v[2], u[0] * v[1] - u[1] * v[0]];
    let length = n.iter().map(|x| x * x).sum::<f64>().sqrt();
    if length > 0.0 { n.map(|x| (x / length) as f32) } else { [0.0; 3] }
}

/// What an STL file cannot carry of this mesh.
pub(super) fn losses(mesh: &Mesh) -> Vec<String> {
    let mut losses = Vec::new();
    let mut used = vec![false; mesh.positions.len()];
    let mut known = HashSet::new();
    let (mut coincident, mut reordered) = (0, false);
    let mut latest = 0;
    for &v in mesh.faces.iter().flatten() {
        let Some(position) = mesh.positions.get(v as usize) else { continue };
        if std::mem::replace(&mut used[v as usize], true) {
            continue;
        }
        reordered |= v < latest;
        latest = v;
        coincident += u64::from(!known.insert(position.map(f32::to_bits)));
    }
    let unused = used.iter().filter(|&&used| !used).count() as u64;
    if unused > 0 {
        losses.push(count(unused, "unreferenced vertex", "unreferenced vertices"));
    }
    if coincident > 0 {
        let vertices = count(coincident, "vertex that coincides", "vertices that coincide");
        losses.push(format!("{vertices} with another"));
    }
    if reordered {
        losses.push("the order of the vertices".into());
    }
    losses
}

#[cfg(test)]
mod tests {
    use super::*;

    fn load(bytes: &[u8]) -> Result<Loaded> {
        read(bytes, &Limits::default())
    }

    fn binary(mesh: &Mesh) -> Vec<u8> {
        let mut bytes = Vec::new();
        write(mesh, &mut bytes).unwrap();
        bytes
    }

    fn square() -> Mesh {
        let positions = vec![[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [1.0, 1.0, 0.0], [0.0, 1.0, 0.0]];
        Mesh { positions, faces: vec![[0, 1, 2], [0, 2, 3]] }
    }

    fn text(mesh: &Mesh) -> String {
        let mut text = String::from("solid a b\n");
        for face in &mesh.faces {
            text += "facet normal 0 0 1\n outer loop\n";
            for [x, y, z] in face.map(|v| mesh.positions[v as usize]) {
                text += &format!("  vertex {x} {y} {z:e}\n");
            }
            text += " endloop\nendfacet\n";
        }
        text + "endsolid\n"
    }

    #[test]
    fn text_and_binary_are_equal() {
        let loaded = load(&binary(&square())).unwrap();
        assert_eq!(loaded.mesh, square());
        assert_eq!(loaded.notes, ["bit-identical corners were merged: 6 corners, 4 vertices"]);
        let text = text(&square());
        for text in [text.to_uppercase().replacen("SOLID", "solid", 1), text.replace('\n', "\r\n"), text] {
            assert_eq!(load(text.as_bytes()).unwrap(), loaded);
        }
    }

    #[test]
    fn a_binary_file_may_start_like_a_text() {
        let mut bytes = binary(&square());
        bytes[..6].copy_from_slice(b"solid ");
        assert_eq!(load(&bytes).unwrap().mesh, square());
    }

    #[test]
    fn zeros_of_either_sign_are_two_vertices() {
        let positions = vec![[0.0, 0.0, 0.0], [-0.0, 0.0, 0.0], [1.0, 0.0, 0.0]];
        let mesh = Mesh { positions, faces: vec![[0, 1, 2]] };
        assert_eq!(load(&binary(&mesh)).unwrap().mesh.positions.len(), 3);
    }

    #[test]
    fn attribute_bytes_several_solids_and_trailing_bytes_are_noted() {
        let mut bytes = binary(&square());
        bytes[HEADER + 48] = 1;
        assert_eq!(load(&bytes).unwrap().notes[1], "attribute bytes are not carried (1 triangle has them)");
        bytes.push(0);
        assert_eq!(load(&bytes).unwrap().notes[2], "ignored after the last triangle: 1 byte");
        let two = text(&square()).repeat(2);
        assert_eq!(load(two.as_bytes()).unwrap().notes[1], "2 solids were joined into one mesh");
    }

    #[test]
    fn normals_are_unit_and_outward_or_zero() {
        let big = f32::MAX;
        let tiny = f32::from_bits(1);
        assert_eq!(normal([[0.0; 3], [1.0, 0.0, 0.0], [0.0, 2.0, 0.0]]), [0.0, 0.0, 1.0]);
        assert_eq!(normal([[-big, 0.0, 0.0], [big, 0.0, 0.0], [0.0, big, 0.0]]), [0.0, 0.0, 1.0]);
        assert_eq!(normal([[0.0; 3], [0.0, tiny, 0.0], [0.0, 0.0, tiny]]), [1.0, 0.0, 0.0]);
        assert_eq!(normal([[1.0; 3], [2.0; 3], [3.0; 3]]), [0.0; 3]);
    }

    #[test]
    fn losses_are_named() {
        let mut mesh = square();
        assert_eq!(losses(&mesh), Vec::<String>::new());
        mesh.faces = vec![[0, 2, 1]];
        assert_eq!(losses(&mesh), ["1 unreferenced vertex", "the order of the vertices"]);
        mesh.faces = vec![[0, 1, 2], [0, 2, 3]];
        mesh.positions[3] = mesh.positions[0];
        assert_eq!(losses(&mesh), ["1 vertex that coincides with another"]);
    }

    #[test]
    fn errors_name_the_place() {
        let error = |bytes: &[u8]| load(bytes).unwrap_err().to_string();
        let mut bytes = binary(&square());
        bytes[HEADER + TRIANGLE + 12..][..4].copy_from_slice(&f32::NAN.to_le_bytes());
        assert_eq!(error(&bytes), "face 1: NaN is not a finite coordinate");
        let text = text(&square());
        let cut = text.replacen(" endloop\n", "", 1);
        assert_eq!(error(cut.as_bytes()), "line 7: \"endfacet\" is out of place");
        assert_eq!(error(text.replace("endsolid", "").as_bytes()), "line 17: the text ends inside a solid");
        assert!(error(text.replacen("1 0 ", "1 z ", 1).as_bytes()).starts_with("line 5: "));
    }
}
