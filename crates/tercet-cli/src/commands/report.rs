//! `tercet report`: a mesh, its levels and what they cost, on one page.

use std::fs;
use std::path::{Path, PathBuf};

use anyhow::{Context, Result};
use tercet::io::Format;
use tercet::metrics::{MetricsOptions, TriangleTree, compare};
use tercet::{EncodeOptions, Encoded, Level, Limits, Mesh};

use super::render::{Look, counts, diagonal};
use super::{Plan, Schemes, encode_shown};
use crate::console::Console;
use crate::page::{Figure, Page};
use crate::picture::{Camera, Picture, Size, Style, width_for_surface};
use crate::plot::{Plot, Point, Series};
use crate::table::Table;
use crate::{Outcome, args, files, input, report as words};

#[derive(Debug, clap::Args)]
pub struct ReportArgs {
    /// A mesh file; - for standard input.
    pub mesh: PathBuf,
    /// The folder to write: index.html, which holds all that it shows, and the pictures as files.
    #[arg(short, long, value_name = "DIR")]
    pub output: PathBuf,
    #[command(flatten)]
    pub look: Look,
    /// The format of MESH [default: by its suffix].
    #[arg(long, value_parser = args::format)]
    pub format: Option<Format>,
}

/// Samples for each signal-to-noise ratio: enough for two decimals.
const SAMPLES: usize = 100_000;
/// Lattices of the whole files that levels are compared with.
const LATTICES: [u8; 6] = [6, 7, 8, 10, 12, 14];
/// Levels that are taken apart, in parts of the finest one's number.
const TAKEN_APART: [f64; 3] = [0.4, 0.7, 1.0];

pub fn report(args: &ReportArgs, limits: &Limits, console: &Console) -> Result<Outcome> {
    let name = files::name(&args.mesh);
    let mesh = files::read_mesh(&args.mesh, args.format, limits, console)?;
    let encoded = encode_shown(&mesh, &EncodeOptions::default(), console).with_context(|| name.clone())?;
    let levels = input::all_levels(&encoded.bytes, limits)?;
    let mut report = Report::new(&mesh, &encoded, &levels, args).with_context(|| name.clone())?;
    let title = args.mesh.file_name().map_or(name.clone(), |name| name.to_string_lossy().into_owned());
    let mut page = Page::new(&title);
    report.surface(&mut page).with_context(|| name.clone())?;
    report.levels(&mut page)?;
    report.steps(&mut page)?;
    report.rates(&mut page, limits, console).with_context(|| name.clone())?;
    report.schemes(&mut page, limits, console).with_context(|| name)?;
    let path = args.output.join("index.html");
    files::write_bytes(page.html().as_bytes(), &path)?;
    console.report(&format!("{}: {} pictures", path.display(), report.pictures), &path)?;
    Ok(Outcome::Good)
}

/// What the sections of a page are made from.
struct Report<'a> {
    mesh: &'a Mesh,
    encoded: &'a Encoded,
    /// With predictions; the finest once more if it was restored.
    levels: &'a [Level],
    look: &'a Look,
    folder: &'a Path,
    diagonal: f64,
    /// Drawn so far.
    pictures: usize,
}

impl<'a> Report<'a> {
    fn new(mesh: &'a Mesh, encoded: &'a Encoded, levels: &'a [Level], args: &'a ReportArgs) -> Result<Self> {
        let folder = &args.output;
        fs::create_dir_all(folder).with_context(|| folder.display().to_string())?;
        Ok(Report { mesh, encoded, levels, look: &args.look, folder, diagonal: diagonal(mesh), pictures: 0 })
    }

    /// Draws a picture, writes it as a file and returns it for the page: seen from where the original
    /// fills it.
    fn draw(&mut self, name: &str, mesh: &Mesh, style: Style, caption: String) -> Result<Figure> {
        let size = self.look.size;
        let space = Size { width: width_for_surface(&style, size.width), ..size };
        let camera = Camera::fit(self.mesh, &self.look.view(self.mesh), space)?;
        // Transparent: on the page it lies on light and on dark grounds.
        let picture =
            Picture { mesh, style, flat: self.look.flat, background: self.look.background.and_then(|b| b.0) };
        let png = picture.draw(&camera, size).png()?;
        files::write_bytes(&png, &self.folder.join(format!("{name}.png")))?;
        self.pictures += 1;
        Ok(Figure { png, size, caption })
    }

    /// The levels, each once: the finest as it was coded.
    fn coded(&self) -> impl Iterator<Item = &'a Level> + use<'a> {
        let levels = self.levels;
        levels.iter().enumerate().filter(|(i, level)| level.level as usize == *i).map(|(_, level)| level)
    }

    fn surface(&mut self, page: &mut Page) -> Result<()> {
        page.paragraph(&format!("{}, {}.", counts(self.mesh), words::total(&self.encoded.info)));
        let shaded = self.draw("surface", self.mesh, Style::Shaded, "The mesh".into())?;
        let wired = self.draw("edges", self.mesh, Style::Wireframe, "Its edges".into())?;
        page.figures(&[shaded, wired]);
        Ok(())
    }

