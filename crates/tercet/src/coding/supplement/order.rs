//! Order: where the original has each vertex and each face.
//!
//! Files are mostly written along the surface: the next vertex lies beside one that came shortly
//! before, or beside one that came long before but next to the one whose neighbour was last named
//! (rows of a scan). So the original's order is followed as a walk. Each element is either a
//! *hop*, a neighbour of an element placed before, its *parent*, or a *jump*, told by its number.
//! Faces are ordered by the original's vertices first, which leaves only what that does not tell.

use super::NumberModel;
use super::graph::Graph;
use super::ranks::RankedSet;
use crate::coding::model::BitModel;
use crate::entropy::Coder;
use crate::mesh::{Mesh, NONE};
use crate::{Error, Result};

/// Codes the order of a mesh: `mesh` has the order of the decoder. When encoding, `original` is
/// the mesh in its own order and `source` the original's vertex for each of `mesh`.
///
/// Time O(n log n).
pub(super) fn code<C: Coder>(
    coder: &mut C,
    mesh: Mesh,
    source: &[u32],
    original: Option<&Mesh>,
) -> Result<Mesh> {
    let vertices = mesh.positions.len() as u32;
    let graph = Graph::of_vertices(vertices, &mesh.faces);
    let order = code_walk(coder, &graph, &inverse(source))?;
    drop(graph);
    let number = inverse(&order);
    let positions = order.iter().map(|&v| mesh.positions[v as usize]).collect();
    let mut faces = mesh.faces;
    for face in &mut faces {
        *face = canonical(face.map(|v| number[v as usize])).0;
    }
    faces.sort_unstable();
    let mut order = Vec::new();
    let mut rotations = Vec::new();
    if let Some(original) = original {
        let rotated: Vec<_> = original.faces.iter().map(|&face| canonical(face)).collect();
        let mut sorted: Vec<u32> = (0..rotated.len() as u32).collect();
        sorted.sort_unstable_by_key(|&f| (rotated[f as usize].0, f));
        order = inverse(&sorted);
        rotations = rotated.iter().map(|r| r.1).collect();
    }
    let order = code_walk(coder, &Graph::of_faces(vertices, &faces), &order)?;
    let faces = order.iter().map(|&f| faces[f as usize]).collect();
    Ok(Mesh { positions, faces: code_rotations(coder, faces, &rotations) })
}

/// The least rotation of a face, and how many corners further the face begins.
fn canonical([a, b, c]: [u32; 3]) -> ([u32; 3], u32) {
    ([a, b, c], 0).min(([c, a, b], 1)).min(([b, c, a], 2))
}

/// From the order of some elements to the place of each.
pub(super) fn inverse(order: &[u32]) -> Vec<u32> {
    let mut inverse = vec![NONE; order.len()];
    for (i, &v) in order.iter().enumerate() {
        inverse[v as usize] = i as u32;
    }
    inverse
}

/// The elements of a graph on the way from one order to another.
struct Walk<'a> {
    graph: &'a Graph,
    /// The elements placed so far.
    order: Vec<u32>,
    /// For each element, its place, or `NONE`.
    place: Vec<u32>,
    /// Elements without a place.
    unplaced: RankedSet,
    /// Places of elements that have neighbours without a place.
    open: RankedSet,
    /// For each element, how many neighbours have no place.
    free: Vec<u32>,
    /// The place of the last hop's parent.
    parent: u32,
}

/// A step of the walk, relative to what is expected.
#[derive(Clone, Copy)]
enum Move {
    /// To the element of this rank among those without a place, less that of the one expected.
    Jump(i64),
    /// To a neighbour of the parent that has this rank among the open, less that expected.
    Hop(i64),
}

struct WalkModels {
    hops: BitModel<2>,
    jumps: NumberModel,
    parents: NumberModel,
    neighbours: BitModel<2>,
    /// The last moves: 1 for a hop.
    history: usize,
    /// Classes of the last jump and the last hop.
    last: [usize; 2],
}

/// Classes of the size of a move: its length in bits, up to 7.
const MOVE_CLASSES: usize = 8;

/// Codes an order of the graph's nodes; when encoding, `wanted` is it.
fn code_walk<C: Coder>(coder: &mut C, graph: &Graph, wanted: &[u32]) -> Result<Vec<u32>> {
    let mut walk = Walk::new(graph);
    let mut models = WalkModels::new();
    for i in 0..graph.nodes() as usize {
        if coder.exhausted() {
            return Err(damaged("it ends early"));
        }
        let wanted = wanted.get(i).copied();
        let hint = wanted.map_or(Move::Jump(0), |v| walk.best_move(v));
        let node = match models.code_move(coder, hint, &walk) {
            Move::Jump(by) => walk.unplaced_at(by),
            Move::Hop(by) => walk.open_at(by).map(|parent| {
                walk.parent = parent;
                models.code_neighbour(coder, wanted, &walk)
            }),
        };
        walk.place(node.ok_or_else(|| damaged("a step to nowhere"))?);
    }
    Ok(walk.order)
}

fn damaged(cause: &str) -> Error {
    Error::format("order section", cause)
}

impl<'a> Walk<'a> {
    fn new(graph: &'a Graph) -> Self {
        let n = graph.nodes();
        Walk {
            graph,
            order: Vec::with_capacity(n as usize),
            place: vec![NONE; n as usize],
            unplaced: RankedSet::full(n),
            open: RankedSet::empty(n),
            free: (0..n).map(|v| graph.row(v).len() as u32).collect(),
            parent: 0,
        }
    }

