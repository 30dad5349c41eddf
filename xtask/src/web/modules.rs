//! The WebAssembly modules: the decoder, the encoder with the mesh readers, and the receiver of datagrams.

use super::Node;
use crate::foreign::{ForeignCargo, cargo_for};
use crate::process::{available, capture, command, debian_packages, run};
use anyhow::{Context, Result, bail};
use std::fs;
use std::io::Write;
use std::path::{Path, PathBuf};
use std::process::Stdio;

const TARGET: &str = "wasm32-unknown-unknown";
/// Features that every browser has had since 2023.
const FEATURES: &str =
    "-Ctarget-feature=+simd128,+bulk-memory,+sign-ext,+nontrapping-fptoint,+mutable-globals";
/// Small functions inline, others not: two thirds of the size at the same speed (docs/experiments.md).
const INLINING: &str = "-Cllvm-args=-inline-threshold=20";
/// Where a panic happened is not said, nor what a value looked like: a page could do nothing with it,
/// and the module would hold the paths of the machine that it was built on.
const WITHOUT_WORDS: [&str; 2] = ["-Zlocation-detail=none", "-Zfmt-debug=none"];

/// The modules, as they are shipped.
pub struct Modules {
    pub decoder: Vec<u8>,
    pub encoder: Vec<u8>,
    pub receiver: Vec<u8>,
    /// What made them.
    pub compiler: String,
}

impl Modules {
    /// Builds all. `target` is where cargo builds.
    pub fn build(node: &Node, target: &Path) -> Result<Modules> {
        let (decoder, compiler) = module(node, target, "tercet-wasm", &[])?;
        let (encoder, _) = module(node, target, "tercet-wasm", &["--features=encoder"])?;
        let (receiver, _) = module(node, target, "tercet-receiver-wasm", &[])?;
        Ok(Modules { decoder, encoder, receiver, compiler })
    }

    /// Their names in the package.
    pub fn files(&self) -> [(&'static str, &[u8]); 3] {
        [("decoder.wasm", &self.decoder), ("encoder.wasm", &self.encoder), ("receiver.wasm", &self.receiver)]
    }
}

fn module(node: &Node, target: &Path, package: &str, features: &[&str]) -> Result<(Vec<u8>, String)> {
    let folder = target.join("web");
    let ForeignCargo { mut cargo, mut toolchain, builds_std } = cargo_for(TARGET, &["lld-19"])?;
    let mut flags = vec![FEATURES, INLINING];
    if builds_std {
        flags.extend(WITHOUT_WORDS);
        cargo.args(["-Zbuild-std-features=optimize_for_size", "-Zpanic-immediate-abort"]);
        cargo.args(["--config", "profile.web.panic=\"immediate-abort\""]);
        cargo.env("CARGO_TARGET_WASM32_UNKNOWN_UNKNOWN_LINKER", "wasm-ld-19");
    } else {
        toolchain = capture(command("rustc", &["--version"]))?.trim().to_owned();
    }
    let build = ["build", "--quiet", "--locked", "--profile=web", "--package", package, "--target", TARGET];
    cargo.args(build).args(features);
    cargo.env_remove("RUSTFLAGS").env_remove("CARGO_ENCODED_RUSTFLAGS");
    cargo.env("CARGO_TARGET_WASM32_UNKNOWN_UNKNOWN_RUSTFLAGS", flags.join(" "));
    cargo.env("CARGO_TARGET_DIR", &folder);
    run(cargo)?;
    let linked = folder.join(TARGET).join("web").join(package.replace('-', "_")).with_extension("wasm");
    Ok((optimised(node, &linked)?, toolchain))
}

/// What binaryen makes of a module. (Debian's version of it breaks modules: npm's is used.)
fn optimised(node: &Node, linked: &Path) -> Result<Vec<u8>> {
    let out: PathBuf = linked.with_extension("optimised.wasm");
    let features = [
        "--enable-simd",
        "--enable-bulk-memory",
        "--enable-sign-ext",
        "--enable-nontrapping-float-to-int",
        "--enable-mutable-globals",
    ];
    let strip = ["--strip-debug", "--strip-producers", "--strip-target-features"];
    let mut optimise = node.tool("wasm-opt", &["-Os"]);
    optimise.args(features).args(strip).arg(linked).arg("-o").arg(&out);
    run(optimise)?;
    fs::read(&out).with_context(|| format!("reading {}", out.display()))
}

/// How many bytes `gzip -9` makes of these.
pub fn gzipped(bytes: &[u8]) -> Result<u64> {
    if !available("gzip") {
        debian_packages(&["gzip"])?;
    }
    let mut gzip = command("gzip", &["-9", "--no-name"]);
    let mut child = gzip.stdin(Stdio::piped()).stdout(Stdio::piped()).spawn().context("starting gzip")?;
    let mut input = child.stdin.take().context("writing to gzip")?;
    let output = std::thread::scope(|scope| {
        // In another thread: both pipes would fill up.
        scope.spawn(move || input.write_all(bytes));
        child.wait_with_output()
    })?;
    if !output.status.success() {
        bail!("gzip: {}", output.status);
    }
    Ok(output.stdout.len() as u64)
}
