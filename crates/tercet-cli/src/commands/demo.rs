//! `tercet demo`: the whole program on one mesh, as a short story.

use std::path::PathBuf;

use std::time::Instant;

use anyhow::{Context, Result, bail};
use tercet::io::Format;
use tercet::{EncodeOptions, Encoded, Info, Level, Limits, Mesh};

use super::{decode, encode, verify};
use crate::console::Console;
use crate::{Outcome, args, files, input, report};

#[derive(Debug, clap::Args)]
pub struct DemoArgs {
    /// A mesh file [default: a generated one, like a scan].
    pub mesh: Option<PathBuf>,
    /// The format of MESH [default: by its suffix].
    #[arg(long, value_parser = args::format)]
    pub format: Option<Format>,
}

const VERTICES: usize = 20_000;
const SEED: u64 = 3;
/// The lattice of the second encoding: what a viewer needs.
const LATTICE_BITS: u8 = 12;
/// Where the file is cut off, in percent of its bytes.
const CUTS: [u64; 4] = [5, 10, 25, 50];

pub fn demo(args: &DemoArgs, limits: &Limits, console: &Console) -> Result<Outcome> {
    let (name, mesh) = match &args.mesh {
        Some(path) => (files::name(path), files::read_mesh(path, args.format, limits, console)?),
        None => ("a generated surface, irregular like a scan".into(), tercet::shapes::scan(VERTICES, SEED)),
    };
    let (vertices, faces) = (mesh.positions.len(), mesh.faces.len());
    console.answer(&format!("The mesh: {name}; {vertices} vertices, {faces} faces."))?;
    show(&mesh, limits, console).with_context(|| name)?;
    Ok(Outcome::Good)
}

fn show(mesh: &Mesh, limits: &Limits, console: &Console) -> Result<()> {
    let exact = EncodeOptions::default();
    let (encoded, seconds) = timed(|| encode::encode_shown(mesh, &exact, console))?;
    console.answer(&format!("\nEncoded in {seconds}, with every bit of every coordinate:\n"))?;
    console.answer(&encode::summary(&encoded))?;

    let (levels, seconds) = timed(|| input::all_levels(&encoded.bytes, limits))?;
    console.answer("\nCut off anywhere, the file is a coarser mesh:\n")?;
    for percent in CUTS {
        let cut = (encoded.bytes.len() as u64 * percent / 100) as usize;
        let kept = input::all_levels(&encoded.bytes[..cut], limits)?;
        console.answer(&format!(
            "  {percent:>3} % = {cut} bytes: {}",
            after_a_cut(&kept, &levels, &encoded.info)?
        ))?;
    }

    let how = check(mesh, &levels, &encoded)?;
    console.answer(&format!("\nWhole, it was decoded in {seconds}:\n  {how}."))?;

    let lattice = EncodeOptions { bits: Some(LATTICE_BITS), keep_order: true, ..exact };
    let encoded = encode::encode_shown(mesh, &lattice, console)?;
    let how = check(mesh, &input::all_levels(&encoded.bytes, limits)?, &encoded)?;
    let bits = report::bits_per_vertex(encoded.info.bytes, &encoded.info);
    console.answer(&format!(
        "\nWith --bits {LATTICE_BITS} --keep-order it takes {} bytes, {bits:.3} bits per vertex:\n  {how}.",
        encoded.info.bytes
    ))?;
    Ok(())
}

/// What a cut left, if it is the same as in the whole file.
fn after_a_cut(kept: &[Level], whole: &[Level], info: &Info) -> Result<String> {
    let Some(best) = kept.last() else {
        return Ok("not yet the base mesh".into());
    };
    if whole.get(kept.len() - 1).is_none_or(|level| level.mesh != best.mesh) {
        bail!("level {} differs between the whole file and its beginning", best.level);
    }
    Ok(decode::describe(best, info))
}

/// How the decoded mesh is the original.
fn check(mesh: &Mesh, levels: &[Level], encoded: &Encoded) -> Result<String> {
    let Some(last) = levels.last().filter(|level| level.restored) else {
        bail!("the whole file does not restore the mesh");
    };
    verify::judge(mesh.clone(), &last.mesh, &encoded.info)
        .map_err(|what| anyhow::anyhow!("the decoded mesh is not the original: {what}"))
}

/// A result and how long it took to come by.
fn timed<T>(work: impl FnOnce() -> tercet::Result<T>) -> tercet::Result<(T, String)> {
    let start = Instant::now();
    let result = work()?;
    Ok((result, format!("{:.2} s", start.elapsed().as_secs_f64())))
}
