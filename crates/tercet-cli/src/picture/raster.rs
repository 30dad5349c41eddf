//! Which face is seen where: a depth buffer.

use super::{Camera, Size};

/// The face seen at each sample, in rows from the top; `NOTHING` where none is.
pub struct Visible {
    pub size: Size,
    pub faces: Vec<u32>,
}

pub const NOTHING: u32 = u32::MAX;

/// A triangle in the picture: x, y and inverse depth of its corners.
#[derive(Clone, Copy, Debug)]
pub struct Projected(pub [[f64; 3]; 3]);

/// Finds the nearest face at each sample; of equally near ones the first.
pub fn visible(positions: &[[f64; 3]], faces: &[[u32; 3]], camera: &Camera, size: Size) -> Visible {
    let projected: Vec<Option<[f64; 3]>> = positions.iter().map(|&p| camera.project(p)).collect();
    let mut seen = vec![NOTHING; size.width * size.height];
    let mut nearest = vec![0.0; seen.len()];
    for (f, face) in (0..).zip(faces) {
        let [Some(a), Some(b), Some(c)] = face.map(|v| projected[v as usize]) else { continue };
        let triangle = Projected([a, b, c]);
        triangle.for_each_sample(size, |at, inverse| {
            if inverse > nearest[at] {
                nearest[at] = inverse;
                seen[at] = f;
            }
        });
    }
    Visible { size, faces: seen }
}

impl Projected {
    pub fn new(corners: [[f64; 3]; 3], camera: &Camera) -> Option<Self> {
        let [a, b, c] = corners.map(|p| camera.project(p));
        Some(Projected([a?, b?, c?]))
    }

    /// Twice the area, positive if counter-clockwise seen from the camera.
    fn area(&self) -> f64 {
        let [a, b, c] = self.0;
        // y points down.
        (c[0] - a[0]) * (b[1] - a[1]) - (b[0] - a[0]) * (c[1] - a[1])
    }

    pub fn is_front(&self) -> bool {
        self.area() > 0.0
    }

    /// The weights of the corners at a point of the picture; `None` for a triangle seen edge-on.
    pub fn weights(&self, [x, y]: [f64; 2]) -> Option<[f64; 3]> {
        let area = self.area();
        let [a, b, c] = self.0;
        let part =
            |p: [f64; 3], q: [f64; 3]| ((x - p[0]) * (q[1] - p[1]) - (q[0] - p[0]) * (y - p[1])) / area;
        (area != 0.0).then(|| [part(b, c), part(c, a), part(a, b)])
    }

    /// As [`weights`](Self::weights), of the point on the triangle that is seen there.
    pub fn weights_in_space(&self, at: [f64; 2]) -> Option<[f64; 3]> {
        let weights = self.weights(at)?;
        let scaled: [f64; 3] = std::array::from_fn(|k| weights[k] * self.0[k][2]);
        let sum: f64 = scaled.iter().sum();
        Some(scaled.map(|w| w / sum))
    }

    /// The lengths of the heights in the picture, by corner.
    pub fn heights(&self) -> [f64; 3] {
        let area = self.area().abs();
        std::array::from_fn(|k| {
            let (p, q) = (self.0[(k + 1) % 3], self.0[(k + 2) % 3]);
            area / (q[0] - p[0]).hypot(q[1] - p[1]).max(f64::MIN_POSITIVE)
        })
    }

    /// Calls `take` with the number and inverse depth of every sample whose centre is in the triangle
    /// or on its boundary.
    fn for_each_sample(&self, size: Size, mut take: impl FnMut(usize, f64)) {
        let range = |k: usize, end: usize| {
            let values = self.0.map(|p| p[k]);
            let low = values.into_iter().fold(f64::INFINITY, f64::min) - 0.5;
            let high = values.into_iter().fold(f64::NEG_INFINITY, f64::max) - 0.5;
            // Conversions saturate: what is outside the picture is not looked at.
            low.ceil().max(0.0) as usize..(high.floor() + 1.0).clamp(0.0, end as f64) as usize
        };
        let columns = range(0, size.width);
        for y in range(1, size.height) {
            for x in columns.clone() {
                let Some(weights) = self.weights(centre(x, y)) else { return };
                if weights.iter().all(|&w| w >= 0.0) {
                    let inverse = (0..3).map(|k| weights[k] * self.0[k][2]).sum();
                    take(y * size.width + x, inverse);
                }
            }
        }
    }
}

/// The centre of a sample.
pub fn centre(x: usize, y: usize) -> [f64; 2] {
    [x as f64 + 0.5, y as f64 + 0.5]
}
