//! Split bits: which coarse faces receive a new vertex.
//!
//! Faces are coded in index order. A face tends to split where it is large: a split face stands
//! for three fine ones. What its neighbours did and which valences would result tell the rest.

use super::model::BitModel;
use super::vector::{Point, cross, log2_length, sub};
use crate::entropy::{Coder, log2_fixed};
use crate::mesh::Surface;

/// The models of split bits; they live as long as the file.
pub(crate) struct SplitModels {
    bits: BitModel<8>,
}

/// Decisions so far at a vertex.
#[derive(Clone, Copy, Default)]
struct Decided {
    split: u16,
    unsplit: u16,
}

/// In place of the area of a virtual face.
const VIRTUAL: i32 = i32::MIN;

/// Logarithms of area, in 1/32 octaves, of one level.
struct Areas {
    face: Vec<i32>,
    /// Mean over the real faces at each vertex.
    vertex: Vec<i32>,
}

/// Running mean of the areas of the faces that were coded alike.
#[derive(Default)]
struct Mean {
    sum: i64,
    count: i64,
}

impl SplitModels {
    pub fn new() -> Self {
        SplitModels { bits: BitModel::new([640, 1024, 640, 3584, 1120, 256, 5760, 512], 32, 260) }
    }

    /// Codes `split`, one entry a face of `surface`; time O(n).
    pub fn code<C: Coder>(
        &mut self,
        coder: &mut C,
        surface: &Surface,
        positions: &[Point],
        split: &mut [bool],
    ) {
        let areas = Areas::new(surface, positions);
        let valence = surface.valences();
        let mut decided = vec![Decided::default(); surface.vertices as usize];
        let mut means = [Mean::default(), Mean::default()];
        for f in 0..surface.faces() {
            let face = surface.face(f);
            let is_virtual = areas.face[f as usize] == VIRTUAL;
            let (mut yes, mut no) = (0, 0);
            for k in 0..3 {
                let g = surface.across(3 * f + k) / 3;
                if g < f {
                    if split[g as usize] { yes += 1 } else { no += 1 }
                }
            }
            let neighbours = 4 * yes + no;
            let area = areas.face[f as usize];
            let shape = Shape::new(surface, positions, &areas, f, is_virtual);
            let threshold = match &means {
                [a, b] if a.count > 0 && b.count > 0 => (a.sum / a.count + b.sum / b.count) / 2,
                _ => area as i64,
            };
            let relative = if is_virtual { 0 } else { bin(area as i64 - threshold, 3, 16) };
            let (ones, zeros, lone) = incidences(&decided, face);
            let valences = valence_triple(&valence, face);
            let flag = is_virtual as usize;
            let tight = tightest(&valence, &decided, face);
            let contexts = [
                (shape.local * 16 + neighbours) * 2 + flag,
                valences * 2 + flag,
                (shape.local * 16 + relative) * 2 + flag,
                ((ones * 16 + zeros) * 7 + lone) * 2 + flag,
                (shape.local * 8 + shape.across) * 7 + shape.aspect,
                relative * 16 + neighbours,
                tight * 16 + neighbours,
                valences,
            ];
            let bit = self.bits.code(coder, split[f as usize], neighbours * 2 + flag, contexts);
            split[f as usize] = bit;
            if !is_virtual {
                let mean = &mut means[bit as usize];
                mean.sum += area as i64;
                mean.count += 1;
            }
            for v in face {
                let d = &mut decided[v as usize];
                if bit {
                    d.split += (d.split < u16::MAX) as u16
                } else {
                    d.unsplit += (d.unsplit < u16::MAX) as u16
                }
            }
        }
    }
}

/// `bins` bins of a logarithm in 1/32, `per_octave` of them an octave, zero in the middle.
fn bin(log: i64, per_octave: i64, bins: i64) -> usize {
    (((log * per_octave) >> 5) + bins / 2).clamp(0, bins - 1) as usize
}

