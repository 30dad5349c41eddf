//! Spheres of nearly equal triangles.

/// An icosahedron whose edges are cut into `frequency` ≥ 1 parts and whose faces into the
/// square of that, on the unit sphere: 10 · `frequency`² + 2 vertices.
pub(super) fn geodesic(frequency: usize) -> (Vec<[f64; 3]>, Vec<[u32; 3]>) {
    let icosahedron = Icosahedron::new();
    let f = frequency;
    let corners = icosahedron.corners;
    let between = |weighted: &[(usize, usize)]| {
        normalised(std::array::from_fn(|axis| {
            weighted.iter().map(|&(corner, weight)| weight as f64 * corners[corner][axis]).sum()
        }))
    };
    let mut points = Vec::with_capacity(10 * f * f + 2);
    points.extend(corners.map(normalised));
    for &[a, b] in &icosahedron.edges {
        points.extend((1..f).map(|j| between(&[(a, f - j), (b, j)])));
    }
    let mut faces = Vec::with_capacity(20 * f * f);
    for &[a, b, c] in &icosahedron.faces {
        let interior = points.len();
        // The point with weights i, j and f − i − j of the three corners.
        let index = |i: usize, j: usize| {
            let k = f - i - j;
            (match (i, j, k) {
                (_, _, 0) => icosahedron.on_edge([a, b], j, f),
                (0, _, _) => icosahedron.on_edge([b, c], k, f),
                (_, 0, _) => icosahedron.on_edge([c, a], i, f),
                // Row i begins after f − 2, f − 3, … points of the rows before.
                _ => interior + (i - 1) * (f - 1) - (i - 1) * i / 2 + j - 1,
            }) as u32
        };
        for i in 0..f {
            for j in 0..f - i {
                faces.push([index(i + 1, j), index(i, j + 1), index(i, j)]);
                if i + j + 2 <= f {
                    faces.push([index(i, j + 1), index(i + 1, j), index(i + 1, j + 1)]);
                }
            }
        }
        for i in 1..f {
            points.extend((1..f - i).map(|j| between(&[(a, i), (b, j), (c, f - i - j)])));
        }
    }
    (points, faces)
}

pub(super) fn normalised(p: [f64; 3]) -> [f64; 3] {
    let length = (p[0] * p[0] + p[1] * p[1] + p[2] * p[2]).sqrt();
    p.map(|x| x / length)
}

/// The regular icosahedron with edges of length 2.
struct Icosahedron {
    corners: [[f64; 3]; 12],
    /// The ends of each edge, the smaller first.
    edges: Vec<[usize; 2]>,
    /// Counter-clockwise seen from outside.
    faces: Vec<[usize; 3]>,
}

impl Icosahedron {
    fn new() -> Self {
        let golden = (1.0 + 5f64.sqrt()) / 2.0;
        // Three golden rectangles, each in the plane of two axes.
        let corners: [[f64; 3]; 12] = std::array::from_fn(|i| {
            let sign = |bit: usize| if i >> bit & 1 == 0 { 1.0 } else { -1.0 };
            let mut corner = [0.0; 3];
            corner[i / 4] = sign(0);
            corner[(i / 4 + 1) % 3] = sign(1) * golden;
            corner
        });
        let square =
            |a: usize, b: usize| (0..3).map(|k| (corners[a][k] - corners[b][k]).powi(2)).sum::<f64>();
        // The next distance between corners is that of a golden rectangle's long side.
        let near = |a: usize, b: usize| square(a, b) < 5.0;
        let mut edges = Vec::new();
        let mut faces = Vec::new();
        for a in 0..12 {
            for b in (a + 1..12).filter(|&b| near(a, b)) {
                edges.push([a, b]);
                for c in (b + 1..12).filter(|&c| near(a, c) && near(b, c)) {
                    let outside = determinant([a, b, c].map(|v| corners[v])) > 0.0;
                    faces.push(if outside { [a, b, c] } else { [a, c, b] });
                }
            }
        }
        Icosahedron { corners, edges, faces }
    }

    /// The number of the point `j` parts of `f` from `a` towards `b`.
    fn on_edge(&self, [a, b]: [usize; 2], j: usize, f: usize) -> usize {
        if j == 0 {
            return a;
        }
        if j == f {
            return b;
        }
        let along = if a < b { j } else { f - j };
        let is_it = |edge: &[usize; 2]| *edge == [a.min(b), a.max(b)];
        let edge = self.edges.iter().position(is_it).expect("faces consist of edges");
        self.corners.len() + edge * (f - 1) + along - 1
    }
}

/// Six times the signed volume of the tetrahedron of the origin and three points.
pub(super) fn determinant([a, b, c]: [[f64; 3]; 3]) -> f64 {
    a[0] * (b[1] * c[2] - b[2] * c[1])
        + a[1] * (b[2] * c[0] - b[0] * c[2])
        + a[2] * (b[0] * c[1] - b[1] * c[0])
}
