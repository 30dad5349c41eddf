//! Labelling vertices even or odd by flooding from face to face.
//!
//! In a surface that one regular step made, the labels of a face fix those of its neighbours, and so
//! of its whole component. A vertex that the step cannot have inserted is even, which fixes the face;
//! a component without one has as many labellings to try as a face can be labelled.

use super::Reduction;
use super::details::details;
use crate::mesh::Surface;

/// How labels spread in the surfaces that one kind of step makes.
pub(super) trait Rule {
    /// In how many ways a face can be labelled; at most 8.
    const LABELLINGS: u32;

    /// Whether the step can have inserted vertex `v`.
    fn may_be_odd(&self, v: u32) -> bool;

    /// Whether vertex `k` of real face `f` is even in labelling `labelling` of that face. If vertex i
    /// must be even, labelling i is the only one that can fit.
    fn is_even(&self, fine: &Surface, f: u32, k: u32, labelling: u32) -> bool;

    /// Whether real face `f` can have this number of even vertices.
    fn fits(&self, f: u32, evens: u32) -> bool;

    /// Whether the far vertex of real face `g` is even if it fits at all, seen from a face of `own`
    /// even vertices over an edge of `common` ones.
    fn beyond(&self, g: u32, own: u32, common: u32) -> bool;

    /// Whether a boundary edge can have this number of even ends.
    fn fits_boundary(&self, evens: u32) -> bool;
}

/// A labelling, but for the components that several labellings fit.
pub(super) struct Labels {
    /// For each vertex whether it is even. Virtual vertices are.
    even: Vec<bool>,
    /// The components left open, with their labellings.
    open: Vec<Choice>,
}

/// A component and the labellings that fit it; every vertex of it may be odd.
pub(super) struct Choice {
    vertices: Vec<u32>,
    /// For each of `vertices`, a bit for each labelling in which it is even.
    evens: Vec<u8>,
    /// A bit for each labelling that fits.
    valid: u8,
}

impl Choice {
    fn is_valid(&self, round: u32) -> bool {
        self.valid >> round & 1 == 1
    }

    /// Writes labelling `round` into `even`; the first that fits if that one does not.
    fn apply(&self, round: u32, even: &mut [bool]) {
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

impl Labels {
    /// Which vertices are even: for each component that several labellings fit, the one with the
    /// smallest details, the first of equal ones.
    ///
    /// `coarsen` is what makes a reduction of a labelling. `positions` as for [`details`]. The
    /// labellings of different components do not interact: one round for each judges them all.
    pub fn settle(
        mut self,
        fine: &Surface,
        positions: &[[i32; 3]],
        coarsen: impl Fn(&[bool]) -> Option<Reduction>,
    ) -> Option<Vec<bool>> {
        if self.open.is_empty() {
            return Some(self.even);
        }
        const NO_COMPONENT: u32 = u32::MAX;
        let mut component = vec![NO_COMPONENT; self.even.len()];
        for (i, choice) in self.open.iter().enumerate() {
            for &v in &choice.vertices {
                component[v as usize] = i as u32;
            }
        }
        let rounds = self.open.iter().map(|choice| 8 - choice.valid.leading_zeros()).max().unwrap_or(0);
        let mut best = vec![None; self.open.len()];
        for round in 0..rounds {
            self.open.iter().for_each(|choice| choice.apply(round, &mut self.even));
            let Some(reduction) = coarsen(&self.even) else { continue };
            let mut sums = vec![0u128; self.open.len()];
            for (v, detail) in details(fine, positions, &reduction) {
                if component[v as usize] != NO_COMPONENT {
                    sums[component[v as usize] as usize] += u128::from(detail);
                }
            }
            for ((best, choice), sum) in best.iter_mut().zip(&self.open).zip(sums) {
                if choice.is_valid(round) && best.is_none_or(|(least, _)| sum < least) {
                    *best = Some((sum, round));
                }
            }
        }
        for (choice, best) in self.open.iter().zip(best) {
            choice.apply(best?.1, &mut self.even);
        }
        Some(self.even)
    }
}

/// The labels of all components, `None` if some component has none. Linear time: a component
/// with a vertex that must be even is flooded once, any other once for each labelling of a face.
pub(super) fn label(fine: &Surface, rule: &impl Rule) -> Option<Labels> {
    let mut flood = Flood::new(fine, rule);
    for c in 0..fine.vertex.len() as u32 {
        let settled = flood.seen[(c / 3) as usize] || rule.may_be_odd(fine.at(c));
        if !settled && !flood.run(c / 3, c % 3) {
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

struct Flood<'a, R> {
    fine: &'a Surface,
    rule: &'a R,
    label: Vec<Label>,
    /// Faces reached by a flood that stands, and all virtual ones.
    seen: Vec<bool>,
    /// The faces of the current flood, in the order reached.
    reached: Vec<u32>,
}

impl<'a, R: Rule> Flood<'a, R> {
    fn new(fine: &'a Surface, rule: &'a R) -> Self {
        let initial = |v| if fine.is_virtual(v) { Label::Even } else { Label::Unknown };
        Flood {
            fine,
            rule,
            label: (0..fine.vertices).map(initial).collect(),
            seen: (0..fine.faces()).map(|f| fine.is_virtual_face(f)).collect(),
            reached: Vec::new(),
        }
    }

    /// Labels the component of face `seed` from that labelling of it. False on a contradiction.
    fn run(&mut self, seed: u32, labelling: u32) -> bool {
        self.reached.clear();
        self.reach(seed);
        for k in 0..3 {
            let even = self.rule.is_even(self.fine, seed, k, labelling);
            if !self.set(self.fine.at(3 * seed + k), even) {
                return false;
            }
        }
        let mut done = 0;
        while let Some(&f) = self.reached.get(done) {
            done += 1;
            if !self.cross(f) {
                return false;
            }
        }
        true
    }

    fn reach(&mut self, f: u32) {
        self.seen[f as usize] = true;
        self.reached.push(f);
    }

    /// Reaches the neighbours of face `f` and labels what is left of them, or checks it. False on a
    /// contradiction.
    fn cross(&mut self, f: u32) -> bool {
        let evens = [0, 1, 2].map(|k| u32::from(self.is_even(3 * f + k)));
        let own = evens.iter().sum();
        let mut neighbours = 0..3;
        self.rule.fits(f, own)
            && neighbours.all(|k| {
                let beyond = self.fine.across(3 * f + k);
                let (g, common) = (beyond / 3, own - evens[k as usize]);
                if self.fine.is_virtual_face(g) {
                    return self.rule.fits_boundary(common);
                }
                if !self.seen[g as usize] {
                    self.reach(g);
                }
                self.set(self.fine.at(beyond), self.rule.beyond(g, own, common))
            })
    }

    fn is_even(&self, c: u32) -> bool {
        self.label[self.fine.at(c) as usize] == Label::Even
    }

    /// Labels `v`; false if it cannot be odd or has the other label.
    fn set(&mut self, v: u32, even: bool) -> bool {
        let wanted = if even { Label::Even } else { Label::Odd };
        let label = &mut self.label[v as usize];
        if *label == Label::Unknown {
            *label = wanted;
        }
        *label == wanted && (even || self.rule.may_be_odd(v))
    }

    /// Tries all labellings of the component of face `f`, in which every vertex may be odd.
    fn choice(&mut self, f: u32) -> Option<Choice> {
        let mut choice = Choice { vertices: Vec::new(), evens: Vec::new(), valid: 0 };
        let mut members = Vec::new();
        for round in 0..R::LABELLINGS {
            let fits = self.run(f, round);
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
