//! A stand-in for a scanned object.

use super::Random;
use super::geodesic::{determinant, geodesic, normalised};
use crate::Mesh;
use crate::mesh::{Surface, cut, next, prev};
use crate::subdivide::flip_edge;

/// Share of the vertices that are strewn at random; the others start on an even sphere.
const STREWN: f64 = 0.25;
/// How far a vertex leaves its place on the even sphere, in edge lengths.
const JITTER: f64 = 0.3;
/// Height of the roughness of the surface, in edge lengths.
const ROUGHNESS: f64 = 0.02;
/// Places that draw points towards them: reach on the unit sphere and pull.
const PULLS: [(f64, f64); 6] = [(1.2, 0.3), (0.9, 0.3), (0.7, 0.25), (0.6, 0.3), (0.5, 0.2), (0.4, 0.3)];
/// Bumps and dents by size: how many, reach on the unit sphere, greatest height.
const BUMPS: [(usize, f64, f64); 3] = [(8, 0.9, 0.25), (20, 0.35, 0.06), (60, 0.12, 0.015)];

/// An irregular closed surface like a scanned object's: a sphere with bumps and dents of several
/// sizes and a little roughness, sampled at uneven density, triangulated after Delaunay.
///
/// It has exactly `vertices` vertices, but at least 12; about two in five have valence 6. Linear
/// time; the same bits for the same arguments on every platform.
pub fn scan(vertices: usize, seed: u64) -> Mesh {
    let vertices = vertices.max(12);
    let mut random = Random::new(seed);
    let mut sphere = Sphere::even(((1.0 - STREWN) * vertices as f64) as usize, &mut random);
    while sphere.points.len() < vertices {
        sphere.strew(&mut random);
    }
    let spacing = (4.0 * std::f64::consts::PI / vertices as f64).sqrt();
    let bumps: Vec<Bump> = BUMPS
        .iter()
        .flat_map(|&(count, reach, height)| std::iter::repeat_n((reach, height), count))
        .map(|(reach, height)| Bump { centre: random.direction(), reach, height: height * random.signed() })
        .collect();
    let positions = sphere.points.iter().map(|&p| {
        let bumps = bumps.iter().map(|bump| bump.height * falloff(p, bump.centre, bump.reach)).sum::<f64>();
        let radius = 1.0 + bumps + ROUGHNESS * spacing * random.signed();
        p.map(|x| (radius * x) as f32)
    });
    Mesh {
        positions: positions.collect(),
        faces: (0..sphere.surface.faces()).map(|f| sphere.surface.face(f)).collect(),
    }
}

struct Bump {
    centre: [f64; 3],
    reach: f64,
    height: f64,
}

/// A smooth weight: 1 at the centre, 0 at the distance `reach` and beyond.
fn falloff(p: [f64; 3], centre: [f64; 3], reach: f64) -> f64 {
    let square: f64 = (0..3).map(|k| (p[k] - centre[k]) * (p[k] - centre[k])).sum();
    let rest = (1.0 - square / (reach * reach)).max(0.0);
    rest * rest * rest
}

/// Points on the unit sphere and their Delaunay triangulation, which is their convex hull.
struct Sphere {
    points: Vec<[f64; 3]>,
    surface: Surface,
}

impl Sphere {
    /// At most `vertices` points, but at least 12, at nearly even density but for the [`PULLS`].
    fn even(vertices: usize, random: &mut Random) -> Self {
        let frequency = ((vertices.saturating_sub(2) as f64 / 10.0).sqrt() as usize).max(1);
        let (mut points, faces) = geodesic(frequency);
        let reach = JITTER * (4.0 * std::f64::consts::PI / points.len() as f64).sqrt();
        let pulls = PULLS.map(|(reach, pull)| (random.direction(), reach, pull));
        for p in &mut points {
            *p = normalised(p.map(|x| x + reach * random.signed()));
            for (centre, reach, pull) in pulls {
                let weight = pull * falloff(*p, centre, reach);
                *p = normalised(std::array::from_fn(|k| p[k] + weight * (centre[k] - p[k])));
            }
        }
        let mesh = Mesh { positions: vec![[0.0; 3]; points.len()], faces };
        let mut sphere = Sphere { points, surface: cut(&mesh).surface };
        sphere.make_convex((0..sphere.surface.vertex.len() as u32).collect());
        sphere
    }

