//! Split bits: which coarse faces receive a new vertex.
//!
//! Faces are coded in index order. A face tends to split where it is large: a split face stands
//! for three fine ones. What its neighbours did and which valences would result tell the rest.
//! Profiles differ in how many opinions they hear.

use super::model::LIMIT;
#[cfg(feature = "max")]
use super::panel::SplitPanel;
use super::priors;
use super::shape::VIRTUAL;
use super::sketch::Sketch;
use crate::Effort;
#[cfg(feature = "max")]
use crate::entropy::log2_fixed;
use crate::entropy::{Coder, Counter};
use crate::mesh::Surface;

/// The models of split bits; they live as long as the file.
pub(crate) enum SplitModels {
    /// One opinion.
    Counted(Vec<Counter>),
    /// More of them, for size.
    #[cfg(feature = "max")]
    Panel(Box<SplitPanel>),
}

/// What is decided of the faces of a surface.
struct Course<'a> {
    sketch: &'a Sketch,
    /// Of each face 0 until it is decided, then 4 if it is split and 1 if not.
    outcomes: Vec<u8>,
    /// Of each vertex the [`Counts`] of the faces at it.
    counts: Vec<Counts>,
    threshold: Threshold,
}

/// How many of some faces are split and, in the upper half, how many are not.
#[derive(Clone, Copy, Default)]
struct Counts(u64);

/// A face that is asked about.
pub(super) struct Face<'a> {
    course: &'a Course<'a>,
    #[cfg_attr(not(feature = "max"), expect(dead_code, reason = "only that effort asks for it"))]
    index: usize,
    #[cfg_attr(not(feature = "max"), expect(dead_code, reason = "only that effort asks for it"))]
    pub corners: [u32; 3],
    /// The corners' opposites.
    #[cfg_attr(not(feature = "max"), expect(dead_code, reason = "only that effort asks for it"))]
    opposites: [u32; 3],
    area: i16,
    /// 4 for each face across an edge that is split, 1 for each that is not.
    pub neighbours: usize,
    /// Of the faces at the three corners; one at two of them counts twice.
    around: Counts,
    /// Bin of the area against that of the faces at the corners; 0 for a virtual face alone.
    pub local: usize,
}

impl SplitModels {
    pub fn new(effort: Effort) -> Self {
        match effort {
            #[cfg(feature = "max")]
            Effort::Max => SplitModels::Panel(Box::default()),
            _ => SplitModels::Counted(priors::counters(&priors::SPLIT[..1])),
        }
    }

    /// Codes `split`, one entry a face of `surface`; time O(n).
    pub fn code<C: Coder>(&mut self, coder: &mut C, surface: &Surface, sketch: &Sketch, split: &mut [bool]) {
        let mut course = Course::new(surface, sketch);
        let faces = surface.vertex.chunks_exact(3).zip(surface.opposite.chunks_exact(3));
        for (index, ((corners, opposites), bit)) in faces.zip(split).enumerate() {
            let corners = [corners[0], corners[1], corners[2]];
            let opposites = [opposites[0], opposites[1], opposites[2]];
            let face = course.look(index, corners, opposites);
            *bit = match self {
                SplitModels::Counted(counters) => counters[face.context()].code(coder, *bit, LIMIT),
                #[cfg(feature = "max")]
                SplitModels::Panel(panel) => panel.code(coder, *bit, &face),
            };
            course.note(index, corners, *bit);
        }
        #[cfg(feature = "max")]
        if let SplitModels::Panel(panel) = self {
            panel.births.advance(surface.vertices);
        }
    }
}

impl<'a> Course<'a> {
    fn new(surface: &'a Surface, sketch: &'a Sketch) -> Self {
        Course {
            sketch,
            outcomes: vec![0; surface.faces() as usize],
            counts: vec![Counts::default(); surface.vertices as usize],
            threshold: Threshold::default(),
        }
    }

