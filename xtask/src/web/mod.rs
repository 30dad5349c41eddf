//! `cargo xtask web`: the WebAssembly modules, the npm package and the viewer that the command embeds.
//!
//! What is built lies in `web/dist` (the package) and, committed, in `crates/tercet-cli/assets/viewer`, so
//! that `cargo install` needs neither Node nor a compiler for WebAssembly.

mod modules;
mod node;

use crate::arguments::Arguments;
use crate::process::{root, run, target_dir};
use anyhow::{Context, Result};
use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};

pub use modules::gzipped;

use modules::Modules;
use node::Node;

/// The viewer as the command embeds it, from the repository's root.
const EMBEDDED: &str = "crates/tercet-cli/assets/viewer";
/// Beside it: which compiler made its WebAssembly. Another one's differs in its bytes.
const COMPILER: &str = "crates/tercet-cli/assets/viewer.compiler";

/// Builds everything anew, and what is embedded with it.
pub fn rebuild(words: &[String]) -> Result<()> {
    Arguments::new(words).finish()?;
    let web = Web::build(&target_dir()?)?;
    web.viewer(&root().join(EMBEDDED))?;
    fs::write(root().join(COMPILER), format!("{}\n", web.modules.compiler))?;
    for (name, bytes) in files(&root().join(EMBEDDED))? {
        println!("{:>9} bytes, {:>7} gzipped  {name}", bytes.len(), gzipped(&bytes)?);
    }
    Ok(())
}

/// The built package, and what builds a page with it.
pub struct Web {
    pub node: Node,
    pub modules: Modules,
}

impl Web {
    /// Builds the modules and the package. `target` is where cargo builds.
    pub fn build(target: &Path) -> Result<Web> {
        let node = Node::prepare(target)?;
        let modules = Modules::build(&node, target)?;
        let web = Web { node, modules };
        let dist = root().join("web/dist");
        if dist.is_dir() {
            fs::remove_dir_all(&dist).context("clearing web/dist")?;
        }
        run(web.node.tool("tsc", &["-p", "src"]))?;
        for (name, bytes) in web.modules.files() {
            fs::write(dist.join(name), bytes).with_context(|| format!("writing web/dist/{name}"))?;
        }
        Ok(web)
    }

    /// Builds the viewer into `folder`, which must lie in the repository or in the target folder.
    pub fn viewer(&self, folder: &Path) -> Result<()> {
        run(self.node.tool(
            "vite",
            &["build", "--logLevel", "warn", "--emptyOutDir", "--outDir", &folder.to_string_lossy()],
        ))
    }
}

/// How what is embedded differs from what the sources give, if it does.
pub enum Embedded {
    /// Not in a byte.
    Equal,
    /// In its WebAssembly alone, which another compiler made: that one.
    OtherCompiler(String),
    /// These files are not what the sources give.
    Stale(Vec<String>),
}

/// Compares what is embedded with the viewer that was built into `folder`.
pub fn compare(web: &Web, folder: &Path) -> Result<Embedded> {
    let embedded = files(&root().join(EMBEDDED)).context("reading the embedded viewer")?;
    let built = files(folder)?;
    let compiler = fs::read_to_string(root().join(COMPILER)).unwrap_or_default().trim().to_owned();
    let same_compiler = compiler == web.modules.compiler;
    let names = embedded.keys().chain(built.keys().filter(|name| !embedded.contains_key(*name)));
    let differing: Vec<&String> = names.filter(|name| embedded.get(*name) != built.get(*name)).collect();
    let wasm_alone = differing.iter().all(|name| name.ends_with(".wasm") && embedded.contains_key(*name));
    Ok(match differing[..] {
        [] => Embedded::Equal,
        _ if wasm_alone && !same_compiler => Embedded::OtherCompiler(compiler),
        _ => Embedded::Stale(differing.into_iter().cloned().collect()),
    })
}

/// The embedded viewer's folder.
pub fn embedded() -> PathBuf {
    root().join(EMBEDDED)
}

/// Every file below `folder`, by its path from there.
fn files(folder: &Path) -> Result<BTreeMap<String, Vec<u8>>> {
    let mut found = BTreeMap::new();
    for entry in fs::read_dir(folder).with_context(|| format!("reading {}", folder.display()))? {
        let path = entry?.path();
        let name = path.file_name().unwrap_or_default().to_string_lossy().into_owned();
        if path.is_dir() {
            found.extend(files(&path)?.into_iter().map(|(inner, bytes)| (format!("{name}/{inner}"), bytes)));
        } else {
            found.insert(name, fs::read(&path)?);
        }
    }
    Ok(found)
}
