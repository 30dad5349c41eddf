//! What is measured of each scheme.

use std::collections::BTreeMap;

use anyhow::Result;
use tercet::metrics::{MetricsOptions, compare};
use tercet::{Level, LevelInfo, Limits, Mesh, Update};

use super::Plan;
use super::subject::{Subject, options};
use crate::commands::encode_shown;
use crate::console::Console;
use crate::input;

/// Equal bytes, in percent of the smaller file.
const BUDGETS: [u64; 4] = [5, 15, 40, 100];

/// Points nearer than this part of the diagonal are the same, but for the rounding to `f32`.
const SAME: f64 = 1e-6;

/// The error that each scheme reaches within so many bytes.
pub struct Budget {
    pub bytes: u64,
    /// RMS distance from the given mesh, as a part of its diagonal; `None` before the base.
    pub errors: [Option<f64>; 2],
}

/// An update of one scheme.
pub struct Variant {
    pub update: Update,
    /// Of the whole file.
    pub bytes: u64,
    /// RMS distance of the levels after one, two, … reverse steps from the subject, as a part of its
    /// diagonal.
    pub errors: Vec<f64>,
    finest: Finest,
}

/// The finest level, which every update restores alike.
struct Finest {
    kept: usize,
    mesh: Mesh,
    /// Without its details.
    predicted: Vec<[f32; 3]>,
}

/// What the lifting equations as printed make of the finest level.
pub struct AsPrinted {
    /// The parts of even and of odd vertices that do not come back to where they were.
    pub wrong: [f64; 2],
    /// How far all vertices are off, as a part of the diagonal.
    pub rms: f64,
}

/// The errors at equal bytes.
pub fn budgets(mesh: &Mesh, subjects: &[Subject; 2], metrics: &MetricsOptions) -> Result<Vec<Budget>> {
    let smaller = subjects.iter().map(|s| s.file.info.bytes).min().unwrap_or_default();
    let mut budgets = Vec::new();
    for percent in BUDGETS {
        let bytes = smaller * percent / 100;
        let mut errors = [None; 2];
        for (error, subject) in errors.iter_mut().zip(subjects) {
            let fits = |&(_, info): &(&Level, &LevelInfo)| info.bytes <= bytes;
            let best = subject.levels.iter().zip(&subject.file.info.levels).take_while(fits).last();
            if let Some((level, _)) = best {
                let found = compare(mesh, &level.mesh, metrics)?;
                *error = Some(found.rms() / found.diagonal);
            }
        }
        budgets.push(Budget { bytes, errors });
    }
    Ok(budgets)
}

/// Encodes a subject under every update.
pub fn variants(subject: &Subject, plan: Plan, limits: &Limits, console: &Console) -> Result<Vec<Variant>> {
    let mut variants = Vec::new();
    for update in [Update::None, Update::Third, Update::Paper] {
        let file = encode_shown(&subject.mesh, &options(subject.scheme, plan, update), console)?;
        let mut levels = input::all_levels(&file.bytes, limits)?;
        levels.truncate(file.info.levels.len());
        let mut errors = Vec::new();
        for level in levels.iter().rev().skip(1).take(subject.steps) {
            let found = compare(&subject.mesh, &level.mesh, &plan.metrics)?;
            errors.push(found.rms() / found.diagonal);
        }
        let Some(Level { mesh, kept, predicted: Some(predicted), .. }) = levels.pop() else { continue };
        let finest = Finest { kept: kept as usize, mesh, predicted };
        variants.push(Variant { update, bytes: file.info.bytes, errors, finest });
    }
    Ok(variants)
}

/// One step of analysis and synthesis as printed, `even' = even − U(e)` in both, of the finest level.
///
/// Then every even vertex comes back as even − 2 U(e), and since P is linear, every odd one as
/// e + P(even − 2 U(e)) = odd − 2 P(U(e)). What is known are the level's predictions without an update,
/// (even, P(even)), and with the corrected one, (even + U(e), P(even + U(e))): their difference is
/// (U(e), P(U(e))), but for the rounding to the lattice. Vertices are paired by their places, for the two
/// files number them differently; those that share a place are left out. `None` if a variant is missing.
pub fn as_printed(variants: &[Variant]) -> Option<AsPrinted> {
    let of = |update: Update| variants.iter().find(|v| v.update == update).map(|v| &v.finest);
    let (none, paper) = (of(Update::None)?, of(Update::Paper)?);
    let corrected = paper.by_place();
    let diagonal = crate::commands::diagonal(&none.mesh);
    let (mut wrong, mut counts, mut squares) = ([0.0; 2], [0.0; 2], 0.0);
    for (place, i) in none.by_place() {
        let Some(&j) = corrected.get(&place) else { continue };
        let (a, b) = (none.predicted[i], paper.predicted[j]);
        let update: f64 = (0..3).map(|k| (f64::from(b[k]) - f64::from(a[k])).powi(2)).sum();
        let off = 2.0 * update.sqrt();
        let class = usize::from(i >= none.kept);
        counts[class] += 1.0;
        wrong[class] += if off > SAME * diagonal { 1.0 } else { 0.0 };
        squares += off * off;
    }
    let [even, odd] = counts;
    (even > 0.0 && odd > 0.0).then(|| AsPrinted {
        wrong: [wrong[0] / even, wrong[1] / odd],
        rms: (squares / (even + odd)).sqrt() / diagonal,
    })
}

impl Finest {
    /// The vertices by the bits of their positions, but for those that share one; sorted, so that sums
    /// over them repeat.
    fn by_place(&self) -> BTreeMap<[u32; 3], usize> {
        let mut found = BTreeMap::new();
        let mut shared = Vec::new();
        for (i, p) in self.mesh.positions.iter().enumerate() {
            let place = p.map(f32::to_bits);
            if found.insert(place, i).is_some() {
                shared.push(place);
            }
        }
        shared.iter().for_each(|place| {
            found.remove(place);
        });
        found
    }
}
