//! The base: the connectivity of the coarsest surface, face by face.
//!
//! The coded region grows from a seed face. Its boundary is a set of loops of open edges (the
//! cut-border of Gumhold and Strasser, "Real time compression of triangle mesh connectivity",
//! 1998). A new face is attached to the *gate*, the most recent open edge a→b; its third
//! vertex is new, or reached by gluing the face to the loop's following edge, its preceding
//! edge or both, or else lies somewhere on a loop, which then splits or joins another one.
//! Gluing is stated, never inferred from vertex numbers, so that any closed surface without
//! a repeated vertex in a face can be coded, simple or not.

use super::model::BitModel;
use crate::entropy::Coder;
use crate::mesh::{NONE, Surface, next, prev};
use crate::{Error, Result};

/// How the face at a gate continues the region.
#[derive(Clone, Copy, PartialEq)]
struct Step {
    new_vertex: bool,
    glue_after: bool,
    glue_before: bool,
}

/// The models of the base; fresh for every file.
struct Models {
    new_vertex: BitModel<4>,
    glue_after: BitModel<4>,
    glue_before: BitModel<4>,
    is_virtual: BitModel<2>,
}

/// A region under construction.
#[derive(Default)]
struct Region {
    surface: Surface,
    /// For each open edge, named by the corner that faces it: its neighbours on the loop.
    after: Vec<u32>,
    before: Vec<u32>,
    is_virtual: Vec<bool>,
    valence: Vec<u32>,
}

/// A coded base.
pub(crate) struct Base {
    /// The surface, virtual vertices first, otherwise numbered as they were coded.
    pub surface: Surface,
    /// For each face, the corner of the encoder's surface that is its corner 0. Empty when
    /// decoding.
    pub origin: Vec<u32>,
}

/// Codes a closed surface of `faces` faces. When encoding, `known` is that surface; no face of
/// it names a vertex twice.
///
/// Time O(n) but for faces that split a loop, which take O(valence) when encoding.
pub(crate) fn code_base<C: Coder>(coder: &mut C, known: Option<&Surface>, faces: u32) -> Result<Base> {
    let mut models = Models {
        new_vertex: BitModel::new([128, 512, 4096, 256], 1, 400),
        glue_after: BitModel::new([128, 512, 4096, 256], 1, 400),
        glue_before: BitModel::new([128, 512, 4096, 256], 1, 400),
        is_virtual: BitModel::new([4, 1], 1, 200),
    };
    let mut region = Region::default();
    let mut oracle = known.map(Oracle::new);
    let mut gates = Vec::new();
    let mut history = 0usize;
    while region.surface.faces() < faces {
        let seed = oracle.as_mut().map(Oracle::next_seed);
        region.start(seed, |region, v| code_virtual(coder, &mut models.is_virtual, &region.is_virtual, v));
        let f = region.surface.faces() - 1;
        gates.extend([3 * f, 3 * f + 1, 3 * f + 2]);
        while let Some(gate) = gates.pop() {
            if region.surface.across(gate) != NONE {
                continue;
            }
            if region.surface.faces() >= faces || coder.exhausted() {
                return Err(Error::format("base", "its faces do not close to a surface"));
            }
            let hint = oracle.as_ref().map(|o| o.step(&region, gate));
            let step = code_step(coder, &mut models, &region, gate, history, hint);
            history = history << 3 & 0x1ff
                | (step.new_vertex as usize) << 2
                | (step.glue_after as usize) << 1
                | step.glue_before as usize;
            let target = if step == (Step { new_vertex: false, glue_after: false, glue_before: false }) {
                let corners = region.surface.vertex.len() as u32;
                let hint = oracle.as_ref().map_or(0, |o| o.target(gate));
                Some(coder.raw_wide(hint, 32 - (corners - 1).leading_zeros()))
            } else {
                None
            };
            region.attach(gate, step, target)?;
            if let Some(oracle) = &mut oracle {
                oracle.attached(gate);
            }
            if step.new_vertex {
                let v = oracle.as_mut().map(Oracle::newest_vertex);
                let flag = code_virtual(coder, &mut models.is_virtual, &region.is_virtual, v);
                region.is_virtual.push(flag);
            }
            let f = region.surface.faces() - 1;
            gates.extend([3 * f, 3 * f + 1]);
        }
    }
    let origin = oracle.map_or(Vec::new(), |o| o.origin);
    Ok(Base { surface: region.finish(), origin })
}