    /// Adds a point in a random face.
    ///
    /// ```text
    ///          c
    ///         /|\
    ///        / v \       (a, b, c) becomes (a, b, v), (b, c, v), (c, a, v)
    ///       /.' '.\
    ///      a ----- b
    /// ```
    fn strew(&mut self, random: &mut Random) {
        let f = random.below(self.surface.faces() as usize) as u32;
        let [a, b, c] = self.surface.face(f);
        // Away from the corners, so that no two points fall together.
        let weights: [f64; 3] = std::array::from_fn(|_| 0.2 + random.unit());
        let corners = [a, b, c].map(|v| self.points[v as usize]);
        let v = self.points.len() as u32;
        self.points.push(normalised(std::array::from_fn(|k| {
            corners.iter().zip(weights).map(|(corner, weight)| corner[k] * weight).sum()
        })));
        let surface = &mut self.surface;
        let first = 3 * f;
        let added = surface.vertex.len() as u32;
        // The corners of the three faces at v face the edges of the old one.
        let at = [first, added, added + 3];
        let beyond = [2, 0, 1].map(|k| surface.across(first + k));
        surface.vertices += 1;
        surface.vertex[first as usize..first as usize + 3].copy_from_slice(&[a, b, v]);
        surface.vertex.extend([b, c, v, c, a, v]);
        surface.opposite.extend([0; 6]);
        for k in 0..3 {
            let (here, following) = (at[k], at[(k + 1) % 3]);
            for (c, d) in [(here + 2, beyond[k]), (here, following + 1)] {
                surface.opposite[c as usize] = d;
                surface.opposite[d as usize] = c;
            }
        }
        self.make_convex(at.map(|c| c + 2).to_vec());
    }

    /// Flips edges until the surface is convex (Lawson, 1977), starting with the edges that
    /// `corners` face.
    fn make_convex(&mut self, mut corners: Vec<u32>) {
        // On a sphere the flips end by themselves, but not if rounding makes two of them
        // disagree for ever; then a few edges that are not Delaunay do no harm.
        let mut flips = 10 * corners.len() + 100;
        while let Some(a) = corners.pop() {
            let b = self.surface.across(a);
            if flips == 0 || !self.is_concave(a) || !self.may_flip(a) {
                continue;
            }
            flips -= 1;
            flip_edge(&mut self.surface, a, b);
            // The faces kept their numbers: their four outer edges may have become concave.
            corners.extend([a, next(a), prev(a), b, next(b), prev(b)]);
        }
    }

    /// Whether the vertex across the edge that corner `a` faces lies outside the plane of its face.
    fn is_concave(&self, a: u32) -> bool {
        let at = |c: u32| self.points[self.surface.at(c) as usize];
        let origin = at(a);
        let from = |p: [f64; 3]| std::array::from_fn(|k| p[k] - origin[k]);
        determinant([at(next(a)), at(prev(a)), at(self.surface.across(a))].map(from)) > 0.0
    }

    /// Whether the edge that `a` faces can be flipped: its ends keep three faces and the new edge
    /// does not exist yet.
    fn may_flip(&self, a: u32) -> bool {
        let surface = &self.surface;
        let far = surface.at(surface.across(a));
        let has_spare = |c: u32| surface.fan(c).nth(3).is_some();
        has_spare(next(a)) && has_spare(prev(a)) && surface.fan(a).all(|c| surface.at(next(c)) != far)
    }
}
