//! A closed oriented surface as a corner table.
//!
//! Corner `c = 3f + k` is the k-th corner of face `f`. Its *opposite* is the corner that
//! faces it across the edge opposite to it. Relations are implicit: the next corner, the
//! face and the edge's two ends need no storage (Rossignac, "3D compression made simple:
//! Edgebreaker on a corner table", 2001).
//!
//! ```text
//!            next(c) = b
//!            /|\
//!           / | \
//!   c = a  /  |  \  opposite(c)
//!          \  |  /
//!           \ | /
//!            \|/
//!            prev(c)
//! ```
//!
//! The surface is closed: a boundary loop is filled by a fan of faces around one *virtual*
//! vertex, so that a boundary is no special case anywhere. Virtual vertices come first:
//! `v` is virtual exactly if `v < virtuals`.

/// No corner, vertex or face.
pub(crate) const NONE: u32 = u32::MAX;

/// The next corner of the same face, counter-clockwise.
#[inline(always)]
pub(crate) fn next(c: u32) -> u32 {
    // A test for a multiple of three is one multiplication, a remainder is more.
    if c.wrapping_add(1).is_multiple_of(3) { c - 2 } else { c + 1 }
}

/// The previous corner of the same face.
#[inline(always)]
pub(crate) fn prev(c: u32) -> u32 {
    if c.is_multiple_of(3) { c + 2 } else { c - 1 }
}

/// A closed, oriented 2-manifold; see the [module](self) for its conventions.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct Surface {
    /// The vertex at each corner; three corners a face.
    pub vertex: Vec<u32>,
    /// The corner across the opposite edge: an involution without fixed points.
    pub opposite: Vec<u32>,
    /// Number of vertices, virtual ones included. Every vertex has at least one corner.
    pub vertices: u32,
    /// Vertices `0..virtuals` are virtual: they fill boundary loops and have no position.
    pub virtuals: u32,
}

impl Surface {
    /// Number of faces, virtual ones included.
    #[inline]
    pub fn faces(&self) -> u32 {
        (self.vertex.len() / 3) as u32
    }

    /// Whether `v` is a virtual vertex.
    #[inline(always)]
    pub fn is_virtual(&self, v: u32) -> bool {
        v < self.virtuals
    }

    /// Whether face `f` has a virtual corner.
    #[inline]
    pub fn is_virtual_face(&self, f: u32) -> bool {
        self.any_virtual(&self.face(f))
    }

    /// Whether some of the vertices are virtual.
    #[inline(always)]
    pub fn any_virtual<const N: usize>(&self, vertices: &[u32; N]) -> bool {
        // Vertices have 31 bits, so that the highest one is the sign of a difference.
        vertices.iter().fold(0, |signs, &v| signs | v.wrapping_sub(self.virtuals)) >> 31 != 0
    }

    /// Number of faces without a virtual corner; linear time if there are virtual vertices.
    pub fn real_faces(&self) -> u32 {
        if self.virtuals == 0 {
            return self.faces();
        }
        let hidden =
            |faces: &[u32]| faces.as_chunks::<3>().0.iter().filter(|face| self.any_virtual(face)).count();
        // Few faces are: of eight together it is mostly enough that no corner is virtual.
        let (blocks, rest) = self.vertex.as_chunks::<24>();
        let in_blocks: usize =
            blocks.iter().filter(|block| self.any_virtual(block)).map(|block| hidden(block)).sum();
        self.faces() - (in_blocks + hidden(rest)) as u32
    }

    /// The three vertices of face `f`.
    #[inline(always)]
    pub fn face(&self, f: u32) -> [u32; 3] {
        let i = 3 * f as usize;
        [self.vertex[i], self.vertex[i + 1], self.vertex[i + 2]]
    }

    /// The vertex at corner `c`.
    #[inline(always)]
    pub fn at(&self, c: u32) -> u32 {
        self.vertex[c as usize]
    }