/// Codes whether the next vertex is virtual; `hint` says so when encoding.
fn code_virtual<C: Coder>(
    coder: &mut C,
    model: &mut BitModel<2>,
    sofar: &[bool],
    hint: Option<bool>,
) -> bool {
    let any = sofar.iter().rev().take(8).any(|&v| v) as usize;
    let last = sofar.last().is_some_and(|&v| v) as usize;
    model.code(coder, hint.unwrap_or(false), 0, [any + 2 * last, 0])
}

fn code_step<C: Coder>(
    coder: &mut C,
    models: &mut Models,
    region: &Region,
    gate: u32,
    history: usize,
    hint: Option<Step>,
) -> Step {
    let hint = hint.unwrap_or(Step { new_vertex: false, glue_after: false, glue_before: false });
    let valence = |v: u32| region.valence[v as usize] as usize;
    let a = valence(region.surface.at(next(gate))).min(15);
    let b = valence(region.surface.at(prev(gate))).min(15);
    let closes =
        (region.after[region.after[gate as usize] as usize] == region.before[gate as usize]) as usize;
    let contexts = [
        (history & 63) * 2 + closes,
        (a * 16 + b) * 2 + closes,
        (history & 0x1ff) * 8 + b.min(7),
        a * 16 + (history & 7) * 2 + closes,
    ];
    let new_vertex = models.new_vertex.code(coder, hint.new_vertex, 0, contexts);
    if new_vertex {
        return Step { new_vertex, glue_after: false, glue_before: false };
    }
    let glue_after = models.glue_after.code(coder, hint.glue_after, 0, contexts);
    let mut contexts = contexts;
    contexts[0] = (history & 31) * 4 + closes * 2 + glue_after as usize;
    contexts[3] = a * 16 + closes * 2 + glue_after as usize;
    let glue_before = models.glue_before.code(coder, hint.glue_before, 0, contexts);
    Step { new_vertex, glue_after, glue_before }
}

impl Region {
    fn add_face(&mut self, face: [u32; 3]) -> u32 {
        let o = self.surface.vertex.len() as u32;
        self.surface.vertex.extend_from_slice(&face);
        self.surface.opposite.extend_from_slice(&[NONE; 3]);
        self.after.extend_from_slice(&[NONE; 3]);
        self.before.extend_from_slice(&[NONE; 3]);
        for v in face {
            self.valence[v as usize] += 1;
        }
        o
    }

    fn new_vertex(&mut self) -> u32 {
        self.valence.push(0);
        self.surface.vertices += 1;
        self.surface.vertices - 1
    }

    /// Starts a component with a face of three new vertices.
    fn start(
        &mut self,
        seed: Option<[bool; 3]>,
        mut code_virtual: impl FnMut(&Region, Option<bool>) -> bool,
    ) {
        let face = [0, 1, 2].map(|k| {
            let flag = code_virtual(self, seed.map(|s| s[k]));
            self.is_virtual.push(flag);
            self.new_vertex()
        });
        let o = self.add_face(face);
        // Corner k faces the edge from corner k+1 to corner k+2.
        for k in 0..3 {
            self.link(o + k, o + (k + 1) % 3);
        }
    }

    fn link(&mut self, edge: u32, following: u32) {
        self.after[edge as usize] = following;
        self.before[following as usize] = edge;
    }

    fn glue(&mut self, c: u32, d: u32) {
        self.surface.opposite[c as usize] = d;
        self.surface.opposite[d as usize] = c;
    }

