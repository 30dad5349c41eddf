//! Our own coder, by way of the library's example program `measure`.

use crate::process::{capture, command, run, target_dir};
use anyhow::{Context, Result};
use std::path::{Path, PathBuf};
use std::process::Command;

pub struct Program {
    path: PathBuf,
    /// fast, default or max.
    effort: String,
}

pub struct Encoded {
    pub bytes: u64,
    /// The part of `bytes` that tells how vertices are joined.
    pub connectivity_bytes: u64,
    pub base_vertices: u64,
    pub seconds: f64,
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
    pub peak_bytes: u64,
}

impl Program {
    pub fn build(effort: &str) -> Result<Self> {
        let words = ["build", "--release", "--locked", "--package=tercet", "--features=remesh"];
        run(command("cargo", &[&words[..], &["--example=measure"]].concat()))?;
        Ok(Program { path: target_dir()?.join("release/examples/measure"), effort: effort.to_owned() })
    }

    /// Writes positions and faces of a mesh file as PLY; returns the numbers of vertices and faces.
    pub fn convert(&self, mesh: &Path, out: &Path) -> Result<(u64, u64)> {
        let facts = Facts::of(self.task("convert").arg(mesh).arg(out))?;
        Ok((facts.number("vertices")?, facts.number("faces")?))
    }

    /// Refines a mesh by steps of a scheme, adds noise, a part of the mean edge, and shuffles it.
    pub fn refine(
        &self,
        mesh: &Path,
        out: &Path,
        scheme: &str,
        steps: u32,
        noise: f32,
    ) -> Result<(u64, u64)> {
        let mut task = self.task("refine");
        task.arg(mesh).arg(out).args([scheme, &steps.to_string(), &noise.to_string()]);
        let facts = Facts::of(&mut task)?;
        Ok((facts.number("vertices")?, facts.number("faces")?))
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
            peak_bytes: facts.number("peak_bytes")?,
        })
    }

    fn task(&self, name: &str) -> Command {
        command(&self.path.to_string_lossy(), &[name])
    }
}

/// What the program printed: lines of `name=value`.
struct Facts(String);

impl Facts {
    fn of(task: &mut Command) -> Result<Self> {
        capture(task).map(Facts)
    }

    fn number<T: std::str::FromStr>(&self, name: &str) -> Result<T> {
        let value = self.0.lines().find_map(|line| line.strip_prefix(name)?.strip_prefix('='));
        value
            .and_then(|value| value.parse().ok())
            .with_context(|| format!("the program measure printed no number {name}"))
    }
}