    #[inline(always)]
    fn look(&self, index: usize, corners: [u32; 3], opposites: [u32; 3]) -> Face<'_> {
        let area = self.sketch.area[index];
        let local = if area == VIRTUAL {
            0
        } else {
            let mean = corners.map(|v| self.sketch.vertex[v as usize].area as i32).iter().sum::<i32>() / 3;
            (((area as i32 - mean) >> 3) + 8).clamp(1, 15) as usize
        };
        Face {
            course: self,
            index,
            corners,
            opposites,
            area,
            neighbours: opposites.map(|o| self.outcomes[(o / 3) as usize]).iter().sum::<u8>().into(),
            around: corners.iter().fold(Counts(0), |sum, &v| sum.plus(self.counts[v as usize])),
            local,
        }
    }

    #[inline(always)]
    fn note(&mut self, index: usize, corners: [u32; 3], split: bool) {
        self.outcomes[index] = if split { 4 } else { 1 };
        let area = self.sketch.area[index];
        if area != VIRTUAL {
            self.threshold.learn(area, split);
        }
        for v in corners {
            let counts = &mut self.counts[v as usize];
            *counts = counts.plus(if split { Counts(1) } else { Counts(1 << 32) });
        }
    }
}

impl Counts {
    #[inline(always)]
    fn plus(self, other: Counts) -> Counts {
        Counts(self.0.wrapping_add(other.0))
    }

    #[inline(always)]
    fn split(self) -> u32 {
        self.0 as u32
    }

    #[inline(always)]
    fn unsplit(self) -> u32 {
        (self.0 >> 32) as u32
    }

    /// How many are split: less than a third, a half, more.
    #[inline(always)]
    fn share(self) -> usize {
        let (split, unsplit) = (self.split() as u64, self.unsplit() as u64);
        (3 * split >= unsplit) as usize + (2 * split >= unsplit) as usize
    }
}

impl Face<'_> {
    pub fn is_virtual(&self) -> bool {
        self.area == VIRTUAL
    }

    /// The one opinion of the fast and the default profile.
    #[inline(always)]
    fn context(&self) -> usize {
        let large = !self.is_virtual() && self.beyond_threshold() >= Threshold::MARGIN;
        ((self.neighbours * 16 + self.local) * 3 + self.around.share()) * 2 + large as usize
    }

    /// How much larger it is than what lies between the areas of split and unsplit faces, in 1/32 octaves.
    #[inline(always)]
    fn beyond_threshold(&self) -> i32 {
        self.course.threshold.below(self.area)
    }
}

