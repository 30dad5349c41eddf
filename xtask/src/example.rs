//! Programs of the library's own, in `crates/tercet/examples`.

use crate::process::{capture, command};
use anyhow::Result;
use std::path::{Path, PathBuf};

/// How a program is compiled.
#[derive(Clone, Copy)]
pub enum Profile {
    /// As tests are, with overflow checks.
    Dev,
    Release,
}

/// Builds an example and returns its path. `target` is where cargo builds.
///
/// The command is named along with the library, whose features are then those of the command's: all share one
/// compiled library.
pub fn example(name: &str, profile: Profile, target: &Path) -> Result<PathBuf> {
    let mut build = command("cargo", &["build", "--quiet", "--locked"]);
    build.args(["--package=tercet", "--package=tercet-cli", "--example", name]);
    let folder = match profile {
        Profile::Dev => "debug",
        Profile::Release => {
            build.arg("--release");
            "release"
        }
    };
    capture(build.env("CARGO_TARGET_DIR", target))?;
    Ok(target.join(folder).join("examples").join(name))
}
