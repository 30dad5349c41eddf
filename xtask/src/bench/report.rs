//! The tables of `BENCHMARKS.md`.

use super::ours::Remeshed;
use super::rate::RateRow;
use crate::process::{capture, command};
use std::fmt::Write;

/// One mesh on one lattice.
pub struct LatticeRow {
    pub mesh: String,
    pub vertices: u64,
    pub bytes: u64,
    pub connectivity_bytes: u64,
    pub base_vertices: u64,
    /// The smaller of levels 7 and 10.
    pub draco_bytes: u64,
    /// What Draco's decoder returns.
    pub draco_vertices: u64,
    /// Encoding and decoding rate, as ratios to Draco's level 10.
    pub rates: Option<(f64, f64)>,
    pub encode_peak: u64,
    pub decode_peak: u64,
}

impl LatticeRow {
    pub fn size_ratio(&self) -> f64 {
        self.bytes as f64 / self.draco_bytes as f64
    }

    fn per_vertex(&self, amount: u64) -> f64 {
        amount as f64 / self.vertices as f64
    }
}

/// Bits of the lattices that remeshes are coded on.
pub const REMESH_BITS: [u8; 2] = [12, 14];

/// One mesh, remeshed to √3 connectivity.
pub struct RemeshedRow {
    pub mesh: String,
    pub placement: &'static str,
    pub remeshed: Remeshed,
    /// Our bytes over those of Draco's level 10, by lattice.
    pub size_ratios: [f64; 2],
}

/// One mesh, every bit of its coordinates kept.
pub struct ExactRow {
    pub mesh: String,
    pub vertices: u64,
    pub bytes: u64,
    pub draco_bytes: u64,
    pub meshopt_bytes: Option<u64>,
}

impl ExactRow {
    pub fn size_ratio(&self) -> f64 {
        let best = self.meshopt_bytes.map_or(self.draco_bytes, |bytes| bytes.min(self.draco_bytes));
        self.bytes as f64 / best as f64
    }
}

/// The command and the machine: "Made by `…`.\nMachine: …".
pub fn origin(words: &[String]) -> String {
    let first_line = |program: &str, arguments: &[&str]| {
        let output = capture(command(program, arguments)).unwrap_or_default();
        output.lines().next().unwrap_or("unknown").to_owned()
    };
    let cpu = std::fs::read_to_string("/proc/cpuinfo").unwrap_or_default();
    let cpu = cpu.lines().find_map(|line| line.strip_prefix("model name")?.split_once(": "));
    let cores = std::thread::available_parallelism().map_or(0, |cores| cores.get());
    format!(
        "Made by `{}`.\n\
         Machine: {}, {cores} cores; {}; Draco {}.\n",
        [&["cargo xtask bench".to_owned()], words].concat().join(" "),
        cpu.map_or("unknown processor", |(_, name)| name),
        first_line("rustc", &["--version"]),
        first_line("dpkg-query", &["--show", "--showformat=${Version}", "draco"]),
    )
}

/// How the tables were made and how to read them.
pub fn opening(words: &[String]) -> String {
    format!(
        "# Benchmarks\n\n\
         {}\n\
         - Sizes are bits per vertex of the input, everything counted; \"Draco\" is the smaller of its\n  \
           levels 7 and 10 on the same lattice, and \"size\" our bytes over its.\n\
         - Rates are ratios to Draco level 10 in the same run, the median of paired runs, each a new\n  \
           process that times coding alone; above 1 is faster than Draco. Smaller meshes are not timed.\n\
         - Memory is the whole process at its fullest, less what it had at its start, in bytes per vertex.\n\
         - \"kept\" is how many of the vertices Draco returns: it drops unreferenced ones and degenerate\n  \
           faces, and tears vertices on what is not an oriented manifold. We return all.\n",
        origin(words),
    )
}

