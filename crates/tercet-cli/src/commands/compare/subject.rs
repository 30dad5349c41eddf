//! A mesh that a scheme fits: the given one, or one resampled from it.

use anyhow::{Context, Result};
use tercet::remesh::{Goal, RemeshOptions, remesh};
use tercet::{EncodeOptions, Encoded, Level, LevelScheme, Limits, Mesh, Progress, Scheme, Update};

use super::Plan;
use crate::commands::encode_shown;
use crate::console::Console;
use crate::input;

/// What a scheme is tried on.
pub struct Subject {
    pub scheme: Scheme,
    pub mesh: Mesh,
    /// Whether it is not the given mesh.
    pub resampled: bool,
    /// Where it comes from, in words.
    pub origin: String,
    pub file: Encoded,
    /// The file's levels with their predictions.
    pub levels: Vec<Level>,
    /// Reverse steps of the scheme to look at: the finest levels.
    pub steps: usize,
}

impl Subject {
    /// The given mesh, if a reverse step of the scheme applies to it; otherwise its remesh.
    pub fn new(mesh: &Mesh, scheme: Scheme, plan: Plan, limits: &Limits, console: &Console) -> Result<Self> {
        let origin = "the mesh as it is".to_string();
        let own = Subject::encode(mesh.clone(), scheme, (false, origin), plan, limits, console)?;
        if own.steps > 0 {
            return Ok(own);
        }
        let wanted = RemeshOptions { scheme, goal: Goal::Levels(plan.levels), ..RemeshOptions::default() };
        let mut meter = console.meter();
        let mut show = |at: Progress| meter.show(at.stage, at.done, at.total);
        let fine = remesh(mesh, &wanted, limits, &mut show).context("resampling")?;
        let origin = format!(
            "resampled, since it does not have the connectivity: a base of {} vertices, refined in {} steps onto it",
            fine.base_vertices, fine.levels
        );
        drop(meter);
        Subject::encode(fine.mesh, scheme, (true, origin), plan, limits, console)
    }

    fn encode(
        mesh: Mesh,
        scheme: Scheme,
        (resampled, origin): (bool, String),
        plan: Plan,
        limits: &Limits,
        console: &Console,
    ) -> Result<Self> {
        let file = encode_shown(&mesh, &options(scheme, plan, Update::None), console)?;
        let levels = input::all_levels(&file.bytes, limits)?;
        let kinds = file.info.levels.iter().rev().take_while(|level| level.kind == kind(scheme));
        let steps = kinds.count().min(plan.levels as usize);
        Ok(Subject { scheme, mesh, resampled, origin, file, levels, steps })
    }

    pub fn name(&self) -> &'static str {
        match self.scheme {
            Scheme::Sqrt3 => "√3",
            Scheme::Butterfly => "butterfly",
        }
    }

    /// Vertices and faces of the finest level and after each reverse step.
    pub fn counts(&self) -> Vec<[u32; 2]> {
        let levels = self.file.info.levels.iter().rev().take(self.steps + 1);
        levels.map(|level| [level.vertices, level.faces]).collect()
    }
}

/// How a subject is encoded under an update.
pub fn options(scheme: Scheme, plan: Plan, update: Update) -> EncodeOptions {
    let scheme = match scheme {
        Scheme::Sqrt3 => LevelScheme::Sqrt3,
        Scheme::Butterfly => LevelScheme::Butterfly,
    };
    EncodeOptions { bits: Some(plan.bits), update, scheme, ..EncodeOptions::default() }
}

/// What a file calls the scheme's levels.
fn kind(scheme: Scheme) -> &'static str {
    match scheme {
        Scheme::Sqrt3 => "sqrt3",
        Scheme::Butterfly => "butterfly",
    }
}
