//! The web: the WebAssembly modules, the npm package and the viewer, in Node and in a real browser.

use super::{Outcome, Setting};
use crate::example::{Profile, example};
use crate::process::{available, command, debian_packages, root, run};
use crate::web::{self, Embedded, Web, gzipped};
use anyhow::{Context, Result, bail};
use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

/// Most that the decoder may take, gzipped. Pages should load 80 000 bytes at most; since format version 7 it
/// knows more than one way to code positions, since 9 what to expect of small meshes, since 10 twins, and misses that
/// (docs/experiments.md).
const DECODER_BUDGET: u64 = 95_000;

/// The built package and viewer, their compiled tests, and files to try them with.
pub struct Page {
    web: Web,
    viewer: PathBuf,
    /// The folder of files with what they decode to.
    fixtures: PathBuf,
}

impl Page {
    fn build(target: &Path) -> Result<Page> {
        let web = Web::build(target)?;
        let (viewer, fixtures) = (target.join("viewer"), target.join("fixtures"));
        web.viewer(&viewer)?;
        run(web.node.tool("tsc", &["-p", "test"]))?;
        let mut write = command(&example("fixtures", Profile::Release, target)?.to_string_lossy(), &[]);
        write.arg(&fixtures);
        // Of a real mesh too, where there are any.
        if let Ok(corpus) = std::env::var("TERCET_CORPUS") {
            write.arg(Path::new(&corpus).join("horse.ply"));
        }
        run(write)?;
        Ok(Page { web, viewer, fixtures })
    }

    /// Node's test runner on the compiled tests of a folder.
    fn tests(&self, folder: &str) -> Command {
        let mut files: Vec<PathBuf> = fs::read_dir(root().join("web/test/out").join(folder))
            .into_iter()
            .flatten()
            .filter_map(|entry| Some(entry.ok()?.path()))
            .filter(|path| path.to_string_lossy().ends_with(".test.js"))
            .collect();
        files.sort();
        let mut node = self.web.node.command(&["--test", "--test-concurrency=1"]);
        node.args(files).env("TERCET_FIXTURES", &self.fixtures);
        node
    }
}

/// The page, built unless an earlier stage has built it.
fn built(setting: &Setting) -> Result<&Page> {
    match setting.page.get() {
        Some(page) => Ok(page),
        None => {
            let page = Page::build(&setting.target)?;
            Ok(setting.page.get_or_init(|| page))
        }
    }
}

/// Builds all of it, compares it with what is embedded, and tests it in Node.
pub fn package(setting: &Setting) -> Result<Outcome> {
    let page = built(setting)?;
    let modules = &page.web.modules;
    let size = gzipped(&modules.decoder)?;
    println!("decoder.wasm: {} bytes, {size} gzipped; it needs no glue", modules.decoder.len());
    if size > DECODER_BUDGET {
        bail!("the decoder takes {size} bytes gzipped, more than {DECODER_BUDGET}");
    }
    run(page.web.node.tool("tsc", &["-p", "viewer"]))?;
    let note = match web::compare(&page.web, &page.viewer)? {
        Embedded::Equal => "what is embedded is what the sources give".into(),
        Embedded::OtherCompiler(compiler) => {
            format!("embedded: the same page; its WebAssembly is by {compiler}, not {}", modules.compiler)
        }
        Embedded::Stale(files) => bail!("run `cargo xtask web` and commit: {} changed", files.join(", ")),
    };
    // Also what is embedded is tried, whoever compiled it.
    for wasm in [root().join("web/dist"), web::embedded().join("assets")] {
        run(page.tests("node").env("TERCET_WASM", wasm))?;
    }
    Ok(Outcome::Passed(format!("decoder {size} bytes gzipped; {note}")))
}

/// The viewer and the client in Chromium.
pub fn browser(setting: &Setting) -> Result<Outcome> {
    let chromium = ["chromium", "chromium-browser", "google-chrome"].into_iter().find(|name| available(name));
    if chromium.is_none() {
        debian_packages(&["chromium"])?;
    }
    let page = built(setting)?;
    let pictures = setting.target.join("screenshots");
    fs::create_dir_all(&pictures).context("making a folder for screenshots")?;
    let mut tests = page.tests("browser");
    tests.env("TERCET_VIEWER", &page.viewer).env("TERCET_SCREENSHOTS", &pictures);
    tests.env("TERCET_CHROMIUM", chromium.unwrap_or("chromium"));
    // The server that the page is tried with: the program that the stage `readme` has built already.
    run(command("cargo", &["build", "--release", "--quiet", "--locked"]))?;
    tests.env("TERCET_COMMAND", setting.target.join("release/tercet"));
    run(tests)?;
    Ok(Outcome::Passed(format!("screenshots in {}", pictures.display())))
}
