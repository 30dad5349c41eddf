//! The same digests on a platform with another word size.
//!
//! The program `digests` is built for the host, as the tests are, and for 32-bit x86, both with overflow
//! checks, and must print the same lines on both.

use super::{Outcome, Setting};
use crate::example::{Profile, example};
use crate::foreign::{ForeignCargo, cargo_for};
use crate::process::{capture, command};
use anyhow::{Result, bail};

const TARGET: &str = "i686-unknown-linux-gnu";
const DIGESTS: [&str; 6] = ["run", "--quiet", "--locked", "--package=tercet", "--example", "digests"];

pub fn compare_digests(setting: &Setting) -> Result<Outcome> {
    if !cfg!(all(target_os = "linux", target_arch = "x86_64")) {
        return Ok(Outcome::Skipped("32-bit x86 programs run on 64-bit x86 Linux only".into()));
    }
    let found = cargo_for(TARGET, &["gcc-multilib"]);
    let ForeignCargo { cargo: mut foreign, toolchain, builds_std } = match found {
        Ok(found) => found,
        Err(why) => return Ok(Outcome::Skipped(format!("no 32-bit toolchain: {why:#}"))),
    };
    if builds_std {
        foreign.arg("-Zbuild-std-features=panic-unwind");
    }
    foreign.args(DIGESTS).args(["--target", TARGET]);
    // The standard library is wanted soon rather than fast.
    foreign.args(["--config", "profile.dev.debug=false"]);
    foreign.args(["--config", "profile.dev.package.\"*\".opt-level=0"]);
    foreign.env("CARGO_TARGET_DIR", setting.target.join("portable"));
    let program = example("digests", Profile::Dev, &setting.target)?;
    let here = capture(command(&program.to_string_lossy(), &[]))?;
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
