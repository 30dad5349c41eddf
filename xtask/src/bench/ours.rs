//! Our own coder, by way of the library's example program `measure`.

use crate::callgrind;
use crate::process::{capture, command, run, target_dir};
use anyhow::{Context, Result};
use std::path::{Path, PathBuf};
use std::process::Command;

pub struct Program {
    path: PathBuf,
    /// fast, default or max.
    effort: String,
    /// Whether its C library is told to give back at once what is freed.
    returns_freed_memory: bool,
}

/// What of a mesh every coder has to know.
pub struct Summary {
    pub vertices: u64,
    pub faces: u64,
    /// The longest side of the bounding box.
    pub side: f64,
}

pub struct Encoded {
    pub bytes: u64,
    /// The part of `bytes` that tells how vertices are joined.
    pub connectivity_bytes: u64,
    pub base_vertices: u64,
    pub seconds: f64,
    /// Those of `seconds` in which a processor worked for it.
    pub cpu_seconds: f64,
    /// Memory at its fullest, the mesh included.
    pub peak_bytes: u64,
}

pub struct Remeshed {
    pub vertices: u64,
    pub base_vertices: u64,
    /// Root mean square distance from the original, as a part of its diagonal.
    pub rms: f64,
    pub folded: u64,
    pub seconds: f64,
}

/// A lossy file.
pub struct Approximated {
    pub bytes: u64,
    pub vertices: u64,
    /// Whether it holds a remesh, not a mesh of the original's vertices.
    pub remeshed: bool,
    pub psnr: f64,
    pub seconds: f64,
}

pub struct Decoded {
    pub vertices: u64,
    pub faces: u64,
    pub seconds: f64,
    pub cpu_seconds: f64,
    pub peak_bytes: u64,
}

impl Program {
    pub fn build(effort: &str) -> Result<Self> {
        let words = ["build", "--release", "--locked", "--package=tercet", "--features=remesh"];
        run(command("cargo", &[&words[..], &["--example=measure"]].concat()))?;
        let path = target_dir()?.join("release/examples/measure");
        Ok(Program { path, effort: effort.to_owned(), returns_freed_memory: false })
    }

    /// The same program under a C library that gives back at once what is freed, where it is glibc: by itself
    /// it keeps up to some tens of megabytes.
    pub fn returning_freed_memory(&self) -> Self {
        Program { path: self.path.clone(), effort: self.effort.clone(), returns_freed_memory: true }
    }

    /// Writes positions and faces of a mesh file in the format that the suffix of `out` names.
    pub fn convert(&self, mesh: &Path, out: &Path) -> Result<Summary> {
        Facts::of(self.task("convert").arg(mesh).arg(out))?.summary()
    }

    /// Generates an irregular surface like a scanned object's.
    pub fn scan(&self, vertices: u64, out: &Path) -> Result<Summary> {
        Facts::of(self.task("scan").arg(vertices.to_string()).arg(out))?.summary()
    }

    /// Refines a mesh by steps of a scheme, adds noise, a part of the mean edge, and shuffles it.
    pub fn refine(&self, mesh: &Path, out: &Path, scheme: &str, steps: u32, noise: f32) -> Result<Summary> {
        let mut task = self.task("refine");
        task.arg(mesh).arg(out).args([scheme, &steps.to_string(), &noise.to_string()]);
        Facts::of(&mut task)?.summary()
    }

    /// Remeshes to √3 connectivity.
    pub fn remesh(&self, mesh: &Path, out: &Path, levels: u32, placement: &str) -> Result<Remeshed> {
        let mut task = self.task("remesh");
        task.arg(mesh).arg(out).args([&levels.to_string(), placement]);
        let facts = Facts::of(&mut task)?;
        Ok(Remeshed {
            vertices: facts.number("vertices")?,
            base_vertices: facts.number("base_vertices")?,
            rms: facts.number("rms")?,
            folded: facts.number("folded")?,
            seconds: facts.number("seconds")?,
        })
    }

    /// Encodes on a lattice of `bits` bits, or exactly.
    pub fn encode(&self, mesh: &Path, out: &Path, bits: Option<u8>) -> Result<Encoded> {
        let bits = bits.map_or("exact".to_owned(), |bits| bits.to_string());
        let facts = Facts::of(self.task("encode").arg(mesh).arg(out).arg(bits).arg(&self.effort))?;
        Ok(Encoded {
            bytes: facts.number("bytes")?,
            connectivity_bytes: facts.number("connectivity_bytes")?,
            base_vertices: facts.number("base_vertices")?,
            seconds: facts.number("seconds")?,
            cpu_seconds: facts.number("cpu_seconds")?,
            peak_bytes: facts.number("peak_bytes")?,
        })
    }

    /// The best lossy file of at most so many bytes.
    pub fn approximate(&self, mesh: &Path, out: &Path, bytes: u64) -> Result<Approximated> {
        let mut task = self.task("approximate");
        task.arg(mesh).arg(out).args(["bytes", &bytes.to_string(), &self.effort]);
        let facts = Facts::of(&mut task)?;
        Ok(Approximated {
            bytes: facts.number("bytes")?,
            vertices: facts.number("vertices")?,
            remeshed: facts.number::<u8>("remeshed")? == 1,
            psnr: facts.number("psnr")?,
            seconds: facts.number("seconds")?,
        })
    }

    /// The PSNR of a surface against the original, as `tercet metrics` tells it.
    pub fn psnr(&self, original: &Path, mesh: &Path) -> Result<f64> {
        Facts::of(self.task("compare").arg(original).arg(mesh))?.number("psnr")
    }

    pub fn decode(&self, file: &Path) -> Result<Decoded> {
        let facts = Facts::of(self.task("decode").arg(file))?;
        Ok(Decoded {
            vertices: facts.number("vertices")?,
            faces: facts.number("faces")?,
            seconds: facts.number("seconds")?,
            cpu_seconds: facts.number("cpu_seconds")?,
            peak_bytes: facts.number("peak_bytes")?,
        })
    }

    /// Instructions of the processes that encode a mesh and decode it, reading and writing included.
    pub fn instructions(&self, mesh: &Path, tct: &Path, bits: u8) -> Result<[u64; 2]> {
        let (mesh, tct) = (mesh.to_string_lossy(), tct.to_string_lossy());
        Ok([
            callgrind::instructions(&self.path, &["encode", &mesh, &tct, &bits.to_string(), &self.effort])?,
            callgrind::instructions(&self.path, &["decode", &tct])?,
        ])
    }

    fn task(&self, name: &str) -> Command {
        let mut task = command(&self.path.to_string_lossy(), &[name]);
        if self.returns_freed_memory {
            // Blocks from this size on, glibc's own choice at first, are mapped and unmapped one by one. Only
            // if it is not set does the size grow with what is freed.
            task.env("MALLOC_MMAP_THRESHOLD_", "131072");
        }
        task
    }
}

/// What the program printed: lines of `name=value`.
struct Facts(String);

impl Facts {
    fn of(task: &mut Command) -> Result<Self> {
        capture(task).map(Facts)
    }

    fn summary(&self) -> Result<Summary> {
        Ok(Summary {
            vertices: self.number("vertices")?,
            faces: self.number("faces")?,
            side: self.number("side")?,
        })
    }

    fn number<T: std::str::FromStr>(&self, name: &str) -> Result<T> {
        let value = self.0.lines().find_map(|line| line.strip_prefix(name)?.strip_prefix('='));
        value
            .and_then(|value| value.parse().ok())
            .with_context(|| format!("the program measure printed no number {name}"))
    }
}
