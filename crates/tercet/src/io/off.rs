//! The Object File Format of Geomview, as text.
//!
//! ```text
//! [ST][C][N]OFF             # may be missing
//! vertices faces [edges]
//! x y z [normal] [colour] [texture coordinates]     one line a vertex
//! n v0 v1 … v(n-1) [colour]                         one line a face
//! ```

use std::io::Write;

use super::Loaded;
use super::builder::{Builder, coordinates};
use super::text::{Text, count, quote};
use crate::{Error, Limits, Mesh, Result};

/// What precedes the vertices.
struct Header<'a> {
    /// The letters before "OFF".
    prefix: &'a [u8],
    vertices: u64,
    faces: u64,
}

/// Reads an OFF file.
pub(super) fn read(bytes: &[u8], limits: &Limits) -> Result<Loaded> {
    let bytes = bytes.strip_prefix(b"\xef\xbb\xbf").unwrap_or(bytes);
    let mut text = Text::new(bytes).with_comments();
    let header = header(&mut text)?;
    check_counts(&header, text.rest().len())?;
    let mut mesh = Builder::new(limits);
    mesh.reserve(header.vertices, header.faces)?;
    let mut notes = Vec::new();

    let mut extended = 0;
    for _ in 0..header.vertices {
        seek_item(&mut text)?;
        mesh.vertex(coordinates(&mut text, &mesh)?)?;
        extended += u64::from(text.word().is_some());
        text.next_line();
    }
    if extended > 0 {
        let vertices = count(extended, "vertex has", "vertices have");
        notes.push(format!("{} are not carried ({vertices} them)", attributes(header.prefix)));
    }

    let mut coloured = 0;
    for _ in 0..header.faces {
        seek_item(&mut text)?;
        face(&mut text, &mut mesh)?;
        coloured += u64::from(text.word().is_some());
        text.next_line();
    }
    if coloured > 0 {
        let faces = count(coloured, "face has", "faces have");
        notes.push(format!("face colours are not carried ({faces} them)"));
    }
    if text.seek_word() {
        notes.push(format!("text after the last face is ignored, from line {} on", text.line()));
    }
    mesh.finish(notes)
}

fn header<'a>(text: &mut Text<'a>) -> Result<Header<'a>> {
    let word = seek_item(text).map(|()| text.word().unwrap_or_default())?;
    // Files exist that have the first count glued to the keyword: "OFF490 518 0".
    let (prefix, glued) = match word.windows(3).position(|w| w == b"OFF") {
        Some(at) => (&word[..at], &word[at + 3..]),
        None => (&word[..0], word),
    };
    if prefix.contains(&b'4') || prefix.contains(&b'n') {
        let keyword = quote(word);
        return Err(Error::Unsupported(format!("{keyword}: only three-dimensional OFF files are read")));
    }
    if !matches!(prefix, b"" | b"C" | b"N" | b"CN" | b"ST" | b"STC" | b"STN" | b"STCN") {
        return Err(text.error(format!("{} is not an OFF keyword", quote(word))));
    }
    let first = if glued.is_empty() {
        seek_item(text)?;
        text.word().unwrap_or_default()
    } else {
        glued
    };
    if first == b"BINARY" {
        return Err(Error::Unsupported("binary OFF files are not read, only text".into()));
    }
    let vertices = text.parse_count(first)?;
    seek_item(text)?;
    let faces = text.word().unwrap_or_default();
    let faces = text.parse_count(faces)?;
    // The number of edges follows; it says nothing, is often wrong and sometimes missing.
    text.next_line();
    Ok(Header { prefix, vertices, faces })
}

fn seek_item(text: &mut Text) -> Result<()> {
    if text.seek_word() { Ok(()) } else { Err(text.error("the text ends too early")) }
}

/// Refuses counts that the bytes cannot hold: "0 0 0" and "0" are the shortest lines.
fn check_counts(header: &Header, bytes: usize) -> Result<()> {
    let vertices = header.vertices.saturating_mul(6);
    let needed = vertices.saturating_add(header.faces.saturating_mul(2)).saturating_sub(1);
    if needed > bytes as u64 {
        let cause = format!(
            "{} vertices and {} faces take {needed} bytes or more, {bytes} follow",
            header.vertices, header.faces
        );
        return Err(Error::syntax("counts", cause));
    }
    Ok(())
}

