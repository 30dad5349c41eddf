//! The base: the original's surface after as many edge collapses as it bears.
//!
//! A collapse moves a vertex into a neighbour, cheapest first, by the quadric error metric (Garland
//! and Heckbert, "Surface simplification using quadric error metrics", 1997) with half-edge
//! collapses, so that every base vertex is one of the original's and creases and tips stay where
//! they are. The link condition (Dey, Edelsbrunner, Guha and Nekhayev, "Topology preserving edge
//! contraction", 1999) keeps the surface a manifold of the same topology. On the closed surface it
//! keeps boundary loops too: the virtual vertex of a loop is a vertex like any.

use std::cmp::Reverse;
use std::collections::BinaryHeap;

use glam::DVec3;

use super::quadric::Quadric;
use crate::mesh::{NONE, Surface, next, prev};

/// What a collapse costs beside its quadric: this times the area it gathers times the squared
/// length of the edge. Where the surface is flat it makes edges equally long; it weighs as much as
/// a deviation of 2 % of the edge.
pub(super) const EVENNESS: f64 = 4e-4;
/// A collapse turns no face by more than this cosine …
const LEAST_TURN: f64 = 0.25;
/// … and makes no face thinner than this, unless it was.
const LEAST_QUALITY: f64 = 0.15;
/// No vertex gets more neighbours than this.
const MOST_NEIGHBOURS: usize = 11;
/// How much a plane across a boundary edge counts, against the faces there.
const RIM_WEIGHT: f64 = 10.0;

/// A coarse surface, its vertices taken from a fine one.
pub(super) struct Base {
    pub surface: Surface,
    /// For each vertex, its number on the fine surface; ascending.
    pub source: Vec<u32>,
    /// What the base vertices stand for.
    pub quadrics: Vec<Quadric>,
}

/// Decimates a surface to `goal` real vertices, or as near as that can be. A vertex's `weight`
/// says how much it matters there. Time O(n log n).
pub(super) fn decimate(surface: &Surface, positions: &[DVec3], weight: &[f64], goal: usize) -> Base {
    let mut work = Decimation::new(surface.clone(), positions, weight);
    let mut left = (surface.vertices - surface.virtuals) as usize;
    for v in surface.virtuals..surface.vertices {
        work.enqueue(v);
    }
    while left > goal {
        let Some(Reverse((bits, v, version))) = work.queue.pop() else { break };
        if work.version[v as usize] != version {
            continue;
        }
        // What it was enqueued for may have become impossible.
        match work.cheapest(v) {
            Some((cost, _)) if cost.to_bits() > bits => {
                work.queue.push(Reverse((cost.to_bits(), v, version)))
            }
            Some((_, c)) => {
                work.collapse(c);
                left -= 1;
            }
            None => {}
        }
    }
    work.finish()
}

struct Decimation<'a> {
    surface: Surface,
    positions: &'a [DVec3],
    quadrics: Vec<Quadric>,
    /// A corner of each vertex; `NONE` once it is gone.
    corner: Vec<u32>,
    on_rim: Vec<bool>,
    dead: Vec<bool>,
    /// Changes with everything that changes a vertex's cost.
    version: Vec<u32>,
    /// Bits of the cost (which is not negative, so that they compare as it does), vertex, version.
    queue: BinaryHeap<Reverse<(u64, u32, u32)>>,
    /// For each vertex, the last vertex that found it among its neighbours.
    seen: Vec<u32>,
}

