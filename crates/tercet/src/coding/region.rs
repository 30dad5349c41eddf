//! Regions: parts of a pass over positions, each with models and a stream of its own, so that threads can
//! share the work.
//!
//! A region knows of the others what was known before the pass. So it does not matter in which order
//! regions are coded, or whether at once.

use super::pass::{Pass, Progress, Roughness};
use super::positions::Positions;
use super::traversal::{Support, Traversal};
use super::twin::Twins;
use super::vector::Point;
use crate::entropy::Coder;
use crate::parallel;
use std::sync::{Mutex, PoisonError};

/// A region has at least so many vertices: its models begin with what those of the first have learnt, and
/// with so many to learn from it costs less than 2 % of the bits.
const LEAST: u32 = 3 << 10;

/// How many regions a pass over `vertices` vertices has in a file of `streams` streams: several only if it
/// visits the best supported vertex first.
pub(crate) fn regions(streams: u32, vertices: u32, by_support: bool) -> u32 {
    if by_support && vertices / LEAST >= streams { streams } else { 1 }
}

/// What is known of each vertex.
#[derive(Clone, Default)]
pub(crate) struct Field {
    /// Where it lies, or is expected. Of virtual vertices it is meaningless.
    pub positions: Vec<Point>,
    pub rough: Vec<Roughness>,
}

/// What regions make of how rough the vertices are that were known before the pass. Each begins with the same.
struct Changes {
    start: Vec<Roughness>,
    /// With the changes so far.
    sum: Vec<Roughness>,
}

impl Changes {
    fn new(start: &[Roughness]) -> Self {
        Changes { start: start.to_vec(), sum: start.to_vec() }
    }

    /// Adds what a region has made of them, and makes it what it was before. Sums do not depend on their order.
    fn take(&mut self, after: &mut [Roughness]) {
        for ((sum, &before), after) in self.sum.iter_mut().zip(&self.start).zip(after) {
            sum.add_change(before, std::mem::replace(after, before));
        }
    }

    fn finish(mut self) -> Vec<Roughness> {
        self.sum.iter_mut().for_each(Roughness::settle);
        self.sum
    }
}

/// The regions of a pass, and how far they have come.
///
/// A region changes its own vertices, and how rough those are that were known before; of the others it knows nothing,
/// even where they have been coded.
pub(crate) struct Regions {
    count: u32,
    /// So many at most are coded at once.
    at_once: usize,
    /// Regions that are coded, and their vertices.
    done: u32,
    coded: usize,
    /// The region after them, if it has begun.
    current: Option<Progress>,
    /// If there are several, once one has begun.
    several: Option<(Start, Changes)>,
}

/// What all regions of a pass begin with, computed once for all of them.
struct Start {
    support: Support,
    /// The corners that each has of those of the smallest numbers, up to the next one's first.
    bounds: Vec<u32>,
    twins: Option<Twins>,
}

impl Start {
    fn new(pass: &Pass, field: &Field, regions: u32) -> Self {
        let (support, twins) = parallel::join(
            field.positions.len(),
            || Support::new(pass.surface, pass.first),
            || pass.twins(&field.positions, None),
        );
        Start { bounds: support.bounds(pass.surface, regions), support, twins }
    }

    fn region(&self, index: u32) -> Progress {
        let [begin, end] = [index, index + 1].map(|i| self.bounds[i as usize]);
        let traversal = self.support.clone().visit_share(begin..end);
        Progress::new(traversal, self.twins.clone())
    }
}

impl Regions {
    /// Regions of which none has begun, to be coded `at_once` at most.
    pub fn new(count: u32, at_once: usize) -> Self {
        Regions {
            count,
            at_once: at_once.min(count as usize),
            done: 0,
            coded: 0,
            current: None,
            several: None,
        }
    }

    /// How many there are.
    pub fn count(&self) -> usize {
        self.count as usize
    }

    /// Codes what is left of the pass, region *i* by the *i*-th models and coder, the vertices of `targets`
    /// when encoding, until all are coded or bytes are missing; whether all are. Coders may be missing at the
    /// end, while their bytes are. `field` is what was known before the pass, and when all is coded what is
    /// known then; its positions are those known so far. Time O(n); memory some 50 bytes a vertex for each
    /// region at work.
    pub fn code<C: Coder + Send>(
        &mut self,
        pass: &Pass,
        models: &mut [Positions],
        coders: &mut [C],
        targets: &[Point],
        field: &mut Field,
    ) -> bool {
        let known = pass.first as usize;
        if self.count > 1 && self.several.is_none() {
            self.several = Some((Start::new(pass, field, self.count), Changes::new(&field.rough[..known])));
        }
        let untouched = self.done == 0 && self.current.is_none();
        let all = coders.len() == self.count as usize && coders.iter().all(Coder::is_whole);
        let done = if self.count > 1 && untouched && all && self.at_once > 1 {
            self.at_once(pass, models, coders, targets, field);
            true
        } else {
            self.in_turn(pass, models, coders, targets, field)
        };
        if done && let Some((_, changes)) = self.several.take() {
            field.rough[..known].copy_from_slice(&changes.finish());
        }
        done
    }

    /// Begins the region whose turn it is.
    fn begin(&self, pass: &Pass, models: &mut Positions, field: &Field) -> Progress {
        models.begin(pass, &field.positions, &field.rough);
        match &self.several {
            Some((start, _)) => start.region(self.done),
            None => {
                let traversal = match pass.by_support {
                    true => Support::new(pass.surface, pass.first).visit_all(),
                    false => Traversal::by_number(pass.surface, pass.first),
                };
                Progress::new(traversal, pass.twins(&field.positions, None))
            }
        }
    }

