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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::entropy::{Decoder, Encoder};
    use crate::mesh::cut;
    use crate::shapes::{noisy, sphere};

    const COUNT: usize = 3;

    fn coded<C: Coder + Send>(
        surface: &Surface,
        sketch: &Sketch,
        mut coders: Vec<C>,
        split: &[bool],
    ) -> (Vec<C>, Vec<bool>) {
        let mut split = split.to_vec();
        Splits::new(Effort::Default).code(&mut coders, 2, surface, sketch, &mut split);
        (coders, split)
    }

    #[test]
    fn regions_come_back_each_from_its_own_stream() {
        let cut = cut(&noisy(&sphere(3), 0.05, 1));
        let surface = &cut.surface;
        let positions: Vec<_> =
            (0..surface.vertices as i32).map(|v| [v * 7 % 300, v * 11 % 300, v]).collect();
        let sketch = Sketch::new(surface, &positions);
        let mut split: Vec<bool> = (0..surface.faces()).map(|f| f % 3 == 0).collect();
        let streams = |split: &[bool]| {
            let encoders = (0..COUNT).map(|_| Encoder::new()).collect();
            let (encoders, _) = coded(surface, &sketch, encoders, split);
            encoders.into_iter().map(Encoder::finish).collect::<Vec<_>>()
        };
        let written = streams(&split);
        let decoders: Vec<_> = written.iter().map(|bytes| Decoder::new(bytes)).collect();
        assert_eq!(coded(surface, &sketch, decoders, &vec![false; split.len()]).1, split);
        // What the others are does not show in a region's stream.
        let last = split.len() - 1;
        split[0] = !split[0];
        split[last] = !split[last];
        let changed = streams(&split);
        assert!(written[0] != changed[0] && written[1] == changed[1] && written[2] != changed[2]);
    }
}
