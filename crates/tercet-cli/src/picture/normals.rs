//! Normals that leave creases sharp.

/// Faces whose normals are nearer than 40° look like one smooth surface.
const SMOOTH_COSINE: f64 = 0.766;
/// Around a vertex of more faces all of them are one smooth surface: comparing each with each would
/// take quadratic time.
const MOST_FACES: usize = 64;

type Vector = [f64; 3];

/// For each face the normals at its three corners, of length 1; those of a face without area are 0.
///
/// At a corner it is the mean, by area, of the faces around the vertex that lie about as the corner's
/// own face does. Linear time.
pub fn corner_normals(positions: &[Vector], faces: &[[u32; 3]], flat: bool) -> Vec<[Vector; 3]> {
    let areas: Vec<Vector> = faces.iter().map(|f| area(f.map(|v| positions[v as usize]))).collect();
    let units: Vec<Vector> = areas.iter().map(|&n| unit(n)).collect();
    if flat {
        return units.iter().map(|&n| [n; 3]).collect();
    }
    let around = Around::new(positions.len(), faces);
    let corner = |f: usize, v: u32| {
        let faces = around.of(v);
        let joined = faces
            .iter()
            .filter(|&&g| faces.len() > MOST_FACES || dot(units[f], units[g as usize]) > SMOOTH_COSINE);
        let sum = joined.fold([0.0; 3], |sum, &g| add(sum, areas[g as usize]));
        let mean = unit(sum);
        if mean == [0.0; 3] { units[f] } else { mean }
    };
    (0..faces.len()).map(|f| faces[f].map(|v| corner(f, v))).collect()
}

/// The faces around each vertex.
struct Around {
    first: Vec<u32>,
    faces: Vec<u32>,
}

impl Around {
    fn new(vertices: usize, faces: &[[u32; 3]]) -> Self {
        let mut first = vec![0u32; vertices + 1];
        faces.iter().flatten().for_each(|&v| first[v as usize + 1] += 1);
        (0..vertices).for_each(|v| first[v + 1] += first[v]);
        let mut next = first.clone();
        let mut around = vec![0; 3 * faces.len()];
        for (f, face) in (0..).zip(faces) {
            for &v in face {
                around[next[v as usize] as usize] = f;
                next[v as usize] += 1;
            }
        }
        Around { first, faces: around }
    }

    fn of(&self, v: u32) -> &[u32] {
        &self.faces[self.first[v as usize] as usize..self.first[v as usize + 1] as usize]
    }
}

/// The normal of a triangle, twice as long as its area is large.
pub fn area([a, b, c]: [Vector; 3]) -> Vector {
    cross(sub(b, a), sub(c, a))
}

/// The vector with length 1; 0 stays 0.
pub fn unit(v: Vector) -> Vector {
    let length = dot(v, v).sqrt();
    if length > 0.0 { v.map(|x| x / length) } else { [0.0; 3] }
}

pub fn dot(a: Vector, b: Vector) -> f64 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

fn cross(a: Vector, b: Vector) -> Vector {
    [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
}

fn add(a: Vector, b: Vector) -> Vector {
    std::array::from_fn(|k| a[k] + b[k])
}

fn sub(a: Vector, b: Vector) -> Vector {
    std::array::from_fn(|k| a[k] - b[k])
}