    /// Attaches a face to the gate a→b; see the table in the format document.
    ///
    /// ```text
    ///        w
    ///      1/ \0        the new face (b, a, w): corner 0 at b faces a→w,
    ///      /   \        corner 1 at a faces w→b, corner 2 at w faces the gate
    ///     b─────a
    ///      gate
    /// ```
    fn attach(&mut self, gate: u32, step: Step, target: Option<u32>) -> Result<()> {
        let damaged = |cause: &str| Err(Error::format("base", cause));
        let (a, b) = (self.surface.at(next(gate)), self.surface.at(prev(gate)));
        let (before, after) = (self.before[gate as usize], self.after[gate as usize]);
        let short = before == gate || before == after;
        if (step.glue_after || step.glue_before) && short {
            return damaged("a face glued to a loop of fewer than three edges");
        }
        let w = if step.new_vertex {
            self.new_vertex()
        } else if step.glue_after {
            self.surface.at(prev(after))
        } else if step.glue_before {
            self.surface.at(next(before))
        } else {
            let t = target.unwrap_or(NONE);
            let is_open = (t as usize) < self.surface.vertex.len() && self.surface.across(t) == NONE;
            if !is_open {
                return damaged("a face attached to an edge that is not open");
            }
            self.surface.at(next(t))
        };
        if w == a || w == b {
            return damaged("a face that names a vertex twice");
        }
        let o = self.add_face([b, a, w]);
        self.glue(o + 2, gate);
        match (step.new_vertex, step.glue_after, step.glue_before, target) {
            (true, ..) => {
                self.link(o, o + 1);
                self.replace(gate, o, o + 1);
            }
            (_, true, true, _) => {
                if self.after[after as usize] != before {
                    return damaged("a loop of more than three edges closed by one face");
                }
                self.glue(o + 1, after);
                self.glue(o, before);
            }
            (_, true, false, _) => {
                self.glue(o + 1, after);
                self.link(before, o);
                let beyond = self.after[after as usize];
                self.link(o, beyond);
            }
            (_, false, true, _) => {
                self.glue(o, before);
                let beyond = self.before[before as usize];
                self.link(beyond, o + 1);
                self.link(o + 1, after);
            }
            (_, _, _, target) => {
                let t = target.unwrap_or(NONE);
                let s = self.before[t as usize];
                self.replace(gate, o, o + 1);
                self.link(o, t);
                self.link(s, o + 1);
            }
        }
        Ok(())
    }

    /// Puts the edges `first` … `last` in the place of `gate` on its loop.
    fn replace(&mut self, gate: u32, first: u32, last: u32) {
        let (before, after) = (self.before[gate as usize], self.after[gate as usize]);
        if before == gate {
            self.link(last, first);
        } else {
            self.link(before, first);
            self.link(last, after);
        }
    }

    /// Renumbers the vertices, virtual ones first.
    fn finish(self) -> Surface {
        let mut surface = self.surface;
        surface.virtuals = self.is_virtual.iter().filter(|&&v| v).count() as u32;
        let (mut virtuals, mut real) = (0, surface.virtuals);
        let number: Vec<u32> = self
            .is_virtual
            .iter()
            .map(|&v| {
                let counter = if v { &mut virtuals } else { &mut real };
                *counter += 1;
                *counter - 1
            })
            .collect();
        surface.vertex.iter_mut().for_each(|v| *v = number[*v as usize]);
        surface
    }
}

/// The encoder's surface beside the region that grows over it.
struct Oracle<'a> {
    surface: &'a Surface,
    /// For each region face, the known corner that is its corner 0.
    origin: Vec<u32>,
    /// For each known face, its region face or `NONE`.
    visited: Vec<u32>,
    vertex_seen: Vec<bool>,
    next_face: u32,
}

impl<'a> Oracle<'a> {
    fn new(surface: &'a Surface) -> Self {
        Oracle {
            surface,
            origin: Vec::new(),
            visited: vec![NONE; surface.faces() as usize],
            vertex_seen: vec![false; surface.vertices as usize],
            next_face: 0,
        }
    }

    /// Visits the first unvisited face; returns which of its corners are virtual.
    fn next_seed(&mut self) -> [bool; 3] {
        while self.visited[self.next_face as usize] != NONE {
            self.next_face += 1;
        }
        self.visit(3 * self.next_face);
        self.surface.face(self.next_face).map(|v| {
            self.vertex_seen[v as usize] = true;
            self.surface.is_virtual(v)
        })
    }

    fn visit(&mut self, corner: u32) {
        self.visited[(corner / 3) as usize] = self.origin.len() as u32;
        self.origin.push(corner);
    }

    /// The known corner of a region corner.
    fn known(&self, c: u32) -> u32 {
        let o = self.origin[(c / 3) as usize];
        match c % 3 {
            0 => o,
            1 => next(o),
            _ => prev(o),
        }
    }

    /// The region corner of a known corner in a visited face.
    fn region(&self, c: u32) -> u32 {
        let f = self.visited[(c / 3) as usize];
        (0..3).map(|k| 3 * f + k).find(|&d| self.known(d) == c).unwrap_or(NONE)
    }