/// Decided faces at the three corners, and how many corners saw only splits or nothing yet.
fn incidences(decided: &[Decided], face: [u32; 3]) -> (usize, usize, usize) {
    let (mut ones, mut zeros, mut lone) = (0, 0, 0);
    for v in face {
        let d = decided[v as usize];
        ones += d.split as usize;
        zeros += d.unsplit as usize;
        lone += match (d.split, d.unsplit) {
            (0, 0) => 1,
            (_, 0) => 2,
            _ => 0,
        };
    }
    (ones.min(15), zeros.min(15), lone)
}

/// The three valences, sorted, each in 3..=10.
fn valence_triple(valence: &[u32], face: [u32; 3]) -> usize {
    let mut v = face.map(|v| valence[v as usize].clamp(3, 10) as usize - 3);
    v.sort_unstable();
    (v[0] * 8 + v[1]) * 8 + v[2]
}

/// The corner with the fewest undecided faces: its valence, splits so far and undecided faces.
fn tightest(valence: &[u32], decided: &[Decided], face: [u32; 3]) -> usize {
    let key = |v: u32| {
        let d = decided[v as usize];
        let undecided = valence[v as usize].saturating_sub(d.split as u32 + d.unsplit as u32);
        let key = (valence[v as usize].min(11) * 6 + (d.split as u32).min(5)) * 5 + undecided.min(4);
        (undecided, key as usize)
    };
    face.map(key).into_iter().min().map_or(0, |k| k.1)
}

impl Areas {
    fn new(surface: &Surface, positions: &[Point]) -> Self {
        let mut face = vec![VIRTUAL; surface.faces() as usize];
        let mut sums = vec![(0i32, 0i32); surface.vertices as usize];
        for f in 0..surface.faces() {
            let t = surface.face(f);
            if t.iter().any(|&v| surface.is_virtual(v)) {
                continue;
            }
            let p = t.map(|v| positions[v as usize]);
            let area = log2_length(cross(sub(p[1], p[0]), sub(p[2], p[0])));
            face[f as usize] = area;
            for v in t {
                let (sum, count) = &mut sums[v as usize];
                *sum = sum.saturating_add(area);
                *count += 1;
            }
        }
        let vertex = sums.iter().map(|&(sum, count)| sum / count.max(1)).collect();
        Areas { face, vertex }
    }
}

/// How a face's area and proportions compare with its surroundings', in bins.
#[derive(Default)]
struct Shape {
    local: usize,
    across: usize,
    aspect: usize,
}

impl Shape {
    fn new(surface: &Surface, positions: &[Point], areas: &Areas, f: u32, is_virtual: bool) -> Self {
        if is_virtual {
            return Shape::default();
        }
        let t = surface.face(f);
        let area = areas.face[f as usize];
        let around: i32 = t.iter().map(|&v| areas.vertex[v as usize] / 3).sum();
        let (mut sum, mut count) = (0, 0);
        for k in 0..3 {
            let g = surface.across(3 * f + k) / 3;
            let area = areas.face[g as usize];
            if area != VIRTUAL {
                sum += area;
                count += 1;
            }
        }
        let beside = if count > 0 { sum / count } else { area };
        let p = t.map(|v| positions[v as usize]);
        let squares = [0, 1, 2].map(|k| {
            let e = sub(p[(k + 1) % 3], p[k]);
            e[0] * e[0] + e[1] * e[1] + e[2] * e[2] + 1
        });
        let (long, short) = (squares.iter().max().copied(), squares.iter().min().copied());
        let ratio = log2_fixed(long.unwrap_or(1) as u64, 5) - log2_fixed(short.unwrap_or(1) as u64, 5);
        Shape {
            local: bin((area - around) as i64, 4, 20),
            across: bin((area - beside) as i64, 3, 8),
            aspect: ((ratio * 3) >> 6).min(6) as usize,
        }
    }
}
