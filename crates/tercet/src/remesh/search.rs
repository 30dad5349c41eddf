//! The search for a base that is good enough: fine where the remesh would otherwise be off.

use glam::DVec3;

use super::base::make_base;
use super::climb::Level;
use super::deviation::{Deviation, Samples};
use super::folds::{folded, restore_folded, unfold};
use super::input::Input;
use super::original::Original;
use super::ring::Ring;
use super::{Goal, LEVELS_ERROR, Placement, RemeshOptions, Tally};
use crate::metrics::{Comparison, MetricsOptions, compare};
use crate::{Error, Progress, Result};

/// A remesh that was found.
pub(super) struct Found {
    pub level: Level,
    pub base_vertices: usize,
    pub rays: Tally,
    /// Triangles that were folded on the way.
    pub unfolded: usize,
    /// How far it is from the original.
    pub comparison: Comparison,
}

/// Bases that are tried, at most; each has half as many vertices again as the one before.
const BASES: usize = 12;
/// Unless the levels are given, the first base has one in so many of the vertices …
const FIRST_PARTS: u64 = 243;
/// … within these bounds, if the mesh has so many.
const FIRST_VERTICES: std::ops::RangeInclusive<usize> = 60..=1000;
/// A level whose error is more than this part of the coarser one's …
const STALLED: f64 = 0.9;
/// … from this level on shows that the base cannot do better.
const STALLED_FROM: u32 = 4;
/// How much the weight of a vertex may grow from one base to the next.
const MOST_EMPHASIS: f64 = 8.0;
/// Steps of relaxation at the end, and how far each goes towards the mean of the neighbours.
const RELAX_STEPS: usize = 3;
const RELAX_SHARE: f64 = 0.4;

/// Tries bases until one leads to `options.goal` without folds and with at most `max_faces` faces.
pub(super) fn search(
    input: &Input,
    original: &Original,
    options: &RemeshOptions,
    max_faces: usize,
    progress: &mut dyn FnMut(Progress),
) -> Result<Found> {
    let search = Search { input, original, options, max_faces, samples: Samples::new(original) };
    let vertices = input.positions.len() - input.surface.virtuals as usize;
    let mut weight = vec![1.0; input.positions.len()];
    let mut size = first_size(vertices, options);
    let mut best = f64::INFINITY;
    for base in 0..BASES as u64 {
        progress(Progress { stage: "remeshing", done: base, total: BASES as u64 });
        match search.climb(&weight, size)? {
            Attempt::Good(found) => return Ok(found),
            Attempt::Bad(level, deviation) => {
                best = best.min(deviation.rms / original.diagonal);
                search.emphasise(&mut weight, &level, &deviation);
            }
        }
        if size == vertices {
            break;
        }
        size = (size * 3 / 2).min(vertices);
    }
    Err(Error::Parameter(format!(
        "the goal is not reached without folds within {max_faces} faces; the error came down to {best:.2e}"
    )))
}

/// How many vertices the first base gets.
fn first_size(vertices: usize, options: &RemeshOptions) -> usize {
    let parts = match options.goal {
        Goal::Levels(levels) => options.scheme.growth().saturating_pow(levels),
        Goal::MaxError(_) => FIRST_PARTS,
    };
    let size = (vertices as u64 / parts) as usize;
    size.clamp(*FIRST_VERTICES.start(), *FIRST_VERTICES.end()).min(vertices)
}

/// What became of a base.
enum Attempt {
    Good(Found),
    /// The finest level that was reached, and how far it is off.
    Bad(Level, Deviation),
}

/// What all attempts share.
struct Search<'a> {
    input: &'a Input,
    original: &'a Original,
    options: &'a RemeshOptions,
    max_faces: usize,
    samples: Samples,
}

