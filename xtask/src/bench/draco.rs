//! Draco's command-line tools, from Debian's package `draco`.

use crate::process::{available, capture, command, debian_packages};
use anyhow::{Context, Result};
use std::fs::{self, File};
use std::io::{BufRead, BufReader};
use std::path::Path;

pub struct Encoded {
    pub bytes: u64,
    pub seconds: f64,
}

pub struct Decoded {
    /// Draco drops some vertices (unreferenced, in degenerate faces) and tears others.
    pub vertices: u64,
    pub seconds: f64,
}

pub fn set_up() -> Result<()> {
    if available("draco_encoder") && available("draco_decoder") {
        Ok(())
    } else {
        debian_packages(&["draco"])
    }
}

/// Encodes with positions on a lattice of `bits` bits, or unrounded.
pub fn encode(mesh: &Path, out: &Path, bits: Option<u8>, level: u8) -> Result<Encoded> {
    let mut draco = command("draco_encoder", &["-qp", &bits.unwrap_or(0).to_string()]);
    draco.args(["-cl", &level.to_string(), "-i"]).arg(mesh).arg("-o").arg(out);
    let seconds = seconds(&capture(draco)?, "ms to encode")?;
    Ok(Encoded { bytes: fs::metadata(out)?.len(), seconds })
}

pub fn decode(file: &Path, out: &Path) -> Result<Decoded> {
    let mut draco = command("draco_decoder", &["-i"]);
    draco.arg(file).arg("-o").arg(out);
    let seconds = seconds(&capture(draco)?, "ms to decode")?;
    Ok(Decoded { vertices: ply_vertices(out)?, seconds })
}

/// The time in "(12 ms to decode)". Draco cuts it to whole milliseconds, so on average it lacks half of one.
fn seconds(output: &str, unit: &str) -> Result<f64> {
    let (before, _) = output.split_once(unit).with_context(|| format!("Draco does not print '{unit}'"))?;
    let (_, number) = before.rsplit_once('(').context("Draco prints its time in another form")?;
    Ok((number.trim().parse::<f64>()? + 0.5) / 1000.0)
}

fn ply_vertices(ply: &Path) -> Result<u64> {
    for line in BufReader::new(File::open(ply)?).split(b'\n').take(20) {
        if let Some(count) = String::from_utf8_lossy(&line?).strip_prefix("element vertex ") {
            return Ok(count.trim().parse()?);
        }
    }
    anyhow::bail!("{} states no number of vertices", ply.display())
}

#[cfg(test)]
mod tests {
    #[test]
    fn the_time_is_read_from_the_closing_line() {
        let output =
            "Encoder options:\n  Compression level = 10\n\nEncoded mesh saved to a.drc (4 ms to encode).\n";
        assert_eq!(super::seconds(output, "ms to encode").unwrap(), 0.0045);
        assert!(super::seconds(output, "ms to decode").is_err());
    }
}
