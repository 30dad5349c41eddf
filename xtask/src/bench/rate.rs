//! What a number of bytes buys: our lossy files against simplified meshes coded by Draco.

use super::{Scratch, Subject, draco, meshopt, ours};
use anyhow::{Context, Result};
use std::path::{Path, PathBuf};

/// The sizes that are compared, in bytes.
const BUDGETS: [u64; 4] = [2_000, 5_000, 10_000, 20_000];
/// Draco's lattices.
const BITS: std::ops::RangeInclusive<u8> = 6..=14;
/// Draco's slowest level.
const LEVEL: u8 = 10;
/// Each simplified mesh has so many times the faces of the one before, from the fewest up to the mesh's own, or
/// to more than fit in the largest budget.
const FACES_GROWTH: f64 = 1.06;
const LEAST_FACES: f64 = 150.0;
const MOST_FACES: f64 = 40_000.0;

/// One mesh within one budget.
pub struct RateRow {
    pub mesh: String,
    pub budget: u64,
    pub ours: ours::Approximated,
    pub peer: Peer,
}

/// The simplified mesh whose Draco file is the nearest to the original.
pub struct Peer {
    /// Faces asked for.
    pub faces: u64,
    pub bits: u8,
    pub bytes: u64,
    pub psnr: f64,
}

/// All budgets for every subject.
pub fn rows(subjects: &[Subject], ours: &ours::Program, scratch: &Scratch) -> Result<Vec<RateRow>> {
    let meshopt = meshopt::Program::set_up().context("the peer's simplification")?;
    let mut rows = Vec::new();
    for subject in subjects {
        let most = MOST_FACES.min(subject.faces as f64);
        let steps = ((most / LEAST_FACES).ln() / FACES_GROWTH.ln()).max(0.0) as i32;
        let sizes: Vec<u64> =
            (0..=steps).map(|step| (most / FACES_GROWTH.powi(steps - step)) as u64).collect();
        let simplified = meshopt.simplify(&subject.ply, &sizes, &scratch.0)?;
        for budget in BUDGETS {
            let found = ours.approximate(&subject.ply, &scratch.file("a.tct"), budget)?;
            let peer = best_peer(subject, &simplified, budget, ours, scratch)?;
            println!("{}, {budget} bytes: {:.2} dB, peer {:.2} dB", subject.name, found.psnr, peer.psnr);
            rows.push(RateRow { mesh: subject.name.clone(), budget, ours: found, peer });
        }
    }
    Ok(rows)
}

/// Of both kinds of simplification and every lattice, the most faces that fit: the best of these.
fn best_peer(
    subject: &Subject,
    simplified: &[(u64, [PathBuf; 2])],
    budget: u64,
    ours: &ours::Program,
    scratch: &Scratch,
) -> Result<Peer> {
    let (drc, ply) = (scratch.file("a.drc"), scratch.file("decoded.ply"));
    let mut best: Option<Peer> = None;
    for kind in 0..2 {
        for bits in BITS {
            let size =
                |mesh: &Path| draco::encode(mesh, &drc, Some(bits), LEVEL).map(|encoded| encoded.bytes);
            let fit = most_that_fit(simplified, |(_, meshes)| Ok(size(&meshes[kind])? <= budget))?;
            let Some((faces, meshes)) = fit.map(|i| &simplified[i]) else { continue };
            let bytes = size(&meshes[kind])?;
            draco::decode(&drc, &ply)?;
            let psnr = ours.psnr(&subject.ply, &ply)?;
            if best.as_ref().is_none_or(|best| psnr > best.psnr) {
                best = Some(Peer { faces: *faces, bits, bytes, psnr });
            }
        }
    }
    best.with_context(|| format!("{}: nothing fits in {budget} bytes", subject.name))
}

/// The last item that fits, if those that do come first.
fn most_that_fit<T>(items: &[T], fits: impl Fn(&T) -> Result<bool>) -> Result<Option<usize>> {
    let (mut fit, mut too_many) = (0, items.len());
    while fit < too_many {
        let middle = fit.midpoint(too_many);
        match fits(&items[middle])? {
            true => fit = middle + 1,
            false => too_many = middle,
        }
    }
    Ok(fit.checked_sub(1))
}

#[cfg(test)]
mod tests {
    use super::most_that_fit;

    #[test]
    fn the_last_that_fits_is_found() {
        let items = [1, 2, 3, 5, 8];
        for most in 0..10 {
            let expected = items.iter().rposition(|&item| item <= most);
            assert_eq!(most_that_fit(&items, |&item| Ok(item <= most)).unwrap(), expected);
        }
    }
}
