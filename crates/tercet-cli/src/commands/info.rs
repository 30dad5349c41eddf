//! `tercet info`.

use std::path::PathBuf;

use anyhow::Result;
use serde_json::{Value, json};
use tercet::{Approximation, Info, Limits, Precision};

use crate::console::Console;
use crate::feed::Feed;
use crate::{Outcome, files, report};

#[derive(Debug, clap::Args)]
pub struct InfoArgs {
    /// A .tct file; - for standard input.
    #[arg(value_name = "FILE.tct")]
    pub file: PathBuf,
    /// Print JSON.
    #[arg(long)]
    pub json: bool,
}

pub fn info(args: &InfoArgs, limits: &Limits, console: &Console) -> Result<Outcome> {
    let info = Feed::open(&args.file, None, limits)?.info()?;
    if let Some(present) = size(args).filter(|&present| present < info.bytes) {
        let cut = format!("truncated after {present} of {} bytes", info.bytes);
        console.warn(&files::name(&args.file), &cut);
    }
    console.answer(&if args.json { format!("{:#}", as_json(&info)) } else { as_text(&info) })?;
    Ok(Outcome::Good)
}

/// The file's size, where it has one.
fn size(args: &InfoArgs) -> Option<u64> {
    let metadata = std::fs::metadata(&args.file).ok()?;
    (!files::is_standard(&args.file) && metadata.is_file()).then_some(metadata.len())
}

fn as_text(info: &Info) -> String {
    format!(
        "version    {}\neffort     {}\nprecision  {}\norder      {}\nvertices   {}\nfaces      {}\n{}{}",
        info.version,
        report::effort(info.effort),
        report::precision(&info.precision),
        report::order(info),
        info.vertices,
        info.faces,
        info.approximation.as_ref().map_or(String::new(), source),
        report::levels(info),
    )
}

/// What a lossy file stands for, as a line.
fn source(of: &Approximation) -> String {
    format!(
        "lossy      RMS {}, greatest at most {}, of the diagonal, from a mesh of {} vertices and {} faces, digest {:016x}\n",
        report::error(of.rms),
        report::error(of.greatest),
        of.vertices,
        of.faces,
        of.digest,
    )
}

fn as_json(info: &Info) -> Value {
    let level = |level: &tercet::LevelInfo| {
        json!({
            "level": level.level,
            "kind": level.kind,
            "grouped": level.grouped,
            "update": report::update(level.update).unwrap_or("none"),
            "vertices": level.vertices,
            "faces": level.faces,
            "bytes": level.bytes,
            "error": level.error,
        })
    };
    let lossy = info.approximation.as_ref().map(|of| {
        json!({
            "vertices": of.vertices,
            "faces": of.faces,
            "digest": format!("{:016x}", of.digest),
            "rms": of.rms,
            "greatest": of.greatest,
        })
    });
    json!({
        "version": info.version,
        "effort": report::effort(info.effort),
        "precision": precision(&info.precision),
        "order_kept": info.order_kept,
        "vertices": info.vertices,
        "faces": info.faces,
        "lossy": lossy,
        "bytes": info.bytes,
        "levels": info.levels.iter().map(level).collect::<Vec<_>>(),
    })
}

fn precision(precision: &Precision) -> Value {
    match precision {
        Precision::Lattice { bits, origin, side } => {
            json!({ "kind": "lattice", "exact": false, "bits": bits, "origin": origin, "side": side })
        }
        Precision::Decimal { exponent, digits, origin } => {
            json!({ "kind": "decimal", "exact": true, "exponent": exponent, "digits": digits, "origin": origin })
        }
        Precision::Binary { exponent, origin } => {
            json!({ "kind": "binary", "exact": true, "exponent": exponent, "origin": origin })
        }
        Precision::Refined { exponent, origin } => {
            json!({ "kind": "refined", "exact": true, "exponent": exponent, "origin": origin })
        }
    }
}
