//! `tercet verify`.

use std::path::PathBuf;

use anyhow::{Result, bail};
use tercet::io::Format;
use tercet::verify::{Sameness, compare, quantised};
use tercet::{Info, Limits, Mesh, Precision};

use crate::console::Console;
use crate::feed::Feed;
use crate::{Outcome, args, files};

#[derive(Debug, clap::Args)]
pub struct VerifyArgs {
    /// The original mesh; - for standard input.
    pub mesh: PathBuf,
    /// The file that should restore it; - for standard input.
    #[arg(value_name = "FILE.tct")]
    pub file: PathBuf,
    /// The format of MESH [default: by its suffix].
    #[arg(long, value_parser = args::format)]
    pub format: Option<Format>,
}

pub fn verify(args: &VerifyArgs, limits: &Limits, console: &Console) -> Result<Outcome> {
    if files::is_standard(&args.mesh) && files::is_standard(&args.file) {
        bail!("-: only one of the two can be standard input");
    }
    let original = files::read_mesh(&args.mesh, args.format, limits, console)?;
    let mut feed = Feed::open(&args.file, None, limits)?;
    let info = feed.info()?;
    let mut meter = console.meter();
    let mut last = None;
    while let Some(level) = feed.next_level()? {
        meter.show("decoding", feed.bytes, info.bytes);
        last = Some(level);
    }
    drop(meter);
    feed.finish()?;
    let name = files::name(&args.file);
    let Some(decoded) = last.filter(|level| level.restored) else {
        bail!("{name}: it does not hold the whole mesh");
    };
    match judge(original, &decoded.mesh, &info) {
        Ok(how) => console.answer(&format!("{name}: {how}"))?,
        Err(what) => bail!("{name}: not {}: {what}", files::name(&args.mesh)),
    }
    Ok(Outcome::Good)
}

/// Whether `decoded` keeps what its file promises of `original`: how it does, or what differs.
pub fn judge(original: Mesh, decoded: &Mesh, info: &Info) -> Result<String, String> {
    let (expected, precision) = match info.precision {
        Precision::Lattice { bits, .. } => (
            quantised(&original, &info.precision),
            format!("every position on its point of the {bits}-bit lattice"),
        ),
        _ => (original, "every bit of every position".to_string()),
    };
    match compare(&expected, decoded) {
        Sameness::Identical => Ok(format!("identical: {precision}, order kept")),
        Sameness::Renumbered if info.order_kept => {
            Err("the order of vertices or faces is not the one that the file promises".into())
        }
        Sameness::Renumbered => Ok(format!("equal up to the order of vertices and faces: {precision}")),
        Sameness::Different(what) => Err(what),
    }
}
