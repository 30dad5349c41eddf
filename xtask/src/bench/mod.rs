//! `cargo xtask bench`: size, speed and memory against Draco, and meshoptimizer where nothing is rounded.
//!
//! All coders get the same file: positions and faces only, as the library reads them from the corpus.
//! They code on the same lattice (step = longest side of the bounding box / (2^bits − 1)). Draco's
//! size is the smaller of its levels 7 and 10; its speed is that of level 10. Every timed run is a new
//! process that times its own coding without reading and writing files, and ours alternate with Draco's.

mod draco;
mod meshopt;
mod openctm;
mod ours;
mod peers;
mod rate;
mod report;
mod scale;
mod spread;

use crate::arguments::Arguments;
use crate::process::root;
use anyhow::{Context, Result, bail};
use report::{ExactRow, LatticeRow, RemeshedRow};
use spread::Spread;
use std::fs;
use std::path::{Path, PathBuf};

/// Meshes with more vertices than this have times long enough to compare.
const TIMED_VERTICES: u64 = 10_000;
/// Meshes with at most this many vertices serve as bases of refined meshes.
const BASE_VERTICES: u64 = 8_000;
const REFINED_STEPS: u32 = 2;
const REFINED_BITS: u8 = 12;
/// Steps above the base of a remesh.
const REMESH_LEVELS: u32 = 5;
/// As parts of the mean edge; without noise, details are rounding only.
const NOISE: [f32; 2] = [0.02, 0.0];
/// Subdivision schemes: as a table's name and in its title.
const SCHEMES: [(&str, &str); 2] = [("sqrt3", "√3"), ("butterfly", "Butterfly")];

const TABLES: [&str; 8] = ["lattice", "sqrt3", "butterfly", "remesh", "rate", "exact", "peers", "scale"];

struct Options {
    corpus: PathBuf,
    only: Option<Vec<String>>,
    bits: Vec<u8>,
    tables: Vec<String>,
    /// Whether only some tables are made: the others stay in `BENCHMARKS.md` as they are.
    some: bool,
    runs: usize,
    effort: String,
    write: bool,
}

impl Options {
    fn parse(words: &[String]) -> Result<Self> {
        let mut arguments = Arguments::new(words);
        let given = arguments.value::<PathBuf>("--corpus")?;
        let named = || std::env::var_os("TERCET_CORPUS").map(PathBuf::from);
        let tables = arguments.list("--tables")?;
        let options = Options {
            corpus: given.or_else(named).unwrap_or_else(|| root().join("../shared/models")),
            only: arguments.list("--only")?,
            bits: arguments.list("--bits")?.unwrap_or_else(|| vec![10, 12, 14]),
            some: tables.is_some(),
            tables: tables.unwrap_or_else(|| TABLES.map(String::from).to_vec()),
            runs: arguments.value("--runs")?.unwrap_or(5).max(1),
            effort: arguments.value("--effort")?.unwrap_or_else(|| "default".to_owned()),
            write: arguments.flag("--write"),
        };
        arguments.finish()?;
        Ok(options)
    }

    fn wants(&self, table: &str) -> bool {
        self.tables.iter().any(|wanted| wanted == table)
    }
}

/// A mesh as all coders get it.
struct Subject {
    name: String,
    ply: PathBuf,
    vertices: u64,
    faces: u64,
    /// The longest side of the bounding box.
    side: f64,
}

impl Subject {
    fn new(name: String, ply: PathBuf, summary: ours::Summary) -> Self {
        let ours::Summary { vertices, faces, side } = summary;
        Subject { name, ply, vertices, faces, side }
    }
}

