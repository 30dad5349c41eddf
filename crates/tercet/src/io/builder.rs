//! A mesh under construction: counts memory, cuts polygons, remembers what to tell.

use std::io::ErrorKind;

use super::Loaded;
use super::text::{Text, count};
use crate::{Error, Limits, Mesh, Result};

/// Bytes of a vertex, and of a face.
const ITEM: u64 = 12;

/// Collects vertices and faces under a memory limit.
pub(super) struct Builder<'a> {
    mesh: Mesh,
    limits: &'a Limits,
    polygon: Polygon,
    cut: Cut,
}

/// The corners of the polygon being read, as far as its fan needs them.
#[derive(Default)]
struct Polygon {
    first: u32,
    last: u32,
    corners: u64,
}

/// What became of polygons that are not triangles.
#[derive(Default)]
struct Cut {
    polygons: u64,
    triangles: u64,
    short: u64,
}

impl<'a> Builder<'a> {
    pub fn new(limits: &'a Limits) -> Self {
        Builder { mesh: Mesh::default(), limits, polygon: Polygon::default(), cut: Cut::default() }
    }

    /// Makes room for further items that a file declares; the caller has checked their
    /// numbers against the bytes that are there.
    pub fn reserve(&mut self, vertices: u64, faces: u64) -> Result<()> {
        if vertices > u64::from(u32::MAX) {
            return Err(too_many(vertices));
        }
        let held = (self.mesh.positions.capacity() + self.mesh.faces.capacity()) as u64;
        self.limits.check("mesh", vertices.saturating_add(faces).saturating_add(held), ITEM)?;
        allocate(&mut self.mesh.positions, vertices)?;
        allocate(&mut self.mesh.faces, faces)
    }

    /// Number of vertices so far.
    pub fn vertices(&self) -> u32 {
        self.mesh.positions.len() as u32
    }

    /// Number of faces so far.
    pub fn faces(&self) -> usize {
        self.mesh.faces.len()
    }

    /// Adds a vertex.
    pub fn vertex(&mut self, position: [f32; 3]) -> Result<()> {
        if self.vertices() == u32::MAX {
            return Err(too_many(u64::from(u32::MAX) + 1));
        }
        push(&mut self.mesh.positions, position, self.mesh.faces.capacity(), self.limits)
    }

    /// Adds a triangle.
    pub fn face(&mut self, face: [u32; 3]) -> Result<()> {
        push(&mut self.mesh.faces, face, self.mesh.positions.capacity(), self.limits)
    }

    /// Adds a corner to the current polygon: from the third on, each completes one
    /// triangle of the fan around the first.
    pub fn corner(&mut self, vertex: u32) -> Result<()> {
        match self.polygon.corners {
            0 => self.polygon.first = vertex,
            1 => {}
            _ => self.face([self.polygon.first, self.polygon.last, vertex])?,
        }
        self.polygon.last = vertex;
        self.polygon.corners += 1;
        Ok(())
    }

    /// Ends the current polygon.
    pub fn end_polygon(&mut self) {
        match self.polygon.corners {
            0..=2 => self.cut.short += 1,
            3 => {}
            corners => {
                self.cut.polygons += 1;
                self.cut.triangles += corners - 2;
            }
        }
        self.polygon.corners = 0;
    }

    /// The checked mesh, with notes on its polygons before the given ones.
    ///
    /// # Errors
    /// Those of [`Mesh::check`].
    pub fn finish(self, others: Vec<String>) -> Result<Loaded> {
        self.mesh.check()?;
        let mut notes = Vec::new();
        if self.cut.polygons > 0 {
            let polygons = count(self.cut.polygons, "polygon was", "polygons were");
            notes.push(format!("{polygons} cut into {} triangles", self.cut.triangles));
        }
        if self.cut.short > 0 {
            let cause = "with fewer than three corners";
            let one = format!("face {cause} is not carried");
            let many = format!("faces {cause} are not carried");
            notes.push(count(self.cut.short, &one, &many));
        }
        notes.extend(others);
        Ok(Loaded { mesh: self.mesh, notes })
    }
}

/// More vertices than an index can name.
fn too_many(vertices: u64) -> Error {
    Error::Limit { what: "mesh vertices", needed: vertices, allowed: u32::MAX.into() }
}

/// Appends an item. Growth is done here rather than by `Vec`, so that the memory it takes
/// (old and new block at once, and the `others` 12-byte items) is checked before it is taken.
fn push<T>(items: &mut Vec<T>, item: T, others: usize, limits: &Limits) -> Result<()> {
    if items.len() == items.capacity() {
        let old = items.len();
        let new = (old + old / 2).max(64);
        limits.check("mesh", (old as u64) + (new as u64) + (others as u64), ITEM)?;
        allocate(items, (new - old) as u64)?;
    }
    items.push(item);
    Ok(())
}

/// Makes room for further items. A limit above what the machine has is the caller's
/// choice; running out of memory is then an error like any other.
fn allocate<T>(items: &mut Vec<T>, further: u64) -> Result<()> {
    let out_of_memory = || Error::Io(ErrorKind::OutOfMemory.into());
    let further = usize::try_from(further).map_err(|_| out_of_memory())?;
    items.try_reserve_exact(further).map_err(|_| out_of_memory())
}
/// Three numbers, the position of the next vertex; an error names it, from 0.
pub(super) fn coordinates(text: &mut Text, mesh: &Builder) -> Result<[f32; 3]> {
    let mut number = || text.number().map_err(|error| error.in_vertex(mesh.vertices() as usize));
    Ok([number()?, number()?, number()?])
}
