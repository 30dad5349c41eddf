//! Split bits in the `max` profile.

use super::super::priors;
use super::super::split::Face;
use super::{Births, Panel};
use crate::entropy::Coder;

/// The contexts of the mixed model and nine more.
pub(crate) struct SplitPanel {
    bits: Panel<13, 5>,
    pub births: Births,
}

/// Sorted triples of ages, as digits.
const AGES: usize = Births::AGES.pow(3);

/// Values of one corner of [`two_tightest`].
const PAIRS: usize = 128;

impl Default for SplitPanel {
    fn default() -> Self {
        let [a, b, c, d] = priors::SPLIT.map(priors::size);
        let sizes = [
            a,
            b,
            c,
            d,
            512,
            3584,
            512,
            PAIRS * PAIRS,
            AGES * 16,
            AGES * 512,
            16 * AGES,
            360 * 16,
            AGES * 360,
        ];
        SplitPanel {
            bits: Panel::new(priors::SPLIT, sizes, [Face::SETS, AGES, 48, 16, 1]),
            births: Births::default(),
        }
    }
}

impl SplitPanel {
    pub fn code<C: Coder>(&mut self, coder: &mut C, bit: bool, face: &Face) -> bool {
        let mut ages = face.corners.map(|v| self.births.age(v));
        ages.sort_unstable();
        let ages = ages.into_iter().fold(0, |digits, age| digits * Births::AGES + age);
        let (flag, size) = (face.is_virtual() as usize, face.size());
        let [a, b, c, d] = face.contexts();
        let contexts = [
            a,
            b,
            c,
            d,
            (face.local * 16 + size) * 2 + flag,
            face.incidences() * 2 + flag,
            (size * 16 + face.neighbours) * 2 + flag,
            two_tightest(face),
            ages * 16 + face.neighbours,
            ages * 512 + face.valences(),
            face.local * AGES + ages,
            face.tightest() * 16 + face.local,
            ages * 360 + face.tightest(),
        ];
        let sets = [face.set(), ages, face.local * 3 + face.share(), size, 0];
        self.bits.code(coder, bit, sets, contexts)
    }
}

/// The two corners with the fewest undecided faces, each by their number, its valence and splits so far.
fn two_tightest(face: &Face) -> usize {
    let mut keys = face.corners.map(|v| {
        let [valence, split, undecided] = face.corner(v).map(|x| x as usize);
        (undecided.min(3) * 8 + valence.clamp(3, 10) - 3) * 4 + split.min(3)
    });
    keys.sort_unstable();
    keys[0] * PAIRS + keys[1]
}
