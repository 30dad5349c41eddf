//! Building for a platform whose standard library is not at hand.
//!
//! It comes from rustup where that can be; otherwise it is built from the sources that Debian packages
//! with a compiler of its own.

use crate::process::{capture, command, debian_packages, promised_version, succeeds};
use anyhow::{Context, Result, bail};
use std::process::Command;

/// A cargo that can build for a platform.
pub struct ForeignCargo {
    /// To be given further `-Z` flags, then a subcommand: cargo forgets the flags before a subcommand
    /// if others follow it.
    pub cargo: Command,
    /// The compiler's version, or "rustup" for the one that builds everything else.
    pub toolchain: String,
    /// Whether the standard library is compiled along, so that flags may concern it.
    pub builds_std: bool,
}

/// A cargo for `target`; `linker` names the Debian packages that linking needs.
pub fn cargo_for(target: &str, linker: &[&str]) -> Result<ForeignCargo> {
    let installed = capture(command("rustup", &["target", "list", "--installed"])).unwrap_or_default();
    if installed.lines().any(|line| line == target) {
        debian_packages(linker)?;
        return Ok(of_rustup());
    }
    match of_debian(linker) {
        Ok(found) => Ok(found),
        Err(_) if succeeds(command("rustup", &["target", "add", target])) => Ok(of_rustup()),
        Err(why) => Err(why.context(format!("rustup cannot add {target}"))),
    }
}

fn of_rustup() -> ForeignCargo {
    ForeignCargo { cargo: command("cargo", &[]), toolchain: "rustup".into(), builds_std: false }
}

/// Cargo with Debian's compiler, which brings the standard library's sources.
fn of_debian(linker: &[&str]) -> Result<ForeignCargo> {
    debian_packages(&[&["rustc-web", "rust-web-src"], linker].concat())?;
    let files = capture(command("dpkg-query", &["--listfiles", "rustc-web"]))?;
    let rustc = files.lines().find(|file| file.ends_with("/bin/rustc"));
    let rustc = rustc.context("the package rustc-web holds no rustc")?;
    let version = capture(command(rustc, &["--version"]))?;
    if minor(version.split_whitespace().nth(1)) < minor(Some(&promised_version()?)) {
        bail!("Debian's {} is too old", version.trim());
    }
    let mut cargo = command("cargo", &["-Zbuild-std=std,panic_abort"]);
    // -Zbuild-std is not stable; nothing else here depends on it.
    cargo.env("RUSTC", rustc).env("RUSTC_BOOTSTRAP", "1");
    Ok(ForeignCargo { cargo, toolchain: version.trim().into(), builds_std: true })
}

/// The 95 of "1.95.0".
fn minor(version: Option<&str>) -> Option<u32> {
    version?.split('.').nth(1)?.parse().ok()
}
