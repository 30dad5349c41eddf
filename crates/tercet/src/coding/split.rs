//! Split bits: which coarse faces receive a new vertex.
//!
//! Faces are coded in index order. A face tends to split where it is large: a split face stands
//! for three fine ones. What its neighbours did and which valences would result tell the rest.

#[cfg(feature = "max")]
use super::births::Births;
use super::model::BitModel;
#[cfg(feature = "max")]
use super::panel::Panel;
use super::shape::{Shapes, VIRTUAL};
use super::vector::{Point, dot, sub};
use crate::Effort;
use crate::entropy::{Coder, log2_fixed};
use crate::mesh::Surface;

/// The models of split bits; they live as long as the file.
pub(crate) enum SplitModels {
    Mixed(BitModel<6>),
    /// More contexts, for size.
    #[cfg(feature = "max")]
    Panel(Box<SplitPanel>),
}

/// A vertex: what it looks like and what has been decided about the faces at it; 8 bytes.
#[derive(Clone, Copy)]
struct Corner {
    area: i16,
    /// Number of faces, split ones and unsplit ones so far, each at most 255.
    valence: u8,
    split: u8,
    unsplit: u8,
}

/// Running mean of the areas of the faces that were coded alike, in 1/2¹³ octaves.
#[derive(Clone, Copy, Default)]
struct Mean {
    value: i32,
    count: u32,
}

impl Mean {
    /// After this many values old ones fade.
    const LIMIT: u32 = 1 << 10;

    fn learn(&mut self, area: i16) {
        self.count = (self.count + 1).min(Self::LIMIT);
        self.value += (((area as i32) << 8) - self.value) / self.count as i32;
    }
}

impl SplitModels {
    pub fn new(effort: Effort) -> Self {
        match effort {
            #[cfg(feature = "max")]
            Effort::Max => SplitModels::Panel(Box::new(SplitPanel::new())),
            _ => SplitModels::Mixed(BitModel::new([640, 1024, 640, 3584, 1120, 5760], 32, 260)),
        }
    }

    /// Codes `split`, one entry a face of `surface`; time O(n).
    pub fn code<C: Coder>(
        &mut self,
        coder: &mut C,
        surface: &Surface,
        shapes: &Shapes,
        positions: &[Point],
        split: &mut [bool],
    ) {
        let corner = |v: &super::shape::VertexShape| Corner {
            area: v.area,
            valence: v.valence.min(255) as u8,
            split: 0,
            unsplit: 0,
        };
        let mut corners: Vec<Corner> = shapes.vertex.iter().map(corner).collect();
        let mut means = [Mean::default(); 2];
        for f in 0..surface.faces() {
            let face = surface.face(f);
            let shape = shapes.face[f as usize];
            let around = face.map(|v| corners[v as usize]);
            let across = [0, 1, 2].map(|k| surface.across(3 * f + k) / 3);
            let mut neighbours = 0;
            for g in across {
                neighbours += if g < f { 1 + 3 * split[g as usize] as usize } else { 0 };
            }
            let area = shape.area as i32;
            let [local, size] = if shape.is_virtual() {
                [0, 0]
            } else {
                let mean = around.iter().map(|c| c.area as i32).sum::<i32>() / 3;
                let threshold = match means {
                    [a, b] if a.count > 0 && b.count > 0 => (a.value + b.value) >> 9,
                    _ => area,
                };
                [bin(area - mean, 4, 20), bin(area - threshold, 3, 16)]
            };
            let flag = shape.is_virtual() as usize;
            let known = split[f as usize];
            let contexts = || {
                let [beside, aspect] = match shape.is_virtual() {
                    true => [0, 0],
                    false => [
                        beside(area, across.map(|g| shapes.face[g as usize].area)),
                        aspect(face.map(|v| positions[v as usize])),
                    ],
                };
                [
                    (local * 16 + neighbours) * 2 + flag,
                    valence_triple(&around) * 2 + flag,
                    (local * 16 + size) * 2 + flag,
                    incidences(&around) * 2 + flag,
                    (local * 8 + beside) * 7 + aspect,
                    tightest(&around) * 16 + neighbours,
                ]
            };
            let bit = match self {
                SplitModels::Mixed(bits) => bits.code(coder, known, neighbours * 2 + flag, contexts()),
                #[cfg(feature = "max")]
                SplitModels::Panel(panel) => {
                    let bins = [local, size, neighbours, flag];
                    panel.code(coder, known, contexts(), face, &around, bins)
                }
            };
            split[f as usize] = bit;
            if !shape.is_virtual() {
                means[bit as usize].learn(shape.area);
            }
            for v in face {
                let c = &mut corners[v as usize];
                let count = if bit { &mut c.split } else { &mut c.unsplit };
                *count = count.saturating_add(1);
            }
        }
        #[cfg(feature = "max")]
        if let SplitModels::Panel(panel) = self {
            panel.births.advance(surface.vertices);
        }
    }
}

/// The contexts of the mixed model and five more.
#[cfg(feature = "max")]
pub(crate) struct SplitPanel {
    bits: Panel<11, 5>,
    births: Births,
}

/// Sorted triples of ages, as digits.
#[cfg(feature = "max")]
const AGES: usize = Births::AGES.pow(3);

