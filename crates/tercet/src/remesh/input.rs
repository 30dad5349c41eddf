//! What can be remeshed: an oriented manifold, made of the mesh that was given.

use std::collections::VecDeque;

use glam::DVec3;

use crate::mesh::{Cut, Surface, cut};
use crate::{Error, Mesh, Result};

/// A mesh as an oriented manifold, and what had to be done for that.
pub(super) struct Input {
    /// Only the faces that count, all of one orientation where they join.
    pub mesh: Mesh,
    pub surface: Surface,
    /// One a vertex of the surface; those of virtual vertices mean nothing.
    pub positions: Vec<DVec3>,
    pub repairs: Repairs,
}

/// What was changed of a mesh before it could be remeshed.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Repairs {
    /// Faces that name a vertex twice, left out.
    pub degenerate_faces: usize,
    /// Faces turned round to agree with their neighbours.
    pub turned_faces: usize,
    /// Vertices that several fans of faces shared; each fan received its own.
    pub cut_vertices: usize,
}

impl Input {
    /// Makes a manifold of `mesh`. Time O(n log n).
    ///
    /// # Errors
    /// [`Error::Mesh`] with the place: no faces, an edge of more than two faces, or faces that
    /// cannot agree on a side.
    pub fn new(mesh: &Mesh) -> Result<Self> {
        mesh.check()?;
        let mut faces = mesh.faces.clone();
        faces.retain(|f| f[0] != f[1] && f[1] != f[2] && f[2] != f[0]);
        if faces.is_empty() {
            return Err(Error::mesh("faces", "there are none, so there is no surface to remesh"));
        }
        let mut repairs = Repairs { degenerate_faces: mesh.faces.len() - faces.len(), ..Repairs::default() };
        repairs.turned_faces = orient(&mut faces)?;
        let mesh = Mesh { positions: mesh.positions.clone(), faces };
        let Cut { surface, vertex_source, loose, .. } = cut(&mesh);
        repairs.cut_vertices = vertex_source.len() + loose.len() - mesh.positions.len();
        let mut positions = vec![DVec3::ZERO; surface.virtuals as usize];
        positions.extend(vertex_source.iter().map(|&v| point(mesh.positions[v as usize])));
        Ok(Input { mesh, surface, positions, repairs })
    }
}

/// A position in double precision.
pub(super) fn point(p: [f32; 3]) -> DVec3 {
    DVec3::from_array(p.map(f64::from))
}

/// One side of an edge: its ends in ascending order, its face, and whether the face runs from the
/// lower end to the higher.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
struct Side {
    ends: (u32, u32),
    face: u32,
    ascending: bool,
}

/// Turns faces round until neighbours agree, in each component as few as possible; returns how many.
fn orient(faces: &mut [[u32; 3]]) -> Result<usize> {
    let mut sides = Vec::with_capacity(3 * faces.len());
    for (face, f) in (0..).zip(faces.iter()) {
        for (a, b) in [(f[0], f[1]), (f[1], f[2]), (f[2], f[0])] {
            sides.push(Side { ends: (a.min(b), a.max(b)), face, ascending: a < b });
        }
    }
    sides.sort_unstable();
    // For each face its neighbours, and whether they disagree with it.
    let mut neighbours = vec![[(0, false); 3]; faces.len()];
    let mut count = vec![0; faces.len()];
    for same in sides.chunk_by(|s, t| s.ends == t.ends) {
        match *same {
            [_] => {}
            [s, t] => {
                let disagree = s.ascending == t.ascending;
                for (from, to) in [(s.face, t.face), (t.face, s.face)] {
                    let n = &mut count[from as usize];
                    neighbours[from as usize][*n] = (to, disagree);
                    *n += 1;
                }
            }
            _ => {
                let (a, b) = same[0].ends;
                let cause = format!("{} faces share it, so the mesh is not a manifold", same.len());
                return Err(Error::mesh(format!("edge between vertices {a} and {b}"), cause));
            }
        }
    }
    let mut turned = 0;
    let mut turn: Vec<Option<bool>> = vec![None; faces.len()];
    for first in 0..faces.len() as u32 {
        if turn[first as usize].is_some() {
            continue;
        }
        turn[first as usize] = Some(false);
        let mut component = vec![first];
        let mut waiting = VecDeque::from([first]);
        while let Some(f) = waiting.pop_front() {
            let mine = turn[f as usize] == Some(true);
            for &(g, disagree) in &neighbours[f as usize][..count[f as usize]] {
                match turn[g as usize] {
                    None => {
                        turn[g as usize] = Some(mine != disagree);
                        component.push(g);
                        waiting.push_back(g);
                    }
                    Some(theirs) if theirs != (mine != disagree) => {
                        let cause =
                            "no choice of sides suits all faces around it: the mesh is not orientable";
                        return Err(Error::mesh(format!("face {g}"), cause));
                    }
                    Some(_) => {}
                }
            }
        }
        let against = component.iter().filter(|&&f| turn[f as usize] == Some(true)).count();
        let fewer = 2 * against <= component.len();
        for &f in component.iter().filter(|&&f| turn[f as usize] == Some(fewer)) {
            faces[f as usize].swap(1, 2);
            turned += 1;
        }
    }
    Ok(turned)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::shapes;

    fn cause(mesh: &Mesh) -> String {
        Input::new(mesh).err().unwrap().to_string()
    }

    #[test]
    fn faces_turned_against_the_rest_are_turned_back() {
        let whole = shapes::torus(8, 6);
        let mut mesh = whole.clone();
        for f in [3, 4, 50] {
            mesh.faces[f].swap(0, 1);
        }
        let input = Input::new(&mesh).unwrap();
        assert_eq!(input.repairs, Repairs { turned_faces: 3, ..Repairs::default() });
        assert_eq!(input.surface.virtuals, 0);
        let same = |f: &[u32; 3], g: &[u32; 3]| (0..3).any(|k| [0, 1, 2].map(|i| f[(i + k) % 3]) == *g);
        assert!(input.mesh.faces.iter().zip(&whole.faces).all(|(f, g)| same(f, g)));
    }

    #[test]
    fn what_is_not_an_orientable_manifold_is_refused_with_the_place() {
        assert!(cause(&Mesh::default()).starts_with("faces: "));
        let positions = vec![[0.0; 3]; 5];
        let book = Mesh { positions, faces: vec![[0, 1, 2], [1, 0, 3], [0, 1, 4]] };
        assert_eq!(
            cause(&book),
            "edge between vertices 0 and 1: 3 faces share it, so the mesh is not a manifold"
        );
        // A Möbius strip of five triangles: each shares an edge with the next, and the last with the first.
        let strip = Mesh {
            positions: vec![[0.0; 3]; 5],
            faces: vec![[0, 1, 2], [1, 2, 3], [2, 3, 4], [3, 4, 0], [4, 0, 1]],
        };
        assert!(cause(&strip).contains("not orientable"), "{}", cause(&strip));
    }

    #[test]
    fn fans_that_share_a_vertex_are_cut_apart() {
        let bow = Mesh { positions: vec![[0.0; 3]; 5], faces: vec![[0, 1, 2], [0, 3, 4]] };
        let input = Input::new(&bow).unwrap();
        assert_eq!(input.repairs.cut_vertices, 1);
        assert_eq!(input.surface.virtuals, 2);
    }
}
