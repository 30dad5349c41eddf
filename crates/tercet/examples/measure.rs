//! Codes one mesh and prints what it cost, as lines of `name=value`: our side of `cargo xtask bench`.
//!
//! ```text
//! measure convert MESH OUT              positions and faces only; OUT's suffix names its format
//! measure scan VERTICES OUT.ply         a generated irregular surface, like a scanned object's
//! measure refine MESH OUT.ply SCHEME STEPS NOISE   sqrt3 or butterfly steps, noise as a part of the
//!                                                mean edge, vertices and faces shuffled
//! measure remesh MESH OUT.ply LEVELS normal|relaxed   to √3 connectivity
//! measure encode MESH.ply OUT.tct BITS EFFORT [smallest]   BITS is a number or "exact"; fast, default or max
//! measure approximate MESH.ply OUT.tct bytes|error BOUND EFFORT   the best lossy file within it
//! measure compare A B                            how far apart two surfaces are
//! measure decode FILE.tct
//! ```
//!
//! `seconds` are those of coding alone, without reading and writing files; `cpu_seconds` those of them in which
//! a processor worked for it, 0 where the system does not tell. `peak_bytes` is the process's
//! memory at its fullest less what it had at its start, input and output included; 0 where the system
//! does not tell.

use std::error::Error;
use std::fs;
use std::path::Path;
use std::time::Instant;
use tercet::approximate::{Bound, Method};
use tercet::io::{self, Format};
use tercet::metrics::{self, Comparison, MetricsOptions};
use tercet::remesh::{Goal, Placement, RemeshOptions};
use tercet::{Effort, EncodeOptions, Limits, Mesh, Progressive, Scheme};

type Result<T> = std::result::Result<T, Box<dyn Error>>;

fn main() -> Result<()> {
    let words: Vec<String> = std::env::args().skip(1).collect();
    match words.iter().map(String::as_str).collect::<Vec<_>>()[..] {
        ["convert", mesh, out] => write(&read(mesh)?, out),
        ["scan", vertices, out] => write(&tercet::shapes::scan(vertices.parse()?, 1), out),
        ["remesh", mesh, out, levels, placement] => {
            remesh(&read(mesh)?, out, levels.parse()?, self::placement(placement)?)
        }
        ["refine", mesh, out, scheme, steps, noise] => {
            write(&refine(&read(mesh)?, self::scheme(scheme)?, steps.parse()?, noise.parse()?)?, out)
        }
        ["encode", mesh, out, bits, effort] => encode(mesh, out, bits, effort, Progressive::Best),
        ["encode", mesh, out, bits, effort, "smallest"] => {
            encode(mesh, out, bits, effort, Progressive::Smallest)
        }
        ["approximate", mesh, out, "bytes", bytes, effort] => {
            approximate(&read(mesh)?, out, Bound::MaxBytes(bytes.parse()?), effort)
        }
        ["approximate", mesh, out, "error", error, effort] => {
            approximate(&read(mesh)?, out, Bound::MaxError(error.parse()?), effort)
        }
        ["compare", a, b] => compare(&read(a)?, &read(b)?),
        ["decode", file] => decode(file),
        _ => Err("usage: see the head of examples/measure.rs".into()),
    }
}

fn encode(mesh: &str, out: &str, bits: &str, effort: &str, progressive: Progressive) -> Result<()> {
    let before = peak_bytes();
    let mesh = read(mesh)?;
    let bits = if bits == "exact" { None } else { Some(bits.parse()?) };
    let options =
        EncodeOptions { bits, effort: self::effort(effort), progressive, ..EncodeOptions::default() };
    let encoded = timed(|| tercet::encode(&mesh, &options))?;
    println!("peak_bytes={}", peak_bytes().saturating_sub(before));
    println!("bytes={}", encoded.bytes.len());
    println!("connectivity_bytes={}", encoded.connectivity_bits.div_ceil(8));
    println!("base_vertices={}", encoded.info.levels.first().map_or(0, |base| base.vertices));
    Ok(fs::write(out, &encoded.bytes)?)
}

/// Does the work and prints how long it took.
fn timed<T>(work: impl FnOnce() -> T) -> T {
    let (start, before) = (Instant::now(), cpu_seconds());
    let done = work();
    println!("seconds={}", start.elapsed().as_secs_f64());
    println!("cpu_seconds={}", cpu_seconds() - before);
    done
}

fn effort(name: &str) -> Effort {
    match name {
        "fast" => Effort::Fast,
        "max" => Effort::Max,
        _ => Effort::Default,
    }
}

fn approximate(mesh: &Mesh, out: &str, bound: Bound, effort: &str) -> Result<()> {
    let options = EncodeOptions { effort: self::effort(effort), ..EncodeOptions::default() };
    let start = Instant::now();
    let found = tercet::approximate::approximate(mesh, bound, &options, &Limits::default(), &mut |_| {})?;
    println!("seconds={}", start.elapsed().as_secs_f64());
    println!("bytes={}", found.encoded.bytes.len());
    println!("vertices={}", found.encoded.info.vertices);
    println!("trials={}", found.trials);
    println!("remeshed={}", u8::from(matches!(found.method, Method::Remeshed(..))));
    print_comparison(&found.comparison);
    Ok(fs::write(out, &found.encoded.bytes)?)
}

fn compare(a: &Mesh, b: &Mesh) -> Result<()> {
    print_comparison(&metrics::compare(a, b, &MetricsOptions::default())?);
    Ok(())
}

