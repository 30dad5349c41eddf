//! `tercet encode`.

use std::path::{Path, PathBuf};

use anyhow::{Context, Result};
use tercet::approximate::{Approximated, Bound, Method, approximate};
use tercet::io::Format;
use tercet::{EncodeOptions, Encoded, Limits, Mesh, Scheme};

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
    /// Lossy: the smallest file found whose surface is this near, as a part of the bounding box's diagonal: the
    /// root mean square of distances, the larger of both directions, measured on the decoded mesh.
    #[arg(long, value_name = "E", value_parser = args::error, conflicts_with_all = ["bits", "keep_order", "max_bytes"])]
    pub max_error: Option<f32>,
    /// Lossy: the nearest surface found that fits in so many bytes; with K, M or G, times 1024.
    #[arg(long, value_name = "N", value_parser = args::size, conflicts_with_all = ["bits", "keep_order"])]
    pub max_bytes: Option<u64>,
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
    /// Code √3 and butterfly levels in groups of about a packet each, which can be shown in any order: for links that
    /// lose packets. Takes some 1 percent more, on fine lattices up to 4.
    #[arg(long, conflicts_with_all = ["max_error", "max_bytes"])]
    pub groups: bool,
    /// How much work it may take to write and to read the file.
    #[arg(long, default_value = "default")]
    pub effort: Effort,
    /// The format of MESH [default: by its suffix].
    #[arg(long, value_parser = args::format)]
    pub format: Option<Format>,
}

impl EncodeArgs {
    /// What a lossy file is asked for.
    fn bound(&self) -> Option<Bound> {
        let error = self.max_error.map(|error| Bound::MaxError(error.into()));
        error.or(self.max_bytes.map(Bound::MaxBytes))
    }
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
        groups: args.groups,
    };
    if let Some(bound) = args.bound() {
        return encode_lossy(args, &mesh, bound, &options, &output, limits, console);
    }
    let encoded = encode_shown(&mesh, &options, console).with_context(|| files::name(&args.mesh))?;
    files::write_bytes(&encoded.bytes, &output)?;
    console.report(&summary(&encoded), &output)?;
    Ok(Outcome::Good)
}

fn encode_lossy(
    args: &EncodeArgs,
    mesh: &Mesh,
    bound: Bound,
    options: &EncodeOptions,
    output: &Path,
    limits: &Limits,
    console: &Console,
) -> Result<Outcome> {
    let mut meter = console.meter();
    let show = &mut |at: tercet::Progress| meter.show(at.stage, at.done, at.total);
    let found = approximate(mesh, bound, options, limits, show);
    drop(meter);
    let found = found.with_context(|| files::name(&args.mesh))?;
    if let Some(cause) = &found.not_remeshed {
        console.warn(&files::name(&args.mesh), &format!("not remeshed, so only simplified: {cause}"));
    }
    files::write_bytes(&found.encoded.bytes, output)?;
    console.report(&format!("{}\n{}", summary(&found.encoded), nearness(&found)), output)?;
    Ok(Outcome::Good)
}

/// What a lossy file holds, and how near it is.
fn nearness(found: &Approximated) -> String {
    let what = match found.method {
        Method::Exact => "the mesh itself, every bit of it".into(),
        Method::Rounded => "the mesh itself on a lattice".into(),
        Method::Simplified => "a simplified mesh".into(),
        Method::Remeshed(scheme, steps) => {
            let scheme = match scheme {
                Scheme::Sqrt3 => "√3",
                Scheme::Butterfly => "butterfly",
            };
            format!("a remesh of {steps} {scheme} steps")
        }
    };
    let part = |length: f64| report::error((length / found.comparison.diagonal) as f32);
    format!(
        "{what}, the best of {} files tried\n\
         distance from the mesh: RMS {}, greatest {} to {}, of the diagonal; PSNR {}",
        found.trials,
        part(found.comparison.rms()),
        part(found.comparison.hausdorff()),
        part(found.comparison.hausdorff_at_most()),
        report::decibels(found.comparison.psnr()),
    )
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
