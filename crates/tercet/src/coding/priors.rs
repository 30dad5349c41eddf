//! What split and flip bits are expected to be before any has been coded.
//!
//! The logit of each value of a context is a sum of what its digits say, fitted to what meshes end with at 12 bits (igea,
//! horse, fandisk, cow, cheburashka and the dragon at three resolutions); the test `starting_values` in `training` prints
//! the tables. Later digits are the lower ones.

use crate::entropy::{Counter, squash};

/// The contexts of a decision, by what each value of each digit says, in 1/256.
pub(super) type Contexts = [&'static [&'static [i16]]; 4];

/// Of a split bit, as in [`Face::contexts`](super::split::Face::contexts).
pub(super) static SPLIT: Contexts = [
    &[
        &[-11, -149, -212, -242, 34, -64, -118, 0, 183, 114, 0, 0, 319, 0, 0, 0],
        &[10, -297, -264, -314, -314, -300, -217, -79, 56, 143, 196, 253, 279, 219, 147, 80],
        &[-26, 1, -13],
        &[-84, 125],
    ],
    &[
        &[-221, -266, -101, 116, 142, 1, -99, -38],
        &[-342, 32, -63, -5, 49, 35, -112, -265],
        &[-455, 276, 2, 12, 22, 12, -4, -80],
        &[-5, 108],
    ],
    &[
        &[0, 0, -1033, -82, -245, -117, 33, 74, 41, -72, -222, -212],
        &[27, 1, -17, -32, -45, -90],
        &[0, -5, -13, -3, 38],
        &[-1, -130, -194, -253, 73, -24, -79, 0, 251, 200, 0, 0, 425, 0, 0, 0],
    ],
    &[
        &[-349, -532, -445, -465, -449, -413, -328, -177, -4, 118, 214, 282, 295, 230, 163, 77],
        &[59, 24, -33, -18, -8, -22, -44, -42],
        &[112, 55, -17, -116, -101, -62, -96],
    ],
];

/// Of a flip bit, as in [`Edge::contexts`](super::flip::Edge::contexts).
pub(super) static FLIP: Contexts = [
    &[
        &[
            409, 370, 420, 445, 449, 440, 394, 343, 301, 268, 239, 205, 170, 139, 96, 64, 41, 6, -25, -60,
            -103, -142, -193, -197, -274, -283, -322, -319, -315, -300, -295, -334,
        ],
        &[60, -58, -11, 7, -22, -26, -47, -53, -46, -45, -27, -9, 32, 44, 69, 106],
        &[105, -57, -179, -224],
        &[-116, -39, 53, 0],
    ],
    &[
        &[546, 608, 576, 432, 322, 241, 169, 75, 13, -58, -160, -255, -377, -473, -502, -413],
        &[65, -92, -95, 0, 107, -27, 0, 0, 156, 0, 0, 0, 0, 0, 0, 0],
        &[-49, -213, -319, 23],
        &[150, -87, 52, -331],
    ],
    &[
        &[-14, 83, 97, 181, 366, 308, 162, 60],
        &[-245, -22, 33, 128, 0, 0, 0, 0],
        &[0, -106, 35, 105, 18, -196, -267, -57],
        &[287, -80],
    ],
    &[
        &[
            0, 0, -13, 0, 123, 158, 177, 131, 119, 99, 114, 85, 122, 156, 191, 229, 258, 250, 254, 210, 152,
            108, 57, -10, -13, -22, -49, -97, -148, -84, -18, 0,
        ],
        &[
            280, 273, 316, 331, 334, 312, 251, 191, 143, 109, 78, 48, 10, -26, -76, -108, -138, -171, -204,
            -244, -290, -333, -386, -398, -482, -501, -545, -550, -549, -525, -501, -500,
        ],
        &[122, -28, -62, -200],
    ],
];

/// What the first and the third context of a flip bit weigh at first, in 1/8192.
pub(super) const FLIP_WEIGHTS: [i16; 2] = [6144, 5829];

/// Counters for all values of some contexts, one context after the other.
pub(super) fn counters(contexts: &[&[&[i16]]]) -> Vec<Counter> {
    let mut counters = Vec::with_capacity(contexts.iter().map(|digits| size(digits)).sum());
    for digits in contexts {
        let expected = |logit| Counter::expecting((squash(logit) >> 8).clamp(1, 255) as u8);
        counters.extend(logits(digits).into_iter().map(expected));
    }
    counters
}

/// How many values a context with these digits has.
pub(super) const fn size(digits: &[&[i16]]) -> usize {
    let (mut size, mut k) = (1, 0);
    while k < digits.len() {
        size *= digits[k].len();
        k += 1;
    }
    size
}

