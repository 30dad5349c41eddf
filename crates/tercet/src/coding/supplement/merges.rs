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
/// Time O(n log n), but linear for most: only those that may coincide with others are sorted.
pub(super) fn code<C: Coder>(
    coder: &mut C,
    surface: &Surface,
    points: &[Point],
    source: &[u32],
    sources: usize,
) -> Merged {
    let boundary = boundary_vertices(surface);
    let by_point = coinciding(points);
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

/// The vertices that coincide with others, and some of the rest, by point and number: less than a sixteenth of them,
/// unless they were made to share their hashes.
fn coinciding(points: &[Point]) -> Vec<u32> {
    // Of sixteen bits a vertex, those whose points have the hash, and those for which another one had it before.
    let bits = (16 * points.len() as u64).next_power_of_two().max(64);
    let place = |p: &Point| {
        let hash = HASH.iter().zip(p).fold(0u64, |sum, (&k, &x)| sum.wrapping_add(k.wrapping_mul(x as u64)));
        let bit = hash >> (u64::BITS - bits.ilog2());
        ((bit / 64) as usize, 1u64 << (bit % 64))
    };
    let mut met = vec![[0u64; 2]; (bits / 64) as usize];
    for (word, bit) in points.iter().map(place) {
        let [once, again] = &mut met[word];
        *again |= *once & bit;
        *once |= bit;
    }
    let is_met_again = |p: &Point| {
        let (word, bit) = place(p);
        met[word][1] & bit != 0
    };
    let mut found: Vec<u32> = (0..).zip(points).filter(|(_, p)| is_met_again(p)).map(|(v, _)| v).collect();
    found.sort_unstable_by_key(|&v| (points[v as usize], v));
    found
}

/// Multipliers of the coordinates, 2⁶⁴ over powers of the root of x⁴ = x + 1: the upper bits of the sum are spread
/// evenly over any lattice (M. Roberts, "The unreasonable effectiveness of quasirandom sequences", 2018).
const HASH: [u64; 3] = [0xd1b5_4a32_d192_ed03, 0xabc9_8388_fb8f_ac03, 0x8cb9_2ba7_2f3d_8dd7];

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
    for face in surface.vertex.as_chunks::<3>().0.iter().filter(|face| surface.any_virtual(face)) {
        for v in face {
            if let Some(v) = v.checked_sub(surface.virtuals) {
                boundary[v as usize] = true;
            }
        }
    }
    boundary
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn vertices_that_coincide_are_found_in_the_order_of_their_points(
            points in prop::collection::vec(prop::array::uniform3(-3i32..3), 0..300),
        ) {
            let groups = |list: &[u32]| -> Vec<Vec<u32>> {
                let groups = list.chunk_by(|&a, &b| points[a as usize] == points[b as usize]);
                groups.filter(|group| group.len() > 1).map(<[u32]>::to_vec).collect()
            };
            let mut all: Vec<u32> = (0..points.len() as u32).collect();
            all.sort_by_key(|&v| points[v as usize]);
            prop_assert_eq!(groups(&coinciding(&points)), groups(&all));
        }
    }

    #[test]
    fn where_nothing_coincides_hardly_anything_is_sorted() {
        let scattered = (0..10_000u32).map(|i| [i * 7919 % 4093, i * 104_729 % 4091, i]);
        let scattered: Vec<Point> = scattered.map(|p| p.map(|x| x as i32)).collect();
        let row: Vec<Point> = (0..10_000).map(|i| [i, 0, 0]).collect();
        for points in [scattered, row] {
            let found = coinciding(&points).len();
            assert!(found < points.len() / 8, "{found}");
        }
    }
}