impl Search<'_> {
    /// Makes a base of about `size` vertices and refines it until the goal is reached or out of reach.
    fn climb(&self, weight: &[f64], size: usize) -> Result<Attempt> {
        let Search { original, options, .. } = *self;
        let mut level = make_base(self.input, original, weight, size, options.scheme);
        let base_vertices = level.positions.len() - level.surface.virtuals as usize;
        let growth = options.scheme.growth() as usize;
        let mut rays = Tally::default();
        let [mut unfolded, _] = unfold(&mut level, original);
        let mut deviation = self.samples.measure(original, &level.mesh())?;
        while growth * level.mesh().faces.len() <= self.max_faces {
            let Some(finer) = level.climb(original, &mut rays) else { break };
            level = finer;
            let [found, left] = unfold(&mut level, original);
            unfolded += found;
            let relaxed = (options.placement == Placement::Relaxed).then(|| relax(&level, original));
            let finest = relaxed.as_ref().unwrap_or(&level);
            let before = deviation.rms;
            deviation = self.samples.measure(original, &finest.mesh())?;
            let near = deviation.rms <= self.wanted();
            let enough = match options.goal {
                Goal::MaxError(_) => near,
                Goal::Levels(levels) => level.steps == levels,
            };
            if enough && near && left == 0 {
                // The samples above are few; these are as many as anybody would measure with.
                let finest = finest.clone();
                let mesh = &self.original.mesh;
                let comparison = compare(mesh, &finest.mesh(), &MetricsOptions::default())?;
                if comparison.rms() <= self.wanted() {
                    let found = Found { level: finest, base_vertices, rays, unfolded, comparison };
                    return Ok(Attempt::Good(found));
                }
            }
            // Folds grow with every level, and levels that are asked for do not come twice.
            let too_late = enough && (left > 0 || matches!(options.goal, Goal::Levels(_)));
            let stalled = deviation.rms > STALLED * before && level.steps >= STALLED_FROM;
            if too_late || stalled {
                break;
            }
        }
        Ok(Attempt::Bad(level, deviation))
    }

    /// The distance that is allowed.
    fn wanted(&self) -> f64 {
        let part = match self.options.goal {
            Goal::MaxError(error) => error,
            Goal::Levels(_) => LEVELS_ERROR,
        };
        part * self.original.diagonal
    }

    /// Gives more weight to where the remesh is off by more than is allowed, or folded.
    fn emphasise(&self, weight: &mut [f64], level: &Level, deviation: &Deviation) {
        let wanted = self.wanted() * self.wanted();
        let mut excess: Vec<f64> = deviation.squares.iter().map(|square| square / wanted).collect();
        for f in folded(level, self.original) {
            let corners = level.surface.face(f).map(|v| level.positions[v as usize]);
            let centre = corners.iter().sum::<DVec3>() / 3.0;
            if let Some((_, face)) = self.original.nearest(centre) {
                let near = self.original.mesh.faces[face as usize];
                near.iter().for_each(|&v| excess[v as usize] = MOST_EMPHASIS);
            }
        }
        let mut times = vec![1.0f64; weight.len()];
        // The surface's real faces are the mesh's, in order and with the same corners.
        for (f, face) in (0..).zip(&self.original.mesh.faces) {
            for (v, w) in self.input.surface.face(f).into_iter().zip(face) {
                times[v as usize] = excess[*w as usize].clamp(1.0, MOST_EMPHASIS);
            }
        }
        weight.iter_mut().zip(times).for_each(|(weight, times)| *weight *= times);
    }
}

/// A finest level with its triangles evened out, but where that would fold them.
fn relax(before: &Level, original: &Original) -> Level {
    let mut level = before.clone();
    for _ in 0..RELAX_STEPS {
        for corner in level.surface.any_corner() {
            let v = level.surface.at(corner);
            if !level.surface.is_virtual(v) && !level.bound[v as usize] {
                let ring = Ring::new(&level, corner);
                if !ring.on_rim {
                    ring.smooth(&mut level, RELAX_SHARE, original);
                }
            }
        }
    }
    restore_folded(&mut level, before, original);
    level
}
