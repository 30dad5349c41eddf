//! A mesh to look at, from a mesh file or a `.tct` file.

use std::path::Path;

use anyhow::{Result, bail};
use tercet::io::Format;
use tercet::{Level, Limits, Mesh};

use crate::console::Console;
use crate::feed::Feed;
use crate::files;

/// Whether a path names a progressive file, by its suffix.
pub fn is_progressive(path: &Path) -> bool {
    path.extension().is_some_and(|suffix| suffix.eq_ignore_ascii_case("tct"))
}

/// Reads a mesh: of a progressive file the best that it holds, with a warning if that is not all.
pub fn mesh(path: &Path, asked: Option<Format>, limits: &Limits, console: &Console) -> Result<Mesh> {
    if asked.is_some() || !is_progressive(path) {
        return files::read_mesh(path, asked, limits, console);
    }
    let mut feed = Feed::open(path, None, limits)?;
    let mut best: Option<Level> = None;
    while let Some(level) = feed.next_level()? {
        best = Some(level);
    }
    let Some(best) = best else {
        feed.finish()?;
        bail!("{}: there is no level in it", files::name(path));
    };
    if !best.restored {
        console.warn(&files::name(path), &format!("incomplete: level {} is used", best.level));
    }
    Ok(best.mesh)
}
