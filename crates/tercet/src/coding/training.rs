//! How the starting weights of the `max` profile are learnt.
//!
//! ```text
//! TERCET_TRAINING="a.ply b.obj …" cargo test --release -p tercet training -- --ignored --nocapture
//! ```
//!
//! prints the table of [`opinions`](super::opinions): the mean over the meshes, each alike, of the weights
//! that they end with. It starts from the table that is compiled in; what is printed changes little after the second time.

use super::ensemble::VECTORS;
use super::opinions::INITIAL;
use crate::io::{self, Format};
use crate::{Effort, EncodeOptions, Limits};
use std::cell::RefCell;
use std::path::Path;

/// Sums of weights and of how often they have learnt, by row of the table.
type Sums = [([i64; 8 * VECTORS], i64); INITIAL.len()];

thread_local! {
    static SUMS: RefCell<Option<Sums>> = const { RefCell::new(None) };
}

/// Notes the weights of a row that ended with so many uses, if a training asks for it.
pub(super) fn note(row: usize, weights: [[i16; 8]; VECTORS], uses: i16) {
    SUMS.with_borrow_mut(|sums| {
        let Some((sum, total)) = sums.as_mut().map(|sums| &mut sums[row]) else { return };
        sum.iter_mut().zip(weights.as_flattened()).for_each(|(sum, &w)| *sum += w as i64 * uses as i64);
        *total += uses as i64;
    });
}

#[test]
#[ignore = "prints what is compiled in, from meshes that are not in the repository"]
fn starting_weights() {
    let meshes = std::env::var("TERCET_TRAINING").expect("TERCET_TRAINING lists meshes");
    let mut table = [[0i64; 8 * VECTORS]; INITIAL.len()];
    let mut count = [0; INITIAL.len()];
    for path in meshes.split_whitespace() {
        let format = Format::from_path(Path::new(path)).expect("a mesh format");
        let bytes = std::fs::read(path).expect("a mesh that can be read");
        let mesh = io::read(&bytes, format, &Limits::default()).expect("a mesh").mesh;
        SUMS.set(Some([([0; 8 * VECTORS], 0); INITIAL.len()]));
        let options = EncodeOptions { bits: Some(12), effort: Effort::Max, ..EncodeOptions::default() };
        crate::encode(&mesh, &options).expect("a file");
        for (row, (sum, total)) in SUMS.take().unwrap_or_default().into_iter().enumerate() {
            if total > 0 {
                table[row].iter_mut().zip(sum).for_each(|(mean, sum)| *mean += sum / total);
                count[row] += 1;
            }
        }
    }
    for (row, count) in table.iter().zip(count) {
        println!("    [");
        for vector in row.chunks(8) {
            let vector: Vec<String> = vector.iter().map(|w| (w / count.max(1)).to_string()).collect();
            println!("        [{}],", vector.join(", "));
        }
        println!("    ],");
    }
}
