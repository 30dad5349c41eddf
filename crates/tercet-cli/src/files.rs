//! Paths, formats and bytes on disk. `-` stands for standard input or output.

use std::fs::File;
use std::io::{self, Read, Write};
use std::path::{Path, PathBuf};

use anyhow::{Context, Result, bail};
use tercet::io::Format;
use tercet::{Limits, Mesh};

use crate::console::Console;

/// Whether a path stands for standard input or output.
pub fn is_standard(path: &Path) -> bool {
    path == Path::new("-")
}

/// A path's name in messages.
pub fn name(path: &Path) -> String {
    if is_standard(path) { "standard input".into() } else { path.display().to_string() }
}

/// The path with another suffix; `-` stays `-`.
pub fn with_suffix(path: &Path, suffix: &str) -> PathBuf {
    if is_standard(path) { path.into() } else { path.with_extension(suffix) }
}

/// The format to use for a path: the one that was asked for, or else its suffix's.
pub fn format(path: &Path, asked: Option<Format>) -> Result<Format> {
    match asked.or_else(|| Format::from_path(path)) {
        Some(format) => Ok(format),
        None if is_standard(path) => bail!("-: say --format obj, ply, stl or off"),
        None => bail!(
            "{}: the suffix is none of .obj, .ply, .stl, .off: say which it is with --format",
            path.display()
        ),
    }
}

/// Opens a file or standard input for reading.
pub fn open(path: &Path) -> Result<Box<dyn Read>> {
    if is_standard(path) {
        return Ok(Box::new(io::stdin().lock()));
    }
    Ok(Box::new(File::open(path).with_context(|| name(path))?))
}

/// Reads a mesh and warns of what it cannot hold.
pub fn read_mesh(path: &Path, asked: Option<Format>, limits: &Limits, console: &Console) -> Result<Mesh> {
    let format = format(path, asked)?;
    let mut bytes = Vec::new();
    let read = open(path)?.take(limits.max_memory.saturating_add(1)).read_to_end(&mut bytes);
    if read.with_context(|| name(path))? as u64 > limits.max_memory {
        bail!("{}: more than {} bytes, the limit of --max-memory", name(path), limits.max_memory);
    }
    let loaded = tercet::io::read(&bytes, format, limits).with_context(|| name(path))?;
    for note in &loaded.notes {
        console.warn(&name(path), note);
    }
    Ok(loaded.mesh)
}

/// Writes a mesh and warns of what the format cannot carry.
pub fn write_mesh(mesh: &Mesh, path: &Path, format: Format, console: &Console) -> Result<()> {
    for loss in tercet::io::losses(mesh, format) {
        console.warn(&output_name(path), &loss);
    }
    write(path, |out| Ok(tercet::io::write(mesh, format, out)?))
}

/// Writes bytes.
pub fn write_bytes(bytes: &[u8], path: &Path) -> Result<()> {
    write(path, |out| Ok(out.write_all(bytes)?))
}

/// Writes what `write` writes.
pub fn write(path: &Path, write: impl FnOnce(&mut dyn Write) -> Result<()>) -> Result<()> {
    let result = if is_standard(path) {
        let mut out = io::stdout().lock();
        write(&mut out).and_then(|()| Ok(out.flush()?))
    } else {
        File::create(path).map_err(Into::into).and_then(|mut file| write(&mut file))
    };
    result.with_context(|| output_name(path))
}

fn output_name(path: &Path) -> String {
    if is_standard(path) { "standard output".into() } else { path.display().to_string() }
}
