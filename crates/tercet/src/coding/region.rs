//! Regions: parts of a pass over positions, each with models and a stream of its own, so that threads can
//! share the work.
//!
//! A region knows of the others what was known before the pass. So it does not matter in which order
//! regions are coded, or whether at once.

use super::pass::{Pass, Progress, Roughness};
use super::positions::Positions;
use super::traversal::{Share, Traversal};
use super::vector::Point;
use crate::entropy::Coder;
use crate::parallel;
use std::borrow::Cow;
use std::sync::{Mutex, PoisonError};

/// A region has at least so many vertices: its models begin with what those of the first have learnt, and
/// with so many to learn from it costs less than 1 % of the bits.
const LEAST: u32 = 1 << 14;

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

/// A region that has begun.
struct Region {
    field: Field,
    progress: Progress,
}

impl Region {
    fn new(pass: &Pass, models: &mut Positions, field: Field, share: Share) -> Self {
        let traversal = match pass.by_support {
            true => Traversal::by_support(pass.surface, pass.first, share),
            false => Traversal::by_number(pass.surface, pass.first),
        };
        models.begin(pass, &field.positions, &field.rough);
        Region { field, progress: Progress::new(traversal, pass.estimates.len()) }
    }

    /// Whether all of it is coded.
    fn code<C: Coder>(
        &mut self,
        pass: &Pass,
        models: &mut Positions,
        coder: &mut C,
        targets: &[Point],
    ) -> bool {
        let Field { positions, rough } = &mut self.field;
        models.code(coder, pass, &mut self.progress, targets, positions, rough)
    }

    /// Copies the positions that are coded.
    fn show(&self, first: u32, positions: &mut [Point]) {
        let known = self.progress.traversal.known();
        for v in (first as usize..known.len()).filter(|&v| known[v]) {
            positions[v] = self.field.positions[v];
        }
    }

    /// Adds what it has changed of `start` to `merged`. Sums do not depend on their order.
    fn merge(&self, first: u32, start: &Field, merged: &mut Field) {
        self.show(first, &mut merged.positions);
        for ((sum, &before), &after) in merged.rough.iter_mut().zip(&start.rough).zip(&self.field.rough) {
            sum.add_change(before, after);
        }
    }
}

/// The regions of a pass, and how far they have come.
pub(crate) struct Regions {
    count: u32,
    /// Regions that are coded, and their vertices.
    done: u32,
    coded: usize,
    /// The region after them, if it has begun.
    current: Option<Region>,
    /// What is known with the regions that are coded, if there are several.
    merged: Option<Field>,
}

impl Regions {
    /// Regions of which none has begun.
    pub fn new(count: u32) -> Self {
        Regions { count, done: 0, coded: 0, current: None, merged: None }
    }

    /// How many there are.
    pub fn count(&self) -> usize {
        self.count as usize
    }

    /// Codes what is left of the pass, region *i* by the *i*-th models and coder, the vertices of `targets`
    /// when encoding, until all are coded or bytes are missing; whether all are. Coders may be missing at the
    /// end, while their bytes are. `field` is what was known before the pass, and when all is coded what is
    /// known then. Time O(n); memory some 40 bytes a vertex for each region at work.
    pub fn code<C: Coder + Send>(
        &mut self,
        pass: &Pass,
        models: &mut [Positions],
        coders: &mut [C],
        targets: &[Point],
        field: &mut Field,
    ) -> bool {
        let untouched = self.done == 0 && self.current.is_none();
        let all = coders.len() == self.count as usize && coders.iter().all(Coder::is_whole);
        let done = if self.count > 1 && untouched && all {
            self.at_once(pass, models, coders, targets, field);
            true
        } else {
            self.in_turn(pass, models, coders, targets, field)
        };
        if done && let Some(mut merged) = self.merged.take() {
            merged.rough.iter_mut().for_each(Roughness::settle);
            *field = merged;
        }
        done
    }

    fn at_once<C: Coder + Send>(
        &mut self,
        pass: &Pass,
        models: &mut [Positions],
        coders: &mut [C],
        targets: &[Point],
        field: &Field,
    ) {
        let merged = Mutex::new(field.clone());
        let work: Vec<_> = (0..self.count).zip(models).zip(coders).collect();
        parallel::for_each(work, |((index, models), coder)| {
            let mut region = Region::new(pass, models, field.clone(), Share { index, of: self.count });
            region.code(pass, models, coder, targets);
            region.merge(pass.first, field, &mut merged.lock().unwrap_or_else(PoisonError::into_inner));
        });
        self.merged = Some(merged.into_inner().unwrap_or_else(PoisonError::into_inner));
    }

