//! The WebAssembly modules: the decoder, the encoder with the mesh readers, and the receiver of datagrams.

use super::Node;
use crate::foreign::{ForeignCargo, cargo_for};
use crate::process::{at_once, available, capture, command, debian_packages, run};
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
    /// Builds all at once, each in a folder of its own: most of the time one thread links a module. `target`
    /// is where cargo builds.
    pub fn build(node: &Node, target: &Path) -> Result<Modules> {
        let modules: [(_, _, &[&str]); 3] = [
            ("decoder", "tercet-wasm", &[]),
            ("encoder", "tercet-wasm", &["--features=encoder"]),
            ("receiver", "tercet-receiver-wasm", &[]),
        ];
        // One after the other, as this may install something.
        let cargos: Vec<ForeignCargo> =
            modules.iter().map(|_| cargo_for(TARGET, &["lld-19"])).collect::<Result<_>>()?;
        let compiler = match cargos[0].builds_std {
            true => cargos[0].toolchain.clone(),
            false => capture(command("rustc", &["--version"]))?.trim().to_owned(),
        };
        let built = at_once(modules.into_iter().zip(cargos).map(|((name, package, features), cargo)| {
            move || module(node, cargo, &target.join("web").join(name), package, features)
        }));
        let mut built = built.into_iter();
        let mut next = || built.next().context("as many as there are modules")?;
        Ok(Modules { decoder: next()?, encoder: next()?, receiver: next()?, compiler })
    }

    /// Their names in the package.
    pub fn files(&self) -> [(&'static str, &[u8]); 3] {
        [("decoder.wasm", &self.decoder), ("encoder.wasm", &self.encoder), ("receiver.wasm", &self.receiver)]
    }
}

/// Builds a module. `folder` is where cargo builds.
fn module(
    node: &Node,
    foreign: ForeignCargo,
    folder: &Path,
    package: &str,
    features: &[&str],
) -> Result<Vec<u8>> {
    let ForeignCargo { mut cargo, builds_std, .. } = foreign;
    let mut flags = vec![FEATURES, INLINING];
    if builds_std {
        flags.extend(WITHOUT_WORDS);
        cargo.args(["-Zbuild-std-features=optimize_for_size", "-Zpanic-immediate-abort"]);
        cargo.args(["--config", "profile.web.panic=\"immediate-abort\""]);
        cargo.env("CARGO_TARGET_WASM32_UNKNOWN_UNKNOWN_LINKER", "wasm-ld-19");
    }
    let build = ["build", "--quiet", "--locked", "--profile=web", "--package", package, "--target", TARGET];
    cargo.args(build).args(features);
    cargo.env_remove("RUSTFLAGS").env_remove("CARGO_ENCODED_RUSTFLAGS");
    cargo.env("CARGO_TARGET_WASM32_UNKNOWN_UNKNOWN_RUSTFLAGS", flags.join(" "));
    cargo.env("CARGO_TARGET_DIR", folder);
    run(cargo)?;
    let linked = folder.join(TARGET).join("web").join(package.replace('-', "_")).with_extension("wasm");
    optimised(node, &linked)
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
