//! The tables of `BENCHMARKS.md`.

use super::ours::Remeshed;
use super::peers::{self, LOD_RATIO, LOD_VERTICES, PEERS, Peer, PeersRow};
use super::rate::RateRow;
use super::scale::{self, Direction, ScaleRow};
use super::spread::Spread;
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
    pub rates: Option<(Spread, Spread)>,
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
           process that times coding alone, with their quartiles; above 1 is faster than Draco. Smaller meshes\n  \
           are not timed.\n\
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
        let rate = |rate: Option<Spread>| rate.map_or("–".into(), |rate| with_quartiles(rate, 2));
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
        mean(&|row| row.rates.map(|rates| rates.0.median), 2),
        mean(&|row| row.rates.map(|rates| rates.1.median), 2),
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

/// The table of several peers.
pub fn peers(rows: &[PeersRow]) -> String {
    let title = |peer: Peer| match peer {
        Peer::Draco7 => "Draco 7",
        Peer::Draco10 => "Draco 10",
        Peer::Gltfpack => "gltfpack + zstd",
        Peer::OpenCtm => "OpenCTM",
        Peer::Chain => "chain of Draco 10",
    };
    let keeps = |peer: Peer| match peer {
        Peer::Draco7 | Peer::Draco10 => "most vertices",
        Peer::Gltfpack => "distinct used vertices",
        Peer::OpenCtm => "all",
        Peer::Chain => "most vertices",
    };
    let cells = |cell: &dyn Fn(usize) -> String| -> String {
        (0..PEERS.len()).map(|peer| format!(" {} |", cell(peer))).collect()
    };
    let mut text = format!(
        "\n## Against several peers, on a lattice of {bits} bits\n\n\
         \"Ours\" are bits per vertex; of each peer stands our size over its. All round to the same lattice: gltfpack\n\
         by `-cz -vp {bits}`, followed by `zstd -19`; OpenCTM by its method MG2 at level 9, to multiples of the lattice's\n\
         step. Only OpenCTM and we return the vertices and faces that we are given. A chain is a file of Draco's\n\
         level 10 for the mesh and for each of its simplifications (meshoptimizer, vertices chosen), by 1/{LOD_RATIO} from one to\n\
         the next, down to some {LOD_VERTICES} vertices: all bytes, and the time of all. Rates are of meshes of more than\n\
         10 000 vertices, ours over the peer's in paired runs, where the peer tells the time of coding; OpenCTM's includes a file.\n\n\
         | mesh | vertices | ours |{}\n|---|--:|--:|{}\n| *keeps* | | all |{}\n",
        cells(&|peer| title(PEERS[peer]).into()),
        "--:|".repeat(PEERS.len()),
        cells(&|peer| keeps(PEERS[peer]).into()),
        bits = peers::BITS,
    );
    for row in rows {
        let ours = 8.0 * row.bytes as f64 / row.vertices as f64;
        let ratio = |peer: usize| format!("{:.3}", row.bytes as f64 / row.against[peer].bytes as f64);
        text += &format!("| {} | {} | {ours:.2} |{}\n", row.mesh, row.vertices, cells(&ratio));
    }
    let mean = |peer: usize| {
        geometric_mean(rows.iter().map(|row| row.bytes as f64 / row.against[peer].bytes as f64))
            .map_or("–".into(), |mean| format!("**{mean:.3}**"))
    };
    let of_sizes = |shown: &dyn Fn(Spread) -> String| {
        cells(&|peer| peers::size_spread(rows, peer).map_or("–".into(), shown))
    };
    let of_rates = |direction: usize| {
        cells(&|peer| {
            peers::rate_spread(rows, peer, direction).map_or("–".into(), |rate| with_quartiles(rate, 2))
        })
    };
    text + &format!(
        "| *geometric mean* | | |{}\n| *median, quartiles* | | |{}\n| *least, greatest* | | |{}\n\
         | *encode rate: median, quartiles* | | |{}\n| *decode rate: median, quartiles* | | |{}\n",
        cells(&mean),
        of_sizes(&|size| with_quartiles(size, 3)),
        of_sizes(&|size| format!("{:.3}–{:.3}", size.least, size.greatest)),
        of_rates(0),
        of_rates(1),
    )
}

/// The table of how costs grow with the mesh.
pub fn scale(rows: &[ScaleRow]) -> String {
    let mut text = format!(
        "\n## Large meshes\n\n\
         Generated scans (`tercet::shapes::scan`: irregular, a quarter of the vertices in random order) on a lattice of\n\
         {} bits. Time is that of a processor, a vertex, the median of all runs, and over that at the first size in paired runs,\n\
         with quartiles; instructions are those of the whole process (callgrind), a vertex. Memory, in bytes a vertex and with\n\
         the mesh: the process's at its fullest, and where the C library is told to give back at once what is freed\n\
         (`MALLOC_MMAP_THRESHOLD_=131072`), which is what the library holds.\n\n\
         | | vertices | bits per vertex | µs | over the first | instructions | memory | held |\n\
         |---|--:|--:|--:|--:|--:|--:|--:|\n",
        scale::BITS,
    );
    for (d, name) in ["encode", "decode"].into_iter().enumerate() {
        for row in rows {
            let Direction { seconds, ratio, instructions, peak_bytes, held_bytes } = &row.directions[d];
            let each = |amount: u64| format!("{:.0}", amount as f64 / row.vertices as f64);
            writeln!(
                text,
                "| {name} | {} | {:.2} | {:.2} | {} | {} | {} | {} |",
                row.vertices,
                8.0 * row.bytes as f64 / row.vertices as f64,
                1e6 * seconds,
                with_quartiles(*ratio, 2),
                instructions.map_or("–".into(), each),
                each(*peak_bytes),
                each(*held_bytes),
            )
            .expect("a string takes every line");
        }
    }
    text
}

/// "1.00 (0.90–1.10)".
fn with_quartiles(Spread { lower, median, upper, .. }: Spread, digits: usize) -> String {
    format!("{median:.digits$} ({lower:.digits$}–{upper:.digits$})")
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
