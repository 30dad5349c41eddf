//! What a surface must be like for one √3 step to have made it.

use crate::mesh::{Surface, next, prev};
use crate::reverse::label::Rule;
use crate::subdivide::StepKind;

/// What one pass over the surface tells about a division of a given kind.
pub(super) struct Facts {
    pub kind: StepKind,
    /// For each face the number of even vertices that it must have; 0 for a virtual face.
    pub evens: Vec<u8>,
    /// For each vertex whether a step of this kind could have inserted it.
    ///
    /// Inside: six faces, less one in the even generation for each boundary edge that the
    /// vertex is the apex over, for such an edge does not flip. On a boundary: nothing in the
    /// even generation; three real and two virtual faces in the odd one.
    pub may_be_odd: Vec<bool>,
    /// For each vertex whether it is on a boundary, or virtual.
    pub open: Vec<bool>,
}

impl Facts {
    /// Gathers them; `None` if the number of faces or the way in which virtual faces fill the
    /// boundary excludes a division at once.
    pub fn gather(fine: &Surface, kind: StepKind) -> Option<Facts> {
        let real = fine.real_faces();
        if real == 0 || !real.is_multiple_of(3) {
            return None;
        }
        let n = fine.vertices as usize;
        let even_kind = kind == StepKind::Sqrt3Even;
        let mut evens = vec![1u8; fine.faces() as usize];
        let mut faces = vec![0u32; n];
        let mut hidden = vec![0u32; n];
        let mut over = vec![0u32; n];
        for c in 0..fine.vertex.len() as u32 {
            faces[fine.at(c) as usize] += 1;
            if !fine.is_virtual(fine.at(c)) {
                continue;
            }
            let apex = fine.across(c);
            if fine.is_virtual(fine.at(next(c))) || fine.is_virtual(fine.at(prev(c))) {
                return None;
            }
            if fine.is_virtual_face(apex / 3) {
                return None;
            }
            evens[(c / 3) as usize] = 0;
            for v in fine.face(c / 3) {
                hidden[v as usize] += 1;
            }
            if even_kind {
                evens[(apex / 3) as usize] = 2;
                over[fine.at(apex) as usize] += 1;
            }
        }
        let may_be_odd = (0..n).map(|v| match hidden[v] {
            0 => faces[v] + over[v] == 6,
            h => !even_kind && h == 2 && faces[v] == 5 && !fine.is_virtual(v as u32),
        });
        let may_be_odd = may_be_odd.collect();
        let open = hidden.iter().map(|&h| h > 0).collect();
        Some(Facts { kind, evens, may_be_odd, open })
    }
}

/// A labelled face fixes the labels of its neighbours: the third vertex is even if the two common
/// ones leave an even vertex missing.
impl Rule for Facts {
    const LABELLINGS: u32 = 3;

    fn may_be_odd(&self, v: u32) -> bool {
        self.may_be_odd[v as usize]
    }

    /// The even ends of a boundary edge, else the corner alone.
    fn is_even(&self, fine: &Surface, f: u32, k: u32, corner: u32) -> bool {
        match self.evens[f as usize] {
            2 => self.open[fine.at(3 * f + k) as usize],
            _ => k == corner,
        }
    }

    fn fits(&self, f: u32, evens: u32) -> bool {
        evens == u32::from(self.evens[f as usize])
    }

    fn beyond(&self, g: u32, _own: u32, common: u32) -> bool {
        common < u32::from(self.evens[g as usize])
    }

    fn fits_boundary(&self, _evens: u32) -> bool {
        true
    }
}
