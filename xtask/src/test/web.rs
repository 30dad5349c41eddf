//! The web: the WebAssembly modules, the npm package and the viewer, in Node and in a real browser.

use super::{Outcome, Setting};
use crate::process::{available, command, debian_packages, root, run};
use crate::web::{self, Embedded, Web, gzipped};
use anyhow::{Context, Result, bail};
use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

/// Most that the decoder may take, gzipped. Pages should load 80 000 bytes at most; since format version 7 it
/// knows more than one way to code positions, and misses that (docs/experiments.md).
const DECODER_BUDGET: u64 = 87_000;

/// Builds all of it, compares it with what is embedded, and tests it in Node.
pub fn package(setting: &Setting) -> Result<Outcome> {
    let web = Web::build(&setting.target)?;
    let size = gzipped(&web.modules.decoder)?;
    println!("decoder.wasm: {} bytes, {size} gzipped; it needs no glue", web.modules.decoder.len());
    if size > DECODER_BUDGET {
        bail!("the decoder takes {size} bytes gzipped, more than {DECODER_BUDGET}");
    }
    run(web.node.tool("tsc", &["-p", "viewer"]))?;
    let viewer = viewer(setting);
    web.viewer(&viewer)?;
    let note = match web::compare(&web, &viewer)? {
        Embedded::Equal => "what is embedded is what the sources give".into(),
        Embedded::OtherCompiler(compiler) => {
            format!("embedded: the same page; its WebAssembly is by {compiler}, not {}", web.modules.compiler)
        }
        Embedded::Stale(files) => bail!("run `cargo xtask web` and commit: {} changed", files.join(", ")),
    };
    run(web.node.tool("tsc", &["-p", "test"]))?;
    let fixtures = fixtures(setting)?;
    // Also what is embedded is tried, whoever compiled it.
    for wasm in [root().join("web/dist"), web::embedded().join("assets")] {
        let mut tests = tests(&web, "test/out/node", &fixtures);
        run(tests.env("TERCET_WASM", wasm))?;
    }
    Ok(Outcome::Passed(format!("decoder {size} bytes gzipped; {note}")))
}

/// The viewer and the client in Chromium.
pub fn browser(setting: &Setting) -> Result<Outcome> {
    let chromium = ["chromium", "chromium-browser", "google-chrome"].into_iter().find(|name| available(name));
    if chromium.is_none() {
        debian_packages(&["chromium"])?;
    }
    let web = Web::build(&setting.target)?;
    let viewer = viewer(setting);
    web.viewer(&viewer)?;
    run(web.node.tool("tsc", &["-p", "test"]))?;
    let pictures = setting.target.join("screenshots");
    fs::create_dir_all(&pictures).context("making a folder for screenshots")?;
    let mut tests = tests(&web, "test/out/browser", &fixtures(setting)?);
    tests.env("TERCET_VIEWER", &viewer).env("TERCET_SCREENSHOTS", &pictures);
    tests.env("TERCET_CHROMIUM", chromium.unwrap_or("chromium"));
    // The server that the page is tried with: the program that the stage `readme` has built already.
    run(command("cargo", &["build", "--release", "--quiet", "--locked"]))?;
    tests.env("TERCET_COMMAND", setting.target.join("release/tercet"));
    run(tests)?;
    Ok(Outcome::Passed(format!("screenshots in {}", pictures.display())))
}

/// Node's test runner on the compiled tests of a folder.
fn tests(web: &Web, folder: &str, fixtures: &Path) -> Command {
    let mut files: Vec<PathBuf> = fs::read_dir(root().join("web").join(folder))
        .into_iter()
        .flatten()
        .filter_map(|entry| Some(entry.ok()?.path()))
        .filter(|path| path.to_string_lossy().ends_with(".test.js"))
        .collect();
    files.sort();
    let mut node = web.node.command(&["--test", "--test-concurrency=1"]);
    node.args(files).env("TERCET_FIXTURES", fixtures);
    node
}

fn viewer(setting: &Setting) -> PathBuf {
    setting.target.join("viewer")
}

/// Files with what they decode to; of a real mesh too, where there are any.
fn fixtures(setting: &Setting) -> Result<PathBuf> {
    let folder = setting.target.join("fixtures");
    let words = ["run", "--release", "--quiet", "--locked", "--package=tercet", "--example=fixtures", "--"];
    let mut write = command("cargo", &words);
    write.arg(&folder);
    if let Ok(corpus) = std::env::var("TERCET_CORPUS") {
        write.arg(Path::new(&corpus).join("horse.ply"));
    }
    run(write)?;
    Ok(folder)
}
