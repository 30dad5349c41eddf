//! `tercet view`.

use std::io::Read;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use anyhow::{Context, Result, bail};
use object_store::ObjectStoreExt;
use object_store::memory::InMemory;
use tercet::Limits;
use tercet::io::Format;

use super::serve::{Serving, stopped};
use crate::console::Console;
use crate::server::{self, Listener};
use crate::{Outcome, args, files};

/// Look at a mesh in the browser, level by level.
///
/// Starts a server on this machine for this one file, until it is told to stop.
#[derive(Debug, clap::Args)]
pub struct ViewArgs {
    /// A .tct file, a mesh file, or the address of a .tct file; - for standard input.
    #[arg(value_name = "MESH|FILE|URL")]
    pub what: String,
    /// Print the address and leave the browser alone.
    #[arg(long)]
    pub no_browser: bool,
    /// The format of MESH [default: by its suffix].
    #[arg(long, value_parser = args::format)]
    pub format: Option<Format>,
    /// Where to listen; port 0 is any free one.
    #[arg(long, value_name = "HOST:PORT", default_value = "127.0.0.1:0")]
    pub addr: String,
    #[command(flatten)]
    pub serving: Serving,
}

pub fn view(args: &ViewArgs, limits: &Limits, console: &Console) -> Result<Outcome> {
    if !server::has_viewer() {
        bail!("this program was built without the viewer page");
    }
    tokio::runtime::Runtime::new()?.block_on(async {
        let store = InMemory::new();
        let source = if is_url(&args.what) { None } else { Some(load(args, limits, &store).await?) };
        let mut service = args.serving.service(Arc::new(store), limits, &Console::new(true))?;
        let source = match source {
            Some(name) => server::plain_url(&name),
            None => server::relay(&mut service, &args.what)?,
        };
        let address = super::serve::resolve(&args.addr).await?;
        let listener = Listener::bind(address, args.serving.patience()).await;
        let listener = listener.with_context(|| args.addr.clone())?;
        let url = format!("http://{}{}", listener.address()?, server::viewer_url(&source));
        console.answer(&url)?;
        if !args.no_browser && webbrowser::open(&url).is_err() {
            console.warn(&args.what, "no browser could be started: open the address in one");
        }
        listener.run(service, stopped()).await;
        Ok(Outcome::Good)
    })
}

fn is_url(what: &str) -> bool {
    what.starts_with("http://") || what.starts_with("https://")
}

/// Puts the file into the store; the result is the name of what is served.
async fn load(args: &ViewArgs, limits: &Limits, store: &InMemory) -> Result<String> {
    let path = PathBuf::from(&args.what);
    if path.is_dir() {
        bail!("{}: a folder: tercet serve shows what is in it", args.what);
    }
    let mut bytes = Vec::new();
    files::open(&path)?.take(limits.max_memory).read_to_end(&mut bytes).with_context(|| args.what.clone())?;
    let (stored, served) = names(&path, args.format)?;
    let location = object_store::path::Path::parse(&stored).with_context(|| args.what.clone())?;
    store.put(&location, bytes.into()).await?;
    Ok(served)
}

/// A name for the file in the store, and the one under which it is served.
fn names(path: &Path, asked: Option<Format>) -> Result<(String, String)> {
    let name = if files::is_standard(path) { "mesh".into() } else { file_name(path) };
    if asked.is_none() && path.extension().is_some_and(|suffix| suffix == "tct") {
        return Ok((name.clone(), name));
    }
    let format = files::format(path, asked)?;
    let stored = if asked.is_some() { format!("{name}.{}", format.name()) } else { name };
    let served = format!("{stored}.tct");
    Ok((stored, served))
}

fn file_name(path: &Path) -> String {
    path.file_name().map_or("mesh".into(), |name| name.to_string_lossy().into_owned())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_mesh_is_served_under_its_name_with_a_suffix() {
        let names = |path: &str, format| names(Path::new(path), format).unwrap();
        let pair = |a: &str, b: &str| (a.to_string(), b.to_string());
        assert_eq!(names("a/b.tct", None), pair("b.tct", "b.tct"));
        assert_eq!(names("a/b.OBJ", None), pair("b.OBJ", "b.OBJ.tct"));
        assert_eq!(names("a/b.dat", Some(Format::Ply)), pair("b.dat.ply", "b.dat.ply.tct"));
        assert_eq!(names("-", Some(Format::Stl)), pair("mesh.stl", "mesh.stl.tct"));
    }
}
