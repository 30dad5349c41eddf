//! What a surface must be like for one butterfly step to have made it.

use crate::mesh::{Surface, next, prev};
use crate::reverse::label::Rule;

/// What one pass over the surface tells about a division.
pub(super) struct Facts {
    /// For each vertex whether a step could have inserted it: six faces inside, three real and two
    /// virtual ones on a boundary.
    may_be_odd: Vec<bool>,
}

impl Facts {
    /// Gathers them; `None` if the number of faces or the way in which virtual faces fill the
    /// boundary excludes a division at once.
    pub fn gather(fine: &Surface) -> Option<Facts> {
        let real = fine.real_faces();
        if real == 0 || !real.is_multiple_of(4) {
            return None;
        }
        let mut faces = vec![0u32; fine.vertices as usize];
        let mut hidden = vec![0u32; fine.vertices as usize];
        for c in 0..fine.vertex.len() as u32 {
            faces[fine.at(c) as usize] += 1;
            if !fine.is_virtual(fine.at(c)) {
                continue;
            }
            let ends = [next(c), prev(c)].map(|end| fine.at(end));
            if ends.iter().any(|&v| fine.is_virtual(v)) || fine.is_virtual_face(fine.across(c) / 3) {
                return None;
            }
            ends.iter().for_each(|&v| hidden[v as usize] += 1);
        }
        let counts = faces.into_iter().zip(hidden).enumerate();
        let may_be_odd = counts.map(|(v, n)| !fine.is_virtual(v as u32) && matches!(n, (6, 0) | (5, 2)));
        Some(Facts { may_be_odd: may_be_odd.collect() })
    }
}

/// Labelling k < 3 of a face: its vertex k is even. Labelling 3: none is, it is a middle face.
impl Rule for Facts {
    const LABELLINGS: u32 = 4;

    fn may_be_odd(&self, v: u32) -> bool {
        self.may_be_odd[v as usize]
    }

    fn is_even(&self, _fine: &Surface, _f: u32, k: u32, labelling: u32) -> bool {
        k == labelling
    }

    fn fits(&self, _f: u32, evens: u32) -> bool {
        evens <= 1
    }

    /// Beyond a middle face there are even vertices only, beyond a corner face odd ones.
    fn beyond(&self, _g: u32, own: u32, _common: u32) -> bool {
        own == 0
    }

    fn fits_boundary(&self, evens: u32) -> bool {
        evens == 1
    }
}
