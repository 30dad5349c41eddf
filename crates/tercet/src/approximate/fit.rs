//! Moving the vertices of a mesh to where its triangles are nearest to another surface.
//!
//! A mesh whose vertices lie on a curved surface lies on one side of it. Moving them so that the squared
//! distances of the surface's points from the triangles become least (Hoppe, DeRose, Duchamp, McDonald and
//! Stuetzle, "Mesh optimization", 1993, section 4.1) divides the error by up to four, where the surface
//! is a sphere. Each round projects points of the surface onto the triangles and solves the linear least squares
//! problem that then holds, along the distances (tangent distance minimisation: points may slide).

use glam::DVec3;

use crate::metrics::TriangleTree;
use crate::{Mesh, Result};

/// Rounds of projection and solution.
const ROUNDS: usize = 3;
/// Steps of the conjugate gradient method in a round.
const STEPS: usize = 12;
/// What it costs a vertex to move along its normal, against the samples around it.
const STIFFNESS: f64 = 0.2;

/// Moves the vertices of `mesh` towards the least mean square distance from `source`, of which `points` are
/// some, spread evenly. What it costs a vertex to slide within the surface is `friction`: regular triangles are cheap
/// to code, and shall stay as they are. O((n + points) log n) time.
pub(super) fn fit(mesh: &mut Mesh, source: &TriangleTree, points: &[DVec3], friction: f64) -> Result<()> {
    for _ in 0..ROUNDS {
        let problem = Problem::new(mesh, source, points, friction)?;
        for (p, step) in mesh.positions.iter_mut().zip(problem.solve()) {
            *p = (place(*p) + step).as_vec3().to_array();
        }
    }
    Ok(())
}

fn place(p: [f32; 3]) -> DVec3 {
    glam::Vec3::from_array(p).as_dvec3()
}

/// A distance between the surfaces, to be made up for by moves of a triangle's corners.
struct Residual {
    corners: [u32; 3],
    /// Barycentric coordinates of the triangle's point.
    shares: [f64; 3],
    /// Unit vector from there to the source, and how far that is.
    direction: DVec3,
    distance: f64,
    /// The area that it stands for.
    weight: f64,
}

/// The least squares problem: Σ weight · (direction · Σ shares · moves − distance)² + the moves' own cost.
struct Problem {
    residuals: Vec<Residual>,
    normals: Vec<DVec3>,
    /// For each vertex, the squares of its shares times their weights, summed: the scale of its stiffness.
    support: Vec<f64>,
    friction: f64,
}

/// Barycentric coordinates of three points of a triangle whose mean is that of a quadratic function.
const QUADRATURE: [[f64; 3]; 3] =
    [[4.0 / 6.0, 1.0 / 6.0, 1.0 / 6.0], [1.0 / 6.0, 4.0 / 6.0, 1.0 / 6.0], [1.0 / 6.0, 1.0 / 6.0, 4.0 / 6.0]];

impl Residual {
    /// `off` leads from the triangle's point to the source; where they touch, the triangle's normal counts.
    fn new(corners: [u32; 3], shares: [f64; 3], area: DVec3, off: DVec3, weight: f64) -> Option<Self> {
        let direction = off.try_normalize().or(area.try_normalize())?;
        Some(Residual { corners, shares, direction, distance: off.dot(direction), weight })
    }
}

impl Problem {
    fn new(mesh: &Mesh, source: &TriangleTree, points: &[DVec3], friction: f64) -> Result<Self> {
        let tree = TriangleTree::new(mesh)?;
        let corners_of = |face: &[u32; 3]| face.map(|v| place(mesh.positions[v as usize]));
        let mut normals = vec![DVec3::ZERO; mesh.positions.len()];
        let mut residuals = Vec::with_capacity(points.len() + 3 * mesh.faces.len());
        let mut total = 0.0;
        for face in &mesh.faces {
            let [a, b, c] = corners_of(face);
            let area = (b - a).cross(c - a);
            face.iter().for_each(|&v| normals[v as usize] += area);
            total += area.length() / 2.0;
            for shares in QUADRATURE {
                let at = shares[0] * a + shares[1] * b + shares[2] * c;
                let Some(closest) = source.closest(at.to_array()) else { continue };
                let to = DVec3::from_array(closest.point);
                residuals.extend(Residual::new(*face, shares, area, to - at, area.length() / 6.0));
            }
        }
        let weight = total / points.len().max(1) as f64;
        for &p in points {
            let Some(closest) = tree.closest(p.to_array()) else { break };
            let face = mesh.faces[closest.face as usize];
            let at = DVec3::from_array(closest.point);
            let [a, b, c] = corners_of(&face);
            let area = (b - a).cross(c - a);
            if let Some(shares) = barycentric(at, a, b, c) {
                residuals.extend(Residual::new(face, shares, area, p - at, weight));
            }
        }
        normals.iter_mut().for_each(|n| *n = n.normalize_or_zero());
        let mut support = vec![f64::MIN_POSITIVE; mesh.positions.len()];
        for r in &residuals {
            r.corners.iter().zip(r.shares).for_each(|(&v, s)| support[v as usize] += r.weight * s * s);
        }
        Ok(Problem { residuals, normals, support, friction })
    }

