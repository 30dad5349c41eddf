//! Wavefront OBJ: the statements that make a polygon mesh.
//!
//! Of a face's corners only the vertex is read; texture and normal indices are not
//! looked at. Vertices may follow the faces that use them.

use std::io::Write;

use super::Loaded;
use super::builder::{Builder, coordinates};
use super::text::{Names, Text, count};
use crate::{Error, Limits, Mesh, Result};

/// A file's statements that a mesh does not hold.
#[derive(Default)]
struct Left<'a> {
    normals: u64,
    texture: u64,
    colours: u64,
    weights: u64,
    lines: u64,
    points: u64,
    groups: u64,
    materials: u64,
    unknown: u64,
    names: Names<'a>,
}

/// The highest vertex that a face names, counted from 0, and the line where it does.
#[derive(Default)]
struct Highest {
    vertex: u32,
    line: u64,
}

/// Reads an OBJ file.
pub(super) fn read(bytes: &[u8], limits: &Limits) -> Result<Loaded> {
    let bytes = bytes.strip_prefix(b"\xef\xbb\xbf").unwrap_or(bytes);
    let mut text = Text::new(bytes).with_comments().with_continuations();
    let mut mesh = Builder::new(limits);
    let mut left = Left::default();
    let mut highest = Highest::default();
    let mut known = 0u64;
    while text.seek_word() {
        let Some(keyword) = text.word() else { break };
        known += 1;
        match keyword {
            b"v" => vertex(&mut text, &mut mesh, &mut left)?,
            b"f" => face(&mut text, &mut mesh, &mut highest)?,
            b"vn" => left.normals += 1,
            b"vt" => left.texture += 1,
            b"l" => left.lines += 1,
            b"p" => left.points += 1,
            b"o" | b"g" => left.groups += 1,
            b"usemtl" | b"mtllib" => left.materials += 1,
            b"s" => {}
            _ => {
                known -= 1;
                left.unknown += 1;
                left.names.add(keyword);
            }
        }
        text.next_line();
    }
    if known == 0 && left.unknown > 0 {
        return Err(Error::syntax("line 1", "this is not an OBJ file: no statement of one was found"));
    }
    if highest.line > 0 && highest.vertex >= mesh.vertices() {
        return Err(Error::mesh(
            format!("line {}", highest.line),
            format!(
                "vertex {} is out of range: the file has {}",
                u64::from(highest.vertex) + 1,
                mesh.vertices()
            ),
        ));
    }
    mesh.finish(left.notes())
}

/// `v x y z`, then nothing, a weight, or colours (with or without a weight before them).
fn vertex(text: &mut Text, mesh: &mut Builder, left: &mut Left) -> Result<()> {
    mesh.vertex(coordinates(text, mesh)?)?;
    let mut further = 0;
    let mut weight = 1.0;
    while let Some(word) = text.word() {
        weight = text.parse_number(word)?;
        further += 1;
    }
    match further {
        0 => {}
        1 => left.weights += u64::from(weight != 1.0),
        _ => left.colours += 1,
    }
    Ok(())
}

/// `f` and corners `v`, `v/vt`, `v//vn` or `v/vt/vn`, counted from 1, or from the latest
/// vertex backwards as -1, -2 …
fn face(text: &mut Text, mesh: &mut Builder, highest: &mut Highest) -> Result<()> {
    while let Some(word) = text.word() {
        let digits = word.split(|&b| b == b'/').next().unwrap_or(word);
        let index = text.parse_integer(digits)?;
        let vertex = match index {
            1.. => u32::try_from(index - 1).ok(),
            0 => return Err(text.error("index 0: vertices are counted from 1")),
            _ => u32::try_from(i64::from(mesh.vertices()).saturating_add(index)).ok(),
        };
        let Some(vertex) = vertex else {
            let cause = format!("index {index} is out of range: {} vertices so far", mesh.vertices());
            return Err(Error::mesh(format!("line {}", text.line()), cause));
        };
        if vertex >= highest.vertex {
            *highest = Highest { vertex, line: text.line() };
        }
        mesh.corner(vertex)?;
    }
    mesh.end_polygon();
    Ok(())
}

impl Left<'_> {
    fn notes(&self) -> Vec<String> {
        let mut notes = Vec::new();
        let mut note = |n: u64, one: &str, many: &str, what: &str| {
            if n > 0 {
                notes.push(format!("{what} not carried ({})", count(n, one, many)));
            }
        };
        note(self.normals, "normal", "normals", "normals are");
        note(self.texture, "pair", "pairs", "texture coordinates are");
        note(self.colours, "vertex has them", "vertices have them", "colours are");
        note(self.weights, "vertex has one", "vertices have them", "weights other than 1 are");
        note(self.lines, "statement", "statements", "line elements are");
        note(self.points, "statement", "statements", "point elements are");
        note(self.groups, "statement", "statements", "groups are");
        note(self.materials, "statement", "statements", "materials are");
        if self.unknown > 0 {
            let statements = count(self.unknown, "statement", "statements");
            notes.push(format!("{statements} of a kind not read here: {}", self.names));
        }
        notes
    }
}

