//! `tercet decode`.

use std::path::PathBuf;

use anyhow::{Result, bail};
use tercet::io::Format;
use tercet::{Info, Level, Limits, Precision};

use crate::args::Goal;
use crate::console::Console;
use crate::feed::Feed;
use crate::{Outcome, args, files, report};

#[derive(Debug, clap::Args)]
pub struct DecodeArgs {
    /// A .tct file; - for standard input.
    #[arg(value_name = "FILE.tct")]
    pub file: PathBuf,
    /// The mesh to write; - for standard output [default: FILE with the suffix .ply].
    #[arg(short, long, value_name = "MESH")]
    pub output: Option<PathBuf>,
    #[command(flatten)]
    pub goal: Goal,
    /// The format of MESH [default: by its suffix].
    #[arg(long, value_parser = args::format)]
    pub format: Option<Format>,
}

pub fn decode(args: &DecodeArgs, limits: &Limits, console: &Console) -> Result<Outcome> {
    let output = output(args)?;
    let format = files::format(&output, args.format)?;
    let name = files::name(&args.file);
    let mut feed = Feed::open(&args.file, args.goal.bytes, limits)?;
    let info = feed.info()?;
    let finest = info.levels.len().saturating_sub(1) as u32;
    if let Some(level) = args.goal.level.filter(|&level| level > finest) {
        bail!("{name}: there is no level {level}: the finest is {finest}");
    }

    let mut meter = console.meter();
    let mut best: Option<Level> = None;
    while !best.as_ref().is_some_and(|level| is_enough(level, &info, &args.goal)) {
        let Some(level) = next_level(&mut feed, best.as_ref())? else {
            best = feed.preview().or(best);
            break;
        };
        meter.show("decoding", feed.bytes, info.bytes);
        best = Some(level);
    }
    drop(meter);
    let Some(best) = best else {
        feed.finish()?;
        bail!("{name}: there is no level in it");
    };

    files::write_mesh(&best.mesh, &output, format, console)?;
    let reached = describe(&best, &info);
    if is_enough(&best, &info, &args.goal) || args.goal.bytes == Some(feed.bytes) {
        if let Some(most) = args.goal.max_error.filter(|&most| best.restored && !is_within(&info, most)) {
            let asked = report::error(most);
            console.warn(&name, &format!("no level's error is at most {asked}; decoded {reached}"));
        }
        console.report(&format!("{}: {reached}", output.display()), &output)?;
        return Ok(Outcome::Good);
    }
    let cut = format!("truncated after {} of {} bytes", feed.bytes, info.bytes);
    console.warn(&name, &format!("{cut}; decoded {reached}"));
    Ok(Outcome::Partial)
}

/// The mesh to write. A name that was not given must not cost a file that exists: a mesh's own
/// name is the likeliest.
fn output(args: &DecodeArgs) -> Result<PathBuf> {
    if let Some(output) = &args.output {
        return Ok(output.clone());
    }
    let suffix = args.format.map_or("ply", |format| format.name());
    let output = files::with_suffix(&args.file, suffix);
    if !files::is_standard(&output) && output.exists() {
        bail!("{}: exists already: name the mesh to write with -o", output.display());
    }
    Ok(output)
}

/// The next level; an error says which levels are sound nevertheless.
fn next_level(feed: &mut Feed, best: Option<&Level>) -> Result<Option<Level>> {
    feed.next_level().map_err(|error| match best {
        Some(level) => anyhow::anyhow!("{error:#} (--level {} is sound)", level.level),
        None => error,
    })
}

/// Whether nothing better than `level` is wanted.
fn is_enough(level: &Level, info: &Info, goal: &Goal) -> bool {
    let is_finest = level.level as usize + 1 == info.levels.len();
    // The finest level counts once the sections that restore the original are in.
    level.restored
        || !is_finest
            && (goal.level == Some(level.level)
                || goal.max_error.is_some_and(|most| info.levels[level.level as usize].error <= most))
}

/// Whether the whole mesh is within `most` of the original: exact files are.
fn is_within(info: &Info, most: f32) -> bool {
    let rounded = matches!(info.precision, Precision::Lattice { .. });
    !rounded || info.levels.last().is_none_or(|finest| finest.error <= most)
}

/// "level 3 of 0 to 7, 512 vertices, 1020 faces, error 0.5 %"; of a level in part, how many of its vertices
/// lie where they are expected.
pub fn describe(level: &Level, info: &Info) -> String {
    let (vertices, faces) = (level.mesh.positions.len(), level.mesh.faces.len());
    let finest = info.levels.len().saturating_sub(1);
    let which = if level.restored {
        "the whole mesh".into()
    } else {
        format!("level {} of 0 to {finest}", level.level)
    };
    let rest = match info.levels.get(level.level as usize) {
        Some(level_info) if !level.restored && (level.pending == 0 || level_info.kind == "late") => {
            format!(", error {}", report::error(level_info.error))
        }
        Some(_) if level.pending > 0 => format!(", {} of them where they are expected", level.pending),
        _ => String::new(),
    };
    format!("{which}, {vertices} vertices, {faces} faces{rest}")
}
