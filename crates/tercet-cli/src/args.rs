//! The command line's grammar: what commands share; the rest stands with each command.

use clap::{Parser, Subcommand, ValueEnum};
use tercet::io::Format;

use crate::commands;

/// Progressive, lossless compression of triangle meshes.
///
/// Exit status: 0 good, 1 failed, 2 wrong usage, 3 partial (the input ended early).
#[derive(Debug, Parser)]
#[command(name = "tercet", version, arg_required_else_help = true)]
pub struct Args {
    /// Print errors and what was asked for; no tables, warnings or progress.
    #[arg(short, long, global = true, display_order = 100)]
    pub quiet: bool,
    /// Memory that an input may ask for, in bytes or with K, M, G or T.
    #[arg(long, global = true, display_order = 100, value_name = "SIZE", default_value = "4G", value_parser = size)]
    pub max_memory: u64,
    #[command(subcommand)]
    pub command: Command,
}

#[derive(Debug, Subcommand)]
pub enum Command {
    /// Encode a mesh as a progressive file and print its levels.
    Encode(commands::EncodeArgs),
    /// Decode a file, or one of its levels, to a mesh.
    Decode(commands::DecodeArgs),
    /// Say what a file holds.
    Info(commands::InfoArgs),
    /// Check that a file restores a mesh.
    Verify(commands::VerifyArgs),
    /// Measure how far two surfaces are apart.
    Metrics(commands::MetricsArgs),
    /// Compare the two subdivision schemes on a mesh: steps, cost, errors, updates.
    Compare(commands::CompareArgs),
    /// Draw a mesh or a level: its surface, edges, vertex division or error.
    Render(commands::RenderArgs),
    /// Put a mesh, its levels and what they cost on one page, with pictures.
    Report(commands::ReportArgs),
    /// Resample a mesh to subdivision connectivity, which costs nothing to code.
    Remesh(commands::RemeshArgs),
    /// Refine a mesh by subdivision.
    Subdivide(commands::SubdivideArgs),
    /// Try ways to send a file over a lossy channel: what would viewers see, and when?
    Simulate(commands::SimulateArgs),
    /// Show the levels of a mesh, cut the file off, decode and verify.
    Demo(commands::DemoArgs),
    #[cfg(feature = "fetch")]
    Fetch(commands::FetchArgs),
    #[cfg(feature = "serve")]
    Serve(commands::ServeArgs),
    #[cfg(feature = "serve")]
    View(commands::ViewArgs),
}

/// How much of a file is wanted; by default all of it.
#[derive(Debug, Default, clap::Args)]
#[group(multiple = false)]
pub struct Goal {
    /// Decode this level; 0 is the base mesh.
    #[arg(long, value_name = "K")]
    pub level: Option<u32>,
    /// Decode the best level in the first N bytes.
    #[arg(long, value_name = "N")]
    pub bytes: Option<u64>,
    /// Decode the coarsest level with at most this error, as a part of the bounding box's diagonal.
    #[arg(long, value_name = "E", value_parser = error)]
    pub max_error: Option<f32>,
}

#[derive(Clone, Copy, Debug, ValueEnum)]
pub enum Progressive {
    /// Every level as good as its bytes allow, unless that costs more than some 3 %.
    Best,
    /// The smallest file: the positions of the finest levels may come after all levels.
    Smallest,
}

impl From<Progressive> for tercet::Progressive {
    fn from(progressive: Progressive) -> Self {
        match progressive {
            Progressive::Best => tercet::Progressive::Best,
            Progressive::Smallest => tercet::Progressive::Smallest,
        }
    }
}

#[derive(Clone, Copy, Debug, ValueEnum)]
pub enum UpdateRule {
    /// Not at all: the fewest bits.
    None,
    /// By a third of the transposed prediction (butterfly levels: a quarter): better coarse levels.
    Third,
    /// By the whole transposed prediction, as published: for comparison.
    Paper,
}

impl From<UpdateRule> for tercet::Update {
    fn from(rule: UpdateRule) -> Self {
        match rule {
            UpdateRule::None => tercet::Update::None,
            UpdateRule::Third => tercet::Update::Third,
            UpdateRule::Paper => tercet::Update::Paper,
        }
    }
}

