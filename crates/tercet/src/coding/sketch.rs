//! What the faces of a coarse surface look like, in one pass: what split bits, estimates and flip bits know
//! of the geometry.
//!
//! The cotangent of the angle that faces an edge is a difference of squared lengths over the area, so
//! that those of both halves of an edge, before a face is split and after, follow from one number a corner.

use super::shape::{FaceShape, VIRTUAL, direction};
use super::vector::{Point, Vector, dot, sub};
use crate::mesh::Surface;
use crate::parallel;

/// Ratios of squares to areas, in 1/256, are held below this.
const MOST_RATIO: i16 = 1 << 14;

/// The faces and vertices of a level.
pub(crate) struct Sketch {
    /// For each face the logarithm of double its area in 1/32 octaves, or [`VIRTUAL`].
    pub area: Vec<i16>,
    /// For each face and each of its edges the edge's square over four times the face's area, in 1/256, edges in the order
    /// of the corners that face them. In a virtual face that of a real edge is large, the others are 0.
    pub ratio: Vec<[i16; 3]>,
    pub vertex: Vec<VertexSketch>,
}

/// What the faces around a vertex have in common; 10 bytes.
#[derive(Clone, Copy)]
pub(crate) struct VertexSketch {
    /// Unit normal in 1/2¹⁴, weighted by area.
    pub normal: [i16; 3],
    /// Mean of the real faces' `area`.
    pub area: i16,
    /// Number of faces, virtual ones included, at most 2¹⁶ − 1.
    #[cfg_attr(not(feature = "max"), expect(dead_code, reason = "only that effort asks for it"))]
    pub valence: u16,
}

/// Sums over the faces at a vertex.
#[derive(Clone, Copy, Default)]
struct Sum {
    normal: Vector,
    area: u32,
    /// How many are real, and how many virtual.
    real: u32,
    hidden: u32,
}

impl Sketch {
    /// Looks at every face of `surface` once; time O(n).
    pub fn new(surface: &Surface, positions: &[Point]) -> Self {
        let faces = surface.faces() as usize;
        let (mut area, mut ratio) = (vec![0; faces], vec![[0; 3]; faces]);
        let run = parallel::run(faces);
        let corners = surface.vertex.as_chunks::<3>().0.chunks(run);
        let runs: Vec<_> = corners.zip(area.chunks_mut(run).zip(ratio.chunks_mut(run))).collect();
        let sums = parallel::sums(
            runs,
            surface.vertices as usize,
            |(corners, (area, ratio)), sums| {
                for ((&t, area), ratio) in corners.iter().zip(area).zip(ratio) {
                    (*area, *ratio) = Sketch::face(surface, positions, t, sums);
                }
            },
            Sum::add,
        );
        let mut vertex = vec![VertexSketch { normal: [0; 3], area: 0, valence: 0 }; sums.len()];
        parallel::for_entries(&mut vertex, |v, vertex| *vertex = sums[v].sketch());
        Sketch { area, ratio, vertex }
    }

    /// Area and ratios of a face, which adds to the sums at its vertices.
    #[inline(always)]
    fn face(surface: &Surface, positions: &[Point], t: [u32; 3], sums: &mut [Sum]) -> (i16, [i16; 3]) {
        if surface.any_virtual(&t) {
            t.iter().for_each(|&v| sums[v as usize].hidden += 1);
            return (VIRTUAL, t.map(|v| if surface.is_virtual(v) { MOST_RATIO } else { 0 }));
        }
        let [p, q, r] = t.map(|v| positions[v as usize]);
        let spokes = [sub(q, p), sub(r, p)];
        let (shape, normal) = FaceShape::new(spokes);
        for v in t {
            sums[v as usize].add(Sum { normal, area: shape.area as u32, real: 1, hidden: 0 });
        }
        let [a, b] = spokes.map(|spoke| dot(spoke, spoke));
        let squares = [a + b - 2 * dot(spokes[0], spokes[1]), b, a];
        (shape.area, shape.inverse.halves(squares, MOST_RATIO))
    }
}

impl Sum {
    #[inline(always)]
    fn add(&mut self, other: Sum) {
        // A fan would need thousands of the largest faces to leave 64 bits.
        self.normal = [0, 1, 2].map(|k| self.normal[k].wrapping_add(other.normal[k]));
        self.area = self.area.wrapping_add(other.area);
        self.real += other.real;
        self.hidden += other.hidden;
    }

    fn sketch(self) -> VertexSketch {
        VertexSketch {
            normal: direction(self.normal),
            area: (self.area / self.real.max(1)) as i16,
            valence: (self.real + self.hidden).min(u16::MAX.into()) as u16,
        }
    }
}
