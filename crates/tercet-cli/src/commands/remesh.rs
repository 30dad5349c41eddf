//! `tercet remesh`.

use std::path::PathBuf;

use anyhow::{Context, Result};
use tercet::Limits;
use tercet::io::Format;
use tercet::remesh::{Goal, Placement, RemeshOptions, Remeshed, Repairs};

use crate::args::Scheme;
use crate::console::Console;
use crate::{Outcome, args, files, report};

#[derive(Debug, clap::Args)]
pub struct RemeshArgs {
    /// An OBJ, PLY, STL or OFF file; - for standard input.
    pub mesh: PathBuf,
    /// The mesh to write; - for standard output.
    #[arg(short, long, value_name = "OUT")]
    pub output: PathBuf,
    /// The subdivision scheme.
    #[arg(long, default_value = "sqrt3")]
    pub scheme: Scheme,
    /// The largest root mean square distance between the surfaces, as a part of the bounding box's
    /// diagonal [default: 0.0005].
    #[arg(long, value_name = "E", value_parser = args::error, conflicts_with = "levels")]
    pub max_error: Option<f32>,
    /// How many steps shall lead to the result.
    #[arg(long, value_name = "N")]
    pub levels: Option<u32>,
    /// Faces of the result, at most [default: four times those of MESH, at least 200000].
    #[arg(long, value_name = "N")]
    pub max_faces: Option<usize>,
    /// Move new vertices along the predicted normal, the default: the smallest files.
    #[arg(long, conflicts_with = "relaxed")]
    pub normal: bool,
    /// Even the triangles out at the end: larger files, more regular triangles.
    #[arg(long)]
    pub relaxed: bool,
    /// The format of MESH [default: by its suffix].
    #[arg(long, value_parser = args::format)]
    pub format: Option<Format>,
    /// The format of OUT [default: by its suffix].
    #[arg(long, value_name = "FORMAT", value_parser = args::format)]
    pub output_format: Option<Format>,
}

impl RemeshArgs {
    fn options(&self) -> RemeshOptions {
        let usual = RemeshOptions::default();
        RemeshOptions {
            scheme: self.scheme.into(),
            goal: match (self.max_error, self.levels) {
                (_, Some(levels)) => Goal::Levels(levels),
                (Some(error), _) => Goal::MaxError(error.into()),
                (None, None) => usual.goal,
            },
            placement: if self.relaxed { Placement::Relaxed } else { Placement::Normal },
            max_faces: self.max_faces,
        }
    }
}

pub fn remesh(args: &RemeshArgs, limits: &Limits, console: &Console) -> Result<Outcome> {
    let format = files::format(&args.output, args.output_format)?;
    let mesh = files::read_mesh(&args.mesh, args.format, limits, console)?;
    let mut meter = console.meter();
    let show = &mut |at: tercet::Progress| meter.show(at.stage, at.done, at.total);
    let remeshed = tercet::remesh::remesh(&mesh, &args.options(), limits, show);
    drop(meter);
    let remeshed = remeshed.with_context(|| files::name(&args.mesh))?;
    for warning in repairs(&remeshed.repairs) {
        console.warn(&files::name(&args.mesh), &warning);
    }
    files::write_mesh(&remeshed.mesh, &args.output, format, console)?;
    console.report(&format!("{}: {}", args.output.display(), summary(&remeshed)), &args.output)?;
    Ok(Outcome::Good)
}

fn summary(remeshed: &Remeshed) -> String {
    let found = &remeshed.comparison;
    let part = |length: f64| report::error((length / found.diagonal) as f32);
    format!(
        "{} vertices, {} faces: {} levels above a base of {} vertices\n\
         distance from the original: RMS {}, greatest {}, of the diagonal; PSNR {}\n\
         {} of {} rays missed; {} triangles unfolded on the way, {} folded",
        remeshed.mesh.positions.len(),
        remeshed.mesh.faces.len(),
        remeshed.levels,
        remeshed.base_vertices,
        part(found.rms()),
        part(found.hausdorff()),
        report::decibels(found.psnr()),
        remeshed.rays.ray_failures,
        remeshed.rays.rays,
        remeshed.unfolded,
        remeshed.folded,
    )
}

/// What was changed before the mesh could be remeshed.
fn repairs(repairs: &Repairs) -> Vec<String> {
    let each = [
        (repairs.degenerate_faces, "faces that name a vertex twice left out"),
        (repairs.turned_faces, "faces turned round to agree with their neighbours"),
        (repairs.cut_vertices, "vertices doubled where several fans of faces met"),
    ];
    each.iter().filter(|(count, _)| *count > 0).map(|(count, what)| format!("{count} {what}")).collect()
}