/// Writes an OBJ file: each number as the shortest decimal that reads back to its bits.
pub(super) fn write(mesh: &Mesh, out: &mut impl Write) -> Result<()> {
    for [x, y, z] in &mesh.positions {
        writeln!(out, "v {x} {y} {z}")?;
    }
    for face in &mesh.faces {
        let [a, b, c] = face.map(|v| u64::from(v) + 1);
        writeln!(out, "f {a} {b} {c}")?;
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

    const SQUARE: &str = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\n";

    #[test]
    fn negative_indices_count_back_from_the_latest_vertex() {
        let text = format!("{SQUARE}f -4 -3 -2\nv 5 5 5\nf -1 -2 1\n");
        assert_eq!(load(&text).unwrap().mesh.faces, [[0, 1, 2], [4, 3, 0]]);
    }

    #[test]
    fn corners_may_carry_texture_and_normal_indices() {
        let text = format!("{SQUARE}f 1/9 2/9 3/9\nf 1//9 3//9 4//9\nf 2/9/9 3/9/9 4/9/9\n");
        assert_eq!(load(&text).unwrap().mesh.faces, [[0, 1, 2], [0, 2, 3], [1, 2, 3]]);
    }

    #[test]
    fn a_polygon_becomes_a_fan_and_is_noted() {
        let text = format!("{SQUARE}f 2 3 4 1\nf 1 2\n");
        let loaded = load(&text).unwrap();
        assert_eq!(loaded.mesh.faces, [[1, 2, 3], [1, 3, 0]]);
        let notes =
            ["1 polygon was cut into 2 triangles", "1 face with fewer than three corners is not carried"];
        assert_eq!(loaded.notes, notes);
    }

    #[test]
    fn line_ends_comments_and_continuations_do_not_matter() {
        let plain = format!("{SQUARE}f 1 2 3\n");
        let joined = plain.replace("1 2 3", "1 \\\n2\\\n 3 # end");
        let expected = load(&plain).unwrap();
        for text in [&joined, &plain.replace('\n', "\r\n"), &joined.replace('\n', "\r\n")] {
            assert_eq!(load(text).unwrap(), expected, "{text:?}");
        }
    }

    #[test]
    fn vertices_may_follow_their_faces() {
        assert_eq!(load(&format!("f 1 2 3\n{SQUARE}")).unwrap().mesh.faces, [[0, 1, 2]]);
    }

    #[test]
    fn what_is_left_out_is_noted() {
        let text = "mtllib a\nusemtl b\no c\ng d\ns 1\nv 0 0 0 1\nv 0 0 0 2\nv 0 0 0 1 1 1\n\
            vt 0 0\nvn 0 0 1\nvn 0 0 1\nl 1 2\np 1\ncurv 1\nsurf 1\ncurv 2\n";
        let notes = [
            "normals are not carried (2 normals)",
            "texture coordinates are not carried (1 pair)",
            "colours are not carried (1 vertex has them)",
            "weights other than 1 are not carried (1 vertex has one)",
            "line elements are not carried (1 statement)",
            "point elements are not carried (1 statement)",
            "groups are not carried (2 statements)",
            "materials are not carried (2 statements)",
            "3 statements of a kind not read here: \"curv\", \"surf\"",
        ];
        assert_eq!(load(text).unwrap().notes, notes);
    }

    #[test]
    fn errors_name_the_line() {
        assert_eq!(error("v 0 0\n"), "line 1, vertex 0: a number is missing at the end of the line");
        assert_eq!(error("\nv 0 0 x\n"), "line 2, vertex 0: \"x\" is not a number");
        assert_eq!(error("v 0 0 nan\n"), "line 1, vertex 0: \"nan\" is not a finite 32-bit float");
        assert_eq!(error("v 0 0 0\nf 0 1 1\n"), "line 2: index 0: vertices are counted from 1");
        assert_eq!(error("v 0 0 0\nf 1 1 -2\n"), "line 2: index -2 is out of range: 1 vertices so far");
        assert_eq!(error("v 0 0 0\nf 1 1 7\nf 1 1 1\n"), "line 2: vertex 7 is out of range: the file has 1");
        assert!(error("f 1 2 99999999999\n").starts_with("line 1: index 99999999999 is out of range"));
        assert!(error("f -9223372036854775808 1 1\n").starts_with("line 1: "));
    }
}
