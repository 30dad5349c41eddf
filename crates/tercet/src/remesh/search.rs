//! The search for a base that is good enough: fine where the remesh would otherwise be off.

use glam::DVec3;

use super::base::make_base;
use super::climb::Level;
use super::deviation::{Deviation, Samples};
use super::folds::{folded, restore_folded, unfold};
use super::input::Input;
use super::original::Original;
use super::ring::Ring;
use super::{Goal, Placement, RemeshOptions, Tally};
use crate::{Error, Progress, Result};

/// A remesh that was found.
pub(super) struct Found {
    pub level: Level,
    pub base_vertices: usize,
    pub rays: Tally,
    /// Triangles that were folded on the way.
    pub unfolded: usize,
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
    let samples = Samples::new(original);
    let vertices = input.positions.len() - input.surface.virtuals as usize;
    let mut weight = vec![1.0; input.positions.len()];
    let mut size = first_size(vertices, options);
    let mut best = f64::INFINITY;
    for base in 0..BASES as u64 {
        progress(Progress { stage: "remeshing", done: base, total: BASES as u64 });
        let attempt = climb(input, original, &weight, size, options, max_faces, &samples)?;
        if attempt.good {
            return Ok(attempt.found);
        }
        let Some(deviation) = attempt.deviation else { break };
        best = best.min(deviation.rms / original.diagonal);
        if size == vertices {
            break;
        }
        let wanted = match options.goal {
            Goal::MaxError(error) => error * original.diagonal,
            Goal::Levels(_) => deviation.rms,
        };
        emphasise(&mut weight, input, &attempt.found.level, original, &deviation, wanted);
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
struct Attempt {
    found: Found,
    good: bool,
    /// Of the finest level; none if the base itself is too large.
    deviation: Option<Deviation>,
}

/// Makes a base of about `size` vertices and refines it until the goal is reached or out of reach.
fn climb(
    input: &Input,
    original: &Original,
    weight: &[f64],
    size: usize,
    options: &RemeshOptions,
    max_faces: usize,
    samples: &Samples,
) -> Result<Attempt> {
    let mut level = make_base(input, original, weight, size, options.scheme);
    let base_vertices = level.positions.len() - level.surface.virtuals as usize;
    let growth = options.scheme.growth() as usize;
    let mut rays = Tally::default();
    let mut deviation: Option<Deviation> = None;
    let [mut unfolded, mut left] = unfold(&mut level, original);
    let mut good = options.goal == Goal::Levels(0) && left == 0;
    while !good && growth * level.mesh().faces.len() <= max_faces && options.goal != Goal::Levels(level.steps)
    {
        let Some(finer) = level.climb(original, options.placement, &mut rays) else { break };
        level = finer;
        let found;
        [found, left] = unfold(&mut level, original);
        unfolded += found;
        let mut candidate = level.clone();
        if options.placement == Placement::Relaxed {
            relax(&mut candidate, original);
            left = folded(&candidate, original).len();
        }
        let reached = samples.measure(original, &candidate.mesh())?;
        let before = deviation.replace(reached).map_or(f64::INFINITY, |d| d.rms);
        let rms = deviation.as_ref().map_or(before, |d| d.rms);
        let enough = match options.goal {
            Goal::MaxError(error) => rms <= error * original.diagonal,
            Goal::Levels(levels) => level.steps == levels,
        };
        good = enough && left == 0;
        if good {
            level = candidate;
        }
        if enough || (rms > STALLED * before && level.steps >= STALLED_FROM) {
            break;
        }
    }
    Ok(Attempt { found: Found { level, base_vertices, rays, unfolded }, good, deviation })
}

/// Evens out the triangles of a finest level, but where that would fold them.
fn relax(level: &mut Level, original: &Original) {
    let before = level.clone();
    for _ in 0..RELAX_STEPS {
        for corner in level.surface.any_corner() {
            let v = level.surface.at(corner);
            if !level.surface.is_virtual(v) && !level.bound[v as usize] {
                let ring = Ring::new(level, corner);
                if !ring.on_rim {
                    ring.smooth(level, RELAX_SHARE, original);
                }
            }
        }
    }
    restore_folded(level, &before, original);
}

/// Gives more weight to where the remesh is off by more than `wanted`, or folded.
fn emphasise(
    weight: &mut [f64],
    input: &Input,
    level: &Level,
    original: &Original,
    deviation: &Deviation,
    wanted: f64,
) {
    let mut excess: Vec<f64> = deviation.squares.iter().map(|square| square / (wanted * wanted)).collect();
    for f in folded(level, original) {
        let corners = level.surface.face(f).map(|v| level.positions[v as usize]);
        let centre = corners.iter().sum::<DVec3>() / 3.0;
        if let Some((_, face)) = original.nearest(centre) {
            original.mesh.faces[face as usize].iter().for_each(|&v| excess[v as usize] = MOST_EMPHASIS);
        }
    }
    let mut times = vec![1.0f64; weight.len()];
    // The surface's real faces are the mesh's, in order and with the same corners.
    for (f, face) in (0..).zip(&original.mesh.faces) {
        for (v, w) in input.surface.face(f).into_iter().zip(face) {
            times[v as usize] = excess[*w as usize].clamp(1.0, MOST_EMPHASIS);
        }
    }
    weight.iter_mut().zip(times).for_each(|(weight, times)| *weight *= times);
}
