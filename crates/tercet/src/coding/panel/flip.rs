//! Flip bits in the `max` profile.

use super::super::flip::{Edge, UNIT, ordered};
use super::super::priors;
use super::{Births, Panel};
use crate::entropy::Coder;
use crate::mesh::{Surface, next, prev};

/// The contexts of the mixed model and nine more.
pub(crate) struct FlipPanel {
    bits: Panel<13, 5>,
    pub births: Births,
}

/// Pairs of ages: of the ends of an edge, and of its apexes, where new vertices have one of their own.
const END_AGES: usize = Births::AGES.pow(2);
const APEX_AGES: usize = (Births::AGES + 1).pow(2);

impl Default for FlipPanel {
    fn default() -> Self {
        let ages = END_AGES * APEX_AGES;
        let [a, b, c, d] = priors::FLIP.map(priors::size);
        let sizes = [
            a,
            b,
            c,
            d,
            2048,
            1024,
            ages * 16,
            END_AGES * 64,
            256 * 64,
            256 * 64,
            32 * 32 * 4,
            32 * 256,
            128 * 256,
        ];
        FlipPanel {
            bits: Panel::new(priors::FLIP, sizes, [Edge::SETS, 256, ages, 64, 4]),
            births: Births::default(),
        }
    }
}

impl FlipPanel {
    /// `corners` face the edge.
    pub fn code<C: Coder>(
        &mut self,
        coder: &mut C,
        bit: bool,
        surface: &Surface,
        corners: [u32; 2],
        edge: &Edge,
    ) -> bool {
        let Edge { ends, apexes, angle, kind, .. } = *edge;
        let age = |c: u32| self.births.age(surface.at(c));
        let are_split = edge.are_split();
        let apex = |i: usize| if are_split[i] { Births::AGES } else { age(corners[i]) };
        let [young, old] = ordered([age(next(corners[0])), age(prev(corners[0]))]);
        let end_ages = young * Births::AGES + old;
        let [young, old] = ordered([apex(0), apex(1)]);
        let ages = end_ages * APEX_AGES + young * (Births::AGES + 1) + old;
        let [few, many] = edge.outcomes();
        let outcomes = few * 16 + many;
        let excess = ends[0].wrapping_add(ends[1]).wrapping_sub(apexes[0]).wrapping_sub(apexes[1]);
        let balance = ((excess >> 4) + 16).clamp(0, 31) as usize;
        let valences = |expected: [i32; 2]| {
            let [low, high] = ordered(expected.map(|e| (e.wrapping_sub(3 * UNIT) >> 5).clamp(0, 7) as usize));
            low * 8 + high
        };
        let one = kind % 2;
        let (low, high) = edge.ends_in_bins();
        let [a, b, c, d] = edge.contexts();
        let contexts = [
            a,
            b,
            c,
            d,
            (angle * 16 + low) * 4 + kind,
            (low * 16 + high) * 4 + kind,
            ages * 16 + many,
            (end_ages * 32 + angle) * 2 + one,
            outcomes * 64 + valences(ends),
            outcomes * 64 + valences(apexes),
            (balance * 32 + angle) * 4 + kind,
            angle * 256 + outcomes,
            (balance * 4 + kind) * 256 + outcomes,
        ];
        self.bits.code(coder, bit, [edge.set(), outcomes, ages, balance * 2 + one, kind], contexts)
    }
}
