//! The search for the best file within a bound.
//!
//! Every candidate is a mesh of some *family* and size, on a lattice whose rounding adds little to the error
//! that the mesh has anyway. About where it is sought, a family's error falls as its size grows, error ∝ 1 / bytes,
//! so that their product says which family is best before any has the right size, and the quotient to the
//! bound which size to try next.

use std::rc::Rc;

use super::candidate::{Family, Shape, Source};
use super::{Approximated, Bound, Method};
use crate::container::{self, Approximation};
use crate::encode::encode_stretched;
use crate::info::Info;
use crate::metrics::{Comparison, MetricsOptions, compare};
use crate::{EncodeOptions, Encoded, Error, Limits, Mesh, Progress, Result, decode, encode};

/// Lattices: the coarsest and the finest that a file can have, in bits.
const DEPTHS: std::ops::RangeInclusive<f64> = 4.0..=24.0;
/// The part of a candidate's error that rounding makes up (as root mean squares), and by how many bits
/// other lattices are tried for the best.
const ROUNDING_SHARE: f64 = 0.65;
const OTHER_DEPTHS: [f64; 2] = [-0.4, 0.4];
/// The mean square of the error that rounding to a lattice of step 1 adds to a surface: 1/12 at its vertices
/// along the normal, half of that on the triangles between them.
const ROUNDING_SQUARE: f64 = 1.0 / 24.0;
/// How near to the bound the next size is aimed, and how near it need not come.
const AIM: f64 = 0.98;
const NEAR: f64 = 0.96;
/// A mesh whose bytes are within these parts of the bound is not replaced: its lattice is changed, one bit of
/// which doubles the bytes so many times.
const ALMOST: std::ops::RangeInclusive<f64> = 0.85..=1.18;
const DOUBLINGS_PER_BIT: f64 = 0.33;
/// Sizes that a promising family is tried at, and how often a file that is measured too far off is mended.
const SIZES: usize = 5;
const CORRECTIONS: usize = 6;
/// Trials that `progress` counts on; there may be fewer or more.
const EXPECTED_TRIALS: u64 = 20;
/// The first simplified mesh has so many vertices where an error is asked for, and costs so many bits for
/// each where bytes are.
const FIRST_VERTICES: usize = 1000;
const FIRST_BITS_PER_VERTEX: u64 = 18;
/// Vertices of a remesh for each of a simplified mesh of about the same bytes, or the same error.
const REMESH_SIZE_BY_BYTES: f64 = 3.0;
const REMESH_SIZE_BY_ERROR: f64 = 1.6;
/// A remesh is tried at other sizes if its product is below this, against that of simplified meshes.
const WORTH_REFINING: f64 = 1.25;
/// Vertices of the base that the number of steps is first chosen for.
const FIRST_BASE: f64 = 250.0;
/// A vertex of the source costs no less than this on any lattice.
const LEAST_BITS_PER_VERTEX: u64 = 5;
/// It may be exact for as few.
const EXACT_BITS_PER_VERTEX: u64 = 16;

/// A file that was made.
struct Trial {
    method: Method,
    score: Score,
    encoded: Encoded,
}

/// What a trial was, and what came of it.
#[derive(Clone, Copy)]
struct Score {
    /// Where a trial of another size would come from; the source itself has one size.
    family: Option<(Family, usize)>,
    /// Bits of the lattice beyond those that the rule chooses.
    finer: f64,
    bytes: u64,
    /// The error that is expected, as a part of the diagonal.
    error: f64,
}

impl Score {
    /// The less the better, whatever the bound.
    fn product(&self) -> f64 {
        self.error * self.bytes as f64
    }
}

/// The score with the least product; of equal ones the first.
fn least(scores: [Option<Score>; 2]) -> Option<Score> {
    scores.into_iter().flatten().min_by(|a, b| a.product().total_cmp(&b.product()))
}

/// Finds the best file for `bound`.
pub(super) fn search(
    mesh: &Mesh,
    bound: Bound,
    options: &EncodeOptions,
    progress: &mut dyn FnMut(Progress),
) -> Result<Approximated> {
    let source = Source::new(mesh, options.scheme)?;
    let mut search =
        Search { source: &source, bound, options, good: Vec::new(), shapes: Vec::new(), trials: 0, progress };
    search.families()?;
    search.itself()?;
    let (trial, comparison) = search.settle()?;
    let encoded = marked(mesh, trial.encoded, &comparison)?;
    Ok(Approximated {
        encoded,
        method: trial.method,
        comparison,
        trials: search.trials,
        not_remeshed: source.not_remeshed().map(ToString::to_string),
    })
}

