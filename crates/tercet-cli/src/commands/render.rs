//! `tercet render`.

use std::path::PathBuf;

use anyhow::{Context, Result, bail};
use clap::ValueEnum;
use tercet::io::Format;
use tercet::metrics::TriangleTree;
use tercet::{Level, Limits, Mesh};

use crate::console::Console;
use crate::picture::{Camera, Colour, Picture, Size, Style, Up, View, stance, width_for_surface};
use crate::{Outcome, args, files, input};

#[derive(Debug, clap::Args)]
pub struct RenderArgs {
    /// A mesh or .tct file; - for standard input.
    pub file: PathBuf,
    /// The PNG file to write; - for standard output.
    #[arg(short, long, value_name = "PNG")]
    pub output: PathBuf,
    /// What to show.
    #[arg(long, default_value = "shaded")]
    pub mode: Mode,
    /// Show this level, 0 being the base, from where the finest fills the picture [default: the finest].
    /// A mesh file is encoded for that.
    #[arg(long, value_name = "K")]
    pub level: Option<u32>,
    /// Show the level below refined to this one without its details.
    #[arg(long)]
    pub without_details: bool,
    /// What errors are distances from [default: the finest level; of a level without its details, the
    /// level with them].
    #[arg(long, value_name = "MESH")]
    pub reference: Option<PathBuf>,
    /// The error that the last colour stands for, as a part of the bounding box's diagonal [default: as
    /// the picture needs it].
    #[arg(long, value_name = "E", value_parser = args::error)]
    pub scale: Option<f32>,
    #[command(flatten)]
    pub look: Look,
    /// The format of mesh files [default: by their suffix].
    #[arg(long, value_parser = args::format)]
    pub format: Option<Format>,
}

/// From where, and how large.
#[derive(Clone, Debug, clap::Args)]
pub struct Look {
    /// Width and height in pixels, at most 4096.
    #[arg(long, value_name = "WxH", default_value = "800x600", value_parser = size)]
    pub size: Size,
    /// The camera's direction around the upward axis, in degrees; 0 is in front: z, or −y where z is up
    /// [default: 30 beside the front, or the back if the mesh's top leans to it].
    #[arg(long, value_name = "DEGREES", allow_negative_numbers = true, value_parser = degrees)]
    pub azimuth: Option<f64>,
    /// The camera's direction above the horizon, in degrees.
    #[arg(long, value_name = "DEGREES", default_value_t = 20.0, allow_negative_numbers = true, value_parser = degrees)]
    pub elevation: f64,
    /// The axis that points up: x, y, z, -x, -y or -z [default: y, or z if the mesh stands well only so].
    #[arg(long, value_name = "AXIS", allow_hyphen_values = true, value_parser = up)]
    pub up: Option<Up>,
    /// Show every face flat [default: smooth but for creases].
    #[arg(long)]
    pub flat: bool,
    /// Behind the surface: none, or #rrggbb; unless given, white for a single picture and none on a page.
    #[arg(long, value_name = "COLOUR", value_parser = background)]
    pub background: Option<Background>,
}

#[derive(Clone, Copy, Debug)]
pub struct Background(pub Option<Colour>);

#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum Mode {
    /// The surface.
    Shaded,
    /// The surface with its edges.
    Wireframe,
    /// The vertices that a level keeps of the one below (even, blue), and those that it adds (odd, orange).
    Division,
    /// The distance from the finest level or from --reference, in colours.
    Error,
}

impl Look {
    /// From where to see a mesh: as was asked, and otherwise as it stands best.
    pub fn view(&self, mesh: &Mesh) -> View {
        let up = self.up.unwrap_or_else(|| stance::upward(mesh));
        let azimuth = self.azimuth.unwrap_or_else(|| stance::azimuth(mesh, up));
        View { azimuth, elevation: self.elevation, up }
    }
}

/// What is drawn.
struct Subject {
    mesh: Mesh,
    /// Even vertices.
    kept: u32,
    /// What fills the picture: the finest mesh.
    framed: Mesh,
    /// What errors are distances from.
    reference: Option<Mesh>,
    /// In words.
    what: String,
}