    fn levels(&mut self, page: &mut Page) -> Result<()> {
        page.heading("Levels");
        page.paragraph(
            "Every beginning of the file is a coarser mesh. Bytes are those from the file's start; an error is \
             the root mean square distance of the original's vertices, as a part of the bounding box's diagonal.",
        );
        let infos = &self.encoded.info.levels;
        let mut figures = Vec::new();
        for (level, info) in self.coded().zip(infos) {
            let caption = format!(
                "Level {}: {}, {} bytes, error {}",
                level.level,
                counts(&level.mesh),
                info.bytes,
                words::error(info.error)
            );
            let name = format!("level-{:02}", level.level);
            figures.push(self.draw(&name, &level.mesh, Style::Wireframe, caption)?);
        }
        page.figures(&figures);
        page.table(&words::level_table(&self.encoded.info));
        Ok(())
    }

    /// Some levels taken apart: their vertices divided, the level below refined without details, and
    /// what the details have to make good.
    fn steps(&mut self, page: &mut Page) -> Result<()> {
        page.heading("Vertex division and details");
        page.paragraph(
            "Even vertices (blue) are those that a level keeps of the one below; odd ones (orange) are added. \
             Without its details a level is the one below, refined: its new vertices lie where they are \
             predicted. The colours show how far that surface is from the level.",
        );
        let finest = self.encoded.info.levels.len() - 1;
        let mut numbers = TAKEN_APART.map(|part| (part * finest as f64).round() as usize).to_vec();
        numbers.dedup();
        for level in self.coded().filter(|level| numbers.contains(&(level.level as usize))) {
            let Some(predicted) = &level.predicted else { continue };
            let k = level.level;
            let bare = Mesh { positions: predicted.clone(), faces: level.mesh.faces.clone() };
            let reference = TriangleTree::new(&level.mesh)?;
            let division = Style::Division { kept: level.kept };
            let error = Style::Error { reference: &reference, diagonal: self.diagonal, scale: None };
            let odd = level.mesh.positions.len() - level.kept as usize;
            let division_caption = format!("Level {k}: {} even and {odd} odd vertices", level.kept);
            let bare_caption = format!("Level {k} without its details");
            let error_caption = format!("How far that is from level {k}, as a part of the diagonal");
            page.figures(&[
                self.draw(&format!("division-{k:02}"), &level.mesh, division, division_caption)?,
                self.draw(&format!("without-details-{k:02}"), &bare, Style::Shaded, bare_caption)?,
                self.draw(&format!("error-{k:02}"), &bare, error, error_caption)?,
            ]);
        }
        Ok(())
    }

    /// Bytes against signal-to-noise ratios: of every level, and of whole files on coarser lattices.
    fn rates(&mut self, page: &mut Page, limits: &Limits, console: &Console) -> Result<()> {
        page.heading("Rate and distortion");
        page.paragraph(
            "PSNR is 20 log10(diagonal / RMS), of the distance of the two surfaces in the worse direction. \
             A file on a lattice is rounded, and has to arrive whole; every level of the exact file is one of \
             its beginnings.",
        );
        let mut table = Table::new(["file", "bytes", "RMS", "Hausdorff at most", "PSNR in dB"]);
        let mut of_levels = Vec::new();
        for (level, info) in self.coded().zip(&self.encoded.info.levels) {
            let name = format!("exact, level {}", level.level);
            of_levels.extend(self.measure(&mut table, name, info.bytes, &level.mesh)?);
        }
        let mut of_files = Vec::new();
        for bits in LATTICES {
            let options = EncodeOptions { bits: Some(bits), ..EncodeOptions::default() };
            let file = encode_shown(self.mesh, &options, console)?;
            let mesh = tercet::decode(&file.bytes, limits)?;
            let name = format!("{bits}-bit lattice, whole");
            of_files.extend(self.measure(&mut table, name, file.info.bytes, &mesh)?);
        }
        page.plot(&Plot {
            x_label: "bytes",
            y_label: "PSNR in dB",
            series: vec![
                Series { name: "levels of the exact file".into(), points: of_levels },
                Series { name: "whole files on lattices".into(), points: of_files },
            ],
        });
        page.table(&table);
        Ok(())
    }

    /// The paper's comparison of schemes.
    fn schemes(&self, page: &mut Page, limits: &Limits, console: &Console) -> Result<()> {
        page.heading("Both subdivision schemes");
        let metrics = MetricsOptions { samples: SAMPLES / 4, ..MetricsOptions::default() };
        let plan = Plan { levels: 2, bits: 12, metrics };
        for (title, table) in Schemes::new(self.mesh, plan, limits, console)?.tables() {
            page.paragraph(&title);
            page.table(&table);
        }
        Ok(())
    }

    /// Adds a row, and returns the point for the plot: none for a level without a surface, nor where
    /// there is no difference.
    fn measure(&self, table: &mut Table, name: String, bytes: u64, mesh: &Mesh) -> Result<Option<Point>> {
        if mesh.faces.is_empty() {
            return Ok(None);
        }
        let options = MetricsOptions { samples: SAMPLES, ..MetricsOptions::default() };
        let found = compare(self.mesh, mesh, &options)?;
        let part = |length: f64| words::error((length / found.diagonal) as f32);
        let psnr = found.psnr();
        table.row([
            name,
            bytes.to_string(),
            part(found.rms()),
            part(found.hausdorff_at_most()),
            if psnr.is_finite() { format!("{psnr:.2}") } else { "no difference".into() },
        ]);
        Ok(psnr.is_finite().then_some(Point { x: bytes as f64, y: psnr, band: None }))
    }
}
