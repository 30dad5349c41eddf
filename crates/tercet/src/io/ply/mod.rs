//! The Stanford polygon format: a text header that declares elements and their
//! properties, then the items of each element as text or binary.
//!
//! A mesh is made of the elements `vertex` (properties `x`, `y`, `z` of any type), `face`
//! and `tristrips` (a list `vertex_indices` or `vertex_index`); others are passed over.

mod body;
mod header;

use std::io::Write;

use self::body::{Ascii, Binary, Body};
use self::header::{Element, Encoding, Header, Kind, Property};
use super::Loaded;
use super::builder::Builder;
use super::text::{Names, Text, count};
use crate::{Error, Limits, Mesh, Result};

/// Reads a PLY file in any of its three encodings.
pub(super) fn read(bytes: &[u8], limits: &Limits) -> Result<Loaded> {
    let mut text = Text::new(bytes);
    let header = header::read(&mut text)?;
    let big_endian = match header.encoding {
        Encoding::Ascii => return Reader::new(&header, Ascii { text }, limits).read(),
        Encoding::LittleEndian => false,
        Encoding::BigEndian => true,
    };
    let body = Binary { bytes: text.rest(), offset: text.offset(), big_endian };
    Reader::new(&header, body, limits).read()
}

/// A mesh being read from a body.
struct Reader<'a, B> {
    header: &'a Header<'a>,
    body: B,
    mesh: Builder<'a>,
    /// Vertices declared; faces may come before them.
    vertices: u64,
    rounded: bool,
    notes: Vec<String>,
}

impl<'a, B: Body> Reader<'a, B> {
    fn new(header: &'a Header<'a>, body: B, limits: &'a Limits) -> Self {
        Reader { header, body, mesh: Builder::new(limits), vertices: 0, rounded: false, notes: Vec::new() }
    }

    fn read(mut self) -> Result<Loaded> {
        self.check_counts()?;
        let elements = &self.header.elements;
        let vertex = elements.iter().find(|element| element.name == b"vertex");
        self.vertices = vertex.ok_or_else(|| Error::syntax("header", "no element \"vertex\""))?.count;
        for element in elements {
            match element.name {
                b"vertex" => self.read_vertices(element)?,
                b"face" => self.read_faces(element)?,
                b"tristrips" => self.read_strips(element)?,
                _ => self.skip_element(element)?,
            }
        }
        if self.rounded {
            self.notes.push("coordinates were rounded to 32-bit floats".into());
        }
        let trailing = self.body.start_item().is_ok() && self.body.rest() > 0;
        if trailing {
            let bytes = count(self.body.rest() as u64, "byte", "bytes");
            self.notes.push(format!("ignored after the last element: {bytes}"));
        }
        self.mesh.finish(self.notes)
    }

    /// Refuses counts that the bytes cannot hold, before anything is allocated for them.
    fn check_counts(&self) -> Result<()> {
        let mut needed = 0u64;
        for element in &self.header.elements {
            needed = needed.saturating_add(element.count.saturating_mul(B::least_bytes(element)));
            if needed.saturating_sub(1) > self.body.rest() as u64 {
                let cause = format!(
                    "a count of {}, for which the file is too short ({} bytes after the header)",
                    element.count,
                    self.body.rest()
                );
                return Err(Error::syntax(element.place(), cause));
            }
        }
        Ok(())
    }

    fn read_vertices(&mut self, element: &Element) -> Result<()> {
        let mut axes = [0; 3];
        for (axis, name) in axes.iter_mut().zip([b"x", b"y", b"z"]) {
            *axis = match element.find(name) {
                Some(i) if element.properties[i].length.is_none() => i,
                _ => return Err(Error::syntax(element.place(), "x, y and z must each be one number")),
            };
        }
        self.mesh.reserve(element.count, 0)?;
        for vertex in 0..element.count {
            let mut position = [0.0; 3];
            self.body.start_item()?;
            for (i, property) in element.properties.iter().enumerate() {
                match axes.iter().position(|&axis| axis == i) {
                    Some(axis) => {
                        let coordinate =
                            self.body.coordinate(property.kind).map_err(|e| e.in_vertex(vertex as usize))?;
                        position[axis] = coordinate.value;
                        self.rounded |= coordinate.rounded;
                    }
                    None => skip(&mut self.body, property)?,
                }
            }
            self.body.end_item()?;
            self.mesh.vertex(position)?;
        }
        self.note_properties(element, &axes);
        Ok(())
    }

