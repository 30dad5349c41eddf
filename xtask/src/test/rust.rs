//! The stages that are one command of the Rust toolchain.

use super::{Outcome, Setting};
use crate::process::{available, capture, command, debian_packages, promised_version, root, run, succeeds};
use anyhow::{Context, Result, bail};
use std::io::{BufRead, BufReader};
use std::process::Stdio;

/// `cargo fmt --check` on both workspaces.
pub fn format(_: &Setting) -> Result<Outcome> {
    component("rustfmt", "fmt")?;
    run(command("cargo", &["fmt", "--all", "--check"]))?;
    run(command("cargo", &["fmt", "--manifest-path", "fuzz/Cargo.toml", "--check"]))?;
    Ok(Outcome::Passed(String::new()))
}

/// Clippy on everything; a warning fails.
pub fn clippy(_: &Setting) -> Result<Outcome> {
    component("clippy", "clippy")?;
    run(command("cargo", &["clippy", "--workspace", "--all-targets", "--locked", "--", "-D", "warnings"]))?;
    Ok(Outcome::Passed(String::new()))
}

/// The documentation, private items too; a warning fails.
pub fn docs(_: &Setting) -> Result<Outcome> {
    let words = ["doc", "--workspace", "--no-deps", "--document-private-items", "--locked"];
    let mut doc = command("cargo", &words);
    doc.env("RUSTDOCFLAGS", "-D warnings");
    run(doc)?;
    Ok(Outcome::Passed(String::new()))
}

/// Checks with the oldest compiler that the workspace promises to support.
pub fn msrv(setting: &Setting) -> Result<Outcome> {
    let promised = promised_version()?;
    let current = capture(command("rustc", &["--version"]))?;
    if current.split_whitespace().nth(1).is_some_and(|it| it.starts_with(&format!("{promised}."))) {
        return Ok(Outcome::Passed(format!("the other stages run on {promised}")));
    }
    let toolchain = format!("{promised}.0");
    let present = || succeeds(command("rustup", &["run", &toolchain, "cargo", "--version"]));
    let install = ["toolchain", "install", "--profile", "minimal", &toolchain];
    if !present() && !succeeds(command("rustup", &install)) {
        return Ok(Outcome::Skipped(format!("Rust {toolchain} is not installed and rustup cannot fetch it")));
    }
    let words = ["run", &toolchain, "cargo", "check", "--workspace", "--all-targets", "--locked"];
    let mut check = command("rustup", &words);
    check.env("CARGO_TARGET_DIR", setting.target.join("msrv"));
    run(check)?;
    Ok(Outcome::Passed(format!("Rust {toolchain}")))
}

/// Runs the README's `sh` blocks line by line; `cargo xtask` lines are this program's own.
pub fn readme(setting: &Setting) -> Result<Outcome> {
    let Ok(text) = std::fs::read_to_string(root().join("README.md")) else {
        return Ok(Outcome::Skipped("there is no README.md".into()));
    };
    run(command("cargo", &["build", "--release", "--locked"]))?;
    let path = std::env::var_os("PATH").unwrap_or_default();
    let path = std::env::join_paths(
        std::iter::once(setting.target.join("release")).chain(std::env::split_paths(&path)),
    )?;
    let mut lines = 0;
    for line in shell_lines(&text).filter(|line| !line.starts_with("cargo xtask")) {
        let mut shell = command("sh", &["-euc", line]);
        shell.env("PATH", &path);
        run(shell)?;
        lines += 1;
    }
    Ok(Outcome::Passed(format!("{lines} commands")))
}

/// The lines inside ```` ```sh ```` fences, without comments and empty lines.
fn shell_lines(markdown: &str) -> impl Iterator<Item = &str> {
    let mut inside = false;
    markdown.lines().map(str::trim).filter(move |line| {
        if line.starts_with("```") {
            inside = !inside && *line == "```sh";
            return false;
        }
        inside && !line.is_empty() && !line.starts_with('#')
    })
}

/// `cargo test`, its output passed on, and its counts added up over all test programs.
pub fn tests(_: &Setting) -> Result<Outcome> {
    // For the test between network namespaces, which says so where it cannot be tried.
    if let Err(why) = debian_packages(&["iproute2", "nftables"]) {
        println!("{why:#}");
    }
    let mut cargo = command("cargo", &["test", "--workspace", "--locked"]);
    match std::env::var("TERCET_CORPUS") {
        Ok(folder) => println!("real meshes: {folder}"),
        Err(_) => println!("TERCET_CORPUS is not set: generated meshes only"),
    }
    let mut child = cargo.stdout(Stdio::piped()).spawn().context("starting cargo test")?;
    let output = child.stdout.take().context("reading cargo test's output")?;
    let (mut passed, mut failed, mut ignored) = (0, 0, 0);
    for line in BufReader::new(output).lines() {
        let line = line?;
        println!("{line}");
        passed += count(&line, "passed");
        failed += count(&line, "failed");
        ignored += count(&line, "ignored");
    }
    let status = child.wait()?;
    if !status.success() {
        bail!("cargo test: {status}, {failed} failed");
    }
    if passed == 0 {
        bail!("cargo test ran no test");
    }
    println!("\n{passed} passed, {failed} failed, {ignored} skipped");
    Ok(Outcome::Passed(format!("{passed} tests")))
}

/// The number before `word` in libtest's closing line; 0 in any other line.
fn count(line: &str, word: &str) -> u64 {
    let Some((_, counts)) = line.strip_prefix("test result: ").and_then(|rest| rest.split_once(". ")) else {
        return 0;
    };
    let part = counts.split("; ").find_map(|part| part.strip_suffix(word));
    part.and_then(|number| number.trim().parse().ok()).unwrap_or(0)
}

/// Sees to it that `cargo SUBCOMMAND`, which rustup ships as `component`, is there.
fn component(component: &str, subcommand: &str) -> Result<()> {
    if succeeds(command("cargo", &[subcommand, "--version"])) {
        return Ok(());
    }
    if !available("rustup") {
        bail!("cargo {subcommand} is missing; install {component}");
    }
    run(command("rustup", &["component", "add", component]))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn counts_come_from_the_closing_line_only() {
        let closing = "test result: ok. 12 passed; 0 failed; 3 ignored; 0 measured; 0 filtered out";
        assert_eq!((count(closing, "passed"), count(closing, "ignored")), (12, 3));
        assert_eq!(count("test a::b ... 12 passed; ok", "passed"), 0);
    }

    #[test]
    fn only_shell_fences_of_the_readme_are_run() {
        let text = "run\n```sh\n# comment\nls -l\n\n```\n```text\nno\n```\n```sh\ntrue\n```\n";
        assert_eq!(shell_lines(text).collect::<Vec<_>>(), ["ls -l", "true"]);
    }
}
