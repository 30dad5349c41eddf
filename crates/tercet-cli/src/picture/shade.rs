//! Colours for what is seen.

use tercet::Mesh;
use tercet::metrics::TriangleTree;

use super::colour::{self, Colour, Light, mix};
use super::normals::{area, corner_normals, dot, unit};
use super::raster::{NOTHING, Projected, Visible, centre};
use super::{Camera, Image, Picture, SUPERSAMPLING, Style};

/// The part of an error picture's samples that its scale reaches: single spikes would make the rest
/// look all the same.
const WITHIN_SCALE: f64 = 0.995;
/// A lamp over the left shoulder and a weaker one from the right, in view space.
const KEY: ([f64; 3], f64) = ([-0.46, 0.62, 0.64], 0.72);
const FILL: ([f64; 3], f64) = ([0.75, -0.05, 0.66], 0.16);
/// What comes from everywhere, and how much more from above than from below.
const AMBIENT: f64 = 0.24;
const SKY: f64 = 0.07;
const GLOSS: f64 = 0.10;
const SHARPNESS: i32 = 24;
/// Colours that carry meaning are lit so much more evenly.
const EVENNESS: f64 = 0.55;
/// A surface's openings are at most this part of its area if it is nearly closed.
const NEARLY_CLOSED: f64 = 0.05;

/// Gives every pixel its colour; returns what the last colour of an error picture stands for.
pub fn shade(
    picture: &Picture,
    camera: &Camera,
    positions: &[[f64; 3]],
    seen: &Visible,
    image: &mut Image,
) -> Option<f64> {
    let surface = Surface {
        mesh: picture.mesh,
        positions,
        normals: corner_normals(positions, &picture.mesh.faces, picture.flat),
        inside_out: is_inside_out(positions, &picture.mesh.faces),
        camera,
    };
    let size = typical_size(seen, picture.mesh.faces.len());
    let (errors, scale) = match picture.style {
        Style::Error { reference, diagonal, scale } => {
            let errors = distances(&surface, seen, reference, diagonal);
            let scale = scale.unwrap_or_else(|| nice_scale(&errors));
            (errors, Some(scale))
        }
        _ => (Vec::new(), None),
    };
    for y in 0..image.size.height {
        for x in 0..image.size.width {
            let (mut light, mut count) = ([0.0; 3], 0.0);
            for s in 0..SUPERSAMPLING * SUPERSAMPLING {
                let (sx, sy) = (SUPERSAMPLING * x + s % SUPERSAMPLING, SUPERSAMPLING * y + s / SUPERSAMPLING);
                let at = sy * seen.size.width + sx;
                let Some(point) = surface.point(seen.faces[at], centre(sx, sy)) else { continue };
                let colour = match (&picture.style, scale) {
                    (_, Some(scale)) => {
                        surface.lit(&point, Colour::of_error(f64::from(errors[at]) / scale).light(), EVENNESS)
                    }
                    (Style::Division { kept }, _) => surface.divided(&point, *kept, size),
                    (Style::Wireframe, _) => surface.wired(&point, size),
                    _ => surface.lit(&point, surface.clay(&point), 0.0),
                };
                light = std::array::from_fn(|k| light[k] + colour[k]);
                count += 1.0;
            }
            if count > 0.0 {
                let opacity = count / (SUPERSAMPLING * SUPERSAMPLING) as f64;
                image.put(x, y, Colour::of(light.map(|l| l / count)), opacity);
            }
        }
    }
    scale
}

/// Whether faces look inwards: of a surface that is closed or nearly so, whose areas as vectors cancel
/// out, and whose volume is negative.
fn is_inside_out(positions: &[[f64; 3]], faces: &[[u32; 3]]) -> bool {
    let (mut sum, mut areas, mut volume) = ([0.0; 3], 0.0, 0.0);
    for face in faces {
        let corners = face.map(|v| positions[v as usize]);
        let area = area(corners);
        sum = std::array::from_fn(|k| sum[k] + area[k]);
        areas += dot(area, area).sqrt();
        volume += dot(corners[0], area);
    }
    volume < 0.0 && dot(sum, sum).sqrt() < NEARLY_CLOSED * areas
}

/// The side of a typical triangle that is seen, in samples.
fn typical_size(seen: &Visible, faces: usize) -> f64 {
    let mut found = vec![false; faces];
    let mut samples = 0;
    for &f in seen.faces.iter().filter(|&&f| f != NOTHING) {
        found[f as usize] = true;
        samples += 1;
    }
    let count = found.iter().filter(|&&found| found).count();
    (2.0 * f64::from(samples) / count.max(1) as f64).sqrt()
}

/// The distance of each sample from the reference, as a part of `diagonal`; 0 where nothing is seen.
fn distances(surface: &Surface, seen: &Visible, reference: &TriangleTree, diagonal: f64) -> Vec<f32> {
    let distance = |(at, &f): (usize, &u32)| {
        let (x, y) = (at % seen.size.width, at / seen.size.width);
        let found = surface.point(f, centre(x, y)).and_then(|p| reference.closest(surface.in_mesh(&p)));
        found.map_or(0.0, |found| (found.distance / diagonal) as f32)
    };
    seen.faces.iter().enumerate().map(distance).collect()
}