    fn read_faces(&mut self, element: &Element) -> Result<()> {
        let Some(list) = indices(element)? else { return Ok(()) };
        self.mesh.reserve(0, element.count)?;
        for item in 0..element.count {
            self.read_item(element, list, |reader, kind| {
                let index = reader.body.integer(kind)?;
                let vertex = reader.vertex(index, element, item)?;
                reader.mesh.corner(vertex)
            })?;
            self.mesh.end_polygon();
        }
        self.note_properties(element, &[list]);
        Ok(())
    }

    /// Each strip's item k ≥ 2 makes a triangle with the two before it, in turns
    /// counter-clockwise as listed and with the first two exchanged. -1 starts anew.
    fn read_strips(&mut self, element: &Element) -> Result<()> {
        let Some(list) = indices(element)? else { return Ok(()) };
        let (before, mut strips, mut stitches) = (self.mesh.faces(), 0u64, 0u64);
        for item in 0..element.count {
            let mut strip = Strip::default();
            self.read_item(element, list, |reader, kind| {
                let index = reader.body.integer(kind)?;
                if index == -1 {
                    strip = Strip::default();
                    return Ok(());
                }
                let vertex = reader.vertex(index, element, item)?;
                strips += u64::from(strip.length == 0);
                match strip.push(vertex) {
                    Some([a, b, c]) if a == b || b == c || c == a => stitches += 1,
                    Some(face) => reader.mesh.face(face)?,
                    None => {}
                }
                Ok(())
            })?;
        }
        if strips > 0 {
            let strips = count(strips, "triangle strip was", "triangle strips were");
            let triangles = count((self.mesh.faces() - before) as u64, "triangle", "triangles");
            self.notes.push(format!("{strips} cut into {triangles}"));
        }
        if stitches > 0 {
            let triangles = count(stitches, "degenerate triangle", "degenerate triangles");
            self.notes.push(format!("{triangles} within strips, which only join their parts, left out"));
        }
        self.note_properties(element, &[list]);
        Ok(())
    }

    /// Reads one item of an element, calling `entry` for each number of its list.
    fn read_item(
        &mut self,
        element: &Element,
        list: usize,
        mut entry: impl FnMut(&mut Self, Kind) -> Result<()>,
    ) -> Result<()> {
        self.body.start_item()?;
        for (i, property) in element.properties.iter().enumerate() {
            match property.length {
                Some(length) if i == list => {
                    for _ in 0..self.body.length(length)? {
                        entry(self, property.kind)?;
                    }
                }
                _ => skip(&mut self.body, property)?,
            }
        }
        self.body.end_item()
    }

    fn skip_element(&mut self, element: &Element) -> Result<()> {
        // Without properties an item takes no bytes, and any count of them is possible.
        if !element.properties.is_empty() {
            for _ in 0..element.count {
                self.body.start_item()?;
                element.properties.iter().try_for_each(|property| skip(&mut self.body, property))?;
                self.body.end_item()?;
            }
        }
        let items = count(element.count, "item", "items");
        self.notes.push(format!("{} is not carried ({items})", element.place()));
        Ok(())
    }

    /// An index as a vertex, which may still be to come.
    fn vertex(&self, index: i64, element: &Element, item: u64) -> Result<u32> {
        match u32::try_from(index) {
            Ok(vertex) if u64::from(vertex) < self.vertices => Ok(vertex),
            _ => {
                let place = format!("{} {item}", String::from_utf8_lossy(element.name));
                let cause = format!("index {index} is out of range: the file has {} vertices", self.vertices);
                Err(Error::mesh(place, cause))
            }
        }
    }