    fn step(&self, region: &Region, gate: u32) -> Step {
        let apex = self.surface.across(self.known(gate));
        let new_vertex = !self.vertex_seen[self.surface.at(apex) as usize];
        let joins = |corner: u32, edge: u32| edge != gate && self.surface.across(corner) == self.known(edge);
        Step {
            new_vertex,
            // Of the face across, next(apex) is at b and faces a→w, prev(apex) is at a and faces w→b.
            glue_after: !new_vertex && joins(prev(apex), region.after[gate as usize]),
            glue_before: !new_vertex && joins(next(apex), region.before[gate as usize]),
        }
    }

    /// The open edge that starts at the apex and bounds the gap that the new face lies in.
    fn target(&self, gate: u32) -> u32 {
        let mut c = self.surface.across(self.known(gate));
        // Turn counter-clockwise round the apex until a visited face shows its open edge.
        loop {
            let across = self.surface.across(next(c));
            if self.visited[(across / 3) as usize] != NONE {
                return self.region(across);
            }
            c = next(across);
        }
    }

    fn attached(&mut self, gate: u32) {
        let apex = self.surface.across(self.known(gate));
        self.visit(next(apex));
    }

    /// Marks the apex of the last face as seen; returns whether it is virtual.
    fn newest_vertex(&mut self) -> bool {
        let apex = prev(self.origin[self.origin.len() - 1]);
        let v = self.surface.at(apex);
        self.vertex_seen[v as usize] = true;
        self.surface.is_virtual(v)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::entropy::{Decoder, Encoder};
    use crate::mesh::{Mesh, cut};
    use proptest::prelude::*;

    /// Codes and decodes; checks that the result is the surface, by its own correspondence.
    fn round_trip(surface: &Surface) -> usize {
        let mut encoder = Encoder::new();
        let coded = code_base(&mut encoder, Some(surface), surface.faces()).unwrap();
        let bytes = encoder.finish();
        let decoded = code_base(&mut Decoder::new(&bytes), None, surface.faces()).unwrap().surface;
        assert_eq!(decoded, coded.surface);
        decoded.validate().unwrap();
        let mut image = vec![NONE; decoded.vertices as usize];
        let known = |c: u32| {
            let o = coded.origin[(c / 3) as usize];
            [o, next(o), prev(o)][(c % 3) as usize]
        };
        for c in 0..decoded.vertex.len() as u32 {
            let v = &mut image[decoded.at(c) as usize];
            assert!(*v == NONE || *v == surface.at(known(c)));
            *v = surface.at(known(c));
            assert_eq!(known(decoded.across(c)), surface.across(known(c)));
            assert_eq!(decoded.is_virtual(decoded.at(c)), surface.is_virtual(*v));
        }
        bytes.len()
    }

    fn grid_torus(n: u32, m: u32) -> Mesh {
        let at = |i: u32, j: u32| i % n * m + j % m;
        let faces = (0..n * m)
            .flat_map(|q| {
                let (i, j) = (q / m, q % m);
                [[at(i, j), at(i + 1, j), at(i + 1, j + 1)], [at(i, j), at(i + 1, j + 1), at(i, j + 1)]]
            })
            .collect();
        Mesh { positions: vec![[0.0; 3]; (n * m) as usize], faces }
    }

    #[test]
    fn handles_components_and_boundaries_come_back() {
        let torus = grid_torus(9, 7);
        let bytes = round_trip(&cut(&torus).surface);
        assert!(bytes < 40, "{bytes} bytes for a regular torus of 63 vertices");
        let mut open = torus.clone();
        open.faces.retain(|f| !f.contains(&5) && !f.contains(&40));
        open.faces.extend([[0, 1, 62], [70, 71, 72]]);
        open.positions.resize(73, [0.0; 3]);
        round_trip(&cut(&open).surface);
        round_trip(&Surface::default());
    }

    proptest! {
        #[test]
        fn any_surface_comes_back(faces in prop::collection::vec(prop::array::uniform3(0u32..12), 0..60)) {
            round_trip(&cut(&Mesh { positions: vec![[0.0; 3]; 12], faces }).surface);
        }

        #[test]
        fn any_bytes_give_a_closed_surface_or_an_error(
            bytes in prop::collection::vec(any::<u8>(), 0..60),
            faces in 0u32..200,
        ) {
            if let Ok(base) = code_base(&mut Decoder::new(&bytes), None, faces) {
                prop_assert!(base.surface.validate().is_ok());
                prop_assert_eq!(base.surface.faces(), faces);
            }
        }
    }
}