/// The file with its mark, unless it is exact.
fn marked(mesh: &Mesh, encoded: Encoded, comparison: &Comparison) -> Result<Encoded> {
    if comparison.rms() == 0.0 {
        return Ok(encoded);
    }
    // Not less than was measured.
    let part = |length: f64| ((length / comparison.diagonal) as f32).next_up();
    let approximation = Approximation {
        vertices: mesh.positions.len() as u32,
        faces: mesh.faces.len() as u32,
        digest: mesh.digest(),
        rms: part(comparison.rms()),
        greatest: part(comparison.hausdorff_at_most()),
    };
    let bytes = container::mark(&encoded.bytes, approximation)?;
    let info = Info::of(&bytes)?;
    Ok(Encoded { bytes, info, ..encoded })
}

struct Search<'a> {
    source: &'a Source<'a>,
    bound: Bound,
    options: &'a EncodeOptions,
    /// The trials that are expected to keep to the bound.
    good: Vec<Trial>,
    /// The meshes of the trials so far.
    shapes: Vec<((Family, usize), Rc<Shape>)>,
    trials: usize,
    progress: &'a mut dyn FnMut(Progress),
}

impl Search<'_> {
    /// Tries the families that come in all sizes.
    fn families(&mut self) -> Result<()> {
        let first = match self.bound {
            Bound::MaxBytes(bytes) => (8 * bytes / FIRST_BITS_PER_VERTEX) as usize,
            Bound::MaxError(_) => FIRST_VERTICES,
        };
        let Some(simplified) = self.refine(Family::Simplified, first, 0.0)? else { return Ok(()) };
        let mut best = simplified;
        if let Some(remeshed) = self.remeshes(&simplified)?
            && let Some((family, size)) = remeshed.family
            && remeshed.product() < WORTH_REFINING * simplified.product()
        {
            // From the mesh that did well: one of almost its size may fail somewhere.
            let refined = self.refine(family, size, 0.0)?;
            best = least([Some(best), refined.or(Some(remeshed))]).unwrap_or(best);
        }
        // The rule for the lattice is right for most; whether it is for the best is tried.
        let Some((family, size)) = best.family else { return Ok(()) };
        for finer in OTHER_DEPTHS {
            if let Some(other) = self.attempt(family, size, finer)?
                && other.product() < best.product()
            {
                self.refine(family, self.next_size(size, &other), finer)?;
                break;
            }
        }
        Ok(())
    }

    /// Looks for the scheme and the number of steps with the least product, by one trial for each.
    fn remeshes(&mut self, simplified: &Score) -> Result<Option<Score>> {
        let Some((_, vertices)) = simplified.family else { return Ok(None) };
        let more = match self.bound {
            Bound::MaxBytes(_) => REMESH_SIZE_BY_BYTES,
            Bound::MaxError(_) => REMESH_SIZE_BY_ERROR,
        };
        let mut size = (more * vertices as f64) as usize;
        let mut base = FIRST_BASE;
        let mut best = None;
        for &scheme in self.source.schemes(self.options.scheme) {
            let growth = scheme.growth() as f64;
            let first = ((size as f64 / base).ln() / growth.ln()).round().max(1.0) as u32;
            let mut here = self.attempt(Family::Remeshed(scheme, first), size, 0.0)?;
            // The second scheme is tried on a base that was good for the first.
            let directions: &[i64] = if best.is_none() { &[-1, 1] } else { &[] };
            for &direction in directions {
                let there = self.more_steps(here, direction)?;
                let moved = there.map(|score| score.family) != here.map(|score| score.family);
                here = there;
                if moved {
                    break;
                }
            }
            best = least([best, here]);
            if let Some(Score { family: Some((Family::Remeshed(scheme, steps), tried)), .. }) = best {
                size = best.map_or(tried, |score| self.nearby_size(tried, &score));
                base = tried as f64 / (scheme.growth() as f64).powi(steps as i32);
            }
        }
        Ok(best)
    }

    /// Changes the number of steps of a remesh by one as long as that helps.
    fn more_steps(&mut self, mut here: Option<Score>, direction: i64) -> Result<Option<Score>> {
        while let Some(score) = here
            && let Some((Family::Remeshed(scheme, steps), size)) = score.family
            && let Some(steps) = u32::try_from(i64::from(steps) + direction).ok().filter(|&n| n > 0)
        {
            let other = self.attempt(Family::Remeshed(scheme, steps), self.nearby_size(size, &score), 0.0)?;
            if other.is_none_or(|other| other.product() >= score.product()) {
                break;
            }
            here = other;
        }
        Ok(here)
    }

    /// Tries sizes of a family until one is near the bound; returns the last. Where only bytes count, a mesh of
    /// almost the right size stays, and its lattice makes up for the rest.
    fn refine(&mut self, family: Family, mut size: usize, mut finer: f64) -> Result<Option<Score>> {
        let mut last = None;
        for _ in 0..SIZES {
            let Some(score) = self.attempt(family, size, finer)? else { break };
            last = Some(score);
            let (ratio, next) = (self.ratio(&score), self.next_size(size, &score));
            if (NEAR..=1.0).contains(&ratio) || next == size {
                break;
            }
            match self.bound {
                Bound::MaxBytes(_) if ALMOST.contains(&ratio) => {
                    finer += (AIM / ratio).log2() / DOUBLINGS_PER_BIT;
                }
                _ => size = next,
            }
        }
        Ok(last)
    }

    /// The bound is kept where this is at most 1.
    fn ratio(&self, score: &Score) -> f64 {
        match self.bound {
            Bound::MaxBytes(bytes) => score.bytes as f64 / bytes.max(1) as f64,
            Bound::MaxError(error) => score.error / error,
        }
    }

    /// The size that should meet the bound, after one that gave `score`.
    fn next_size(&self, size: usize, score: &Score) -> usize {
        let off = self.ratio(score) / AIM;
        let times = match self.bound {
            Bound::MaxBytes(_) => 1.0 / off,
            Bound::MaxError(_) => off,
        };
        self.source.possible_size(size as f64 * times.clamp(0.1, 10.0))
    }

    /// The same, but not far from `size`: a remesh that fails somewhere says little of others.
    fn nearby_size(&self, size: usize, score: &Score) -> usize {
        self.next_size(size, score).clamp(size / 2, 2 * size)
    }

    /// Makes a mesh and its file; `None` if there is no such mesh.
    fn attempt(&mut self, family: Family, size: usize, finer: f64) -> Result<Option<Score>> {
        let size = self.source.possible_size(size as f64);
        let Some(shape) = self.shape(family, size)? else { return Ok(None) };
        let total = match self.bound {
            Bound::MaxError(error) => error,
            Bound::MaxBytes(_) => shape.error / (1.0 - ROUNDING_SHARE * ROUNDING_SHARE).sqrt(),
        };
        let depth = self.depth_for(ROUNDING_SHARE * total) + finer;
        self.trial(family.method(), &shape, depth, Some((family, size)), finer).map(Some)
    }

    fn shape(&mut self, family: Family, size: usize) -> Result<Option<Rc<Shape>>> {
        if let Some((_, shape)) = self.shapes.iter().find(|(key, _)| *key == (family, size)) {
            return Ok(Some(Rc::clone(shape)));
        }
        let shape = self.source.shape(family, size)?.map(Rc::new);
        self.shapes.extend(shape.iter().map(|shape| ((family, size), Rc::clone(shape))));
        Ok(shape)
    }

    /// The bits of the lattice whose rounding adds this error.
    fn depth_for(&self, error: f64) -> f64 {
        (self.source.side * ROUNDING_SQUARE.sqrt() / error + 1.0).log2()
    }

    /// Makes a file of a mesh on a lattice of this depth: of the next whole number of bits, over a larger cube.
    fn trial(
        &mut self,
        method: Method,
        shape: &Shape,
        depth: f64,
        family: Option<(Family, usize)>,
        finer: f64,
    ) -> Result<Score> {
        let done = (self.trials as u64).min(EXPECTED_TRIALS);
        (self.progress)(Progress { stage: "searching", done, total: EXPECTED_TRIALS });
        let depth = depth.clamp(*DEPTHS.start(), *DEPTHS.end());
        let (bits, stretch) = (depth.ceil(), (depth.ceil() - depth).exp2());
        self.trials += 1;
        let options = EncodeOptions { bits: Some(bits as u8), ..*self.options };
        let encoded = encode_stretched(&shape.mesh, &options, stretch, &mut |_| {})?;
        let step = self.source.side * stretch / (bits.exp2() - 1.0);
        let error = (shape.error * shape.error + step * step * ROUNDING_SQUARE).sqrt();
        let bytes = encoded.bytes.len() as u64 + Approximation::MOST_BYTES;
        let score = Score { family, finer, bytes, error };
        if self.ratio(&score) <= 1.0 {
            self.good.push(Trial { method, score, encoded });
        }
        Ok(score)
    }

    /// Tries the source itself, on lattices and exact, where it may be small enough.
    fn itself(&mut self) -> Result<()> {
        let vertices = self.source.mesh.positions.len().max(1) as u64;
        let least = vertices * LEAST_BITS_PER_VERTEX / 8;
        let shape = || Shape { mesh: self.source.mesh.clone(), error: 0.0 };
        match self.bound {
            Bound::MaxError(error) => {
                let best = self.good.iter().map(|trial| trial.score.bytes).min();
                let depth = self.depth_for(AIM * error);
                if depth <= *DEPTHS.end() && best.is_none_or(|best| least < best) {
                    self.trial(Method::Rounded, &shape(), depth, None, 0.0)?;
                }
            }
            Bound::MaxBytes(bytes) if least < bytes => {
                if 8 * bytes / vertices >= EXACT_BITS_PER_VERTEX {
                    let exact = self.exact()?;
                    self.good.extend(Some(exact).filter(|exact| exact.score.bytes <= bytes));
                }
                // A bit of depth costs three bits a vertex.
                let shape = shape();
                let bits_of = |bytes: u64| 8.0 * bytes as f64 / vertices as f64;
                let possible = |depth: f64| depth.clamp(*DEPTHS.start(), *DEPTHS.end());
                let mut depth = possible(bits_of(bytes));
                for _ in 0..SIZES {
                    let score = self.trial(Method::Rounded, &shape, depth, None, 0.0)?;
                    let next = possible(depth + (AIM * bits_of(bytes) - bits_of(score.bytes)) / 3.0);
                    if (NEAR..=1.0).contains(&self.ratio(&score)) || next == depth {
                        break;
                    }
                    depth = next;
                }
            }
            Bound::MaxBytes(_) => {}
        }
        Ok(())
    }

    /// The best trial that keeps to the bound when it is measured.
    fn settle(&mut self) -> Result<(Trial, Comparison)> {
        let mut corrections = 0;
        while let Some(trial) = self.take_best() {
            let comparison = self.measure(&trial.encoded)?;
            let Bound::MaxError(allowed) = self.bound else { return Ok((trial, comparison)) };
            let error = comparison.rms() / comparison.diagonal;
            if error <= allowed {
                return Ok((trial, comparison));
            }
            if let Some((family, size)) = trial.score.family
                && corrections < CORRECTIONS
            {
                corrections += 1;
                let size = size as f64 * error / (AIM * allowed);
                self.attempt(family, size as usize, trial.score.finer)?;
            }
        }
        match self.bound {
            Bound::MaxBytes(bytes) => {
                Err(Error::Parameter(format!("no lossy file of at most {bytes} bytes was found")))
            }
            Bound::MaxError(error) => self.ever_finer(error),
        }
    }

    /// The source on a lattice that is fine enough, or exact.
    fn ever_finer(&mut self, error: f64) -> Result<(Trial, Comparison)> {
        let shape = Shape { mesh: self.source.mesh.clone(), error: 0.0 };
        let mut depth = self.depth_for(AIM * error).max(*DEPTHS.start());
        while depth <= *DEPTHS.end() {
            self.trial(Method::Rounded, &shape, depth, None, 0.0)?;
            depth = depth.floor() + 1.0;
            let Some(trial) = self.take_best() else { continue };
            let comparison = self.measure(&trial.encoded)?;
            if comparison.rms() <= error * comparison.diagonal {
                return Ok((trial, comparison));
            }
        }
        let trial = self.exact()?;
        let comparison = self.measure(&trial.encoded)?;
        Ok((trial, comparison))
    }

    /// The source with every bit.
    fn exact(&mut self) -> Result<Trial> {
        self.trials += 1;
        let encoded = encode(self.source.mesh, self.options)?;
        let score = Score { family: None, finer: 0.0, bytes: encoded.bytes.len() as u64, error: 0.0 };
        Ok(Trial { method: Method::Exact, score, encoded })
    }

    /// Takes the trial that is expected to be the best.
    fn take_best(&mut self) -> Option<Trial> {
        let value = |trial: &Trial| match self.bound {
            Bound::MaxBytes(_) => trial.score.error,
            Bound::MaxError(_) => trial.score.bytes as f64,
        };
        let best =
            (0..self.good.len()).min_by(|&a, &b| value(&self.good[a]).total_cmp(&value(&self.good[b])))?;
        Some(self.good.swap_remove(best))
    }

    fn measure(&self, encoded: &Encoded) -> Result<Comparison> {
        let decoded = decode(&encoded.bytes, &Limits { max_memory: u64::MAX })?;
        compare(self.source.mesh, &decoded, &MetricsOptions::default())
    }
}