pub fn run(words: &[String]) -> Result<()> {
    let options = Options::parse(words)?;
    draco::set_up()?;
    let ours = ours::Program::build(&options.effort)?;
    let scratch = Scratch::new()?;
    // One table makes its meshes itself.
    let takes_corpus = options.tables.iter().any(|table| table != "scale");
    let subjects = if takes_corpus { subjects(&options, &ours, &scratch)? } else { Vec::new() };
    let mut text = String::new();
    if options.wants("lattice") {
        for &bits in &options.bits {
            let rows = lattice_rows(&subjects, bits, options.runs, &ours, &scratch)?;
            text += &report::lattice(&format!("On a lattice of {bits} bits"), &rows);
        }
    }
    for (scheme, title) in SCHEMES.into_iter().filter(|(scheme, _)| options.wants(scheme)) {
        let refined = refined(&subjects, scheme, &ours, &scratch)?;
        let rows = lattice_rows(&refined, REFINED_BITS, options.runs, &ours, &scratch)?;
        let title = format!(
            "{title} connectivity: {REFINED_STEPS} steps on an irregular base, shuffled, with noise of a part of \
             the mean edge and without; {REFINED_BITS} bits"
        );
        text += &report::lattice(&title, &rows);
    }
    if options.wants("remesh") {
        text += &report::remeshed(&remeshed_rows(&subjects, &ours, &scratch)?);
    }
    if options.wants("rate") {
        text += &report::rate(&rate::rows(&subjects, &ours, &scratch)?);
    }
    if options.wants("exact") {
        text += &report::exact(&exact_rows(&subjects, &ours, &scratch)?);
    }
    if options.wants("peers") {
        text += &report::peers(&peers::rows(&subjects, options.runs, &ours, &scratch)?);
    }
    if options.wants("scale") {
        text += &report::scale(&scale::rows(options.runs, &ours, &scratch)?);
    }
    let opening = report::opening(words);
    println!("\n{opening}{text}");
    if options.write {
        let file = root().join("BENCHMARKS.md");
        let whole = match options.some {
            false => opening + &text,
            true => {
                let before = fs::read_to_string(&file).context("reading BENCHMARKS.md")?;
                report::merged(&before, &text, &report::origin(words))
            }
        };
        fs::write(file, whole).context("writing BENCHMARKS.md")?;
    }
    Ok(())
}

/// The corpus's meshes in the order of their names, each converted for all coders.
fn subjects(options: &Options, ours: &ours::Program, scratch: &Scratch) -> Result<Vec<Subject>> {
    let folder = &options.corpus;
    let entries = fs::read_dir(folder).with_context(|| format!("reading the corpus {}", folder.display()))?;
    let mut files = entries.map(|entry| Ok(entry?.path())).collect::<Result<Vec<_>>>()?;
    files.sort();
    let mut subjects = Vec::new();
    for file in files {
        let suffix = file.extension().unwrap_or_default().to_string_lossy().to_lowercase();
        let name = file.file_stem().unwrap_or_default().to_string_lossy().into_owned();
        let wanted = options.only.as_ref().is_none_or(|only| only.contains(&name));
        if wanted && ["obj", "ply", "stl", "off"].contains(&suffix.as_str()) {
            let ply = scratch.file(&format!("{name}.ply"));
            let summary = ours.convert(&file, &ply)?;
            subjects.push(Subject::new(name, ply, summary));
        }
    }
    if subjects.is_empty() {
        bail!("no mesh to compare in {}", folder.display());
    }
    Ok(subjects)
}

/// The small subjects after steps of a scheme, shuffled, with noise and without. Meshes that refinement
/// refuses are left out.
fn refined(
    subjects: &[Subject],
    scheme: &str,
    ours: &ours::Program,
    scratch: &Scratch,
) -> Result<Vec<Subject>> {
    let mut refined = Vec::new();
    for base in subjects.iter().filter(|base| base.vertices <= BASE_VERTICES) {
        for noise in NOISE {
            let name = format!("{}-{scheme}-{noise}", base.name);
            let ply = scratch.file(&format!("{name}.ply"));
            match ours.refine(&base.ply, &ply, scheme, REFINED_STEPS, noise) {
                Ok(summary) => refined.push(Subject::new(name, ply, summary)),
                Err(error) => println!("{name}: left out: {error:#}"),
            }
        }
    }
    Ok(refined)
}

fn lattice_rows(
    subjects: &[Subject],
    bits: u8,
    runs: usize,
    ours: &ours::Program,
    scratch: &Scratch,
) -> Result<Vec<LatticeRow>> {
    let rows = subjects.iter().map(|subject| {
        let row = lattice_row(subject, bits, runs, ours, scratch);
        let row = row.with_context(|| format!("{} at {bits} bits", subject.name))?;
        println!("{} at {bits} bits: {:.3} of Draco's size", row.mesh, row.size_ratio());
        Ok(row)
    });
    rows.collect()
}

