//! Labelling vertices even or odd by flooding from face to face.

use crate::mesh::{Surface, next, prev};
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
        let n = fine.vertices as usize;
        let even_kind = kind == StepKind::Sqrt3Even;
        let mut evens = vec![1u8; fine.faces() as usize];
        let mut faces = vec![0u32; n];
        let mut hidden = vec![0u32; n];
        let mut over = vec![0u32; n];
        let mut real = fine.faces();
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
            real -= 1;
            evens[(c / 3) as usize] = 0;
            for v in fine.face(c / 3) {
                hidden[v as usize] += 1;
            }
            if even_kind {
                evens[(apex / 3) as usize] = 2;
                over[fine.at(apex) as usize] += 1;
            }
        }
        if real == 0 || !real.is_multiple_of(3) {
            return None;
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

/// A labelling, but for the components that several labellings fit.
pub(super) struct Labels {
    /// For each vertex whether it is even. Virtual vertices are.
    pub even: Vec<bool>,
    /// The components left open, with their labellings.
    pub open: Vec<Choice>,
}

/// A component and the labellings that fit it; every vertex of it may be odd.
pub(super) struct Choice {
    pub vertices: Vec<u32>,
    /// For each of `vertices`, a bit for each labelling in which it is even.
    evens: Vec<u8>,
    /// A bit for each labelling that fits.
    valid: u8,
}

impl Choice {
    pub fn is_valid(&self, round: u32) -> bool {
        self.valid >> round & 1 == 1
    }

    /// Writes labelling `round`, 0 to 2, into `even`; the first that fits if that one does not.
    pub fn apply(&self, round: u32, even: &mut [bool]) {
        let round = if self.is_valid(round) { round } else { self.valid.trailing_zeros() };
        for (&v, bits) in self.vertices.iter().zip(&self.evens) {
            even[v as usize] = bits >> round & 1 == 1;
        }
    }
}

#[derive(Clone, Copy, PartialEq, Eq)]
enum Label {
    Unknown,
    Even,
    Odd,
}

/// The labels of all components, `None` if some component has none. Linear time: a component
/// with a vertex that must be even is flooded once, any other three times.
pub(super) fn label(fine: &Surface, facts: &Facts) -> Option<Labels> {
    let mut flood = Flood::new(fine, facts);
    for c in 0..fine.vertex.len() as u32 {
        let settled = flood.seen[(c / 3) as usize] || facts.may_be_odd[fine.at(c) as usize];
        if !settled && !flood.run(c) {
            return None;
        }
    }
    let mut open = Vec::new();
    for f in 0..fine.faces() {
        if !flood.seen[f as usize] {
            open.push(flood.choice(f)?);
        }
    }
    let even = flood.label.iter().map(|&l| l == Label::Even).collect();
    Some(Labels { even, open })
}

struct Flood<'a> {
    fine: &'a Surface,
    facts: &'a Facts,
    label: Vec<Label>,
    /// Faces reached by a flood that stands, and all virtual ones.
    seen: Vec<bool>,
    /// The faces of the current flood, in the order reached.
    reached: Vec<u32>,
}

impl<'a> Flood<'a> {
    fn new(fine: &'a Surface, facts: &'a Facts) -> Self {
        let initial = |v| if fine.is_virtual(v) { Label::Even } else { Label::Unknown };
        Flood {
            fine,
            facts,
            label: (0..fine.vertices).map(initial).collect(),
            seen: facts.evens.iter().map(|&e| e == 0).collect(),
            reached: Vec::new(),
        }
    }

    /// Labels the component of corner `seed`, whose vertex is even. False on a contradiction.
    fn run(&mut self, seed: u32) -> bool {
        self.reached.clear();
        self.reach(seed / 3);
        let two = self.facts.evens[(seed / 3) as usize] == 2;
        for c in [seed, next(seed), prev(seed)] {
            // The even ends of a boundary edge, else the seed alone.
            let even = if two { self.facts.open[self.fine.at(c) as usize] } else { c == seed };
            if !self.set(self.fine.at(c), even) {
                return false;
            }
        }
        let mut done = 0;
        while let Some(&f) = self.reached.get(done) {
            done += 1;
            if self.evens(f) != self.facts.evens[f as usize] || !self.cross(f) {
                return false;
            }
        }
        true
    }

    fn reach(&mut self, f: u32) {
        self.seen[f as usize] = true;
        self.reached.push(f);
    }

    /// Reaches the neighbours of face `f` and labels what is left of them: the third vertex is
    /// even if the two common ones leave an even vertex missing.
    fn cross(&mut self, f: u32) -> bool {
        for c in 3 * f..3 * f + 3 {
            let beyond = self.fine.across(c);
            let g = beyond / 3;
            if self.seen[g as usize] {
                continue;
            }
            self.reach(g);
            let v = self.fine.at(beyond);
            if self.label[v as usize] == Label::Unknown
                && !self.set(v, self.evens(g) < self.facts.evens[g as usize])
            {
                return false;
            }
        }
        true
    }

    /// Number of vertices of face `f` labelled even.
    fn evens(&self, f: u32) -> u8 {
        self.fine.face(f).into_iter().map(|v| u8::from(self.label[v as usize] == Label::Even)).sum()
    }

    /// Labels `v`; false if it cannot be odd or has the other label.
    fn set(&mut self, v: u32, even: bool) -> bool {
        let wanted = if even { Label::Even } else { Label::Odd };
        let label = &mut self.label[v as usize];
        if *label == Label::Unknown {
            *label = wanted;
        }
        *label == wanted && (even || self.facts.may_be_odd[v as usize])
    }

    /// Tries all three labellings of the component of face `f`, in which every vertex may be
    /// odd.
    fn choice(&mut self, f: u32) -> Option<Choice> {
        let mut choice = Choice { vertices: Vec::new(), evens: Vec::new(), valid: 0 };
        let mut members = Vec::new();
        for round in 0..3 {
            let fits = self.run(3 * f + round);
            let faces = std::mem::take(&mut self.reached);
            // Forgetting the labels on the way lists each vertex once, in the same order for
            // every labelling that fits.
            let mut count = 0;
            for &g in &faces {
                self.seen[g as usize] = false;
                for v in self.fine.face(g) {
                    let label = std::mem::replace(&mut self.label[v as usize], Label::Unknown);
                    if fits && label != Label::Unknown {
                        if choice.valid == 0 {
                            choice.vertices.push(v);
                            choice.evens.push(0);
                        }
                        choice.evens[count] |= u8::from(label == Label::Even) << round;
                        count += 1;
                    }
                }
            }
            if fits {
                choice.valid |= 1 << round;
                members = faces;
            }
        }
        members.iter().for_each(|&g| self.seen[g as usize] = true);
        (choice.valid != 0).then_some(choice)
    }
}