#[derive(Clone, Copy, Debug, ValueEnum)]
pub enum Effort {
    /// One adaptive table for each kind of decision: several times faster.
    Fast,
    /// Several models, mixed: smaller.
    Default,
    /// As many models as pay at all; at present those of the default.
    Max,
}

impl From<Effort> for tercet::Effort {
    fn from(effort: Effort) -> Self {
        match effort {
            Effort::Fast => tercet::Effort::Fast,
            Effort::Default => tercet::Effort::Default,
            Effort::Max => tercet::Effort::Max,
        }
    }
}

#[derive(Clone, Copy, Debug, ValueEnum)]
pub enum Scheme {
    /// Interpolatory √3 subdivision: three times the faces a step.
    Sqrt3,
    /// Modified butterfly subdivision: four times the faces a step.
    Butterfly,
}

impl From<Scheme> for tercet::Scheme {
    fn from(scheme: Scheme) -> Self {
        match scheme {
            Scheme::Sqrt3 => tercet::Scheme::Sqrt3,
            Scheme::Butterfly => tercet::Scheme::Butterfly,
        }
    }
}

#[derive(Clone, Copy, Debug, ValueEnum)]
pub enum LevelScheme {
    /// √3 or butterfly levels, whichever fit.
    Auto,
    /// √3 levels as long as they fit.
    Sqrt3,
    /// Butterfly levels as long as they fit.
    Butterfly,
    /// Neither: every level's connectivity is stored.
    Adaptive,
}

impl From<LevelScheme> for tercet::LevelScheme {
    fn from(scheme: LevelScheme) -> Self {
        match scheme {
            LevelScheme::Auto => tercet::LevelScheme::Auto,
            LevelScheme::Sqrt3 => tercet::LevelScheme::Sqrt3,
            LevelScheme::Butterfly => tercet::LevelScheme::Butterfly,
            LevelScheme::Adaptive => tercet::LevelScheme::Adaptive,
        }
    }
}

pub fn format(name: &str) -> Result<Format, String> {
    Format::from_name(name).ok_or_else(|| "formats are obj, ply, stl and off".into())
}

pub fn error(text: &str) -> Result<f32, String> {
    match text.parse() {
        Ok(error) if error >= 0.0 => Ok(error),
        _ => Err("an error is a number that is not negative".into()),
    }
}

/// A time in seconds.
#[cfg(any(feature = "serve", feature = "fetch"))]
pub fn seconds(text: &str) -> Result<std::time::Duration, String> {
    let seconds: f64 = text.parse().map_err(|error| format!("{error}"))?;
    std::time::Duration::try_from_secs_f64(seconds).map_err(|error| error.to_string())
}

/// A number of bytes: digits and optionally one of K, M, G, T, each 1024 times the one before.
pub fn size(text: &str) -> Result<u64, String> {
    let digits = text.trim_end_matches(|c: char| c.is_ascii_alphabetic());
    let factor = match text[digits.len()..].to_ascii_uppercase().as_str() {
        "" => 1,
        "K" => 1 << 10,
        "M" => 1 << 20,
        "G" => 1 << 30,
        "T" => 1 << 40,
        _ => return Err("sizes end in a digit, K, M, G or T".into()),
    };
    let number: u64 = digits.parse().map_err(|error| format!("{error}"))?;
    number.checked_mul(factor).ok_or_else(|| "too large".into())
}

#[cfg(test)]
mod tests {
    use super::*;
    use clap::CommandFactory;

    #[test]
    fn the_grammar_is_consistent() {
        Args::command().debug_assert();
    }

    #[test]
    fn sizes_take_suffixes_and_nothing_else() {
        assert_eq!(size("0"), Ok(0));
        assert_eq!(size("4G"), Ok(4 << 30));
        assert_eq!(size("512m"), Ok(512 << 20));
        for bad in ["", "G", "-1", "4GB", "1.5G", "99999999999G", "4 G"] {
            assert!(size(bad).is_err(), "{bad}");
        }
    }
}
