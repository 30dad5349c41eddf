//! From any mesh to a closed oriented surface: cut what is not a manifold, close boundaries.
//!
//! An edge joins faces that use it in opposite directions, two by two; where more than two use it
//! the pairs are chosen so that a fin (two faces back to back) becomes a fold of the sheet that it
//! stands on. What is left over stays open. Around a vertex the faces then form *fans*; each fan
//! beyond the first receives a copy of the vertex. (After Guéziec et al., "Cutting and stitching: converting
//! sets of polygons to manifold surfaces", 2001.) Every open boundary loop is filled by the
//! faces around one virtual vertex.

use std::collections::VecDeque;

use super::{Mesh, NONE, Surface, next, prev};

/// A mesh as a surface, and where each part of the surface came from.
#[derive(Debug, Default)]
pub(crate) struct Cut {
    /// The closed surface: virtual vertices first; real faces first, in the mesh's order and
    /// with its first corners.
    pub surface: Surface,
    /// For each real vertex of the surface, its vertex in the mesh. A mesh vertex that was cut
    /// occurs several times.
    pub vertex_source: Vec<u32>,
    /// Mesh faces that name a vertex twice; the surface leaves them out.
    pub degenerate: Vec<u32>,
    /// Mesh vertices that no face of the surface uses, ascending.
    pub loose: Vec<u32>,
}

/// Cuts and closes `mesh`, whose indices must be in range. Time O(n log k) with k the largest
/// valence; nothing of the mesh is lost.
pub(crate) fn cut(mesh: &Mesh) -> Cut {
    let is_degenerate = |f: &[u32; 3]| f[0] == f[1] || f[1] == f[2] || f[2] == f[0];
    let mut degenerate = Vec::new();
    let mut vertex = Vec::with_capacity(3 * mesh.faces.len());
    for (i, f) in mesh.faces.iter().enumerate() {
        if is_degenerate(f) {
            degenerate.push(i as u32);
        } else {
            vertex.extend_from_slice(f);
        }
    }
    let mut opposite = vec![NONE; vertex.len()];
    pair_edges(&vertex, mesh.positions.len(), &mut opposite);
    let mut sources: Vec<u32> = (0..mesh.positions.len() as u32).collect();
    separate_fans(&mut vertex, &opposite, &mut sources);
    let loose = number_used_vertices(&mut vertex, &mut sources, mesh.positions.len());
    let mut surface = Surface { vertices: sources.len() as u32, vertex, opposite, virtuals: 0 };
    close_boundaries(&mut surface);
    Cut { surface, vertex_source: sources, degenerate, loose }
}

/// Pairs half-edges that run along one edge in opposite directions.
fn pair_edges(vertex: &[u32], vertices: usize, opposite: &mut [u32]) {
    // Where the half-edges of each vertex end in a list by their lesser end; while it is filled, where they begin.
    let mut ends = vec![0u32; vertices + 1];
    for face in vertex.chunks_exact(3) {
        for (a, b) in [(face[1], face[2]), (face[2], face[0]), (face[0], face[1])] {
            ends[a.min(b) as usize + 1] += 1;
        }
    }
    for v in 0..vertices {
        ends[v + 1] += ends[v];
    }
    // The greater end of each, and its corner.
    let mut edges = vec![0u64; vertex.len()];
    for (face, first) in vertex.chunks_exact(3).zip((0..).step_by(3)) {
        for (a, b, c) in [(face[1], face[2], 0), (face[2], face[0], 1), (face[0], face[1], 2)] {
            let slot = &mut ends[a.min(b) as usize];
            edges[*slot as usize] = u64::from(a.max(b)) << 32 | u64::from(first + c as u32);
            *slot += 1;
        }
    }
    let corner = |edge: u64| edge as u32;
    let mut begin = 0;
    for &end in &ends[..vertices] {
        let edges = &mut edges[begin as usize..end as usize];
        begin = end;
        edges.sort_unstable();
        for same in edges.chunk_by(|&c, &d| c >> 32 == d >> 32) {
            match *same {
                [_] => {}
                [c, d] => {
                    let (c, d) = (corner(c), corner(d));
                    if vertex[next(c) as usize] != vertex[next(d) as usize] {
                        join(opposite, c, d);
                    }
                }
                _ => pair_many(vertex, &same.iter().map(|&c| corner(c)).collect::<Vec<_>>(), opposite),
            }
        }
    }
}

fn join(opposite: &mut [u32], c: u32, d: u32) {
    opposite[c as usize] = d;
    opposite[d as usize] = c;
}