#[cfg(feature = "max")]
impl Face<'_> {
    /// Values of [`set`](Face::set).
    pub const SETS: usize = 32;

    #[inline(always)]
    pub fn set(&self) -> usize {
        self.neighbours * 2 + self.is_virtual() as usize
    }

    #[inline(always)]
    pub fn contexts(&self) -> [usize; 4] {
        let shape = match self.is_virtual() {
            true => 0,
            false => (self.local * 8 + self.beside()) * 7 + self.aspect(),
        };
        [
            self.context(),
            self.valences() * 2 + self.is_virtual() as usize,
            self.tightest() * 16 + self.neighbours,
            shape,
        ]
    }

    /// How a real face's area compares with the mean of those across its edges, three bins an octave.
    #[inline(always)]
    fn beside(&self) -> usize {
        let (mut sum, mut count) = (0, 0);
        for o in self.opposites {
            let area = self.course.sketch.area[(o / 3) as usize];
            if area != VIRTUAL {
                sum += area as i32;
                count += 1;
            }
        }
        // The quotient by 3, 2 or 1, multiplied by its reciprocal in 1/2¹⁶.
        let mean = (sum * [0, 1 << 16, 1 << 15, 21_846][count]) >> 16;
        let larger = if count > 0 { self.area as i32 - mean } else { 0 };
        (((larger * 3) >> 5) + 4).clamp(0, 7) as usize
    }

    /// The longest edge over the shortest, logarithm in 2/3 octaves, at most 6.
    #[inline(always)]
    fn aspect(&self) -> usize {
        let [a, b, c] = self.course.sketch.ratio[self.index].map(|square| square.max(1) as u64);
        let ratio = log2_fixed(a.max(b).max(c), 5) - log2_fixed(a.min(b).min(c), 5);
        ((ratio * 3) >> 6).min(6) as usize
    }

    /// The valences of the corners, sorted, each in 3..=10, as digits.
    #[inline(always)]
    pub fn valences(&self) -> usize {
        let [a, b, c] = self.corners.map(|v| self.valence(v).clamp(3, 10) as usize - 3);
        let (low, high) = (a.min(b), a.max(b));
        (low.min(c) * 8 + high.min(c).max(low)) * 8 + high.max(c)
    }

    #[inline(always)]
    fn valence(&self, v: u32) -> u32 {
        self.course.sketch.vertex[v as usize].valence as u32
    }

    /// Of a corner its valence, how many faces at it are split, and how many undecided.
    #[inline(always)]
    pub fn corner(&self, v: u32) -> [u32; 3] {
        let counts = self.course.counts[v as usize];
        let (valence, split) = (self.valence(v), counts.split());
        [valence, split, valence.saturating_sub(split.saturating_add(counts.unsplit()))]
    }

    /// The corner with the fewest undecided faces: its valence, splits so far and undecided faces.
    #[inline(always)]
    pub fn tightest(&self) -> usize {
        let [a, b, c] = self.corners.map(|v| {
            let [valence, split, undecided] = self.corner(v);
            let key = (valence.min(11) * 6 + split.min(5)) * 5 + undecided.min(4);
            undecided << 16 | key
        });
        (a.min(b).min(c) & 0xffff) as usize
    }

    /// How many of the decided faces around are split: less than a third, a half, more.
    pub fn share(&self) -> usize {
        self.around.share()
    }

    /// Decided faces at the corners, and how many corners saw only splits or nothing yet.
    pub fn incidences(&self) -> usize {
        let lone = self.corners.map(|v| match self.course.counts[v as usize] {
            counts if counts.unsplit() > 0 => 0,
            counts => 1 + (counts.split() > 0) as usize,
        });
        let [ones, zeros] = [self.around.split(), self.around.unsplit()].map(|n| n.min(15) as usize);
        (ones * 16 + zeros) * 7 + lone.iter().sum::<usize>()
    }

    /// The area against what lies between those of split and unsplit faces, three of 16 bins an octave.
    pub fn size(&self) -> usize {
        if self.is_virtual() { 0 } else { (((self.beyond_threshold() * 3) >> 5) + 8).clamp(0, 15) as usize }
    }
}

/// What lies between the areas of the faces that were split and of those that were not.
#[derive(Default)]
struct Threshold {
    /// Running means of the areas, in 1/2²¹ octaves, and how many there were, of faces unsplit and split.
    means: [(i32, u32); 2],
}

impl Threshold {
    /// Larger faces by this many 1/32 octaves are large.
    const MARGIN: i32 = 11;
    /// A new area counts for 2⁻¹⁰ at least.
    const LIMIT: u32 = 1 << 10;

    /// How far it lies below an area, in 1/32 octaves.
    #[inline(always)]
    fn below(&self, area: i16) -> i32 {
        let [(a, some), (b, others)] = self.means;
        // Without both kinds there is no threshold.
        let both = (some.min(others) > 0) as i32;
        (area as i32 - ((a + b) >> 17)) * both
    }

    #[inline(always)]
    fn learn(&mut self, area: i16, split: bool) {
        let (mean, count) = &mut self.means[split as usize];
        *count = (*count + 1).min(Self::LIMIT);
        *mean += (((area as i32) << 16) - *mean) >> count.ilog2();
    }
}

/// What they are at the end is what training is for.
#[cfg(all(test, feature = "max"))]
impl Drop for SplitModels {
    fn drop(&mut self) {
        if let SplitModels::Counted(counters) = self {
            super::training::note_counters(super::training::Table::Split(0), counters);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn shares_split_at_a_third_and_a_half() {
        let around = |split: u64, unsplit: u64| Counts(split | unsplit << 32).share();
        assert_eq!([around(0, 1), around(1, 3), around(1, 2), around(0, 0)], [0, 1, 2, 2]);
    }
}