    /// Each thread's regions on a copy of the field.
    fn at_once<C: Coder + Send>(
        &mut self,
        pass: &Pass,
        models: &mut [Positions],
        coders: &mut [C],
        targets: &[Point],
        field: &mut Field,
    ) {
        let Some((start, changes)) = &mut self.several else { return };
        let (known, count) = (pass.first as usize, self.count);
        let whole = Mutex::new((field, changes));
        let whole = || whole.lock().unwrap_or_else(PoisonError::into_inner);
        let mut shares: Vec<Vec<_>> = (0..self.at_once).map(|_| Vec::new()).collect();
        for (i, region) in (0..count).zip(models).zip(coders).enumerate() {
            shares[i % self.at_once].push(region);
        }
        parallel::for_each(shares, |share| {
            let mut own = whole().0.clone();
            for ((index, models), coder) in share {
                models.begin(pass, &own.positions, &own.rough);
                let mut progress = start.region(index);
                models.code(coder, pass, &mut progress, targets, &mut own.positions, &mut own.rough);
                let (field, changes) = &mut *whole();
                changes.take(&mut own.rough[..known]);
                let coded = progress.traversal.known();
                for v in (known..coded.len()).filter(|&v| coded[v]) {
                    (field.positions[v], field.rough[v]) = (own.positions[v], own.rough[v]);
                }
            }
        });
    }

    fn in_turn<C: Coder>(
        &mut self,
        pass: &Pass,
        models: &mut [Positions],
        coders: &mut [C],
        targets: &[Point],
        field: &mut Field,
    ) -> bool {
        for (models, coder) in models.iter_mut().zip(coders).skip(self.done as usize) {
            let mut progress = self.current.take().unwrap_or_else(|| self.begin(pass, models, field));
            let Field { positions, rough } = field;
            if !models.code(coder, pass, &mut progress, targets, positions, rough) {
                self.current = Some(progress);
                return false;
            }
            self.done += 1;
            self.coded += progress.traversal.visited();
            if let Some((_, changes)) = &mut self.several {
                changes.take(&mut rough[..pass.first as usize]);
            }
            if self.done == self.count {
                return true;
            }
        }
        false
    }

    /// How many vertices are coded.
    pub fn coded(&self) -> usize {
        self.coded + self.current.as_ref().map_or(0, |progress| progress.traversal.visited())
    }
}

#[cfg(test)]
mod tests {
    use super::super::axes::AxisOrder;
    use super::super::pass::ANYWHERE;
    use super::super::ring::LATE;
    use super::*;
    use crate::entropy::{Decoder, Encoder};
    use crate::mesh::{Surface, cut};
    use crate::shapes::grid;
    use crate::{Effort, subdivide::FRACTION_BITS};

    const COUNT: u32 = 3;

    /// Codes all regions of a surface of which only its first real vertex is known.
    fn code<C: Coder + Send>(
        surface: &Surface,
        targets: &[Point],
        rounds: &mut [Vec<C>],
        at_once: usize,
        effort: Effort,
    ) -> Field {
        let first = surface.virtuals + 1;
        let estimates: Vec<_> =
            targets.iter().map(|p| p.map(|x| ((x as i64) << FRACTION_BITS) + 70)).collect();
        let (bits, origin) = ANYWHERE;
        let (order, shares) = (AxisOrder::NormalLast, &LATE);
        let pass = Pass {
            surface,
            first,
            estimates: &estimates,
            order,
            by_support: true,
            shares,
            bits,
            origin,
            symmetry: None,
        };
        let vertices = surface.vertices as usize;
        let mut field = Field { positions: vec![[9; 3]; vertices], rough: vec![Roughness::START; vertices] };
        let mut models = vec![Positions::new(effort); COUNT as usize];
        let mut regions = Regions::new(COUNT, at_once);
        let last = rounds.len() - 1;
        for (i, coders) in rounds.iter_mut().enumerate() {
            let targets = if C::ENCODES { targets } else { &[] };
            assert_eq!(regions.code(&pass, &mut models, coders, targets, &mut field), i == last);
        }
        field
    }

    fn come_back_whatever_the_order(effort: Effort) {
        let surface = cut(&grid(40, 30)).surface;
        let first = surface.virtuals as usize + 1;
        let targets: Vec<Point> = (0..surface.vertices as i32 - first as i32)
            .map(|v| [v % 40 * 20, v / 40 * 20 - 300, v % 7])
            .collect();
        let mut encoders = [(0..COUNT).map(|_| Encoder::new()).collect()];
        let written = code(&surface, &targets, &mut encoders, 2, effort);
        assert_eq!(written.positions[first..], targets);
        let [encoders] = encoders;
        let streams: Vec<Vec<u8>> = encoders.into_iter().map(Encoder::finish).collect();
        let decoders = |count: usize| streams[..count].iter().map(|bytes| Decoder::new(bytes)).collect();
        for at_once in [1, 2, 3] {
            let rounds = [vec![decoders(3)], vec![decoders(1), decoders(3)], vec![decoders(2), decoders(3)]];
            for mut rounds in rounds {
                let read = code(&surface, &targets, &mut rounds, at_once, effort);
                assert_eq!(read.positions, written.positions);
                assert_eq!(read.rough, written.rough);
            }
        }
    }

    #[test]
    fn regions_come_back_at_once_and_in_turn_without_a_known_neighbour() {
        come_back_whatever_the_order(Effort::Default);
        #[cfg(feature = "max")]
        come_back_whatever_the_order(Effort::Max);
    }
}
