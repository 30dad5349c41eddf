//! `tercet compare`: the paper's comparison of the two schemes, on any mesh.

mod measure;
mod subject;

use std::path::PathBuf;

use anyhow::{Context, Result};
use serde_json::{Value, json};
use tercet::io::Format;
use tercet::metrics::MetricsOptions;
use tercet::{Limits, Mesh, Scheme, Update};

use crate::console::Console;
use crate::table::Table;
use crate::{Outcome, args, files, report as words};
use measure::{AsPrinted, Budget, Variant, as_printed, budgets, variants};
use subject::Subject;

#[derive(Debug, clap::Args)]
pub struct CompareArgs {
    /// A mesh file; - for standard input.
    pub mesh: PathBuf,
    /// Reverse steps to compare, and refinements of a mesh that has to be resampled.
    #[arg(long, value_name = "N", default_value_t = 2, value_parser = clap::value_parser!(u32).range(1..=8))]
    pub levels: u32,
    /// Round positions to a cubic lattice of 2^N points along the longest side.
    #[arg(long, value_name = "N", default_value_t = 12, value_parser = clap::value_parser!(u8).range(4..=24))]
    pub bits: u8,
    /// Samples for each error.
    #[arg(long, value_name = "N", default_value_t = 50_000)]
    pub samples: usize,
    /// Print JSON.
    #[arg(long)]
    pub json: bool,
    /// The format of MESH [default: by its suffix].
    #[arg(long, value_parser = args::format)]
    pub format: Option<Format>,
}

/// How closely to look.
#[derive(Clone, Copy, Debug)]
pub struct Plan {
    /// Reverse steps.
    pub levels: u32,
    /// Of the lattice.
    pub bits: u8,
    /// How errors are measured.
    pub metrics: MetricsOptions,
}

const SCHEMES: [Scheme; 2] = [Scheme::Sqrt3, Scheme::Butterfly];

pub fn compare(args: &CompareArgs, limits: &Limits, console: &Console) -> Result<Outcome> {
    let name = files::name(&args.mesh);
    let mesh = files::read_mesh(&args.mesh, args.format, limits, console)?;
    let metrics = MetricsOptions { samples: args.samples, ..MetricsOptions::default() };
    let plan = Plan { levels: args.levels, bits: args.bits, metrics };
    let found = Schemes::new(&mesh, plan, limits, console).with_context(|| name)?;
    if args.json {
        console.answer(&format!("{:#}", found.as_json()))?;
    } else {
        let parts = found.tables().into_iter().map(|(title, table)| format!("{title}\n\n{}", table.lines()));
        console.answer(&parts.collect::<Vec<_>>().join("\n\n"))?;
    }
    Ok(Outcome::Good)
}

/// Both schemes on one mesh; arrays are in the order of `SCHEMES`.
pub struct Schemes {
    plan: Plan,
    subjects: [Subject; 2],
    budgets: Vec<Budget>,
    variants: [Vec<Variant>; 2],
    printed: [Option<AsPrinted>; 2],
}

impl Schemes {
    /// Resamples where a scheme does not fit, encodes and measures.
    ///
    /// # Errors
    /// If the mesh has no surface, or cannot be resampled.
    pub fn new(mesh: &Mesh, plan: Plan, limits: &Limits, console: &Console) -> Result<Self> {
        let subject = |scheme| Subject::new(mesh, scheme, plan, limits, console);
        let subjects = [subject(SCHEMES[0])?, subject(SCHEMES[1])?];
        let budgets = budgets(mesh, &subjects, &plan.metrics)?;
        let mut of_variants = [Vec::new(), Vec::new()];
        let mut printed = [None, None];
        for (i, subject) in subjects.iter().enumerate() {
            let found = variants(subject, plan, limits, console)?;
            printed[i] = as_printed(&found);
            of_variants[i] = found;
        }
        Ok(Schemes { plan, subjects, budgets, variants: of_variants, printed })
    }

    /// The tables with their titles.
    pub fn tables(&self) -> Vec<(String, Table)> {
        let what = self.subjects.iter().map(|s| format!("{}: {}", s.name(), s.origin)).collect::<Vec<_>>();
        let bits = self.plan.bits;
        vec![
            (format!("Reverse steps. {}.", what.join("; ")), self.steps()),
            (
                format!(
                    "Cost on a {bits}-bit lattice, and the RMS distance from the mesh at equal bytes, as a part of \
                     its diagonal."
                ),
                self.costs(),
            ),
            (
                "Updates: what each costs, the RMS distance of the levels after one and two reverse steps, and \
                 whether the step is undone. As printed it is not: analysis and synthesis both subtract."
                    .into(),
                self.updates(),
            ),
        ]
    }

