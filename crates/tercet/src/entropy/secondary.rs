//! Secondary estimation: what a probability has turned out to mean.

use super::{LOGIT_LIMIT, squash};

/// Knots of a curve, so far apart in logits of 1/256.
const KNOTS: usize = 33;
const STEP_BITS: u32 = 7;

/// An outcome moves the nearest knot by one part in 2⁶.
const RATE: i32 = 6;

/// For each context a curve from logits to probabilities, linear between knots. The curves begin as the
/// logistic function.
#[derive(Clone, Debug)]
pub(crate) struct Secondary(Vec<[u16; KNOTS]>);

/// The knot that an outcome moves.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Knot {
    context: usize,
    knot: usize,
}

impl Secondary {
    pub fn new(contexts: usize) -> Self {
        let knot = |i: usize| squash(((i as i32) << STEP_BITS) - (LOGIT_LIMIT + 1));
        Secondary(vec![std::array::from_fn(knot); contexts])
    }

    /// The probability that a logit within ± [`LOGIT_LIMIT`] has meant in a context, and what is to learn the outcome.
    #[inline(always)]
    pub fn refine(&self, context: usize, logit: i32) -> (u16, Knot) {
        let at = logit + LOGIT_LIMIT + 1;
        let (knot, part) = ((at >> STEP_BITS) as usize, at & ((1 << STEP_BITS) - 1));
        let [low, high] = [knot, knot + 1].map(|knot| self.0[context][knot] as i32);
        let p = low + (((high - low) * part) >> STEP_BITS);
        (p as u16, Knot { context, knot: knot + (part >> (STEP_BITS - 1)) as usize })
    }

    /// Learns an outcome.
    #[inline(always)]
    pub fn learn(&mut self, Knot { context, knot }: Knot, bit: bool) {
        let p = &mut self.0[context][knot];
        let target = if bit { 65503 } else { 32 };
        *p = (*p as i32 + ((target - *p as i32) >> RATE)) as u16;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_wrong_probability_is_put_right_and_others_stay() {
        let mut secondary = Secondary::new(2);
        for logit in -LOGIT_LIMIT..=LOGIT_LIMIT {
            let (p, _) = secondary.refine(0, logit);
            assert!(p > 0 && p.abs_diff(squash(logit)) < 500, "{logit}: {p}");
        }
        // A logit at a knot.
        let logit = 5 << STEP_BITS;
        for i in 0..4000 {
            let (_, knot) = secondary.refine(1, logit);
            secondary.learn(knot, i % 4 == 0);
        }
        assert!(secondary.refine(1, logit).0.abs_diff(1 << 14) < 3000);
        assert_eq!(secondary.refine(0, logit).0, squash(logit));
        for (bit, logit) in [(true, LOGIT_LIMIT), (false, -LOGIT_LIMIT)] {
            for _ in 0..2000 {
                let (p, knot) = secondary.refine(0, logit);
                assert!(p > 0);
                secondary.learn(knot, bit);
            }
        }
    }
}
