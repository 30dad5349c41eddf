//! Numbers whose distribution is not known in advance.

use crate::entropy::{Coder, Counter};

/// Memory of the counters: a few hundred numbers.
const LIMIT: u16 = 200;
/// Bits of a number's binary length, as a unary code.
const LENGTHS: usize = 32;
/// Bits below a number's leading one that are learnt; the rest are equally likely.
const LEARNT: u32 = 3;

/// An adaptive Elias gamma code: the length of the number plus one in unary, then the bits below
/// its leading one, where the unary decisions, the first three bits and the sign have counters.
///
/// A number that nothing predicts costs about two bits more than its own.
pub(crate) struct NumberModel {
    lengths: Vec<Counter>,
    leading: Vec<Counter>,
    signs: Vec<Counter>,
}

impl NumberModel {
    /// Independent models for `contexts` situations.
    pub fn new(contexts: usize) -> Self {
        NumberModel {
            lengths: vec![Counter::NEW; contexts * LENGTHS],
            leading: vec![Counter::NEW; (contexts * LENGTHS) << LEARNT],
            signs: vec![Counter::NEW; contexts],
        }
    }

    /// Codes a number below 2³² − 1.
    pub fn code<C: Coder>(&mut self, coder: &mut C, value: u32, context: usize) -> u32 {
        let value = value.min(u32::MAX - 1) + 1;
        let wanted = value.ilog2();
        let mut bits = 0;
        while bits < 31 && self.lengths[context * LENGTHS + bits as usize].code(coder, bits < wanted, LIMIT) {
            bits += 1;
        }
        let learnt = bits.min(LEARNT);
        let nodes = (context * LENGTHS + bits as usize) << LEARNT;
        let mut top = 1u32;
        for k in 1..=learnt {
            let bit = value >> (bits - k) & 1 == 1;
            top = top << 1 | self.leading[nodes + top as usize].code(coder, bit, LIMIT) as u32;
        }
        let rest = bits - learnt;
        let low = coder.raw_wide(value & ((1 << rest) - 1), rest);
        (top << rest | low) - 1
    }

    /// Codes a number whose magnitude is below 2³² − 1.
    pub fn code_signed<C: Coder>(&mut self, coder: &mut C, value: i64, context: usize) -> i64 {
        let magnitude = self.code(coder, value.unsigned_abs() as u32, context) as i64;
        if magnitude == 0 || !self.signs[context].code(coder, value < 0, LIMIT) {
            return magnitude;
        }
        -magnitude
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::entropy::{Decoder, Encoder};
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn numbers_of_every_size_come_back(
            values in prop::collection::vec((0u32..=32, any::<u32>(), any::<bool>(), 0usize..3), 0..200)
        ) {
            let values: Vec<(i64, usize)> = values
                .into_iter()
                .map(|(shift, v, minus, context)| {
                    let v = v.checked_shr(shift).unwrap_or(0).min(u32::MAX - 1) as i64;
                    (if minus { -v } else { v }, context)
                })
                .collect();
            let (mut model, mut encoder) = (NumberModel::new(3), Encoder::new());
            for &(v, context) in &values {
                model.code_signed(&mut encoder, v, context);
            }
            let bytes = encoder.finish();
            let (mut model, mut decoder) = (NumberModel::new(3), Decoder::new(&bytes));
            for &(v, context) in &values {
                prop_assert_eq!(model.code_signed(&mut decoder, 0, context), v);
            }
        }
    }

    #[test]
    fn a_number_that_repeats_costs_next_to_nothing() {
        let (mut model, mut encoder) = (NumberModel::new(1), Encoder::new());
        (0..1000).for_each(|_| assert_eq!(model.code(&mut encoder, 12, 0), 12));
        assert!(encoder.finish().len() < 30);
    }
}
