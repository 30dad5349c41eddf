//! `tercet fetch`.

use std::path::{Path, PathBuf};
use std::time::Duration;

use anyhow::{Context, Result, bail};
use tercet::Limits;
use tercet::io::Format;

use crate::args::{self, Goal};
use crate::console::Console;
use crate::fetch::{Announcer, Fetched, Part, Protocol, Retries, Source, Transfer, Wanted};
use crate::{Outcome, files};

/// Get a file from a server, level by level.
///
/// Any server of files will do, with ranges or without. What has arrived is kept in OUTPUT.part
/// until everything is there; the same command goes on from it.
#[derive(Debug, clap::Args)]
pub struct FetchArgs {
    /// The address of a .tct file: http, https, ws or wss.
    pub url: String,
    /// The mesh to write, or a .tct file to keep it as it is; - for standard output [default: the
    /// name in URL with the suffix .ply].
    #[arg(short, long, value_name = "MESH")]
    pub output: Option<PathBuf>,
    #[command(flatten)]
    pub goal: Goal,
    /// How to ask for it: ws and wt are what tercet serve adds; auto takes the best that is offered.
    #[arg(long, value_name = "PROTOCOL", default_value = "http")]
    pub protocol: Protocol,
    /// Seconds that the server may say nothing.
    #[arg(long, value_name = "SECONDS", default_value = "30", value_parser = args::seconds)]
    pub timeout: Duration,
    /// How often to try again when nothing arrives; the time between tries grows.
    #[arg(long, value_name = "N", default_value_t = 5)]
    pub retries: u32,
    /// Print a JSON object on a line for each level, for what of one in groups is there before the whole, and one at the
    /// end.
    #[arg(long)]
    pub json: bool,
    /// The format of MESH [default: by its suffix].
    #[arg(long, value_parser = args::format)]
    pub format: Option<Format>,
}

/// What is written.
enum Kind {
    Mesh(Format),
    /// The bytes as they came.
    Tct,
}

pub fn fetch(args: &FetchArgs, limits: &Limits, console: &Console) -> Result<Outcome> {
    let output = output(args)?;
    let is_tct = args.format.is_none() && output.extension().is_some_and(|suffix| suffix == "tct");
    let kind = if is_tct { Kind::Tct } else { Kind::Mesh(files::format(&output, args.format)?) };
    let source = Source::new(&args.url, args.protocol, args.timeout, limits)?;
    let beside = (!files::is_standard(&output)).then_some(output.as_path());
    let announcer = Announcer::new(console, &args.url, output.clone(), args.json);
    let transfer = Transfer::new(
        source,
        Wanted::new(&args.goal),
        Part::open(beside, &args.url).with_context(|| output.display().to_string())?,
        *limits,
        Retries::new(args.retries),
        announcer.clone(),
    );
    let fetched = tokio::runtime::Runtime::new()?.block_on(transfer.run());
    let fetched = fetched.with_context(|| args.url.clone())?;
    finish(args, fetched, kind, &output, &announcer, console)
}

fn finish(
    args: &FetchArgs,
    fetched: Fetched,
    kind: Kind,
    output: &Path,
    announcer: &Announcer,
    console: &Console,
) -> Result<Outcome> {
    let Fetched { best, info, mut part, failure } = fetched;
    if let (Some(level), Some(info)) = (args.goal.level, &info)
        && level as usize >= info.levels.len()
    {
        part.remove()?;
        bail!("{}: there is no level {level}: the finest is {}", args.url, info.levels.len() - 1);
    }
    let (Some(best), Some(info)) = (best, info) else {
        let nothing = || anyhow::anyhow!("there is no level in the bytes that were asked for");
        return Err(failure.unwrap_or_else(nothing)).with_context(|| args.url.clone());
    };
    match kind {
        Kind::Mesh(format) => files::write_mesh(&best.mesh, output, format, console)?,
        Kind::Tct => files::write(output, |out| Ok(part.copy(out)?))?,
    }
    let reached = super::decode::describe(&best, &info);
    announcer.done(&reached, part.bytes(), failure.is_none());
    match failure {
        None => {
            part.remove()?;
            Ok(Outcome::Good)
        }
        Some(failure) => {
            let kept = "the same command goes on from what is kept";
            console.warn(&args.url, &format!("{failure:#}; wrote {reached}; {kept}"));
            Ok(Outcome::Partial)
        }
    }
}

/// The file to write. A name that was not given must not cost a file that exists.
fn output(args: &FetchArgs) -> Result<PathBuf> {
    if let Some(output) = &args.output {
        return Ok(output.clone());
    }
    let path = args.url.split(['?', '#']).next().unwrap_or_default();
    let name = path.rsplit('/').next().unwrap_or_default();
    let name = percent_encoding::percent_decode_str(name).decode_utf8_lossy();
    let stem = Path::new(name.as_ref())
        .file_name()
        .with_context(|| format!("{}: the address names no file: say which to write with -o", args.url))?;
    let suffix = args.format.map_or("ply", |format| format.name());
    let output = Path::new(stem).with_extension(suffix);
    if output.exists() {
        bail!("{}: exists already: name the mesh to write with -o", output.display());
    }
    Ok(output)
}
