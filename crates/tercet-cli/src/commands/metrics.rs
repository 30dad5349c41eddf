//! `tercet metrics`.

use std::path::PathBuf;

use anyhow::{Context, Result, bail};
use serde_json::{Value, json};
use tercet::Limits;
use tercet::io::Format;
use tercet::metrics::{Comparison, Deviation, MetricsOptions, Side, compare};

use crate::console::Console;
use crate::table::Table;
use crate::{Outcome, args, files, input, report};

#[derive(Debug, clap::Args)]
pub struct MetricsArgs {
    /// A mesh or .tct file; - for standard input. Its diagonal is the unit.
    pub a: PathBuf,
    /// The mesh or .tct file to compare it with.
    pub b: PathBuf,
    /// Points sampled on each surface, evenly by area.
    #[arg(long, value_name = "N", default_value_t = MetricsOptions::default().samples)]
    pub samples: usize,
    /// The samples' seed.
    #[arg(long, value_name = "S", default_value_t = MetricsOptions::default().seed)]
    pub seed: u64,
    /// Print JSON.
    #[arg(long)]
    pub json: bool,
    /// The format of meshes [default: by their suffix].
    #[arg(long, value_parser = args::format)]
    pub format: Option<Format>,
}

pub fn metrics(args: &MetricsArgs, limits: &Limits, console: &Console) -> Result<Outcome> {
    if files::is_standard(&args.a) && files::is_standard(&args.b) {
        bail!("-: only one of the two can be standard input");
    }
    let a = input::mesh(&args.a, args.format, limits, console)?;
    let b = input::mesh(&args.b, args.format, limits, console)?;
    let options = MetricsOptions { samples: args.samples, seed: args.seed };
    let [name_a, name_b] = [&args.a, &args.b].map(|path| files::name(path));
    let found = compare(&a, &b, &options).with_context(|| format!("A = {name_a}, B = {name_b}"))?;
    let text = if args.json {
        format!("{:#}", as_json(&found, &options))
    } else {
        format!("A: {name_a}, {}\nB: {name_b}, {}\n\n{}", counts(&found.a), counts(&found.b), table(&found))
    };
    console.answer(&text)?;
    Ok(Outcome::Good)
}

/// "8 vertices (1 in no face), 12 faces (2 without area)".
fn counts(side: &Side) -> String {
    let aside = |count: usize, what: &str| match count {
        0 => String::new(),
        _ => format!(" ({count} {what})"),
    };
    format!(
        "{} vertices{}, {} faces{}",
        side.vertices,
        aside(side.unreferenced, "in no face, not measured"),
        side.faces,
        aside(side.degenerate, "without area"),
    )
}

fn table(found: &Comparison) -> String {
    let mut table = Table::new(["distance", "RMS", "mean", "greatest", "at most"]);
    let part = |length: f64| report::error((length / found.diagonal) as f32);
    let mut row = |name: &str, figures: [f64; 4]| {
        let [rms, mean, max, at_most] = figures.map(part);
        table.row([name.into(), rms, mean, max, at_most]);
    };
    let of = |side: &Deviation| [side.rms, side.mean, side.max, side.max_at_most];
    row("of A from B", of(&found.a_to_b));
    row("of B from A", of(&found.b_to_a));
    row("of both", [found.rms(), found.mean(), found.hausdorff(), found.hausdorff_at_most()]);
    format!(
        "{}\nas parts of A's diagonal, {}; the Hausdorff distance is from \"greatest\" to \"at most\"\nPSNR {}",
        table.lines(),
        found.diagonal,
        report::decibels(found.psnr()),
    )
}

fn as_json(found: &Comparison, options: &MetricsOptions) -> Value {
    let deviation = |side: &Deviation| {
        json!({
            "rms": side.rms,
            "mean": side.mean,
            "max": side.max,
            "max_at_most": side.max_at_most,
        })
    };
    let side = |side: &Side| {
        json!({
            "vertices": side.vertices,
            "unreferenced": side.unreferenced,
            "faces": side.faces,
            "degenerate": side.degenerate,
            "area": side.area,
        })
    };
    json!({
        "samples": options.samples,
        "seed": options.seed,
        "a": side(&found.a),
        "b": side(&found.b),
        "diagonal": found.diagonal,
        "a_to_b": deviation(&found.a_to_b),
        "b_to_a": deviation(&found.b_to_a),
        "rms": found.rms(),
        "mean": found.mean(),
        "hausdorff": found.hausdorff(),
        "hausdorff_at_most": found.hausdorff_at_most(),
        // Infinite, where there is no difference: null.
        "psnr": found.psnr(),
    })
}