#[cfg(feature = "max")]
impl SplitPanel {
    fn new() -> Self {
        let sizes = [640, 1024, 640, 3584, 1120, 5760, 512, PAIRS * PAIRS, AGES * 16, AGES * 512, 20 * AGES];
        SplitPanel { bits: Panel::new(sizes, [32, AGES, 60, 16, 1]), births: Births::default() }
    }

    fn code<C: Coder>(
        &mut self,
        coder: &mut C,
        bit: bool,
        mixed: [usize; 6],
        face: [u32; 3],
        around: &[Corner; 3],
        [local, size, neighbours, flag]: [usize; 4],
    ) -> bool {
        let mut ages = face.map(|v| self.births.age(v));
        ages.sort_unstable();
        let ages = ages.into_iter().fold(0, |digits, age| digits * Births::AGES + age);
        let [a, b, c, d, e, f] = mixed;
        let contexts = [
            a,
            b,
            c,
            d,
            e,
            f,
            (size * 16 + neighbours) * 2 + flag,
            two_tightest(around),
            ages * 16 + neighbours,
            ages * 512 + valence_triple(around),
            local * AGES + ages,
        ];
        let sets = [neighbours * 2 + flag, ages, local * 3 + share(around), size, 0];
        self.bits.code(coder, bit, sets, contexts)
    }
}

/// `bins` bins of a logarithm in 1/32, `per_octave` of them an octave, zero in the middle.
#[inline(always)]
fn bin(log: i32, per_octave: i32, bins: i32) -> usize {
    (((log * per_octave) >> 5) + bins / 2).clamp(0, bins - 1) as usize
}

/// How a real face's area compares with those of the faces `beside` it, in bins.
#[inline(always)]
fn beside(area: i32, beside: [i16; 3]) -> usize {
    let (mut sum, mut count) = (0, 0);
    for other in beside {
        if other != VIRTUAL {
            sum += other as i32;
            count += 1;
        }
    }
    // The quotient by 3, 2 or 1, multiplied by its reciprocal in 1/2¹⁶.
    let mean = (sum * [0, 1 << 16, 1 << 15, 21846][count]) >> 16;
    bin(if count > 0 { area - mean } else { 0 }, 3, 8)
}

/// The longest edge over the shortest, logarithm in 2/3 octaves, at most 6.
#[inline(always)]
fn aspect(p: [Point; 3]) -> usize {
    let [a, b, c] = [sub(p[1], p[0]), sub(p[2], p[1]), sub(p[2], p[0])].map(|e| dot(e, e) as u64 + 1);
    let ratio = log2_fixed(a.max(b).max(c), 5) - log2_fixed(a.min(b).min(c), 5);
    ((ratio * 3) >> 6).min(6) as usize
}

/// Decided faces at the three corners, and how many corners saw only splits or nothing yet.
#[inline(always)]
fn incidences(around: &[Corner; 3]) -> usize {
    let (mut ones, mut zeros, mut lone) = (0, 0, 0);
    for c in around {
        ones += c.split as usize;
        zeros += c.unsplit as usize;
        lone += if c.unsplit > 0 { 0 } else { 1 + (c.split > 0) as usize };
    }
    (ones.min(15) * 16 + zeros.min(15)) * 7 + lone
}

/// How many of the decided faces at the three corners are split: less than a third, a half, more.
#[cfg(feature = "max")]
fn share(around: &[Corner; 3]) -> usize {
    let split: usize = around.iter().map(|c| c.split as usize).sum();
    let unsplit: usize = around.iter().map(|c| c.unsplit as usize).sum();
    (3 * split >= unsplit) as usize + (2 * split >= unsplit) as usize
}

/// The three valences, sorted, each in 3..=10, as digits.
#[inline(always)]
fn valence_triple(around: &[Corner; 3]) -> usize {
    let [a, b, c] = around.map(|c| c.valence.clamp(3, 10) as usize - 3);
    let (low, high) = (a.min(b), a.max(b));
    (low.min(c) * 8 + high.min(c).max(low)) * 8 + high.max(c)
}

/// The corner with the fewest undecided faces: its valence, splits so far and undecided faces.
#[inline(always)]
fn tightest(around: &[Corner; 3]) -> usize {
    let [a, b, c] = around.map(|c| {
        let undecided = c.valence.saturating_sub(c.split.saturating_add(c.unsplit)) as u32;
        let key = (c.valence.min(11) as u32 * 6 + c.split.min(5) as u32) * 5 + undecided.min(4);
        undecided << 16 | key
    });
    (a.min(b).min(c) & 0xffff) as usize
}

/// Values of one corner of [`two_tightest`].
#[cfg(feature = "max")]
const PAIRS: usize = 128;

/// The two corners with the fewest undecided faces, each by their number, its valence and splits so far.
#[cfg(feature = "max")]
fn two_tightest(around: &[Corner; 3]) -> usize {
    let mut keys = around.map(|c| {
        let undecided = c.valence.saturating_sub(c.split.saturating_add(c.unsplit)) as usize;
        (undecided.min(3) * 8 + c.valence.clamp(3, 10) as usize - 3) * 4 + c.split.min(3) as usize
    });
    keys.sort_unstable();
    keys[0] * PAIRS + keys[1]
}
