//! A short run of every fuzz target: libFuzzer on the stable toolchain.
//!
//! `cargo fuzz` asks for a nightly compiler for the sake of AddressSanitizer. The code under test is
//! safe Rust, so coverage alone will do, and that the stable compiler can insert
//! (`fuzz/rustc-with-coverage`).

use super::{Outcome, Setting};
use crate::process::{at_once, available, command, debian_packages, root, run};
use anyhow::{Context, Result, bail};
use std::fs;
use std::path::Path;

pub fn run_all(setting: &Setting) -> Result<Outcome> {
    if !available("c++") {
        debian_packages(&["g++"])?;
    }
    let target_dir = setting.target.join("fuzz");
    let mut build =
        command("cargo", &["build", "--release", "--locked", "--manifest-path", "fuzz/Cargo.toml"]);
    build.env("RUSTC_WRAPPER", root().join("fuzz/rustc-with-coverage"));
    build.env("CARGO_TARGET_DIR", &target_dir);
    run(build)?;

    let targets = targets()?;
    let cores = std::thread::available_parallelism().map_or(1, |cores| cores.get());
    let programs = target_dir.join("release");
    let try_one = |target: &String| {
        run_one(target, &programs.join(target), setting).with_context(|| format!("fuzz target {target}"))
    };
    for together in targets.chunks(cores) {
        at_once(together.iter().map(|target| || try_one(target))).into_iter().collect::<Result<()>>()?;
    }
    let seconds = setting.fuzz_time.as_secs();
    Ok(Outcome::Passed(format!("{} targets, {seconds} s each", targets.len())))
}

/// The names of the fuzz targets, one for each file in `fuzz/fuzz_targets`.
fn targets() -> Result<Vec<String>> {
    let mut names = Vec::new();
    for entry in fs::read_dir(root().join("fuzz/fuzz_targets")).context("reading fuzz/fuzz_targets")? {
        let path = entry?.path();
        names.extend(path.file_stem().map(|stem| stem.to_string_lossy().into_owned()));
    }
    names.sort();
    Ok(names)
}

/// Runs one target on what earlier runs found, the committed seeds and the kept findings.
fn run_one(target: &str, program: &Path, setting: &Setting) -> Result<()> {
    let found = setting.target.join("fuzz-corpus").join(target);
    let artifacts = root().join("fuzz/artifacts").join(target);
    fs::create_dir_all(&found)?;
    fs::create_dir_all(&artifacts)?;
    let mut fuzz = command(&program.to_string_lossy(), &[]);
    fuzz.arg(format!("-max_total_time={}", setting.fuzz_time.as_secs()));
    fuzz.arg(format!("-artifact_prefix={}/", artifacts.display()));
    fuzz.args(["-timeout=10", "-max_len=4096", "-print_final_stats=1"]).arg(found);
    // Folders after the first are read only.
    let committed = ["seeds", "regressions"].map(|kind| root().join("fuzz").join(kind).join(target));
    fuzz.args(committed.iter().filter(|folder| folder.is_dir()));

    let output = fuzz.output().with_context(|| format!("starting {}", program.display()))?;
    let log = String::from_utf8_lossy(&output.stderr);
    if !output.status.success() {
        // Lines with # tell of progress, not of the finding.
        log.lines().filter(|line| !line.starts_with('#')).for_each(|line| eprintln!("{line}"));
        bail!(
            "{}; the input is in {}: mend the cause and keep it as fuzz/regressions/{target}/CAUSE",
            output.status,
            artifacts.display()
        );
    }
    let statistic = |name: &str| {
        let value = log.lines().find_map(|line| line.strip_prefix(name)?.strip_prefix(':'));
        value.map_or("?", str::trim).to_owned()
    };
    let runs = statistic("stat::number_of_executed_units");
    println!("{target}: {runs} inputs, {} MB at most", statistic("stat::peak_rss_mb"));
    Ok(())
}