/// A number of few digits that nearly all errors are below.
fn nice_scale(errors: &[f32]) -> f64 {
    let mut errors: Vec<f32> = errors.iter().copied().filter(|&e| e > 0.0).collect();
    if errors.is_empty() {
        return 1e-6;
    }
    let last = ((errors.len() - 1) as f64 * WITHIN_SCALE) as usize;
    let (_, &mut most, _) = errors.select_nth_unstable_by(last, f32::total_cmp);
    // Below this, f32 coordinates do not differ.
    let most = f64::from(most).max(1e-9);
    let power = 10f64.powf(most.log10().floor());
    [1.0, 2.0, 5.0].into_iter().map(|digit| digit * power).find(|&nice| nice >= most).unwrap_or(10.0 * power)
}

/// What is drawn, in view space.
struct Surface<'a> {
    mesh: &'a Mesh,
    positions: &'a [[f64; 3]],
    normals: Vec<[[f64; 3]; 3]>,
    /// Whether faces are clockwise seen from outside.
    inside_out: bool,
    camera: &'a Camera,
}

/// A point of a face that is seen.
struct Point {
    face: usize,
    triangle: Projected,
    /// Of the corners, in the picture and in space.
    flat_weights: [f64; 3],
    weights: [f64; 3],
    at: [f64; 2],
}

impl Surface<'_> {
    fn point(&self, face: u32, at: [f64; 2]) -> Option<Point> {
        let vertices = self.mesh.faces.get(face as usize)?;
        let triangle = Projected::new(vertices.map(|v| self.positions[v as usize]), self.camera)?;
        let (flat_weights, weights) = (triangle.weights(at)?, triangle.weights_in_space(at)?);
        Some(Point { face: face as usize, triangle, flat_weights, weights, at })
    }

    /// The point in the mesh's own coordinates.
    fn in_mesh(&self, point: &Point) -> [f64; 3] {
        let corners = self.mesh.faces[point.face].map(|v| self.mesh.positions[v as usize].map(f64::from));
        blend(corners, point.weights)
    }

    /// The colour of the material: another one inside.
    fn clay(&self, point: &Point) -> Light {
        let is_outside = point.triangle.is_front() != self.inside_out;
        if is_outside { colour::CLAY.light() } else { colour::INSIDE.light() }
    }

    /// A material's colour in the light of the lamps. `evenness` is how little it depends on them.
    fn lit(&self, point: &Point, material: Light, evenness: f64) -> Light {
        let vertices = self.mesh.faces[point.face];
        let place = blend(vertices.map(|v| self.positions[v as usize]), point.weights);
        let normal = unit(blend(self.normals[point.face], point.weights));
        let eye = self.camera.towards_camera(place);
        let normal = if point.triangle.is_front() { normal } else { normal.map(|x| -x) };
        let mut amount = AMBIENT + SKY * normal[1];
        let mut gloss = 0.0;
        for (lamp, strength) in [KEY, FILL] {
            let lamp = unit(lamp);
            amount += strength * dot(normal, lamp).max(0.0);
            let half = unit(std::array::from_fn(|k| lamp[k] + eye[k]));
            gloss += GLOSS * strength * dot(normal, half).max(0.0).powi(SHARPNESS);
        }
        let amount = amount + evenness * (0.95 - amount);
        material.map(|m| m * amount + gloss * (1.0 - evenness))
    }

    /// The surface with its edges.
    fn wired(&self, point: &Point, size: f64) -> Light {
        let surface = self.lit(point, self.clay(point), 0.2);
        mix(surface, colour::EDGE.light(), edge(point, size))
    }

    /// The surface with its edges, and its vertices in two colours. Where triangles are smaller than
    /// dots, each point has the colour of the nearest corner.
    fn divided(&self, point: &Point, kept: u32, size: f64) -> Light {
        let pixel = SUPERSAMPLING as f64;
        let radius = (0.22 * size).clamp(1.4 * pixel, 6.0 * pixel);
        let away = |k: usize| {
            let [x, y, _] = point.triangle.0[k];
            (point.at[0] - x).hypot(point.at[1] - y)
        };
        let nearest = (1..3).fold(0, |best, k| if away(k) < away(best) { k } else { best });
        let surface = self.lit(point, colour::PALE.light(), 0.3);
        let surface = mix(surface, colour::EDGE.light(), 0.7 * edge(point, size));
        let vertex = self.mesh.faces[point.face][nearest];
        let dot = if vertex < kept { colour::EVEN } else { colour::ODD };
        let cover = (radius - away(nearest) + 0.5).clamp(0.0, 1.0);
        mix(surface, self.lit(point, dot.light(), 0.7), cover)
    }
}

/// How much of an edge is seen at a point, 0 to 1: fainter where edges are dense.
fn edge(point: &Point, size: f64) -> f64 {
    let pixel = SUPERSAMPLING as f64;
    let heights = point.triangle.heights();
    let away = (0..3).map(|k| point.flat_weights[k] * heights[k]).fold(f64::INFINITY, f64::min);
    let half_width = (0.03 * size).clamp(0.35 * pixel, 0.7 * pixel);
    let density = (size / (9.0 * pixel)).clamp(0.12, 0.9);
    density * (half_width - away + 0.5).clamp(0.0, 1.0)
}

fn blend(corners: [[f64; 3]; 3], weights: [f64; 3]) -> [f64; 3] {
    std::array::from_fn(|k| (0..3).map(|i| weights[i] * corners[i][k]).sum())
}