/// The text `before` with the sections of `new` in place of those of the same titles, or at the end, each
/// of them with its origin.
pub fn merged(before: &str, new: &str, origin: &str) -> String {
    let titled = |text: &str| -> Vec<(String, String)> {
        let sections = text.split("\n## ").skip(1);
        sections
            .map(|section| section.split_once('\n').unwrap_or((section, "")))
            .map(|(title, body)| (title.to_owned(), body.to_owned()))
            .collect()
    };
    let mut sections = titled(before);
    for (title, body) in titled(new) {
        let body = format!("\n{origin}{body}");
        match sections.iter_mut().find(|(known, _)| *known == title) {
            Some((_, known)) => *known = body,
            None => sections.push((title, body)),
        }
    }
    let opening = before.split("\n## ").next().unwrap_or_default();
    let end = |body: &str| body.trim_end_matches('\n').to_owned() + "\n";
    let sections = sections.iter().map(|(title, body)| format!("\n## {title}\n{}", end(body)));
    end(opening) + &sections.collect::<String>()
}

/// The table of one lattice.
pub fn lattice(title: &str, rows: &[LatticeRow]) -> String {
    let mut text = format!(
        "\n## {title}\n\n\
         | mesh | vertices | base | connectivity | geometry | total | Draco | size | encode rate \
         | decode rate | encode memory | decode memory | kept |\n\
         |---|--:|--:|--:|--:|--:|--:|--:|--:|--:|--:|--:|--:|\n"
    );
    for row in rows {
        let bits = |bytes: u64| 8.0 * row.per_vertex(bytes);
        let rate = |rate: Option<f64>| rate.map_or("–".into(), |rate| format!("{rate:.2}"));
        writeln!(
            text,
            "| {} | {} | {} | {:.2} | {:.2} | {:.2} | {:.2} | {:.3} | {} | {} | {:.0} | {:.0} | {} |",
            row.mesh,
            row.vertices,
            row.base_vertices,
            bits(row.connectivity_bytes),
            bits(row.bytes.saturating_sub(row.connectivity_bytes)),
            bits(row.bytes),
            bits(row.draco_bytes),
            row.size_ratio(),
            rate(row.rates.map(|rates| rates.0)),
            rate(row.rates.map(|rates| rates.1)),
            row.per_vertex(row.encode_peak),
            row.per_vertex(row.decode_peak),
            row.draco_vertices,
        )
        .expect("a string takes every line");
    }
    let mean = |value: &dyn Fn(&LatticeRow) -> Option<f64>, digits: usize| {
        geometric_mean(rows.iter().filter_map(value)).map_or("–".into(), |mean| format!("{mean:.digits$}"))
    };
    text + &format!(
        "| *geometric mean* | | | | | {} | {} | **{}** | **{}** | **{}** | {} | {} | |\n",
        mean(&|row| Some(8.0 * row.per_vertex(row.bytes)), 2),
        mean(&|row| Some(8.0 * row.per_vertex(row.draco_bytes)), 2),
        mean(&|row| Some(row.size_ratio()), 3),
        mean(&|row| row.rates.map(|rates| rates.0), 2),
        mean(&|row| row.rates.map(|rates| rates.1), 2),
        mean(&|row| Some(row.per_vertex(row.encode_peak)), 0),
        mean(&|row| Some(row.per_vertex(row.decode_peak)), 0),
    )
}

/// The tables of remeshes, one a placement.
pub fn remeshed(rows: &[RemeshedRow]) -> String {
    let mut text = format!(
        "\n## Remeshed to √3 connectivity\n\n\
         \"error\" is the root mean square distance from the original, as a part of its diagonal; \"size\" our\n\
         bytes over those of Draco's level 10 on the same remesh, on lattices of {} and {} bits.\n",
        REMESH_BITS[0], REMESH_BITS[1],
    );
    for same in rows.chunk_by(|a, b| a.placement == b.placement) {
        write!(
            text,
            "\n| {} | base | vertices | error | folded | seconds | size, {} bits | size, {} bits |\n\
             |---|--:|--:|--:|--:|--:|--:|--:|\n",
            same[0].placement, REMESH_BITS[0], REMESH_BITS[1],
        )
        .expect("a string takes every line");
        for RemeshedRow { mesh, remeshed, size_ratios: [first, second], .. } in same {
            let Remeshed { vertices, base_vertices, rms, folded, seconds } = remeshed;
            writeln!(
                text,
                "| {mesh} | {base_vertices} | {vertices} | {rms:.1e} | {folded} | {seconds:.0} | {first:.3} | {second:.3} |",
            )
            .expect("a string takes every line");
        }
        let mean = |k: usize| geometric_mean(same.iter().map(|row| row.size_ratios[k])).unwrap_or(f64::NAN);
        text += &format!("| *geometric mean* | | | | | | **{:.3}** | **{:.3}** |\n", mean(0), mean(1));
    }
    text
}

