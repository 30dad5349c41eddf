//! The mesh formats of other people: OBJ, PLY, STL and OFF.
//!
//! A reader changes as little as it can. Vertices and faces keep the file's order and
//! rotation; degenerate and repeated faces and unreferenced vertices stay. What a
//! [`Mesh`] cannot hold (polygons, normals, colours …) is cut or left out, and a note
//! says so. Only STL, which has no indices, has its corners merged.

mod builder;
mod obj;
mod off;
mod ply;
mod stl;
mod text;

use std::io::{BufWriter, Write};
use std::path::Path;

use crate::{Limits, Mesh, Result};

/// A mesh file format.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
#[non_exhaustive]
pub enum Format {
    /// Wavefront OBJ: text.
    Obj,
    /// The Stanford polygon format: read in all three encodings, written as binary little endian.
    Ply,
    /// Stereolithography: read as text and binary, written as binary.
    Stl,
    /// The Object File Format of Geomview: text.
    Off,
}

impl Format {
    /// The format that a path's suffix stands for, in any letter case.
    pub fn from_path(path: &Path) -> Option<Format> {
        Format::from_name(path.extension()?.to_str()?)
    }

    /// The format of that [name](Format::name), in any letter case.
    pub fn from_name(name: &str) -> Option<Format> {
        [Format::Obj, Format::Ply, Format::Stl, Format::Off]
            .into_iter()
            .find(|format| format.name().eq_ignore_ascii_case(name))
    }

    /// The usual suffix without its dot: "obj", "ply", "stl" or "off".
    pub fn name(self) -> &'static str {
        match self {
            Format::Obj => "obj",
            Format::Ply => "ply",
            Format::Stl => "stl",
            Format::Off => "off",
        }
    }
}

/// A mesh that was read, and what the reader had to change or leave out.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Loaded {
    /// The mesh. It passes [`Mesh::check`].
    pub mesh: Mesh,
    /// Remarks for a person, one line each: "12 polygons were cut into 30 triangles",
    /// "normals are not carried (48485 vertices have them)".
    pub notes: Vec<String>,
}

/// Reads a mesh from a whole file's bytes, in time linear in their number.
///
/// Decimal text becomes the nearest `f32`. A polygon is cut into a fan from its first
/// corner, which is a triangulation of every convex polygon.
///
/// # Errors
/// [`Error::Syntax`](crate::Error::Syntax) if the bytes break the format's rules,
/// [`Error::Mesh`](crate::Error::Mesh) for a coordinate that is not finite or an index out of
/// range, [`Error::Unsupported`](crate::Error::Unsupported) for a variant that is not read, and
/// [`Error::Limit`](crate::Error::Limit) if the mesh would not fit into `limits`.
pub fn read(bytes: &[u8], format: Format, limits: &Limits) -> Result<Loaded> {
    match format {
        Format::Obj => obj::read(bytes, limits),
        Format::Ply => ply::read(bytes, limits),
        Format::Stl => stl::read(bytes, limits),
        Format::Off => off::read(bytes, limits),
    }
}

/// Writes a mesh; writes are buffered here and flushed at the end.
///
/// Reading the result gives the same bits, except what [`losses`] names.
///
/// # Errors
/// [`Error::Mesh`](crate::Error::Mesh) if the mesh fails [`Mesh::check`],
/// [`Error::Parameter`](crate::Error::Parameter) if the format cannot count that many faces,
/// and [`Error::Io`](crate::Error::Io).
pub fn write(mesh: &Mesh, format: Format, out: &mut dyn Write) -> Result<()> {
    mesh.check()?;
    let mut out = BufWriter::with_capacity(1 << 16, out);
    match format {
        Format::Obj => obj::write(mesh, &mut out)?,
        Format::Ply => ply::write(mesh, &mut out)?,
        Format::Stl => stl::write(mesh, &mut out)?,
        Format::Off => off::write(mesh, &mut out)?,
    }
    Ok(out.flush()?)
}

/// What a format cannot carry of this mesh, one line each; empty if it carries everything.
pub fn losses(mesh: &Mesh, format: Format) -> Vec<String> {
    match format {
        Format::Stl => stl::losses(mesh),
        Format::Obj | Format::Ply | Format::Off => Vec::new(),
    }
}

#[cfg(test)]
mod tests;
