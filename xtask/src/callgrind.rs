//! Instructions, which noise cannot touch, as valgrind's tool callgrind counts them.

use crate::process::{command, debian_packages};
use anyhow::{Context, Result, ensure};
use std::path::Path;

/// Installs valgrind if need be.
pub fn set_up() -> Result<()> {
    debian_packages(&["valgrind"])
}

/// Instructions that the program takes, some fifty times as slow as without being counted.
pub fn instructions(program: &Path, words: &[&str]) -> Result<u64> {
    let mut counter = command("valgrind", &["--tool=callgrind", "--callgrind-out-file=/dev/null"]);
    counter.arg(program).args(words);
    let output = counter.output().context("starting valgrind")?;
    let report = String::from_utf8_lossy(&output.stderr);
    ensure!(output.status.success(), "valgrind: {}\n{}", output.status, report.trim_end());
    let count = report.lines().find_map(|line| line.split_once("Collected : "));
    let (_, count) = count.context("valgrind told no count")?;
    count.trim().parse().context("a count of instructions")
}