/// The table of lossy files.
pub fn rate(rows: &[RateRow]) -> String {
    let mut text = String::from(
        "\n## Rate and distortion of lossy files\n\n\
         The best file of at most so many bytes: `tercet encode --max-bytes`, and meshoptimizer's quadric simplification\n\
         to any number of faces (vertices kept or moved, whichever is better) coded by Draco level 10 on any lattice of 6 to 14\n\
         bits. PSNR against the original as `tercet metrics` tells it: 20 log10(diagonal / RMS).\n\n\
         | mesh | at most | ours | holds | vertices | PSNR | seconds | peer | faces | bits | PSNR | gain |\n\
         |---|--:|--:|---|--:|--:|--:|--:|--:|--:|--:|--:|\n",
    );
    for RateRow { mesh, budget, ours, peer } in rows {
        writeln!(
            text,
            "| {mesh} | {budget} | {} | {} | {} | {:.2} | {:.0} | {} | {} | {} | {:.2} | **{:+.2}** |",
            ours.bytes,
            if ours.remeshed { "a remesh" } else { "its vertices" },
            ours.vertices,
            ours.psnr,
            ours.seconds,
            peer.bytes,
            peer.faces,
            peer.bits,
            peer.psnr,
            ours.psnr - peer.psnr,
        )
        .expect("a string takes every line");
    }
    text
}

/// The table of exact coding.
pub fn exact(rows: &[ExactRow]) -> String {
    let mut text = String::from(
        "\n## Exact float32\n\n\
         Bits per vertex; \"size\" is ours over the smaller peer. Draco without quantisation, the smaller \
         of levels 7 and 10.\n\n\
         | mesh | vertices | ours | Draco | meshopt + zstd -19 | size |\n|---|--:|--:|--:|--:|--:|\n",
    );
    for row in rows {
        let bits = |bytes: u64| 8.0 * bytes as f64 / row.vertices as f64;
        let meshopt = row.meshopt_bytes.map_or("–".into(), |bytes| format!("{:.2}", bits(bytes)));
        writeln!(
            text,
            "| {} | {} | {:.2} | {:.2} | {meshopt} | {:.3} |",
            row.mesh,
            row.vertices,
            bits(row.bytes),
            bits(row.draco_bytes),
            row.size_ratio(),
        )
        .expect("a string takes every line");
    }
    let mean = geometric_mean(rows.iter().map(ExactRow::size_ratio));
    text + &mean.map_or(String::new(), |mean| format!("| *geometric mean* | | | | | **{mean:.3}** |\n"))
}

/// The mean of positive values, as exp of the mean logarithm; none of none.
fn geometric_mean(values: impl Iterator<Item = f64>) -> Option<f64> {
    let (sum, count) = values.fold((0.0, 0u32), |(sum, count), value| (sum + value.ln(), count + 1));
    (count > 0).then(|| (sum / f64::from(count)).exp())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_geometric_mean_of_a_number_and_its_inverse_is_one() {
        assert!((geometric_mean([4.0, 0.25].into_iter()).unwrap() - 1.0).abs() < 1e-12);
        assert_eq!(geometric_mean(std::iter::empty()), None);
    }

    #[test]
    fn some_tables_replace_those_of_their_titles_and_leave_the_others() {
        let before = "# Benchmarks\n\nMade.\n\n## One\n\nold\n\n## Two\n\nkept\n";
        let after = merged(before, "\n## One\n\nnew\n\n## Three\n\nmore\n", "Made so.\n");
        assert_eq!(
            after,
            "# Benchmarks\n\nMade.\n\n## One\n\nMade so.\n\nnew\n\n## Two\n\nkept\n\n## Three\n\nMade so.\n\nmore\n"
        );
    }

    #[test]
    fn the_exact_ratio_is_taken_against_the_smaller_peer() {
        let row = |meshopt_bytes| ExactRow {
            mesh: String::new(),
            vertices: 1,
            bytes: 30,
            draco_bytes: 60,
            meshopt_bytes,
        };
        assert_eq!(row(None).size_ratio(), 0.5);
        assert_eq!(row(Some(40)).size_ratio(), 0.75);
    }
}