/// Of all values of a context, in order.
fn logits(digits: &[&[i16]]) -> Vec<i32> {
    let mut sums = vec![0];
    for digit in digits {
        let mut longer = vec![0; sums.len() * digit.len()];
        for (places, sum) in longer.chunks_exact_mut(digit.len()).zip(sums) {
            places.iter_mut().zip(*digit).for_each(|(place, &logit)| *place = sum + logit as i32);
        }
        sums = longer;
    }
    sums
}

#[cfg(test)]
mod tests {
    use super::super::opinions::{MIXED, REPEATED, ROWS};
    use super::*;

    #[test]
    fn the_sum_of_the_digits_says_what_a_value_is_expected_to_be() {
        let digits: &[&[i16]] = &[&[0, 600], &[-300, 0, 300]];
        let found = logits(digits);
        assert_eq!(found.len(), size(digits));
        assert_eq!(found, [-300, 0, 300, 300, 600, 900]);
        assert!(
            counters(&[digits])
                .into_iter()
                .zip(found)
                .all(|(counter, l)| counter.p().abs_diff(squash(l)) < 256)
        );
    }

    /// The cells of the rows of a section's tables, without those that begin with a word.
    fn rows(document: &str, section: &str) -> Vec<Vec<String>> {
        let text = document.split("\n### ").find(|text| text.starts_with(section)).unwrap();
        let lines = text.lines().filter(|line| line.starts_with("| ") && line.as_bytes()[2].is_ascii_digit());
        let cells = |line: &str| line.trim_matches('|').split('|').map(|cell| cell.trim().into()).collect();
        lines.map(cells).collect()
    }

    fn listed<T: ToString>(numbers: &[T]) -> String {
        numbers.iter().map(T::to_string).collect::<Vec<_>>().join(", ")
    }

    /// What the tables call the [rows](super::super::opinions::row) of nodes.
    const NODES: [&str; ROWS] = ["0", "1", "2, 3", "4 … 7", "8 … 12", "13 … 15"];

    #[test]
    fn the_format_document_prints_what_is_compiled_in() {
        let path = concat!(env!("CARGO_MANIFEST_DIR"), "/../../spec/format.md");
        let document = std::fs::read_to_string(path).unwrap().replace('−', "-");

        let expected = [SPLIT, FLIP].into_iter().flat_map(|contexts| {
            let of = |(context, digits): (usize, &'static [&'static [i16]])| {
                digits.iter().map(move |digit| [(context + 1).to_string(), listed(digit)])
            };
            contexts.into_iter().enumerate().flat_map(of)
        });
        let printed = rows(&document, "6.8 ").into_iter().map(|row| [row[0].clone(), row[2].clone()]);
        assert_eq!(printed.collect::<Vec<_>>(), expected.collect::<Vec<_>>());
        let text = document.split("\n### ").find(|text| text.starts_with("6.5 ")).unwrap();
        assert!(text.contains(&format!("the weights are {} at first", listed(&FLIP_WEIGHTS))));

        let printed = rows(&document, "7.6 ");
        let counters = REPEATED.iter().enumerate().flat_map(|(list, rows)| {
            let row = move |(node, row): (&str, &[u8; 16])| {
                vec![node.to_string(), (list + 1).to_string(), listed(row)]
            };
            NODES.into_iter().zip(rows).map(row)
        });
        let weights = NODES
            .iter()
            .zip(MIXED)
            .map(|(node, [a, b, c, d, .., bias])| vec![node.to_string(), listed(&[a, b, c, d, bias])]);
        let expected: Vec<_> = counters.chain(weights).collect();
        assert!(printed.ends_with(&expected), "{printed:#?} {expected:#?}");
    }

    #[cfg(feature = "max")]
    #[test]
    fn the_format_document_prints_the_weights_of_the_slowest_effort() {
        let path = concat!(env!("CARGO_MANIFEST_DIR"), "/../../spec/format.md");
        let document = std::fs::read_to_string(path).unwrap().replace('−', "-");
        let printed = rows(&document, "7.12 ").into_iter().map(|row| [row[0].clone(), row[1..].join(", ")]);
        let expected = NODES.iter().zip(&super::super::opinions::INITIAL);
        let expected: Vec<_> =
            expected.map(|(node, weights)| [node.to_string(), listed(weights.as_flattened())]).collect();
        assert!(printed.collect::<Vec<_>>().ends_with(&expected), "{expected:#?}");
    }
}
