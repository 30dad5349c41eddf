//! A file's properties in words and tables.

use tercet::{Effort, Info, LevelInfo, Precision, Update};

use crate::table::Table;

/// Bytes a vertex and a face take as plain arrays: three floats and three indices.
const PLAIN_VERTEX: u64 = 12;
const PLAIN_FACE: u64 = 12;

/// A number of bytes as bits per vertex of the original.
pub fn bits_per_vertex(bytes: u64, info: &Info) -> f64 {
    8.0 * bytes as f64 / f64::from(info.vertices.max(1))
}

pub fn effort(effort: Effort) -> &'static str {
    match effort {
        Effort::Fast => "fast",
        Effort::Max => "max",
        _ => "default",
    }
}

/// The table of levels, and a line for the whole file.
pub fn levels(info: &Info) -> String {
    format!("{}\n{}", level_table(info).lines(), total(info))
}

/// A row for each level, and one for what restores the original from the finest.
pub fn level_table(info: &Info) -> Table {
    let mut table =
        Table::new(["level", "kind", "vertices", "faces", "bytes", "cumulative", "bits/vertex", "error"]);
    let mut before = 0;
    for level in &info.levels {
        let bytes = level.bytes.saturating_sub(before);
        before = level.bytes;
        table.row([
            level.level.to_string(),
            kind(level),
            level.vertices.to_string(),
            level.faces.to_string(),
            bytes.to_string(),
            level.bytes.to_string(),
            format!("{:.3}", bits_per_vertex(bytes, info)),
            error(level.error),
        ]);
    }
    let rest = info.bytes.saturating_sub(before);
    if rest > 0 {
        table.row([
            String::new(),
            "restoration".into(),
            info.vertices.to_string(),
            info.faces.to_string(),
            rest.to_string(),
            info.bytes.to_string(),
            format!("{:.3}", bits_per_vertex(rest, info)),
            String::new(),
        ]);
    }
    table
}

/// "total: 12345 bytes, 12.3 bits per vertex, 5.1 % of 241000 plain bytes".
pub fn total(info: &Info) -> String {
    let plain = PLAIN_VERTEX * u64::from(info.vertices) + PLAIN_FACE * u64::from(info.faces);
    let share = if plain > 0 {
        let percent = 100.0 * info.bytes as f64 / plain as f64;
        format!(", {percent:.1} % of the {plain} bytes of its plain arrays")
    } else {
        String::new()
    };
    format!("total: {} bytes, {:.3} bits per vertex{share}", info.bytes, bits_per_vertex(info.bytes, info))
}

fn kind(level: &LevelInfo) -> String {
    let groups = if level.grouped { " in groups" } else { "" };
    let update = update(level.update).map_or(String::new(), |rule| format!(", update {rule}"));
    format!("{}{groups}{update}", level.kind)
}

/// The name of an update rule, if it is one.
pub fn update(update: Update) -> Option<&'static str> {
    match update {
        Update::None => None,
        Update::Third => Some("third"),
        Update::Paper => Some("paper"),
    }
}

/// A level's error, a part of the bounding box's diagonal, in percent with three digits.
pub fn error(error: f32) -> String {
    let percent = 100.0 * error;
    if percent == 0.0 {
        return "0".into();
    }
    let digits = (0..9).find(|&digits| percent >= 100.0 / 10f32.powi(digits)).unwrap_or(9);
    format!("{percent:.*} %", digits as usize)
}

/// How much a count changed: "-66.6 %".
pub fn rate(before: u32, now: u32) -> String {
    let percent = 100.0 * (f64::from(now) - f64::from(before)) / f64::from(before.max(1));
    format!("{percent:.1} %")
}

/// A signal-to-noise ratio.
pub fn decibels(ratio: f64) -> String {
    if ratio.is_finite() { format!("{ratio:.2} dB") } else { "infinite: no difference".into() }
}

/// What a file keeps of positions.
pub fn precision(precision: &Precision) -> String {
    match precision {
        Precision::Lattice { bits, side, .. } => {
            let step = side / ((1u64 << bits) - 1) as f64;
            format!("{bits} bits along the longest side: steps of {step:.6e}")
        }
        Precision::Decimal { exponent: 0, digits: 0, .. } => "exact: integers".into(),
        Precision::Decimal { exponent, digits: 0, .. } => format!("exact: multiples of 10^-{exponent}"),
        Precision::Decimal { exponent, digits, .. } => {
            let step = i32::from(*digits) - i32::from(*exponent);
            format!("exact: levels in steps of 10^{step}, then {exponent} decimals")
        }
        Precision::Binary { exponent, .. } => format!("exact: multiples of 2^{exponent}"),
        Precision::Refined { exponent, .. } => {
            format!("exact: levels in steps of 2^{exponent}, then every bit")
        }
    }
}

/// What a file keeps of the order of vertices and faces.
pub fn order(info: &Info) -> &'static str {
    if info.order_kept { "kept" } else { "not kept: vertices and faces are renumbered" }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn errors_are_percentages_with_three_digits() {
        for (e, text) in [
            (0.0, "0"),
            (1.0, "100 %"),
            (0.25, "25.0 %"),
            (0.0123, "1.23 %"),
            (0.000_045_6, "0.00456 %"),
            (1e-20, "0.000000000 %"),
        ] {
            assert_eq!(error(e), text);
        }
    }
}
