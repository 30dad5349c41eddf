//! OpenCTM's command-line tool, from Debian's package `openctm-tools`: its method MG2, which rounds positions.

use crate::process::{available, capture, command, debian_packages};
use anyhow::{Context, Result};
use std::path::Path;

pub fn set_up() -> Result<()> {
    if available("ctmconv") { Ok(()) } else { debian_packages(&["openctm-tools"]) }
}

/// Encodes with positions rounded to multiples of `step`, with the greatest effort; returns the seconds that
/// it took, writing included.
pub fn encode(mesh: &Path, out: &Path, step: f64) -> Result<f64> {
    let step = step.to_string();
    let options = ["--no-normals", "--method", "MG2", "--level", "9", "--vprec", &step];
    let mut ctm = command("ctmconv", &[]);
    ctm.arg(mesh).arg(out).args(options);
    seconds(&capture(ctm)?, "Saving")
}

/// Decodes; returns the seconds that it took, reading included.
pub fn decode(file: &Path, out: &Path) -> Result<f64> {
    let mut ctm = command("ctmconv", &[]);
    ctm.arg(file).arg(out);
    seconds(&capture(ctm)?, "Loading")
}

/// The time in "Saving a.ctm... 12.5 ms".
fn seconds(output: &str, action: &str) -> Result<f64> {
    let time = output.lines().find_map(|line| line.strip_prefix(action)?.strip_suffix(" ms"));
    let (_, time) = time.and_then(|line| line.rsplit_once("... ")).context("OpenCTM prints no time")?;
    Ok(time.trim().parse::<f64>()? / 1000.0)
}

#[cfg(test)]
mod tests {
    #[test]
    fn the_time_is_read_from_the_line_of_the_action() {
        let output = "Loading a... b.ply... 77.773 ms\nSaving h.ctm... 1133.34 ms\n";
        assert_eq!(super::seconds(output, "Saving").unwrap(), 1.13334);
        assert_eq!(super::seconds(output, "Loading").unwrap(), 0.077773);
        assert!(super::seconds(output, "Packing").is_err());
    }
}
