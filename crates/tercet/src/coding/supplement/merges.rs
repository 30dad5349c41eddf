//! Stitching: which vertices of the surface are one vertex of the mesh.
//!
//! Copies of a vertex lie on the same lattice point, so only vertices that coincide are asked
//! about. Where every other coincidence is an accident of rounding this is cheap: the copies lie
//! on boundaries, the accidents mostly do not.

use super::NumberModel;
use crate::coding::Point;
use crate::coding::model::BitModel;
use crate::entropy::Coder;
use crate::mesh::{NONE, Surface};

/// The real vertices of a surface after stitching.
pub(super) struct Merged {
    /// For each real vertex, its number: copies share one; numbers ascend by first appearance.
    pub number: Vec<u32>,
    /// For each number, the first real vertex that has it.
    pub first: Vec<u32>,
}

/// Codes which of the real vertices at `points` are copies. When encoding, `source` names each
/// one's vertex in the mesh, of `sources`; vertices of the same source must coincide.
///
/// Time O(n log n).
pub(super) fn code<C: Coder>(
    coder: &mut C,
    surface: &Surface,
    points: &[Point],
    source: &[u32],
    sources: usize,
) -> Merged {
    let boundary = boundary_vertices(surface);
    let mut by_point: Vec<u32> = (0..points.len() as u32).collect();
    by_point.sort_unstable_by_key(|&v| (points[v as usize], v));
    let mut copies = BitModel::new([8, 16], 1, 300);
    let mut which = NumberModel::new(1);
    // For each real vertex, the first vertex that it is a copy of; for each source, its place
    // among the distinct vertices of its group.
    let mut original: Vec<u32> = (0..points.len() as u32).collect();
    let mut place = vec![NONE; if C::ENCODES { sources } else { 0 }];
    let mut distinct = Vec::new();
    let mut history = 0;
    for group in by_point.chunk_by(|&a, &b| points[a as usize] == points[b as usize]) {
        distinct.clear();
        let mut any_boundary = false;
        for &v in group {
            let at = source.get(v as usize).map_or(NONE, |&s| place[s as usize]);
            let edge = boundary[v as usize];
            let mut copy = false;
            if !distinct.is_empty() {
                let sides = edge as usize + 2 * any_boundary as usize;
                let contexts = [sides + 4 * (distinct.len() > 1) as usize, sides + 4 * (history & 3)];
                copy = copies.code(coder, at != NONE, 0, contexts);
                history = history << 1 | copy as usize;
            }
            any_boundary |= edge;
            if copy {
                let last = distinct.len() as u32 - 1;
                let back = match last {
                    0 => 0,
                    _ => which.code(coder, last.wrapping_sub(at), 0).min(last),
                };
                original[v as usize] = distinct[(last - back) as usize];
            } else {
                if let Some(&s) = source.get(v as usize) {
                    place[s as usize] = distinct.len() as u32;
                }
                distinct.push(v);
            }
        }
    }
    numbered(&original)
}

/// Numbers the originals in order; an original never follows its copies.
fn numbered(original: &[u32]) -> Merged {
    let mut number = Vec::with_capacity(original.len());
    let mut first = Vec::new();
    for (v, &o) in original.iter().enumerate() {
        if o == v as u32 {
            number.push(first.len() as u32);
            first.push(o);
        } else {
            number.push(number[o as usize]);
        }
    }
    Merged { number, first }
}

/// For each real vertex, whether it lies on a boundary.
fn boundary_vertices(surface: &Surface) -> Vec<bool> {
    let mut boundary = vec![false; (surface.vertices - surface.virtuals) as usize];
    for f in (0..surface.faces()).filter(|&f| surface.is_virtual_face(f)) {
        for v in surface.face(f) {
            if let Some(v) = v.checked_sub(surface.virtuals) {
                boundary[v as usize] = true;
            }
        }
    }
    boundary
}