fn face(text: &mut Text, mesh: &mut Builder) -> Result<()> {
    let corners = text.integer()?;
    if corners < 0 {
        return Err(text.error(format!("a face of {corners} corners")));
    }
    for _ in 0..corners {
        let index = text.integer()?;
        match u32::try_from(index) {
            Ok(vertex) if vertex < mesh.vertices() => mesh.corner(vertex)?,
            _ => {
                let cause =
                    format!("index {index} is out of range: the file has {} vertices", mesh.vertices());
                return Err(Error::mesh(format!("line {}", text.line()), cause));
            }
        }
    }
    mesh.end_polygon();
    Ok(())
}

/// What follows the coordinates of a vertex, by the keyword's prefix.
fn attributes(prefix: &[u8]) -> String {
    let kinds = [(b'N', "normals"), (b'C', "colours"), (b'S', "texture coordinates")];
    let named = kinds.iter().filter(|(letter, _)| prefix.contains(letter)).map(|&(_, name)| name);
    let named: Vec<&str> = named.collect();
    if named.is_empty() { "values after z".into() } else { named.join(" and ") }
}

/// Writes an OFF file: each number as the shortest decimal that reads back to its bits.
pub(super) fn write(mesh: &Mesh, out: &mut impl Write) -> Result<()> {
    writeln!(out, "OFF\n{} {} 0", mesh.positions.len(), mesh.faces.len())?;
    for [x, y, z] in &mesh.positions {
        writeln!(out, "{x} {y} {z}")?;
    }
    for [a, b, c] in &mesh.faces {
        writeln!(out, "3 {a} {b} {c}")?;
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn load(text: &str) -> Result<Loaded> {
        read(text.as_bytes(), &Limits::default())
    }

    fn error(text: &str) -> String {
        load(text).unwrap_err().to_string()
    }

    const BODY: &str = "0 0 0\n1 0 0\n0 1 0\n3 2 0 1\n";

    #[test]
    fn headers_in_use_say_the_same() {
        let expected = load(&format!("OFF\n3 1 0\n{BODY}")).unwrap();
        assert_eq!(expected.mesh.faces, [[2, 0, 1]]);
        for header in ["OFF 3 1 0", "OFF3 1 0", "3 1 0", "# c\nOFF # c\n\n# c\n3 1", "OFF\r\n3\r\n1 3"] {
            assert_eq!(load(&format!("{header}\n{BODY}")).unwrap(), expected, "{header:?}");
        }
    }

    #[test]
    fn attributes_are_noted() {
        let text = "STCNOFF\n3 1 0\n0 0 0 9 9 9 9\n1 0 0\n0 1 0 9\n3 0 1 2 1 0 0\n";
        let notes = [
            "normals and colours and texture coordinates are not carried (2 vertices have them)",
            "face colours are not carried (1 face has them)",
        ];
        assert_eq!(load(text).unwrap().notes, notes);
    }

    #[test]
    fn polygons_are_cut_and_trailing_text_is_noted() {
        let text = "OFF\n4 3 0\n0 0 0\n1 0 0\n1 1 0\n0 1 0\n4 0 1 2 3\n2 0 1\n0\n7\n";
        let loaded = load(text).unwrap();
        assert_eq!(loaded.mesh.faces, [[0, 1, 2], [0, 2, 3]]);
        let notes = [
            "1 polygon was cut into 2 triangles",
            "2 faces with fewer than three corners are not carried",
            "text after the last face is ignored, from line 10 on",
        ];
        assert_eq!(loaded.notes, notes);
    }

    #[test]
    fn variants_not_read_are_named() {
        assert_eq!(error("OFF BINARY\n"), "binary OFF files are not read, only text");
        for keyword in ["4OFF", "nOFF", "4nOFF", "C4OFF"] {
            assert!(error(&format!("{keyword}\n3 0 0 0\n")).contains("only three-dimensional"), "{keyword}");
        }
        assert!(error("XOFF\n").starts_with("line 1: "));
        assert!(error("solid\n").starts_with("line 1: "));
    }

    #[test]
    fn errors_name_the_line() {
        assert!(error("OFF\n3 1 0\n0 0 0\n1 0 0\n0 1 0\n3 0 1 3\n").starts_with("line 6: index 3"));
        assert!(error("OFF\n3 1 0\n0 0 0\n1 0 0\n0 1 0\n3 0 1 -1\n").starts_with("line 6: index -1"));
        assert!(error("OFF\n3 1 0\n0 0 0\n1 0 0\n0 1 0\n-3 0 1 2\n").starts_with("line 6: a face of -3"));
        assert!(
            error("OFF\n3 1 0\n0 0 0\n1 0\n0 1 0\n3 0 1 2\n")
                .starts_with("line 4, vertex 1: a number is missing")
        );
        assert!(error("OFF\n3 1 0\n0 0 0\n1 0 0\n0 1 0.0000\n").starts_with("line 6: the text ends"));
    }
}