impl<'a> Decimation<'a> {
    fn new(surface: Surface, positions: &'a [DVec3], weight: &[f64]) -> Self {
        let n = surface.vertices as usize;
        let mut quadrics = vec![Quadric::ZERO; n];
        let mut on_rim = vec![false; n];
        for f in 0..surface.faces() {
            let face = surface.face(f);
            if surface.is_virtual_face(f) {
                face.into_iter().for_each(|v| on_rim[v as usize] = true);
                continue;
            }
            let [a, b, c] = face.map(|v| positions[v as usize]);
            let importance = face.map(|v| weight[v as usize]).iter().sum::<f64>() / 3.0;
            let area = (b - a).cross(c - a);
            let normal = area.normalize_or_zero();
            let plane = Quadric::plane(a, normal, importance * area.length() / 6.0);
            face.into_iter().for_each(|v| quadrics[v as usize] += plane);
            for c in (3 * f..3 * f + 3).filter(|&c| surface.is_virtual_face(surface.across(c) / 3)) {
                let ends = [surface.at(next(c)), surface.at(prev(c))];
                let [a, b] = ends.map(|v| positions[v as usize]);
                let across = (b - a).cross(normal).normalize_or_zero();
                let wall =
                    Quadric::plane(a, across, importance * RIM_WEIGHT * (b - a).length_squared() / 2.0);
                ends.into_iter().for_each(|v| quadrics[v as usize] += wall);
            }
        }
        let corner = surface.any_corner();
        let dead = vec![false; surface.faces() as usize];
        Decimation {
            surface,
            positions,
            quadrics,
            corner,
            on_rim,
            dead,
            version: vec![0; n],
            queue: BinaryHeap::new(),
            seen: vec![NONE; n],
        }
    }

    fn enqueue(&mut self, v: u32) {
        self.version[v as usize] += 1;
        if let Some((cost, _)) = self.cheapest(v) {
            self.queue.push(Reverse((cost.to_bits(), v, self.version[v as usize])));
        }
    }

    /// The cheapest collapse of `v` that is possible: its cost, and the corner that has `v` next and
    /// the vertex that it moves to before.
    fn cheapest(&mut self, v: u32) -> Option<(f64, u32)> {
        let mut choices: Vec<(f64, u32)> = Vec::with_capacity(8);
        let mine = self.quadrics[v as usize];
        for at_v in self.surface.fan(self.corner[v as usize]) {
            let c = prev(at_v);
            let to = self.surface.at(prev(c));
            if self.surface.is_virtual(to) {
                continue;
            }
            let rim_edge = self.surface.is_virtual(self.surface.at(c))
                || self.surface.is_virtual(self.surface.at(self.surface.across(c)));
            if self.on_rim[v as usize] && !rim_edge {
                continue;
            }
            let p = self.positions[to as usize];
            let length = p.distance_squared(self.positions[v as usize]);
            let both = mine + self.quadrics[to as usize];
            choices.push((both.at(p).max(0.0) + EVENNESS * mine.weight * length, c));
        }
        choices.sort_unstable_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
        choices.into_iter().find(|&(_, c)| self.is_possible(c))
    }

    /// Whether the collapse at corner `c` leaves a manifold of the same topology without folds.
    fn is_possible(&mut self, c: u32) -> bool {
        let (from, to) = (self.surface.at(next(c)), self.surface.at(prev(c)));
        let wings = [self.surface.at(c), self.surface.at(self.surface.across(c))];
        if wings[0] == wings[1] || wings.into_iter().any(|w| self.valence(w) <= 3) {
            return false;
        }
        let surface = &self.surface;
        let mut degree = 0;
        for d in surface.fan(self.corner[from as usize]) {
            self.seen[surface.at(next(d)) as usize] = from;
            degree += 1;
        }
        let mut shared = 0;
        for d in surface.fan(self.corner[to as usize]) {
            shared += usize::from(self.seen[surface.at(next(d)) as usize] == from);
            degree += 1;
        }
        for d in surface.fan(self.corner[from as usize]) {
            self.seen[surface.at(next(d)) as usize] = NONE;
        }
        shared == 2 && degree - 4 <= MOST_NEIGHBOURS && self.keeps_shape(from, to)
    }

    fn valence(&self, v: u32) -> usize {
        self.surface.fan(self.corner[v as usize]).count()
    }

