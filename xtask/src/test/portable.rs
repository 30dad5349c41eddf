//! The same digests on a platform with another word size.
//!
//! The program `digests` is built for the host and for 32-bit x86, both with overflow checks, and
//! must print the same lines on both. The 32-bit standard library comes from rustup where that can
//! be, otherwise it is built from the sources that Debian packages with a compiler of its own.

use super::rust::promised_version;
use super::{Outcome, Setting};
use crate::process::{capture, command, debian_packages, succeeds};
use anyhow::{Context, Result, bail};
use std::process::Command;

const TARGET: &str = "i686-unknown-linux-gnu";
const DIGESTS: [&str; 6] = ["run", "--quiet", "--locked", "--package=tercet", "--example", "digests"];

pub fn compare_digests(setting: &Setting) -> Result<Outcome> {
    if !cfg!(all(target_os = "linux", target_arch = "x86_64")) {
        return Ok(Outcome::Skipped("32-bit x86 programs run on 64-bit x86 Linux only".into()));
    }
    let (mut foreign, toolchain) = match foreign_cargo() {
        Ok(found) => found,
        Err(why) => return Ok(Outcome::Skipped(format!("no 32-bit toolchain: {why:#}"))),
    };
    foreign.args(DIGESTS).args(["--target", TARGET]);
    // The standard library is wanted soon rather than fast.
    foreign.args(["--config", "profile.dev.debug=false"]);
    foreign.args(["--config", "profile.dev.package.\"*\".opt-level=0"]);
    foreign.env("CARGO_TARGET_DIR", setting.target.join("portable"));
    let here = capture(command("cargo", &DIGESTS))?;
    let there = capture(foreign)?;
    if here.lines().next().is_none() {
        bail!("the program `digests` printed nothing");
    }
    let mut pairs = here.lines().zip(there.lines());
    if let Some((ours, theirs)) = pairs.find(|(ours, theirs)| ours != theirs) {
        bail!("the platforms differ\nhost:     {ours}\n{TARGET}: {theirs}");
    }
    if here.lines().count() != there.lines().count() {
        bail!("the platforms print different numbers of digests");
    }
    Ok(Outcome::Passed(format!("{} digests equal on {TARGET} ({toolchain})", here.lines().count())))
}

/// A cargo that can build for [`TARGET`], and whose compiler it uses.
fn foreign_cargo() -> Result<(Command, String)> {
    let installed = capture(command("rustup", &["target", "list", "--installed"])).unwrap_or_default();
    if installed.lines().any(|line| line == TARGET) {
        debian_packages(&["gcc-multilib"])?;
        return Ok((command("cargo", &[]), "rustup".into()));
    }
    match debian_cargo() {
        Ok(found) => Ok(found),
        Err(_) if succeeds(command("rustup", &["target", "add", TARGET])) => {
            Ok((command("cargo", &[]), "rustup".into()))
        }
        Err(why) => Err(why.context(format!("rustup cannot add {TARGET}"))),
    }
}

/// Cargo with Debian's compiler, which brings the standard library's sources.
fn debian_cargo() -> Result<(Command, String)> {
    debian_packages(&["rustc-web", "rust-web-src", "gcc-multilib"])?;
    let files = capture(command("dpkg-query", &["--listfiles", "rustc-web"]))?;
    let rustc = files.lines().find(|file| file.ends_with("/bin/rustc"));
    let rustc = rustc.context("the package rustc-web holds no rustc")?;
    let version = capture(command(rustc, &["--version"]))?;
    if minor(version.split_whitespace().nth(1)) < minor(Some(&promised_version()?)) {
        bail!("Debian's {} is too old", version.trim());
    }
    let mut cargo = command("cargo", &["-Zbuild-std=std,panic_abort", "-Zbuild-std-features=panic-unwind"]);
    // -Zbuild-std is not stable; nothing else here depends on it.
    cargo.env("RUSTC", rustc).env("RUSTC_BOOTSTRAP", "1");
    Ok((cargo, version.trim().into()))
}

/// The 95 of "1.95.0".
fn minor(version: Option<&str>) -> Option<u32> {
    version?.split('.').nth(1)?.parse().ok()
}
