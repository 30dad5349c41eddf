//! Split bits of a large surface in regions: runs of faces, each with models and a stream of its own, so that threads
//! can share the work.
//!
//! A region knows of the others what was known before the first bit: how their faces look.

use super::sketch::Sketch;
use super::split::SplitModels;
use super::traversal::Share;
use crate::Effort;
use crate::entropy::Coder;
use crate::mesh::Surface;
use crate::parallel;

/// The models of each region. Those of one that comes for the first time begin with what the first's have learnt.
pub(crate) struct Splits {
    models: Vec<SplitModels>,
}

impl Splits {
    pub fn new(effort: Effort) -> Self {
        Splits { models: vec![SplitModels::new(effort)] }
    }

    /// Codes `split`, one entry a face of `surface`, in a region for each coder, so many of them `at_once` at most.
    /// Time O(n); memory some 8 bytes a vertex for each region at work.
    pub fn code<C: Coder + Send>(
        &mut self,
        coders: &mut [C],
        at_once: usize,
        surface: &Surface,
        sketch: &Sketch,
        split: &mut [bool],
    ) {
        let count = coders.len();
        if self.models.len() < count {
            self.models.resize(count, self.models[0].clone());
        }
        let mut left = split;
        let mut regions = Vec::with_capacity(count);
        for (index, work) in (0..).zip(self.models.iter_mut().zip(coders)) {
            let faces = Share { index, of: count as u32 }.range(surface.faces());
            let own = left.split_off_mut(..faces.len()).unwrap_or_default();
            regions.push((faces.start as usize, own, work));
        }
        parallel::at_most(at_once, regions, |(first, split, (models, coder))| {
            models.code(coder, surface, sketch, first, split);
        });
    }
}