    /// The paper's Table 1.
    fn steps(&self) -> Table {
        let [a, b] = self.subjects.each_ref().map(Subject::name);
        let heads =
            ["step".to_string(), format!("{a} vertices"), "rate".into(), "faces".into(), "rate".into()];
        let more = [format!("{b} vertices"), "rate".into(), "faces".into(), "rate".into()];
        let mut table = Table::with_heads(heads.into_iter().chain(more).collect());
        let most = self.subjects.iter().map(|s| s.counts().len()).max().unwrap_or_default();
        for step in 0..most {
            let mut row = vec![if step == 0 { "original".into() } else { format!("after {step}") }];
            for subject in &self.subjects {
                let counts = subject.counts();
                let before = step.checked_sub(1).and_then(|before| counts.get(before));
                for k in 0..2 {
                    let now = counts.get(step).map(|now| now[k]);
                    row.push(now.map_or(String::new(), |now| now.to_string()));
                    let rate = now.zip(before).map(|(now, before)| words::rate(before[k], now));
                    row.push(rate.unwrap_or_default());
                }
            }
            table.wide_row(row);
        }
        table
    }

    fn costs(&self) -> Table {
        let [a, b] = self.subjects.each_ref().map(|s| s.name().to_string());
        let mut table = Table::with_heads(vec!["what".into(), a, b]);
        let mut row = |name: String, of: &dyn Fn(&Subject) -> String| {
            table.wide_row(vec![name, of(&self.subjects[0]), of(&self.subjects[1])]);
        };
        let per_vertex =
            |bits: u64, s: &Subject| format!("{:.3}", bits as f64 / f64::from(s.file.info.vertices.max(1)));
        row("vertices".into(), &|s| s.file.info.vertices.to_string());
        row("bytes".into(), &|s| s.file.info.bytes.to_string());
        row("bits per vertex".into(), &|s| per_vertex(8 * s.file.info.bytes, s));
        row("of which connectivity".into(), &|s| per_vertex(s.file.connectivity_bits, s));
        for Budget { bytes, errors } in &self.budgets {
            let errors = errors.map(|error| error.map_or("nothing yet".into(), |e| words::error(e as f32)));
            let [a, b] = errors;
            table.wide_row(vec![format!("error after {bytes} bytes"), a, b]);
        }
        table
    }

    fn updates(&self) -> Table {
        let mut table =
            Table::new(["update", "scheme", "bits per vertex", "error after 1", "error after 2", "undone"]);
        for (i, subject) in self.subjects.iter().enumerate() {
            for variant in &self.variants[i] {
                let bits = words::bits_per_vertex(variant.bytes, &subject.file.info);
                let error =
                    |k: usize| variant.errors.get(k).map_or(String::new(), |&e| words::error(e as f32));
                let (name, scheme) = (variant.name().into(), subject.name().into());
                table.row([name, scheme, format!("{bits:.3}"), error(0), error(1), "exactly".into()]);
            }
            if let Some(AsPrinted { wrong: [even, odd], rms }) = self.printed[i] {
                let (even, odd) = (100.0 * even, 100.0 * odd);
                let rms = words::error(rms as f32);
                let undone =
                    format!("not: {even:.0} % of even and {odd:.0} % of odd vertices are off, {rms} RMS");
                let [none, one, two] = [const { String::new() }; 3];
                table.row(["paper, as printed".into(), subject.name().into(), none, one, two, undone]);
            }
        }
        table
    }

    fn as_json(&self) -> Value {
        let scheme = |i: usize| {
            let subject = &self.subjects[i];
            let file = &subject.file;
            let steps = subject
                .counts()
                .iter()
                .map(|[v, f]| json!({ "vertices": v, "faces": f }))
                .collect::<Vec<_>>();
            let variants = self.variants[i].iter().map(|variant| {
                let update = words::update(variant.update).unwrap_or("none");
                json!({ "update": update, "bytes": variant.bytes, "errors": variant.errors })
            });
            let printed = self.printed[i].as_ref();
            json!({
                "scheme": subject.name(),
                "resampled": subject.resampled,
                "origin": subject.origin,
                "steps": steps,
                "bytes": file.info.bytes,
                "bits_per_vertex": words::bits_per_vertex(file.info.bytes, &file.info),
                "connectivity_bits": file.connectivity_bits,
                "updates": variants.collect::<Vec<_>>(),
                "as_printed": printed.map(|p| json!({ "wrong_even": p.wrong[0], "wrong_odd": p.wrong[1], "rms": p.rms })),
            })
        };
        let budget = |b: &Budget| json!({ "bytes": b.bytes, "errors": b.errors });
        json!({
            "bits": self.plan.bits,
            "schemes": [scheme(0), scheme(1)],
            "equal_bytes": self.budgets.iter().map(budget).collect::<Vec<_>>(),
        })
    }
}

impl Variant {
    fn name(&self) -> &'static str {
        match self.update {
            Update::None => "none",
            Update::Third => "normalised",
            Update::Paper => "paper, corrected sign",
        }
    }
}