/// Pairs three or more half-edges of one edge, with a face of other vertices where possible.
///
/// Those that face a partner of the same vertices choose first where there are at most `MANY`,
/// among the first `MANY` partners left: linear in the number of half-edges.
fn pair_many(vertex: &[u32], same: &[u32], opposite: &mut [u32]) {
    const MANY: usize = 16;
    let forward = |c: &u32| vertex[next(*c) as usize] < vertex[prev(*c) as usize];
    let apex = |c: u32| vertex[c as usize];
    let (mut there, back): (Vec<u32>, Vec<u32>) = same.iter().partition(|c| forward(c));
    // A queue, because partners leave near the front of what may be a long list.
    let mut back = VecDeque::from(back);
    if same.len() <= MANY {
        there.sort_by_key(|&c| !back.iter().any(|&d| apex(d) == apex(c)));
    }
    for c in there {
        let other = back.iter().take(MANY).position(|&d| apex(d) != apex(c)).unwrap_or(0);
        if let Some(d) = back.remove(other) {
            join(opposite, c, d);
        }
    }
}

/// Gives every fan but a vertex's first a vertex of its own, appended to `sources`.
fn separate_fans(vertex: &mut [u32], opposite: &[u32], sources: &mut Vec<u32>) {
    let mut seen = vec![false; sources.len()];
    let mut done = vec![false; vertex.len()];
    for c in 0..vertex.len() as u32 {
        if done[c as usize] {
            continue;
        }
        let v = vertex[c as usize];
        let name = if seen[v as usize] {
            sources.push(sources[v as usize]);
            sources.len() as u32 - 1
        } else {
            seen[v as usize] = true;
            v
        };
        // Counter-clockwise to the open end or round to c, then clockwise from c.
        let mut at = c;
        loop {
            done[at as usize] = true;
            vertex[at as usize] = name;
            let across = opposite[next(at) as usize];
            if across == NONE || next(across) == c {
                break;
            }
            at = next(across);
        }
        at = c;
        loop {
            let across = opposite[prev(at) as usize];
            if across == NONE || done[prev(across) as usize] {
                break;
            }
            at = prev(across);
            done[at as usize] = true;
            vertex[at as usize] = name;
        }
    }
}

/// Renumbers the vertices that have faces, in order; returns the mesh vertices that have none.
fn number_used_vertices(vertex: &mut [u32], sources: &mut Vec<u32>, original: usize) -> Vec<u32> {
    let mut number = vec![NONE; sources.len()];
    for &v in vertex.iter() {
        number[v as usize] = 0;
    }
    let loose = (0..original as u32).filter(|&v| number[v as usize] == NONE).collect();
    let mut used = 0;
    for v in 0..sources.len() {
        if number[v] != NONE {
            number[v] = used;
            sources[used as usize] = sources[v];
            used += 1;
        }
    }
    sources.truncate(used as usize);
    for v in vertex.iter_mut() {
        *v = number[*v as usize];
    }
    loose
}