    /// Names the properties of an element other than those `used`.
    fn note_properties(&mut self, element: &Element, used: &[usize]) {
        if element.count == 0 {
            return;
        }
        let (one, many, of) = match element.name {
            b"vertex" => ("vertex has", "vertices have", ""),
            _ => ("face has", "faces have", "face "),
        };
        let items = count(element.count, one, many);
        let mut others = Names::default();
        let mut known: Vec<&str> = Vec::new();
        for (i, property) in element.properties.iter().enumerate() {
            match attribute(property.name) {
                _ if used.contains(&i) => {}
                None => others.add(property.name),
                Some(attribute) if known.contains(&attribute) => {}
                Some(attribute) => known.push(attribute),
            }
        }
        for attribute in known {
            self.notes.push(format!("{of}{attribute} are not carried ({items} them)"));
        }
        if !others.is_empty() {
            self.notes.push(format!("{of}properties {others} are not carried ({items} them)"));
        }
    }
}

/// The last two vertices of a triangle strip.
#[derive(Default)]
struct Strip {
    last: [u32; 2],
    length: u64,
}

impl Strip {
    fn push(&mut self, vertex: u32) -> Option<[u32; 3]> {
        let [a, b] = self.last;
        self.last = [b, vertex];
        self.length += 1;
        match self.length {
            0..=2 => None,
            n if n % 2 == 1 => Some([a, b, vertex]),
            _ => Some([b, a, vertex]),
        }
    }
}

/// Passes over one property of an item.
fn skip(body: &mut impl Body, property: &Property) -> Result<()> {
    let count = match property.length {
        Some(kind) => body.length(kind)?,
        None => 1,
    };
    body.skip(property.kind, count)
}

/// The property with the vertices of a face or strip; none only if there are no items.
fn indices(element: &Element) -> Result<Option<usize>> {
    let found = element.find(b"vertex_indices").or_else(|| element.find(b"vertex_index"));
    match found.map(|i| (i, &element.properties[i])) {
        Some((i, property)) if property.length.is_some() && property.kind.is_integer() => Ok(Some(i)),
        None if element.count == 0 => Ok(None),
        _ => Err(Error::syntax(element.place(), "a list \"vertex_indices\" of integers is needed")),
    }
}

/// What a property is part of, by the names in common use.
fn attribute(name: &[u8]) -> Option<&'static str> {
    Some(match name {
        b"nx" | b"ny" | b"nz" => "normals",
        b"red" | b"green" | b"blue" | b"alpha" | b"diffuse_red" | b"diffuse_green" | b"diffuse_blue" => {
            "colours"
        }
        b"s" | b"t" | b"u" | b"v" | b"texture_u" | b"texture_v" | b"texcoord" | b"texnumber" => {
            "texture coordinates"
        }
        _ => return None,
    })
}

/// Writes a binary little-endian PLY file. Indices are declared `int`, which every reader
/// knows, as long as they fit.
pub(super) fn write(mesh: &Mesh, out: &mut impl Write) -> Result<()> {
    let index = if i32::try_from(mesh.positions.len()).is_ok() { "int" } else { "uint" };
    writeln!(out, "ply\nformat binary_little_endian 1.0\nelement vertex {}", mesh.positions.len())?;
    writeln!(out, "property float x\nproperty float y\nproperty float z")?;
    writeln!(out, "element face {}\nproperty list uchar {index} vertex_indices", mesh.faces.len())?;
    writeln!(out, "end_header")?;
    for x in mesh.positions.iter().flatten() {
        out.write_all(&x.to_le_bytes())?;
    }
    for face in &mesh.faces {
        out.write_all(&[3])?;
        for v in face {
            out.write_all(&v.to_le_bytes())?;
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests;