    fn in_turn<C: Coder>(
        &mut self,
        pass: &Pass,
        models: &mut [Positions],
        coders: &mut [C],
        targets: &[Point],
        field: &mut Field,
    ) -> bool {
        let several = self.count > 1;
        for (models, coder) in models.iter_mut().zip(coders).skip(self.done as usize) {
            let mut region = match self.current.take() {
                Some(region) => region,
                None => {
                    // A pass of one region needs no copy.
                    let own = if several { field.clone() } else { std::mem::take(field) };
                    Region::new(pass, models, own, Share { index: self.done, of: self.count })
                }
            };
            if !region.code(pass, models, coder, targets) {
                self.current = Some(region);
                return false;
            }
            self.done += 1;
            self.coded += region.progress.traversal.visited();
            if several {
                region.merge(pass.first, field, self.merged.get_or_insert_with(|| field.clone()));
            } else {
                *field = region.field;
            }
            if self.done == self.count {
                return true;
            }
        }
        false
    }

    /// How many vertices are coded.
    pub fn coded(&self) -> usize {
        self.coded + self.current.as_ref().map_or(0, |region| region.progress.traversal.visited())
    }

    /// The positions as far as they are coded; `field` and `first` are those of the pass.
    pub fn positions<'a>(&'a self, first: u32, field: &'a Field) -> Cow<'a, [Point]> {
        match (&self.current, &self.merged) {
            (None, None) => (&field.positions).into(),
            (None, Some(merged)) => (&merged.positions).into(),
            (Some(region), _) if self.count == 1 => (&region.field.positions).into(),
            (Some(region), merged) => {
                let mut positions = merged.as_ref().unwrap_or(field).positions.clone();
                region.show(first, &mut positions);
                positions.into()
            }
        }
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
    fn code<C: Coder + Send>(surface: &Surface, targets: &[Point], rounds: &mut [Vec<C>]) -> Field {
        let first = surface.virtuals + 1;
        let estimates: Vec<_> =
            targets.iter().map(|p| p.map(|x| ((x as i64) << FRACTION_BITS) + 70)).collect();
        let (bits, origin) = ANYWHERE;
        let (order, shares) = (AxisOrder::NormalLast, &LATE);
        let pass =
            Pass { surface, first, estimates: &estimates, order, by_support: true, shares, bits, origin };
        let vertices = surface.vertices as usize;
        let mut field = Field { positions: vec![[9; 3]; vertices], rough: vec![Roughness::START; vertices] };
        let mut models = vec![Positions::new(Effort::Default); COUNT as usize];
        let mut regions = Regions::new(COUNT);
        let last = rounds.len() - 1;
        for (i, coders) in rounds.iter_mut().enumerate() {
            let targets = if C::ENCODES { targets } else { &[] };
            assert_eq!(regions.code(&pass, &mut models, coders, targets, &mut field), i == last);
        }
        field
    }

    #[test]
    fn regions_come_back_at_once_and_in_turn_without_a_known_neighbour() {
        let surface = cut(&grid(40, 30)).surface;
        let first = surface.virtuals as usize + 1;
        let targets: Vec<Point> = (0..surface.vertices as i32 - first as i32)
            .map(|v| [v % 40 * 20, v / 40 * 20 - 300, v % 7])
            .collect();
        let mut encoders = [(0..COUNT).map(|_| Encoder::new()).collect()];
        let written = code(&surface, &targets, &mut encoders);
        assert_eq!(written.positions[first..], targets);
        let [encoders] = encoders;
        let streams: Vec<Vec<u8>> = encoders.into_iter().map(Encoder::finish).collect();
        let decoders = |count: usize| streams[..count].iter().map(|bytes| Decoder::new(bytes)).collect();
        for mut rounds in [vec![decoders(3)], vec![decoders(1), decoders(3)], vec![decoders(2), decoders(3)]]
        {
            let read = code(&surface, &targets, &mut rounds);
            assert_eq!(read.positions, written.positions);
            assert_eq!(read.rough, written.rough);
        }
    }
}
