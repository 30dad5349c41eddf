//! How time and memory grow with the mesh, on generated scans.

use super::spread::Spread;
use super::{Scratch, ours};
use crate::callgrind;
use anyhow::{Context, Result};
use std::fs;
use std::path::PathBuf;

/// Vertices of the meshes; ratios are to the first.
const SIZES: [u64; 3] = [100_000, 1_000_000, 10_000_000];
/// The lattice of all: fine enough that the largest mesh's vertices lie some 36 steps apart, as a scan's do.
pub const BITS: u8 = 16;
/// Larger meshes would take valgrind an hour.
const COUNTED_VERTICES: u64 = 1_000_000;
/// A mesh is left out if the machine has less free memory: for coding it, and for its files.
const BYTES_PER_VERTEX: u64 = 400;

/// One mesh, coded in one direction.
pub struct Direction {
    /// Processor time a vertex, the median of all runs.
    pub seconds: f64,
    /// Processor time a vertex over that of the first mesh, by pairs of runs.
    pub ratio: Spread,
    pub instructions: Option<u64>,
    /// Memory at its fullest: of the process, and if the C library gives back at once what is freed.
    pub peak_bytes: u64,
    pub held_bytes: u64,
}

/// One mesh.
pub struct ScaleRow {
    pub vertices: u64,
    pub bytes: u64,
    /// Encoding and decoding.
    pub directions: [Direction; 2],
}

/// A generated mesh and its file.
struct Generated {
    vertices: u64,
    ply: PathBuf,
    tct: PathBuf,
    bytes: u64,
    /// Seconds of processor time a vertex, encoding and decoding, of each run.
    seconds: [Vec<f64>; 2],
    /// Bytes, encoding and decoding.
    peak: [u64; 2],
}

/// All sizes that the machine has memory for; runs of all sizes alternate.
pub fn rows(runs: usize, ours: &ours::Program, scratch: &Scratch) -> Result<Vec<ScaleRow>> {
    callgrind::set_up()?;
    let mut meshes = Vec::new();
    for vertices in SIZES {
        let needed = vertices * BYTES_PER_VERTEX;
        if available_bytes()? < needed {
            println!("{vertices} vertices: left out: {needed} bytes of memory are not free");
            continue;
        }
        let file = |suffix: &str| scratch.file(&format!("scan-{vertices}.{suffix}"));
        let (ply, tct) = (file("ply"), file("tct"));
        ours.scan(vertices, &ply)?;
        meshes.push(Generated { vertices, ply, tct, bytes: 0, seconds: Default::default(), peak: [0; 2] });
    }
    for run in 0..runs {
        for mesh in &mut meshes {
            mesh.run(ours)?;
            let [encode, decode] = mesh.seconds.each_ref().map(|seconds| 1e6 * seconds[run]);
            println!("{} vertices: {encode:.2} µs a vertex to encode, {decode:.2} to decode", mesh.vertices);
        }
    }
    let (first, frugal) = (meshes.first().context("no memory")?, ours.returning_freed_memory());
    meshes.iter().map(|mesh| mesh.row(first, ours, &frugal)).collect()
}

impl Generated {
    /// Encodes and decodes once, timed.
    fn run(&mut self, ours: &ours::Program) -> Result<()> {
        let encoded = ours.encode(&self.ply, &self.tct, Some(BITS))?;
        let decoded = ours.decode(&self.tct)?;
        self.bytes = encoded.bytes;
        self.peak = [encoded.peak_bytes, decoded.peak_bytes];
        for (all, seconds) in self.seconds.iter_mut().zip([encoded.cpu_seconds, decoded.cpu_seconds]) {
            all.push(seconds / self.vertices as f64);
        }
        Ok(())
    }

    fn row(&self, first: &Generated, ours: &ours::Program, frugal: &ours::Program) -> Result<ScaleRow> {
        let encoded = frugal.encode(&self.ply, &self.tct, Some(BITS))?;
        let held = [encoded.peak_bytes, frugal.decode(&self.tct)?.peak_bytes];
        let instructions = match self.vertices <= COUNTED_VERTICES {
            true => ours.instructions(&self.ply, &self.tct, BITS)?.map(Some),
            false => [None; 2],
        };
        let direction = |d: usize| -> Result<Direction> {
            let pairs = self.seconds[d].iter().zip(&first.seconds[d]);
            let ratio = Spread::of(pairs.map(|(own, first)| own / first).collect()).context("no run")?;
            let seconds = Spread::of(self.seconds[d].clone()).context("no run")?.median;
            let (peak_bytes, held_bytes) = (self.peak[d], held[d]);
            Ok(Direction { seconds, ratio, instructions: instructions[d], peak_bytes, held_bytes })
        };
        let directions = [direction(0)?, direction(1)?];
        Ok(ScaleRow { vertices: self.vertices, bytes: self.bytes, directions })
    }
}

/// Memory that programs can have ("MemAvailable: 1234 kB").
fn available_bytes() -> Result<u64> {
    let info = fs::read_to_string("/proc/meminfo").context("reading /proc/meminfo")?;
    let line = info.lines().find_map(|line| line.strip_prefix("MemAvailable:"));
    let kilobytes = line.and_then(|line| line.trim().strip_suffix(" kB")?.parse::<u64>().ok());
    Ok(1024 * kilobytes.context("/proc/meminfo tells no available memory")?)
}
