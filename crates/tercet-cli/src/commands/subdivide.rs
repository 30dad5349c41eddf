//! `tercet subdivide`.

use std::path::PathBuf;

use anyhow::{Context, Result};
use tercet::Limits;
use tercet::io::Format;

use crate::args::{self, Scheme};
use crate::console::Console;
use crate::{Outcome, files};

#[derive(Debug, clap::Args)]
pub struct SubdivideArgs {
    /// An OBJ, PLY, STL or OFF file; - for standard input.
    pub mesh: PathBuf,
    /// The mesh to write; - for standard output.
    #[arg(short, long, value_name = "OUT")]
    pub output: PathBuf,
    /// The subdivision scheme.
    #[arg(long)]
    pub scheme: Scheme,
    /// How many steps.
    #[arg(long, value_name = "N")]
    pub steps: u32,
    /// The format of MESH [default: by its suffix].
    #[arg(long, value_parser = args::format)]
    pub format: Option<Format>,
    /// The format of OUT [default: by its suffix].
    #[arg(long, value_name = "FORMAT", value_parser = args::format)]
    pub output_format: Option<Format>,
}

pub fn subdivide(args: &SubdivideArgs, limits: &Limits, console: &Console) -> Result<Outcome> {
    let format = files::format(&args.output, args.output_format)?;
    let mesh = files::read_mesh(&args.mesh, args.format, limits, console)?;
    let fine = tercet::subdivide(&mesh, args.scheme.into(), args.steps, limits);
    let fine = fine.with_context(|| files::name(&args.mesh))?;
    files::write_mesh(&fine, &args.output, format, console)?;
    let counts = format!("{} vertices, {} faces", fine.positions.len(), fine.faces.len());
    console.report(&format!("{}: {counts}", args.output.display()), &args.output)?;
    Ok(Outcome::Good)
}