fn lattice_row(
    subject: &Subject,
    bits: u8,
    runs: usize,
    ours: &ours::Program,
    scratch: &Scratch,
) -> Result<LatticeRow> {
    let (tct, drc, ply) = (scratch.file("a.tct"), scratch.file("a.drc"), scratch.file("decoded.ply"));
    let level_7 = draco::encode(&subject.ply, &drc, Some(bits), 7)?;
    let timed = subject.vertices > TIMED_VERTICES;
    let (mut encode_rates, mut decode_rates) = (Vec::new(), Vec::new());
    let mut last = None;
    for _ in 0..if timed { runs } else { 1 } {
        let encoded = ours.encode(&subject.ply, &tct, Some(bits))?;
        let level_10 = draco::encode(&subject.ply, &drc, Some(bits), 10)?;
        encode_rates.push(level_10.seconds / encoded.seconds);
        let decoded = ours.decode(&tct)?;
        let draco_decoded = draco::decode(&drc, &ply)?;
        decode_rates.push(draco_decoded.seconds / decoded.seconds);
        last = Some((encoded, decoded, level_10, draco_decoded));
    }
    let (encoded, decoded, level_10, draco_decoded) = last.context("no run")?;
    if (decoded.vertices, decoded.faces) != (subject.vertices, subject.faces) {
        bail!("decoded {} vertices and {} faces", decoded.vertices, decoded.faces);
    }
    Ok(LatticeRow {
        mesh: subject.name.clone(),
        vertices: subject.vertices,
        bytes: encoded.bytes,
        connectivity_bytes: encoded.connectivity_bytes,
        base_vertices: encoded.base_vertices,
        draco_bytes: level_7.bytes.min(level_10.bytes),
        draco_vertices: draco_decoded.vertices,
        rates: Spread::of(encode_rates).zip(Spread::of(decode_rates)).filter(|_| timed),
        encode_peak: encoded.peak_bytes,
        decode_peak: decoded.peak_bytes,
    })
}

/// The subjects after remeshing, by both placements; those that cannot be remeshed are left out.
fn remeshed_rows(subjects: &[Subject], ours: &ours::Program, scratch: &Scratch) -> Result<Vec<RemeshedRow>> {
    let (ply, tct, drc) = (scratch.file("remeshed.ply"), scratch.file("a.tct"), scratch.file("a.drc"));
    let mut rows = Vec::new();
    for placement in ["normal", "relaxed"] {
        for subject in subjects {
            let remeshed = match ours.remesh(&subject.ply, &ply, REMESH_LEVELS, placement) {
                Ok(remeshed) => remeshed,
                Err(error) => {
                    println!("{}, {placement}: left out: {error:#}", subject.name);
                    continue;
                }
            };
            let mut size_ratios = [0.0; 2];
            for (ratio, bits) in size_ratios.iter_mut().zip(report::REMESH_BITS) {
                let bytes = ours.encode(&ply, &tct, Some(bits))?.bytes;
                *ratio = bytes as f64 / draco::encode(&ply, &drc, Some(bits), 10)?.bytes as f64;
            }
            println!("{}, {placement}: {size_ratios:.3?} of Draco's size", subject.name);
            rows.push(RemeshedRow { mesh: subject.name.clone(), placement, remeshed, size_ratios });
        }
    }
    Ok(rows)
}

fn exact_rows(subjects: &[Subject], ours: &ours::Program, scratch: &Scratch) -> Result<Vec<ExactRow>> {
    let meshopt = meshopt::Program::set_up();
    if let Err(why) = &meshopt {
        println!("without meshoptimizer: {why:#}");
    }
    let (tct, drc) = (scratch.file("a.tct"), scratch.file("a.drc"));
    let rows = subjects.iter().map(|subject| {
        let draco_bytes = [7, 10]
            .map(|level| draco::encode(&subject.ply, &drc, None, level).map(|encoded| encoded.bytes))
            .into_iter()
            .collect::<Result<Vec<_>>>()?;
        let meshopt = meshopt.as_ref().ok().map(|it| it.encode(&subject.ply, &scratch.0)).transpose();
        let row = ExactRow {
            mesh: subject.name.clone(),
            vertices: subject.vertices,
            bytes: ours.encode(&subject.ply, &tct, None)?.bytes,
            draco_bytes: draco_bytes.into_iter().min().context("no level")?,
            meshopt_bytes: meshopt.with_context(|| format!("meshoptimizer on {}", subject.name))?,
        };
        println!("{} exact: {:.3} of the best peer's size", row.mesh, row.size_ratio());
        Ok(row)
    });
    rows.collect()
}

/// A folder in memory where the system has one, removed at the end.
struct Scratch(PathBuf);

impl Scratch {
    fn new() -> Result<Self> {
        let memory = Path::new("/dev/shm");
        let parent = if memory.is_dir() { memory.to_path_buf() } else { std::env::temp_dir() };
        let folder = parent.join(format!("tercet-bench-{}", std::process::id()));
        fs::create_dir_all(&folder).with_context(|| format!("creating {}", folder.display()))?;
        Ok(Scratch(folder))
    }

    fn file(&self, name: &str) -> PathBuf {
        self.0.join(name)
    }
}

impl Drop for Scratch {
    fn drop(&mut self) {
        // A folder that is left behind does no harm, and there is nobody to tell.
        let _ = fs::remove_dir_all(&self.0);
    }
}
