//! Edges along creases of the original, from level to level.
//!
//! A butterfly step halves them. A √3 step flips every edge, so that two steps are needed until an
//! edge comes back, trisected; between them it is hidden behind the edge that crosses it:
//!
//! ```text
//!        y                y                y
//!       /|\              / \               |
//!      / | \            /   \              n
//!     /  |  \          p --- q           p | q      a crease x–y hides behind p–q
//!      \ | /            \   /              m        and comes back as x–m–n–y
//!       \|/              \ /               |
//!        x                x                x
//! ```

use std::collections::HashMap;

use super::climb::Level;
use crate::mesh::{NONE, Surface, next, prev};
use crate::subdivide::{StepKind, cut_edges};

/// An edge on a crease.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Crease {
    /// Its ends.
    pub ends: [u32; 2],
    /// After an odd number of √3 steps, the ends of the edge that it hides behind.
    pub beside: [u32; 2],
}

impl Crease {
    pub fn new(ends: [u32; 2]) -> Self {
        Crease { ends, beside: [NONE; 2] }
    }
}

/// A new vertex that belongs on a crease.
pub(super) struct CreaseVertex {
    pub vertex: u32,
    /// The coarse ends of its edge.
    pub ends: [u32; 2],
    /// How far from the first end to the second it lies.
    pub share: f64,
}

/// The creases after the step `kind`, which refines a level to `fine` (`first` as in `Refined`), and
/// which of the new vertices lie on one. Linear time.
pub(super) fn split_creases(
    level: &Level,
    kind: StepKind,
    fine: &Surface,
    first: &[u32],
) -> (Vec<Crease>, Vec<CreaseVertex>) {
    if level.creases.is_empty() {
        return Default::default();
    }
    match kind {
        StepKind::Butterfly => halve(level),
        StepKind::Sqrt3Odd => bring_back(level, fine, first),
        _ => hide(level, fine, first),
    }
}

/// Finds edges of a level by their ends.
struct Edges(HashMap<[u32; 2], u32>);

impl Edges {
    fn new(level: &Level, edges: impl Iterator<Item = [u32; 2]>) -> Self {
        let mut corner: HashMap<_, _> = edges.map(|e| (ordered(e), NONE)).collect();
        let surface = &level.surface;
        for c in 0..surface.vertex.len() as u32 {
            if let Some(corner) = corner.get_mut(&ordered([surface.at(next(c)), surface.at(prev(c))])) {
                *corner = c;
            }
        }
        Edges(corner)
    }

    /// A corner opposite to the edge.
    fn corner(&self, ends: [u32; 2]) -> Option<u32> {
        self.0.get(&ordered(ends)).copied().filter(|&c| c != NONE)
    }
}

fn ordered([a, b]: [u32; 2]) -> [u32; 2] {
    [a.min(b), a.max(b)]
}

fn halve(level: &Level) -> (Vec<Crease>, Vec<CreaseVertex>) {
    let edges = Edges::new(level, level.creases.iter().map(|crease| crease.ends));
    let mut middle = HashMap::new();
    for (m, c) in (level.surface.vertices..).zip(cut_edges(&level.surface)) {
        middle.extend([(c, m), (level.surface.across(c), m)]);
    }
    let (mut creases, mut vertices) = (Vec::new(), Vec::new());
    for &Crease { ends, .. } in &level.creases {
        if let Some(&vertex) = edges.corner(ends).and_then(|c| middle.get(&c)) {
            vertices.push(CreaseVertex { vertex, ends, share: 0.5 });
            creases.extend(ends.map(|end| Crease::new([end, vertex])));
        }
    }
    (creases, vertices)
}

fn hide(level: &Level, fine: &Surface, first: &[u32]) -> (Vec<Crease>, Vec<CreaseVertex>) {
    let edges = Edges::new(level, level.creases.iter().map(|crease| crease.ends));
    let hidden = level.creases.iter().filter_map(|&Crease { ends, .. }| {
        let c = edges.corner(ends)?;
        let beside = [centre(level, fine, first, c)?, centre(level, fine, first, level.surface.across(c))?];
        Some(Crease { ends, beside })
    });
    (hidden.collect(), Vec::new())
}

fn bring_back(level: &Level, fine: &Surface, first: &[u32]) -> (Vec<Crease>, Vec<CreaseVertex>) {
    let edges = Edges::new(level, level.creases.iter().map(|crease| crease.beside));
    let (mut creases, mut vertices) = (Vec::new(), Vec::new());
    for crease in &level.creases {
        let Some(c) = edges.corner(crease.beside) else { continue };
        let o = level.surface.across(c);
        let centres = (centre(level, fine, first, c), centre(level, fine, first, o));
        if let (Some(m), Some(n)) = centres {
            let [x, y] = [level.surface.at(c), level.surface.at(o)];
            let third = |vertex, ends| CreaseVertex { vertex, ends, share: 1.0 / 3.0 };
            vertices.extend([third(m, [x, y]), third(n, [y, x])]);
            creases.extend([[x, m], [m, n], [n, y]].map(Crease::new));
        }
    }
    (creases, vertices)
}

/// The vertex that a √3 step inserts in the middle of the face of a corner, if it does.
fn centre(level: &Level, fine: &Surface, first: &[u32], c: u32) -> Option<u32> {
    let f = c / 3;
    let on_rim = (3 * f..3 * f + 3).any(|c| level.surface.is_virtual_face(level.surface.across(c) / 3));
    let whole = !level.surface.is_virtual_face(f) && !on_rim;
    whole.then(|| fine.at(3 * first[f as usize] + 8))
}
