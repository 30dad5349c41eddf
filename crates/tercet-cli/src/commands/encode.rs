//! `tercet encode`.

use anyhow::{Context, Result};
use tercet::{EncodeOptions, Encoded, Limits, Mesh};

use crate::console::Console;
use crate::{Outcome, args, files, report};

pub fn encode(args: &args::Encode, limits: &Limits, console: &Console) -> Result<Outcome> {
    let output = args.output.clone().unwrap_or_else(|| files::with_suffix(&args.mesh, "tct"));
    let mesh = files::read_mesh(&args.mesh, args.format, limits, console)?;
    let options = EncodeOptions { bits: args.bits, keep_order: args.keep_order, update: args.update.into() };
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