fn print_comparison(comparison: &Comparison) {
    println!("rms={}", comparison.rms() / comparison.diagonal);
    println!("psnr={}", comparison.psnr());
}

fn decode(file: &str) -> Result<()> {
    let before = peak_bytes();
    let bytes = fs::read(file)?;
    let decoded = timed(|| tercet::decode(&bytes, &Limits::default()))?;
    println!("peak_bytes={}", peak_bytes().saturating_sub(before));
    print_counts(&decoded);
    Ok(())
}

fn remesh(mesh: &Mesh, out: &str, levels: u32, placement: Placement) -> Result<()> {
    let options = RemeshOptions { goal: Goal::Levels(levels), placement, ..RemeshOptions::default() };
    let start = Instant::now();
    let remeshed = tercet::remesh::remesh(mesh, &options, &Limits::default(), &mut |_| {})?;
    println!("seconds={}", start.elapsed().as_secs_f64());
    println!("base_vertices={}", remeshed.base_vertices);
    println!("rms={}", remeshed.comparison.rms() / remeshed.comparison.diagonal);
    println!("folded={}", remeshed.folded);
    write(&remeshed.mesh, out)
}

fn placement(name: &str) -> Result<Placement> {
    match name {
        "normal" => Ok(Placement::Normal),
        "relaxed" => Ok(Placement::Relaxed),
        _ => Err("placements are normal and relaxed".into()),
    }
}

/// Refines, then hides what would give the refinement away but the connectivity itself.
fn refine(base: &Mesh, scheme: Scheme, steps: u32, noise: f32) -> Result<Mesh> {
    let fine = tercet::subdivide(base, scheme, steps, &Limits::default())?;
    let mut random = Random(1);
    let noise = mean_edge(&fine) * noise;
    let order = random.permutation(fine.positions.len());
    let mut mesh = Mesh { positions: vec![[0.0; 3]; fine.positions.len()], faces: Vec::new() };
    for (position, &to) in fine.positions.iter().zip(&order) {
        mesh.positions[to] = position.map(|x| x + noise * random.signed());
    }
    for f in random.permutation(fine.faces.len()) {
        mesh.faces.push(fine.faces[f].map(|v| order[v as usize] as u32));
    }
    Ok(mesh)
}

fn scheme(name: &str) -> Result<Scheme> {
    match name {
        "sqrt3" => Ok(Scheme::Sqrt3),
        "butterfly" => Ok(Scheme::Butterfly),
        _ => Err("schemes are sqrt3 and butterfly".into()),
    }
}

/// The mean length of the faces' first edges.
fn mean_edge(mesh: &Mesh) -> f32 {
    let length = |[a, b, _]: [u32; 3]| {
        let (a, b) = (mesh.positions[a as usize], mesh.positions[b as usize]);
        a.iter().zip(b).map(|(a, b)| (a - b) * (a - b)).sum::<f32>().sqrt()
    };
    mesh.faces.iter().map(|&face| length(face)).sum::<f32>() / mesh.faces.len().max(1) as f32
}

/// The SplitMix64 generator (Steele, Lea and Flood 2014).
struct Random(u64);

impl Random {
    fn next(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        z ^ (z >> 31)
    }

    /// Uniform in −1..1.
    fn signed(&mut self) -> f32 {
        (self.next() >> 40) as f32 / (1u64 << 23) as f32 - 1.0
    }

    fn permutation(&mut self, n: usize) -> Vec<usize> {
        let mut order: Vec<usize> = (0..n).collect();
        for i in (1..n).rev() {
            order.swap(i, (self.next() % (i as u64 + 1)) as usize);
        }
        order
    }
}

fn read(path: &str) -> Result<Mesh> {
    let format = Format::from_path(Path::new(path)).ok_or("the suffix names no mesh format")?;
    Ok(io::read(&fs::read(path)?, format, &Limits::default())?.mesh)
}

fn write(mesh: &Mesh, out: &str) -> Result<()> {
    let format = Format::from_path(Path::new(out)).ok_or("the suffix names no mesh format")?;
    io::write(mesh, format, &mut fs::File::create(out)?)?;
    print_counts(mesh);
    Ok(())
}

fn print_counts(mesh: &Mesh) {
    println!("vertices={}\nfaces={}\nside={}", mesh.positions.len(), mesh.faces.len(), longest_side(mesh));
}

/// The longest side of the bounding box.
fn longest_side(mesh: &Mesh) -> f32 {
    let along = |axis: usize| mesh.positions.iter().map(move |p| p[axis]);
    let side = |axis| along(axis).fold(f32::MIN, f32::max) - along(axis).fold(f32::MAX, f32::min);
    (0..3).map(side).fold(0.0, f32::max)
}

/// For how long this thread has had a processor so far: nanoseconds, the first field of its `schedstat`.
fn cpu_seconds() -> f64 {
    let stat = fs::read_to_string("/proc/thread-self/schedstat").unwrap_or_default();
    stat.split(' ').next().and_then(|first| first.parse::<f64>().ok()).unwrap_or(0.0) / 1e9
}

/// The process's greatest memory so far ("VmHWM: 1234 kB").
fn peak_bytes() -> u64 {
    let status = fs::read_to_string("/proc/self/status").unwrap_or_default();
    let line = status.lines().find_map(|line| line.strip_prefix("VmHWM:"));
    let kilobytes = line.and_then(|line| line.trim().strip_suffix(" kB")?.parse::<u64>().ok());
    kilobytes.unwrap_or(0) * 1024
}
