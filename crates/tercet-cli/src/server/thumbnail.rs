//! A small picture of a file: a coarse level, drawn as a vector graphic.

use std::fmt::Write;
use std::sync::Arc;

use futures_util::TryStreamExt;
use tercet::{Decoder, Info, Limits, Mesh};

use super::failure::Failure;
use super::rendition::Rendition;

/// The finest level that is drawn has at most this many faces.
const MOST_FACES: u32 = 1200;
/// Nothing beyond this many bytes is read for a picture.
const MOST_BYTES: u64 = 1 << 20;
/// Bytes of memory that decoding for a picture may take.
const LIMITS: Limits = Limits { max_memory: 16 << 20 };
/// Half the side of the picture that the mesh fills, in the picture's units.
const HALF: f64 = 96.0;

/// Draws the finest level with at most [`MOST_FACES`] faces, as an SVG.
///
/// # Errors
/// [`Failure::NotFound`] if there is no such level among the first [`MOST_BYTES`];
/// [`Failure::Mesh`] if the file is damaged.
pub async fn draw(rendition: Rendition) -> Result<Arc<str>, Failure> {
    let end = rendition.bytes().min(MOST_BYTES);
    let mut bytes = rendition.object.read(0..end).await?;
    let mut decoder = Decoder::new(LIMITS);
    let mut best = None;
    while let Some(chunk) = bytes.try_next().await? {
        decoder.push(&chunk);
        while let Some(level) = decoder.next_level().map_err(|error| Failure::Mesh(error.to_string()))? {
            best = Some(level.mesh);
            if decoder.info().is_none_or(|info| next_is_too_fine(&info, level.level)) {
                return picture(best);
            }
        }
        if best.is_none() && decoder.info().is_some_and(|info| info.levels[0].faces > MOST_FACES) {
            return Err(Failure::NotFound);
        }
    }
    picture(best)
}

fn next_is_too_fine(info: &Info, level: u32) -> bool {
    info.levels.get(level as usize + 1).is_none_or(|next| next.faces > MOST_FACES)
}

fn picture(mesh: Option<Mesh>) -> Result<Arc<str>, Failure> {
    mesh.filter(|mesh| !mesh.faces.is_empty()).map(|mesh| svg(&mesh).into()).ok_or(Failure::NotFound)
}

/// A face as it is drawn: farthest first, brighter the more it is turned to the light.
struct Patch {
    depth: f64,
    light: f64,
    corners: [[f64; 3]; 3],
}

/// Seen from the upper right, faces painted from back to front.
fn svg(mesh: &Mesh) -> String {
    let turned: Vec<[f64; 3]> = mesh.positions.iter().map(|position| turn(position.map(f64::from))).collect();
    let (centre, half) = extent(&turned);
    let scale = if half > 0.0 { HALF / half } else { 0.0 };
    let placed = |v: u32| {
        let [x, y, z] = turned[v as usize];
        [(x - centre[0]) * scale, (centre[1] - y) * scale, z]
    };
    let mut patches: Vec<Patch> = mesh.faces.iter().map(|face| patch(face.map(placed), scale)).collect();
    patches.sort_by(|a, b| a.depth.total_cmp(&b.depth));
    let mut out = String::from("<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"-100 -100 200 200\">\n");
    for Patch { light, corners: [a, b, c], .. } in patches {
        let [red, green, blue] = [70.0, 105.0, 150.0].map(|least| (least + 95.0 * light) as u8);
        // The stroke closes the seams between faces.
        let _ = writeln!(
            out,
            "<path d=\"M{:.1} {:.1}L{:.1} {:.1}L{:.1} {:.1}z\" fill=\"#{red:02x}{green:02x}{blue:02x}\" \
             stroke=\"#{red:02x}{green:02x}{blue:02x}\" stroke-width=\".4\"/>",
            a[0], a[1], b[0], b[1], c[0], c[1]
        );
    }
    out + "</svg>\n"
}

/// Turns by 30° about the vertical and then by 20° towards the viewer, who looks along −z.
fn turn([x, y, z]: [f64; 3]) -> [f64; 3] {
    let ((s, c), (t, d)) = (30f64.to_radians().sin_cos(), 20f64.to_radians().sin_cos());
    let (x, z) = (c * x + s * z, c * z - s * x);
    [x, d * y - t * z, t * y + d * z]
}

/// The middle of the picture and half its side.
fn extent(points: &[[f64; 3]]) -> ([f64; 2], f64) {
    let along = |axis: usize| {
        let values = points.iter().map(|point| point[axis]);
        let (low, high) = values.fold((f64::MAX, f64::MIN), |(low, high), v| (low.min(v), high.max(v)));
        ((low + high) / 2.0, (high - low) / 2.0)
    };
    let ((x, width), (y, height)) = (along(0), along(1));
    ([x, y], width.max(height))
}

fn patch(corners: [[f64; 3]; 3], scale: f64) -> Patch {
    let [a, b, c] = corners.map(|[x, y, z]| [x, y, z * scale]);
    let [u, v] = [b, c].map(|p| [p[0] - a[0], p[1] - a[1], p[2] - a[2]]);
    let normal = [u[1] * v[2] - u[2] * v[1], u[2] * v[0] - u[0] * v[2], u[0] * v[1] - u[1] * v[0]];
    let length = normal.iter().map(|n| n * n).sum::<f64>().sqrt();
    // Light from the upper left front. A mesh need not be oriented: both sides are lit.
    let along = (0.4 * normal[0] + 0.5 * normal[1] - 0.77 * normal[2]).abs();
    let light = if length > 0.0 { along / length } else { 0.5 };
    Patch { depth: corners.iter().map(|corner| corner[2] / 3.0).sum(), light, corners }
}

#[cfg(test)]
mod tests {
    use super::*;
    use tercet::shapes;

    #[test]
    fn every_face_is_drawn_within_the_picture() {
        let text = svg(&shapes::torus(12, 8));
        assert_eq!(text.matches("<path").count(), 12 * 8 * 2);
        let numbers = text.split(['M', 'L', ' ', 'z', '"']).filter_map(|word| word.parse::<f64>().ok());
        let (low, high) = numbers.fold((0f64, 0f64), |(low, high), n| (low.min(n), high.max(n)));
        assert!((-100.0..-90.0).contains(&low) && (90.0..=200.0).contains(&high), "{low} {high}");
    }

    #[test]
    fn meshes_without_extent_and_of_huge_extent_give_finite_numbers() {
        for size in [0.0, f32::MIN_POSITIVE, f32::MAX] {
            let mesh =
                Mesh { positions: vec![[size; 3], [-size; 3], [size, 0.0, 0.0]], faces: vec![[0, 1, 2]] };
            let text = svg(&mesh);
            assert!(!text.contains("NaN") && !text.contains("inf"), "{text}");
        }
    }
}
