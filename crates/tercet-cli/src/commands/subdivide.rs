//! `tercet subdivide`.

use anyhow::{Context, Result};
use tercet::Limits;

use crate::args::{self, Scheme};
use crate::console::Console;
use crate::{Outcome, files};

pub fn subdivide(args: &args::Subdivide, limits: &Limits, console: &Console) -> Result<Outcome> {
    let format = files::format(&args.output, args.output_format)?;
    let mesh = files::read_mesh(&args.mesh, args.format, limits, console)?;
    let fine = match args.scheme {
        Scheme::Sqrt3 => tercet::subdivide(&mesh, args.steps, limits),
    };
    let fine = fine.with_context(|| files::name(&args.mesh))?;
    files::write_mesh(&fine, &args.output, format, console)?;
    let counts = format!("{} vertices, {} faces", fine.positions.len(), fine.faces.len());
    console.report(&format!("{}: {counts}", args.output.display()), &args.output)?;
    Ok(Outcome::Good)
}