pub fn render(args: &RenderArgs, limits: &Limits, console: &Console) -> Result<Outcome> {
    let name = files::name(&args.file);
    let mut subject = subject(args, limits, console)?;
    if let Some(path) = &args.reference {
        if args.mode != Mode::Error {
            bail!("--reference is for --mode error");
        }
        subject.reference = Some(input::mesh(path, args.format, limits, console)?);
    }
    let tree = match (args.mode, &subject.reference) {
        (Mode::Error, Some(mesh)) => Some(TriangleTree::new(mesh)?),
        (Mode::Error, None) => {
            bail!("{name}: an error is a distance from another mesh: name it with --reference")
        }
        _ => None,
    };
    let style = match (args.mode, &tree) {
        (_, Some(reference)) => {
            Style::Error { reference, diagonal: diagonal(&subject.framed), scale: args.scale.map(f64::from) }
        }
        (Mode::Division, _) => Style::Division { kept: subject.kept },
        (Mode::Wireframe, _) => Style::Wireframe,
        _ => Style::Shaded,
    };
    let space = Size { width: width_for_surface(&style, args.look.size.width), ..args.look.size };
    let camera = Camera::fit(&subject.framed, &args.look.view(&subject.framed), space)
        .with_context(|| name.clone())?;
    let background = args.look.background.map_or(Some(Colour([255; 3])), |background| background.0);
    let picture = Picture { mesh: &subject.mesh, style, flat: args.look.flat, background };
    files::write_bytes(&picture.draw(&camera, args.look.size).png()?, &args.output)?;
    console.report(&format!("{}: {}", args.output.display(), subject.what), &args.output)?;
    Ok(Outcome::Good)
}

fn subject(args: &RenderArgs, limits: &Limits, console: &Console) -> Result<Subject> {
    let name = files::name(&args.file);
    let is_level = args.level.is_some() || args.without_details || args.mode == Mode::Division;
    if !is_level && !input::is_progressive(&args.file) {
        let mesh = input::mesh(&args.file, args.format, limits, console)?;
        let what = counts(&mesh);
        return Ok(Subject { kept: 0, framed: mesh.clone(), reference: None, what, mesh });
    }
    let mut levels = input::levels(&args.file, args.format, limits, console)?;
    let Some(finest) = levels.last().map(|level| (level.level, level.mesh.clone())) else {
        bail!("{name}: there is no level in it");
    };
    let asked = args.level.unwrap_or(finest.0);
    // The finest level may come once more, restored: then its vertices may have other numbers.
    let wants_numbers = args.without_details || args.mode == Mode::Division;
    let found = if wants_numbers {
        levels.iter().position(|level| level.level == asked)
    } else {
        levels.iter().rposition(|level| level.level == asked)
    };
    let Some(Level { mesh, kept, predicted, .. }) = found.map(|i| levels.swap_remove(i)) else {
        bail!("{name}: there is no level {asked}: the finest is {}", finest.0);
    };
    let what = format!("level {asked} of 0 to {}", finest.0);
    if !args.without_details {
        let what = format!("{what}, {}", counts(&mesh));
        return Ok(Subject { kept, framed: finest.1.clone(), reference: Some(finest.1), what, mesh });
    }
    let Some(positions) = predicted else {
        bail!("{name}: level 0 has no details: nothing is below it");
    };
    let bare = Mesh { positions, faces: mesh.faces.clone() };
    let what = format!("{what} without its details, {}", counts(&bare));
    Ok(Subject { mesh: bare, kept, framed: finest.1, reference: Some(mesh), what })
}

pub fn counts(mesh: &Mesh) -> String {
    format!("{} vertices, {} faces", mesh.positions.len(), mesh.faces.len())
}

/// The diagonal of the bounding box.
pub fn diagonal(mesh: &Mesh) -> f64 {
    let along = |k: usize| mesh.positions.iter().map(move |p| f64::from(p[k]));
    let side = |k: usize| {
        let (low, high) = along(k).fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), x| (l.min(x), h.max(x)));
        (high - low).max(0.0)
    };
    side(0).hypot(side(1)).hypot(side(2))
}

fn size(text: &str) -> Result<Size, String> {
    let side = |text: &str| text.parse().ok().filter(|side| (16..=4096).contains(side));
    let sides = text.split_once('x').and_then(|(width, height)| Some((side(width)?, side(height)?)));
    let (width, height) = sides.ok_or("a size is WxH, each from 16 to 4096 pixels")?;
    Ok(Size { width, height })
}

fn degrees(text: &str) -> Result<f64, String> {
    let angle = text.parse().ok().filter(|angle: &f64| angle.abs() <= 360.0);
    angle.ok_or_else(|| "an angle is from -360 to 360 degrees".into())
}

fn up(text: &str) -> Result<Up, String> {
    Up::parse(text).ok_or_else(|| "an axis is x, y, z, -x, -y or -z".into())
}

fn background(text: &str) -> Result<Background, String> {
    match text {
        "none" => Ok(Background(None)),
        _ => Colour::parse(text)
            .map(|colour| Background(Some(colour)))
            .ok_or_else(|| "a background is none or #rrggbb".into()),
    }
}