/// Fills each boundary loop with faces around a new virtual vertex.
///
/// ```text
///    ──▶ a ──▶ b ──▶      the surface lies above, with a→b in it
///         ╲ f ╱           f = (b, a, w)
///           w             virtual
/// ```
fn close_boundaries(surface: &mut Surface) {
    let real_corners = surface.vertex.len() as u32;
    let open: Vec<u32> = (0..real_corners).filter(|&c| surface.across(c) == NONE).collect();
    if open.is_empty() {
        return;
    }
    // A vertex has one fan, so at most one open half-edge starts at it.
    let mut leaving = vec![NONE; surface.vertices as usize];
    for &c in &open {
        leaving[surface.at(next(c)) as usize] = c;
    }
    let mut loops = Vec::new();
    for &first in &open {
        if surface.across(first) != NONE {
            continue;
        }
        let mut c = first;
        let start = surface.vertex.len() as u32;
        loop {
            let (a, b) = (surface.at(next(c)), surface.at(prev(c)));
            let o = surface.vertex.len() as u32;
            // The virtual vertex gets its number when their count is known.
            surface.vertex.extend_from_slice(&[b, a, loops.len() as u32]);
            surface.opposite.extend_from_slice(&[o.wrapping_sub(2), o + 3, c]);
            surface.opposite[c as usize] = o + 2;
            c = leaving[b as usize];
            if c == first {
                break;
            }
        }
        // Corner 0 (at b) faces the edge a–w, shared with the face before; corner 1 the one after.
        let end = surface.vertex.len() as u32;
        surface.opposite[start as usize] = end - 2;
        surface.opposite[end as usize - 2] = start;
        loops.push(start);
    }
    let virtuals = loops.len() as u32;
    for c in 0..surface.vertex.len() {
        let is_virtual = c >= real_corners as usize && c % 3 == 2;
        if !is_virtual {
            surface.vertex[c] += virtuals;
        }
    }
    surface.vertices += virtuals;
    surface.virtuals = virtuals;
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn mesh(vertices: usize, faces: &[[u32; 3]]) -> Mesh {
        Mesh { positions: vec![[0.0; 3]; vertices], faces: faces.to_vec() }
    }

    /// The surface is valid and its real faces are the mesh's, in order.
    fn check(mesh: &Mesh) -> Cut {
        let cut = cut(mesh);
        cut.surface.validate().unwrap();
        let virtuals = cut.surface.virtuals;
        assert_eq!(cut.vertex_source.len(), (cut.surface.vertices - virtuals) as usize);
        let is_real = |f: &usize| !cut.degenerate.contains(&(*f as u32));
        let real: Vec<usize> = (0..mesh.faces.len()).filter(is_real).collect();
        for (f, &source) in real.iter().enumerate() {
            let face = cut.surface.face(f as u32).map(|v| cut.vertex_source[(v - virtuals) as usize]);
            assert_eq!(face, mesh.faces[source]);
        }
        for f in real.len() as u32..cut.surface.faces() {
            let face = cut.surface.face(f);
            assert!(face[2] < virtuals && face[0] >= virtuals && face[1] >= virtuals);
        }
        let mut used = vec![false; mesh.positions.len()];
        cut.vertex_source.iter().for_each(|&v| used[v as usize] = true);
        assert!((0..used.len()).all(|v| used[v] != cut.loose.contains(&(v as u32))));
        cut
    }

    #[test]
    fn small_cases() {
        assert_eq!(check(&mesh(0, &[])).surface.vertices, 0);
        let triangle = check(&mesh(3, &[[0, 1, 2]]));
        assert_eq!((triangle.surface.vertices, triangle.surface.faces()), (4, 4));
        let pillow = check(&mesh(3, &[[0, 1, 2], [0, 2, 1]]));
        assert_eq!((pillow.surface.vertices, pillow.surface.virtuals), (3, 0));
        let twice = check(&mesh(3, &[[0, 1, 2], [0, 1, 2]]));
        assert_eq!((twice.surface.vertices, twice.surface.virtuals), (8, 2));
        let degenerate = check(&mesh(4, &[[0, 1, 2], [1, 1, 3]]));
        assert_eq!((degenerate.degenerate, degenerate.loose), (vec![1], vec![3]));
    }

    #[test]
    fn one_of_three_faces_on_an_edge_and_one_wing_of_a_bow_tie_are_cut_off() {
        let book = check(&mesh(5, &[[0, 1, 2], [0, 1, 3], [1, 0, 4]]));
        assert_eq!(book.surface.virtuals, 2);
        let bow = check(&mesh(5, &[[0, 1, 2], [0, 3, 4]]));
        assert_eq!((bow.vertex_source.len(), bow.surface.virtuals), (6, 2));
        assert_eq!(bow.vertex_source, [0, 1, 2, 3, 4, 0]);
    }

    #[test]
    fn two_closed_sheets_that_share_an_edge_stay_closed() {
        let tetrahedron = |a, b, c, d| [[a, b, c], [a, d, b], [b, d, c], [a, c, d]];
        let mut faces = tetrahedron(0, 1, 2, 3).to_vec();
        faces.extend(tetrahedron(0, 1, 4, 5));
        let cut = check(&mesh(6, &faces));
        assert_eq!((cut.surface.vertices, cut.surface.virtuals), (8, 0));
    }

    #[test]
    fn an_edge_that_very_many_faces_share_is_paired_in_linear_time() {
        // Pairing in quadratic time moves some 10^11 bytes here.
        let faces: Vec<[u32; 3]> =
            (0..600_000).map(|i| if i % 2 == 0 { [0, 1, i + 2] } else { [1, 0, i + 2] }).collect();
        let cut = cut(&mesh(600_002, &faces));
        cut.surface.validate().unwrap();
        assert_eq!(cut.surface.virtuals, 300_000);
    }

    proptest! {
        #[test]
        fn any_soup_becomes_a_closed_surface(
            faces in prop::collection::vec(prop::array::uniform3(0u32..9), 0..40)
        ) {
            check(&mesh(9, &faces));
        }
    }
}