    /// The rank expected of a jump: that of the next element without a place.
    fn jump_base(&self) -> i64 {
        self.order.last().map_or(0, |&v| self.unplaced.rank(v)).into()
    }

    /// The rank expected of a hop's parent: the last one's or, if it is closed, the next one's.
    fn hop_base(&self) -> i64 {
        self.open.rank(self.parent).into()
    }

    fn unplaced_at(&self, by: i64) -> Option<u32> {
        let rank = u32::try_from(self.jump_base() + by).ok()?;
        (rank < self.unplaced.len()).then(|| self.unplaced.select(rank))
    }

    fn open_at(&self, by: i64) -> Option<u32> {
        let rank = u32::try_from(self.hop_base() + by).ok()?;
        (rank < self.open.len()).then(|| self.open.select(rank))
    }

    /// The neighbours of the parent that have no place, ascending.
    fn candidates(&self) -> impl Iterator<Item = u32> + '_ {
        let parent = self.order[self.parent as usize];
        self.graph.row(parent).iter().copied().filter(|&v| self.place[v as usize] == NONE)
    }

    /// The shorter way to `v`. Only the encoder asks.
    fn best_move(&self, v: u32) -> Move {
        let jump = self.unplaced.rank(v) as i64 - self.jump_base();
        let base = self.hop_base();
        let places = self.graph.row(v).iter().map(|&n| self.place[n as usize]).filter(|&p| p != NONE);
        let hop = places.map(|p| self.open.rank(p) as i64 - base).min_by_key(|by| (by.abs(), *by));
        match hop {
            Some(hop) if class(hop) < class(jump) => Move::Hop(hop),
            _ => Move::Jump(jump),
        }
    }

    fn place(&mut self, v: u32) {
        let place = self.order.len() as u32;
        self.order.push(v);
        self.place[v as usize] = place;
        self.unplaced.remove(v);
        if self.free[v as usize] > 0 {
            self.open.insert(place);
        }
        for &n in self.graph.row(v) {
            self.free[n as usize] -= 1;
            let p = self.place[n as usize];
            if self.free[n as usize] == 0 && p != NONE {
                self.open.remove(p);
            }
        }
    }
}

/// The length of a move in bits.
fn class(by: i64) -> usize {
    (64 - by.unsigned_abs().leading_zeros()) as usize
}

impl WalkModels {
    fn new() -> Self {
        WalkModels {
            hops: BitModel::new([64, MOVE_CLASSES * MOVE_CLASSES * 2], 1, 300),
            jumps: NumberModel::new(MOVE_CLASSES),
            parents: NumberModel::new(MOVE_CLASSES),
            neighbours: BitModel::new([2 * 8 * 8, 8 * 8 * 2], 1, 300),
            history: 0,
            last: [0; 2],
        }
    }

    fn code_move<C: Coder>(&mut self, coder: &mut C, hint: Move, walk: &Walk) -> Move {
        let contexts =
            [self.history & 63, (self.last[0] * MOVE_CLASSES + self.last[1]) * 2 + (self.history & 1)];
        let is_hop = walk.open.len() > 0 && {
            let hint = matches!(hint, Move::Hop(_));
            self.hops.code(coder, hint, 0, contexts)
        };
        self.history = self.history << 1 | is_hop as usize;
        let model = if is_hop { &mut self.parents } else { &mut self.jumps };
        let last = &mut self.last[is_hop as usize];
        let (Move::Jump(by) | Move::Hop(by)) = hint;
        let by = model.code_signed(coder, by, *last);
        *last = class(by).min(MOVE_CLASSES - 1);
        if is_hop { Move::Hop(by) } else { Move::Jump(by) }
    }

    /// Codes which of the candidates the hop leads to, by asking one after the other.
    fn code_neighbour<C: Coder>(&mut self, coder: &mut C, wanted: Option<u32>, walk: &Walk) -> u32 {
        let newest = walk.order[walk.order.len() - 1];
        let mut left = walk.free[walk.order[walk.parent as usize] as usize] as usize;
        let mut chosen = NONE;
        for (i, v) in walk.candidates().enumerate() {
            chosen = v;
            left -= 1;
            if left == 0 {
                break;
            }
            let beside = walk.graph.joins(v, newest) as usize;
            let placed = walk.graph.row(v).len() - walk.free[v as usize] as usize;
            let contexts = [
                (placed.min(7) * 8 + left.min(7)) * 2 + beside,
                (i.min(7) * 8 + (left + i).min(7)) * 2 + beside,
            ];
            if self.neighbours.code(coder, wanted == Some(v), 0, contexts) {
                break;
            }
        }
        chosen
    }
}

/// Turns the faces to their first corners; when encoding, `known` says how far.
fn code_rotations<C: Coder>(coder: &mut C, mut faces: Vec<[u32; 3]>, known: &[u32]) -> Vec<[u32; 3]> {
    let mut models = [0, 1].map(|_| BitModel::new([27, 64], 1, 300));
    let mut history = 0;
    let mut before = [NONE; 3];
    for (f, face) in faces.iter_mut().enumerate() {
        let known = known.get(f).copied().unwrap_or(0);
        let corner = |v: u32| face.iter().position(|&w| w == v).unwrap_or(3);
        let contexts = [history, (corner(before[0]) * 4 + corner(before[2])) * 4 + corner(before[1])];
        let rotation = match () {
            () if models[0].code(coder, known == 0, 0, contexts) => 0,
            () if models[1].code(coder, known == 1, 0, contexts) => 1,
            () => 2,
        };
        history = (history * 3 + rotation) % 27;
        face.rotate_left(rotation);
        before = *face;
    }
    faces
}
