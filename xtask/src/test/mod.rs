//! `cargo xtask test`: every check of the project, the quick ones first.

mod costs;
mod dependencies;
mod fuzz;
mod portable;
mod rust;
mod web;

pub use costs::record as record_costs;

use crate::arguments::Arguments;
use crate::process;
use anyhow::{Result, bail};
use std::path::PathBuf;
use std::sync::OnceLock;
use std::time::{Duration, Instant};

/// What a stage may ask of its surroundings.
pub struct Setting {
    /// Where cargo builds; stages with flags of their own build in a folder below it.
    target: PathBuf,
    /// How long each fuzz target runs.
    fuzz_time: Duration,
    /// What two stages try, built by the first of them.
    page: OnceLock<web::Page>,
}

/// How a stage that did not fail ended, and a word on what it did.
pub enum Outcome {
    Passed(String),
    /// This machine cannot run it; the text says why.
    Skipped(String),
}

struct Stage {
    name: &'static str,
    run: fn(&Setting) -> Result<Outcome>,
}

const STAGES: [Stage; 12] = [
    Stage { name: "format", run: rust::format },
    Stage { name: "clippy", run: rust::clippy },
    Stage { name: "docs", run: rust::docs },
    Stage { name: "tests", run: rust::tests },
    Stage { name: "msrv", run: rust::msrv },
    Stage { name: "dependencies", run: dependencies::check },
    Stage { name: "readme", run: rust::readme },
    Stage { name: "costs", run: costs::compare },
    Stage { name: "portable", run: portable::compare_digests },
    Stage { name: "web", run: web::package },
    Stage { name: "browser", run: web::browser },
    Stage { name: "fuzz", run: fuzz::run_all },
];

/// Runs the stages, and stops at the first that fails.
pub fn run(words: &[String]) -> Result<()> {
    let mut arguments = Arguments::new(words);
    let only = arguments.list::<String>("--only")?;
    let fuzz_seconds = arguments.value("--fuzz-seconds")?.unwrap_or(10);
    arguments.finish()?;
    let names = STAGES.map(|stage| stage.name);
    if let Some(unknown) = only.iter().flatten().find(|name| !names.contains(&name.as_str())) {
        bail!("no stage {unknown}; the stages are {}", names.join(", "));
    }

    let fuzz_time = Duration::from_secs(fuzz_seconds);
    let setting = Setting { target: process::target_dir()?, fuzz_time, page: OnceLock::new() };
    let chosen = |name: &str| only.as_ref().is_none_or(|only| only.iter().any(|chosen| chosen == name));
    let mut summary = String::from("\n");
    for stage in STAGES.iter().filter(|stage| chosen(stage.name)) {
        println!("\n=== {} ===", stage.name);
        let start = Instant::now();
        let outcome = (stage.run)(&setting);
        let seconds = start.elapsed().as_secs_f64();
        let (result, note) = match &outcome {
            Ok(Outcome::Passed(note)) => ("passed", note.as_str()),
            Ok(Outcome::Skipped(why)) => ("skipped", why.as_str()),
            Err(_) => ("FAILED", ""),
        };
        let line = format!("{:<13}{result:<8}{seconds:>7.1} s  {note}", stage.name);
        println!("--- {}", line.trim_end());
        summary += &format!("{}\n", line.trim_end());
        if let Err(error) = outcome {
            eprint!("{summary}");
            return Err(error.context(format!("stage {}", stage.name)));
        }
    }
    print!("{summary}");
    Ok(())
}
