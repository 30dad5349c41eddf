//! `tercet encode`.

use std::path::PathBuf;

use anyhow::{Context, Result};
use tercet::io::Format;
use tercet::{EncodeOptions, Encoded, Limits, Mesh};

use crate::args::{Effort, LevelScheme, Progressive, UpdateRule};
use crate::console::Console;
use crate::{Outcome, args, files, report};

#[derive(Debug, clap::Args)]
pub struct EncodeArgs {
    /// An OBJ, PLY, STL or OFF file; - for standard input.
    pub mesh: PathBuf,
    /// The file to write; - for standard output [default: MESH with the suffix .tct].
    #[arg(short, long, value_name = "OUT.tct")]
    pub output: Option<PathBuf>,
    /// Round positions to a cubic lattice of 2^N points along the longest side [default: keep
    /// every bit of every coordinate].
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u8).range(4..=24))]
    pub bits: Option<u8>,
    /// Restore the order of vertices and faces too.
    #[arg(long)]
    pub keep_order: bool,
    /// Which levels that need no connectivity to look for. Where the mesh is not refined by the
    /// scheme, and below the levels that are, levels are adaptive; the table names the kinds.
    #[arg(long, value_name = "SCHEME", default_value = "auto")]
    pub scheme: LevelScheme,
    /// Which comes first: good levels on the way, or few bytes.
    #[arg(long, value_name = "GOAL", default_value = "best")]
    pub progressive: Progressive,
    /// How vertices of √3 and butterfly levels make up for the ones removed.
    #[arg(long, value_name = "RULE", default_value = "none")]
    pub update: UpdateRule,
    /// How much work it may take to write and to read the file.
    #[arg(long, default_value = "default")]
    pub effort: Effort,
    /// The format of MESH [default: by its suffix].
    #[arg(long, value_parser = args::format)]
    pub format: Option<Format>,
}

pub fn encode(args: &EncodeArgs, limits: &Limits, console: &Console) -> Result<Outcome> {
    let output = args.output.clone().unwrap_or_else(|| files::with_suffix(&args.mesh, "tct"));
    let mesh = files::read_mesh(&args.mesh, args.format, limits, console)?;
    let options = EncodeOptions {
        bits: args.bits,
        keep_order: args.keep_order,
        update: args.update.into(),
        effort: args.effort.into(),
        scheme: args.scheme.into(),
        progressive: args.progressive.into(),
    };
    let encoded = encode_shown(&mesh, &options, console).with_context(|| files::name(&args.mesh))?;
    files::write_bytes(&encoded.bytes, &output)?;
    console.report(&summary(&encoded), &output)?;
    Ok(Outcome::Good)
}

/// Encodes and shows how far that has come.
pub fn encode_shown(mesh: &Mesh, options: &EncodeOptions, console: &Console) -> tercet::Result<Encoded> {
    let mut meter = console.meter();
    tercet::encode_with(mesh, options, &mut |at| meter.show(at.stage, at.done, at.total))
}

/// The levels, the total, and what its bits are for.
pub fn summary(encoded: &Encoded) -> String {
    let vertices = f64::from(encoded.info.vertices.max(1));
    format!(
        "{}\nof which connectivity {:.3}, positions {:.3} bits per vertex",
        report::levels(&encoded.info),
        encoded.connectivity_bits as f64 / vertices,
        encoded.position_bits as f64 / vertices,
    )
}