    /// The corner across the edge opposite to `c`.
    #[inline(always)]
    pub fn across(&self, c: u32) -> u32 {
        self.opposite[c as usize]
    }

    /// The corner at the same vertex in the next face counter-clockwise.
    #[inline(always)]
    pub fn swing(&self, c: u32) -> u32 {
        next(self.across(next(c)))
    }

    /// The corners at the vertex of `c`, counter-clockwise from `c`.
    ///
    /// The i-th corner's next and previous vertices are ring members i and i + 1.
    pub fn fan(&self, c: u32) -> impl Iterator<Item = u32> + '_ {
        let mut at = Some(c);
        std::iter::from_fn(move || {
            let now = at?;
            let following = self.swing(now);
            at = (following != c).then_some(following);
            Some(now)
        })
    }

    /// One corner of every vertex: the one of smallest index.
    #[cfg(any(test, feature = "remesh"))]
    pub fn any_corner(&self) -> Vec<u32> {
        self.any_corner_from(0)
    }

    /// One corner of every vertex from `first` on: the one of smallest index.
    pub fn any_corner_from(&self, first: u32) -> Vec<u32> {
        let count = self.vertices - first;
        // Those before go to one more entry: a processor could not guess which.
        let mut corner = vec![NONE; count as usize + 1];
        for (c, &v) in self.vertex.iter().enumerate().rev() {
            corner[v.wrapping_sub(first).min(count) as usize] = c as u32;
        }
        corner.truncate(count as usize);
        corner
    }

    /// The number of faces at every vertex.
    pub fn valences(&self) -> Vec<u32> {
        let mut valence = vec![0; self.vertices as usize];
        for &v in &self.vertex {
            valence[v as usize] += 1;
        }
        valence
    }

    /// Checks every invariant; linear time. Tests call it after each operation.
    ///
    /// Returns what is broken, for an assertion's message.
    #[cfg(test)]
    pub fn validate(&self) -> Result<(), String> {
        let n = self.vertex.len();
        if !n.is_multiple_of(3) || self.opposite.len() != n {
            return Err(format!("{n} corners, {} opposites", self.opposite.len()));
        }
        if self.virtuals > self.vertices {
            return Err(format!("{} virtual of {} vertices", self.virtuals, self.vertices));
        }
        for c in 0..n as u32 {
            let o = self.across(c);
            if o as usize >= n || o == c || self.across(o) != c {
                return Err(format!("corner {c}: opposite {o} is not mutual"));
            }
            if self.at(c) >= self.vertices {
                return Err(format!("corner {c}: vertex {} of {}", self.at(c), self.vertices));
            }
            if self.at(next(c)) != self.at(prev(o)) || self.at(prev(c)) != self.at(next(o)) {
                return Err(format!("corner {c}: its edge runs the same way in both faces"));
            }
        }
        let valence = self.valences();
        for (v, &c) in self.any_corner().iter().enumerate() {
            if c == NONE {
                return Err(format!("vertex {v} has no face"));
            }
            let mut reached = 0;
            for d in self.fan(c) {
                if self.at(d) != v as u32 {
                    return Err(format!("fan of vertex {v} reaches corner {d} of another vertex"));
                }
                reached += 1;
            }
            if reached != valence[v] {
                return Err(format!("vertex {v}: {} faces in several fans", valence[v]));
            }
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn real_faces_are_those_whose_corners_are_all_real(
            vertex in prop::collection::vec(0u32..40, 0..300),
            virtuals in 0u32..6,
        ) {
            let vertex = vertex[..vertex.len() / 3 * 3].to_vec();
            let surface = Surface { vertex, opposite: Vec::new(), vertices: 40, virtuals };
            let real = (0..surface.faces()).filter(|&f| surface.face(f).iter().all(|&v| v >= virtuals));
            prop_assert_eq!(surface.real_faces(), real.count() as u32);
        }
    }
}