    /// The moves, by the conjugate gradient method from no moves on, preconditioned by the diagonal.
    fn solve(&self) -> Vec<DVec3> {
        let n = self.normals.len();
        let mut moves = vec![DVec3::ZERO; n];
        let mut rest = vec![DVec3::ZERO; n];
        for r in &self.residuals {
            self.scatter(r, r.distance, &mut rest);
        }
        let eased = |rest: &[DVec3]| -> Vec<DVec3> {
            rest.iter().zip(&self.support).map(|(r, s)| *r / (s * (1.0 + STIFFNESS))).collect()
        };
        let dot = |a: &[DVec3], b: &[DVec3]| -> f64 { a.iter().zip(b).map(|(a, b)| a.dot(*b)).sum() };
        let mut ahead = eased(&rest);
        let mut heading = ahead.clone();
        let mut size = dot(&rest, &ahead);
        for _ in 0..STEPS {
            let image = self.apply(&heading);
            let curvature = dot(&heading, &image);
            if size <= 0.0 || curvature <= 0.0 {
                break;
            }
            let far = size / curvature;
            moves.iter_mut().zip(&heading).for_each(|(m, h)| *m += far * *h);
            rest.iter_mut().zip(&image).for_each(|(r, i)| *r -= far * *i);
            ahead = eased(&rest);
            let before = std::mem::replace(&mut size, dot(&rest, &ahead));
            heading.iter_mut().zip(&ahead).for_each(|(h, a)| *h = *a + size / before * *h);
        }
        moves
    }

    fn scatter(&self, r: &Residual, amount: f64, into: &mut [DVec3]) {
        for (&v, share) in r.corners.iter().zip(r.shares) {
            into[v as usize] += r.weight * amount * share * r.direction;
        }
    }

    /// The problem's matrix times a vector.
    fn apply(&self, moves: &[DVec3]) -> Vec<DVec3> {
        let mut image: Vec<DVec3> = (0..moves.len())
            .map(|v| {
                let (step, normal) = (moves[v], self.normals[v]);
                let up = normal * step.dot(normal);
                self.support[v] * (STIFFNESS * up + self.friction * (step - up))
            })
            .collect();
        for r in &self.residuals {
            let moved =
                r.corners.iter().zip(r.shares).map(|(&v, s)| s * moves[v as usize].dot(r.direction)).sum();
            self.scatter(r, moved, &mut image);
        }
        image
    }
}

/// The barycentric coordinates of a point of a triangle; `None` if that has no area.
fn barycentric(p: DVec3, a: DVec3, b: DVec3, c: DVec3) -> Option<[f64; 3]> {
    let normal = (b - a).cross(c - a);
    let square = normal.length_squared();
    if square == 0.0 {
        return None;
    }
    let of_b = normal.dot((c - a).cross(a - p)) / square;
    let of_c = normal.dot((b - a).cross(p - a)) / square;
    Some([1.0 - of_b - of_c, of_b, of_c])
}

#[cfg(test)]
mod tests {
    use super::super::gauge::Gauge;
    use super::*;
    use crate::shapes::{annulus, sphere};

    #[test]
    fn triangles_inside_a_sphere_move_outwards_to_a_third_of_the_error() {
        let gauge = Gauge::new(&sphere(5)).unwrap();
        let mut mesh = sphere(2);
        let before = gauge.error(&mesh).unwrap();
        fit(&mut mesh, &gauge.tree, &gauge.samples, 0.3).unwrap();
        let after = gauge.error(&mesh).unwrap();
        assert!(after < before / 3.0, "{before} -> {after}");
        assert!(mesh.positions.iter().all(|&p| (1.0..1.1).contains(&place(p).length())));
    }

    #[test]
    fn what_fits_already_stays() {
        let gauge = Gauge::new(&annulus(40, 6)).unwrap();
        let mut mesh = annulus(40, 6);
        fit(&mut mesh, &gauge.tree, &gauge.samples, 0.3).unwrap();
        assert!(gauge.error(&mesh).unwrap() < 1e-6);
    }

    #[test]
    fn barycentric_coordinates_give_the_point() {
        let [a, b, c] = [DVec3::ZERO, DVec3::new(2.0, 0.0, 1.0), DVec3::new(0.0, 3.0, 0.0)];
        let shares = barycentric(0.2 * a + 0.5 * b + 0.3 * c, a, b, c).unwrap();
        assert!(shares.iter().zip([0.2, 0.5, 0.3]).all(|(x, y)| (x - y).abs() < 1e-12), "{shares:?}");
        assert_eq!(barycentric(a, a, b, b), None);
    }
}
