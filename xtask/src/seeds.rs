//! `cargo xtask seeds`: the files that depend on the format, as the present code writes them.
//!
//! These are what the decoder's fuzz target starts from, and the golden files beside the format document.

use crate::arguments::Arguments;
use crate::process::{command, root, run as run_shown};
use anyhow::{Context, Result};
use std::fs;

/// Replaces every `.tct` file among the seeds, then every golden file.
pub fn run(words: &[String]) -> Result<()> {
    Arguments::new(words).finish()?;
    let folder = root().join("fuzz/seeds/decode");
    for entry in fs::read_dir(&folder).with_context(|| format!("reading {}", folder.display()))? {
        let path = entry?.path();
        if path.extension().is_some_and(|suffix| suffix == "tct") {
            fs::remove_file(&path).with_context(|| format!("removing {}", path.display()))?;
        }
    }
    let seeds = ["run", "--quiet", "--locked", "--package=tercet", "--example", "seeds", "fuzz/seeds/decode"];
    run_shown(command("cargo", &seeds))?;
    let mut golden = command("cargo", &["test", "--quiet", "--locked", "--package=tercet", "--test=library"]);
    golden.args(["--", "--ignored", "--exact", "golden::write_the_golden_files"]);
    run_shown(golden)
}
