//! A mesh or its levels to look at, from a mesh file or a `.tct` file.

use std::path::Path;

use anyhow::{Context, Result, bail};
use tercet::io::Format;
use tercet::{Decoder, EncodeOptions, Level, Limits, Mesh};

use crate::commands::encode_shown;
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

/// Reads all levels with their predictions, the finest also as it is restored, if that makes a
/// difference; of a mesh file those that it encodes to, losslessly.
pub fn levels(path: &Path, asked: Option<Format>, limits: &Limits, console: &Console) -> Result<Vec<Level>> {
    if asked.is_some() || !is_progressive(path) {
        let mesh = files::read_mesh(path, asked, limits, console)?;
        let encoded = encode_shown(&mesh, &EncodeOptions::default(), console);
        let bytes = encoded.with_context(|| files::name(path))?.bytes;
        return all_levels(&bytes, limits).with_context(|| files::name(path));
    }
    let mut feed = Feed::open(path, None, limits)?;
    feed.keep_predictions();
    std::iter::from_fn(|| feed.next_level().transpose()).collect()
}

/// All levels of a file, which may end early, with their predictions.
pub fn all_levels(bytes: &[u8], limits: &Limits) -> tercet::Result<Vec<Level>> {
    let mut decoder = Decoder::new(*limits);
    decoder.keep_predictions(true);
    decoder.push(bytes);
    std::iter::from_fn(|| decoder.next_level().transpose()).collect()
}
