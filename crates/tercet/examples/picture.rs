//! Draws the README's picture: a file's levels as they arrive, as an SVG on standard output.
//!
//! ```text
//! cargo run --release -p tercet --example picture > docs/levels.svg
//! ```

use tercet::{Decoder, EncodeOptions, Level, Limits, Mesh, Result, shapes};

const VERTICES: usize = 1500;
const SEED: u64 = 3;
const BITS: u8 = 12;
/// Where the file is cut off, in percent.
const CUTS: [usize; 4] = [10, 20, 45, 100];
/// Width and height of one level's panel, and what is left below it for its text.
const PANEL: f32 = 240.0;
const TEXT: f32 = 30.0;
/// The generated mesh reaches beyond 1.
const SCALE: f32 = 0.8;
const SHADES: usize = 16;
/// Towards the light; of length 1, as is the line of sight (0, 0, 1).
const LIGHT: [f32; 3] = [-0.48, 0.6, 0.64];

fn main() -> Result<()> {
    let mesh = shapes::scan(VERTICES, SEED);
    let file = tercet::encode(&mesh, &EncodeOptions { bits: Some(BITS), ..EncodeOptions::default() })?.bytes;
    let (width, height) = (PANEL * CUTS.len() as f32, PANEL + TEXT);
    println!("<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 {width} {height}\">");
    println!("<style>path{{stroke:#20405a;stroke-width:.3;stroke-linejoin:round}}");
    println!("text{{font:13px sans-serif;fill:#808080;text-anchor:middle}}");
    for shade in 0..SHADES {
        let part = |dark: usize, bright: usize| dark + (bright - dark) * shade / (SHADES - 1);
        println!(".s{shade}{{fill:rgb({},{},{})}}", part(40, 226), part(70, 236), part(96, 242));
    }
    println!("</style>");
    for (panel, percent) in CUTS.into_iter().enumerate() {
        let Some(level) = best_level(&file[..file.len() * percent / 100])? else { continue };
        println!("<g transform=\"translate({} 0)\">", PANEL * panel as f32);
        draw(&level.mesh);
        let (x, y) = (PANEL / 2.0, PANEL + TEXT / 2.0);
        println!("<text x=\"{x}\" y=\"{y}\">{percent} %: {} faces</text>\n</g>", level.mesh.faces.len());
    }
    println!("</svg>");
    Ok(())
}

/// The finest level in `bytes`, the beginning of a file.
fn best_level(bytes: &[u8]) -> Result<Option<Level>> {
    let mut decoder = Decoder::new(Limits::default());
    decoder.push(bytes);
    let mut best = None;
    while let Some(level) = decoder.next_level()? {
        best = Some(level);
    }
    Ok(best)
}

/// The faces that look at the viewer, the farthest first.
fn draw(mesh: &Mesh) {
    let corners = |face: &[u32; 3]| face.map(|v| turned(mesh.positions[v as usize]));
    let mut faces: Vec<[[f32; 3]; 3]> = mesh.faces.iter().map(corners).collect();
    let depth = |face: &[[f32; 3]; 3]| face.iter().map(|p| p[2]).sum::<f32>();
    faces.sort_by(|a, b| depth(a).total_cmp(&depth(b)));
    for face in faces {
        let normal = normal(face);
        if normal[2] > 0.0 {
            let light: f32 = normal.iter().zip(LIGHT).map(|(n, l)| n * l).sum();
            let shade = ((0.5 + 0.5 * light) * (SHADES - 1) as f32).round();
            let [a, b, c] = face.map(|[x, y, _]| [1.0 + x, 1.0 - y].map(|x| x * PANEL / 2.0));
            let line = |p: [f32; 2], q: [f32; 2]| format!("{:.1} {:.1}", q[0] - p[0], q[1] - p[1]);
            let [start, first, second] = [line([0.0; 2], a), line(a, b), line(b, c)];
            println!("<path class=\"s{shade}\" d=\"M{start}l{first} {second}z\"/>");
        }
    }
}

/// A position seen a little from above and from the side.
fn turned([x, y, z]: [f32; 3]) -> [f32; 3] {
    let (x, z) = (0.8 * x + 0.6 * z, 0.8 * z - 0.6 * x);
    let (y, z) = (0.96 * y - 0.28 * z, 0.96 * z + 0.28 * y);
    [x, y, z].map(|x| x * SCALE)
}

/// The unit normal of a face, or 0 if it has no area.
fn normal([a, b, c]: [[f32; 3]; 3]) -> [f32; 3] {
    let edge = |p: [f32; 3]| [p[0] - a[0], p[1] - a[1], p[2] - a[2]];
    let (u, v) = (edge(b), edge(c));
    let n = [u[1] * v[2] - u[2] * v[1], u[2] * v[0] - u[0] * v[2], u[0] * v[1] - u[1] * v[0]];
    let length = n.iter().map(|x| x * x).sum::<f32>().sqrt();
    n.map(|x| x / length.max(f32::MIN_POSITIVE))
}
