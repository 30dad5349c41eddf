//! Split bits: which coarse faces receive a new vertex.
//!
//! Faces are coded in index order. A face tends to split where it is large: a split face stands
//! for three fine ones. What its neighbours did and which valences would result tell the rest.

use super::model::BitModel;
use super::shape::{FaceShape, Shapes, VIRTUAL};
use crate::entropy::Coder;
use crate::mesh::Surface;

/// The models of split bits; they live as long as the file.
pub(crate) struct SplitModels {
    bits: BitModel<6>,
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
    pub fn new() -> Self {
        SplitModels { bits: BitModel::new([640, 1024, 640, 3584, 1120, 5760], 32, 260) }
    }

    /// Codes `split`, one entry a face of `surface`; time O(n).
    pub fn code<C: Coder>(&mut self, coder: &mut C, surface: &Surface, shapes: &Shapes, split: &mut [bool]) {
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
            let decided = |bit: bool| {
                across.iter().map(|&g| (g < f && split[g as usize] == bit) as usize).sum::<usize>()
            };
            let neighbours = 4 * decided(true) + decided(false);
            let [local, beside] = match shape.is_virtual() {
                true => [0, 0],
                false => relative(shape, &around, across.map(|g| shapes.face[g as usize].area)),
            };
            let threshold = match means {
                [a, b] if a.count > 0 && b.count > 0 => (a.value + b.value) >> 9,
                _ => shape.area as i32,
            };
            let size = if shape.is_virtual() { 0 } else { bin(shape.area as i32 - threshold, 3, 16) };
            let valences = valence_triple(&around);
            let flag = shape.is_virtual() as usize;
            let contexts = [
                (local * 16 + neighbours) * 2 + flag,
                valences * 2 + flag,
                (local * 16 + size) * 2 + flag,
                incidences(&around) * 2 + flag,
                (local * 8 + beside) * 7 + shape.aspect as usize,
                tightest(&around) * 16 + neighbours,
            ];
            let bit = self.bits.code(coder, split[f as usize], neighbours * 2 + flag, contexts);
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
    }
}

/// `bins` bins of a logarithm in 1/32, `per_octave` of them an octave, zero in the middle.
#[inline(always)]
fn bin(log: i32, per_octave: i32, bins: i32) -> usize {
    (((log * per_octave) >> 5) + bins / 2).clamp(0, bins - 1) as usize
}

/// How a real face's area compares with its surroundings' and with its neighbours', in bins.
#[inline(always)]
fn relative(shape: FaceShape, around: &[Corner; 3], beside: [i16; 3]) -> [usize; 2] {
    let area = shape.area as i32;
    let mean = around.iter().map(|c| c.area as i32).sum::<i32>() / 3;
    let (mut sum, mut count) = (0, 0);
    for other in beside {
        if other != VIRTUAL {
            sum += other as i32;
            count += 1;
        }
    }
    // The quotient by 3, 2 or 1, multiplied by its reciprocal in 1/2¹⁶.
    let beside = (sum * [0, 1 << 16, 1 << 15, 21846][count]) >> 16;
    let beside = if count > 0 { beside } else { area };
    [bin(area - mean, 4, 20), bin(area - beside, 3, 8)]
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
        undecided << 16 | (c.valence.min(11) as u32 * 6 + c.split.min(5) as u32) * 5 + undecided.min(4)
    });
    (a.min(b).min(c) & 0xffff) as usize
}