    fn keeps_shape(&self, from: u32, to: u32) -> bool {
        let place = |v: u32| self.positions[v as usize];
        self.surface.fan(self.corner[from as usize]).all(|d| {
            let (a, b) = (self.surface.at(next(d)), self.surface.at(prev(d)));
            if a == to || b == to || self.surface.is_virtual(a) || self.surface.is_virtual(b) {
                return true;
            }
            let (a, b) = (place(a), place(b));
            let (before, after) =
                ((a - place(from)).cross(b - place(from)), (a - place(to)).cross(b - place(to)));
            let quality = shape(place(to), a, b);
            before.dot(after) >= LEAST_TURN * before.length() * after.length()
                && (quality >= LEAST_QUALITY || quality >= shape(place(from), a, b))
        })
    }

    /// Moves the vertex next to corner `c` into the one before it.
    ///
    /// ```text
    ///         x                  x
    ///       / c \                |
    ///     to ← from     →        to      the two faces beside the edge go,
    ///       \ o /                |       their outer edges are joined
    ///         y                  y
    /// ```
    fn collapse(&mut self, c: u32) {
        let o = self.surface.across(c);
        let (from, to) = (self.surface.at(next(c)), self.surface.at(prev(c)));
        let fan: Vec<u32> = self.surface.fan(self.corner[from as usize]).collect();
        for d in fan {
            self.surface.vertex[d as usize] = to;
        }
        for side in [c, o] {
            let (left, right) = (self.surface.across(next(side)), self.surface.across(prev(side)));
            self.surface.opposite[left as usize] = right;
            self.surface.opposite[right as usize] = left;
            self.dead[(side / 3) as usize] = true;
            // The ends of the joined edge need corners that are left.
            self.corner[self.surface.at(next(left)) as usize] = next(left);
            self.corner[self.surface.at(prev(left)) as usize] = prev(left);
        }
        self.corner[from as usize] = NONE;
        let gathered = self.quadrics[from as usize];
        self.quadrics[to as usize] += gathered;
        self.version[from as usize] += 1;
        let ring: Vec<u32> =
            self.surface.fan(self.corner[to as usize]).map(|d| self.surface.at(next(d))).collect();
        for v in ring.into_iter().chain([to]) {
            if !self.surface.is_virtual(v) {
                self.enqueue(v);
            }
        }
    }

    fn finish(self) -> Base {
        let mut number = vec![NONE; self.corner.len()];
        let mut source = Vec::new();
        for (v, _) in (0..).zip(&self.corner).filter(|(_, c)| **c != NONE) {
            number[v as usize] = source.len() as u32;
            source.push(v);
        }
        let mut face_number = vec![NONE; self.dead.len()];
        let alive: Vec<u32> = (0..self.dead.len() as u32).filter(|&f| !self.dead[f as usize]).collect();
        for (new, &old) in (0..).zip(&alive) {
            face_number[old as usize] = new;
        }
        let corners = || alive.iter().flat_map(|&f| 3 * f..3 * f + 3);
        let opposite = |c: u32| {
            let o = self.surface.across(c);
            3 * face_number[(o / 3) as usize] + o % 3
        };
        let surface = Surface {
            vertex: corners().map(|c| number[self.surface.at(c) as usize]).collect(),
            opposite: corners().map(opposite).collect(),
            vertices: source.len() as u32,
            virtuals: self.surface.virtuals,
        };
        let quadrics = source.iter().map(|&v| self.quadrics[v as usize]).collect();
        Base { surface, source, quadrics }
    }
}

/// How near a triangle is to equilateral: 4√3 · area / Σ edge², from 0 to 1.
pub(super) fn shape(a: DVec3, b: DVec3, c: DVec3) -> f64 {
    let square = a.distance_squared(b) + b.distance_squared(c) + c.distance_squared(a);
    if square > 0.0 { 2.0 * 3f64.sqrt() * (b - a).cross(c - a).length() / square } else { 0.0 }
}
