//! How what profiles begin with is learnt.
//!
//! ```text
//! TERCET_TRAINING="a.ply b.obj …" cargo test --release -p tercet training -- --ignored --nocapture
//! ```
//!
//! prints the tables of [`opinions`](super::opinions) and [`priors`](super::priors): the means over the meshes, each alike, of what
//! they end with. It starts from the tables that are compiled in; what is printed changes little after the second time.

use crate::entropy::Counter;
use crate::io::{self, Format};
use crate::{Effort, EncodeOptions, Limits};
use std::cell::RefCell;
use std::collections::BTreeMap;
use std::path::Path;

/// What is learnt.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(super) enum Table {
    /// Weights of the slowest profile's ensemble.
    Initial,
    /// Weights of a mixed coordinate.
    Mixed,
    /// What counters of a coordinate say of candidates that repeat, by list.
    Repeated(usize),
    /// What counters of split and of flip bits say, by context.
    Split(usize),
    Flip(usize),
    /// Weights of the contexts of flip bits.
    FlipWeights,
}

/// Sums of values, and of how often each has learnt, by table and row.
type Sums = BTreeMap<(Table, usize), (Vec<i64>, i64)>;

thread_local! {
    static SUMS: RefCell<Option<Sums>> = const { RefCell::new(None) };
}

/// Notes a row of a table that has learnt so often, if a training asks for it.
pub(super) fn note(table: Table, row: usize, values: &[i16], uses: i16) {
    SUMS.with_borrow_mut(|sums| {
        let Some(sums) = sums else { return };
        let (sum, total) = sums.entry((table, row)).or_insert_with(|| (vec![0; values.len()], 0));
        sum.iter_mut().zip(values).for_each(|(sum, &value)| *sum += value as i64 * uses as i64);
        *total += uses as i64;
    });
}

/// Notes what the counters of a context say.
pub(super) fn note_counters(table: Table, counters: &[Counter]) {
    for (value, counter) in counters.iter().enumerate() {
        let (p, seen) = counter.state();
        note(table, value, &[(p >> 1) as i16], seen);
    }
}

#[test]
#[ignore = "prints what is compiled in, from meshes that are not in the repository"]
fn starting_values() {
    let meshes = std::env::var("TERCET_TRAINING").expect("TERCET_TRAINING lists meshes");
    let mut tables: BTreeMap<(Table, usize), (Vec<i64>, i64)> = BTreeMap::new();
    let mut uses: BTreeMap<(Table, usize), i64> = BTreeMap::new();
    for path in meshes.split_whitespace() {
        let format = Format::from_path(Path::new(path)).expect("a mesh format");
        let bytes = std::fs::read(path).expect("a mesh that can be read");
        let mesh = io::read(&bytes, format, &Limits::default()).expect("a mesh").mesh;
        for effort in [Effort::Default, Effort::Max] {
            SUMS.set(Some(Sums::new()));
            let options = EncodeOptions { bits: Some(12), effort, ..EncodeOptions::default() };
            crate::encode(&mesh, &options).expect("a file");
            for (key, (sum, total)) in SUMS.take().unwrap_or_default() {
                if total > 0 {
                    let (means, count) = tables.entry(key).or_insert_with(|| (vec![0; sum.len()], 0));
                    means.iter_mut().zip(sum).for_each(|(mean, sum)| *mean += sum / total);
                    *count += 1;
                    *uses.entry(key).or_default() += total;
                }
            }
        }
    }
    // What split and flip counters say is not printed as it is, but by digits.
    let printed = tables.iter().filter(|((table, _), _)| !matches!(table, Table::Split(_) | Table::Flip(_)));
    for (&(table, row), (sums, count)) in printed {
        let means: Vec<String> = sums.iter().map(|sum| (sum / count).to_string()).collect();
        println!("{table:?}, row {row}: {}", means.join(", "));
    }
    let split = (0..).map(Table::Split).zip(super::priors::SPLIT);
    let contexts = split.chain((0..).map(Table::Flip).zip(super::priors::FLIP));
    for (table, digits) in contexts {
        let rows: Vec<(usize, f64, f64)> = tables
            .iter()
            .filter(|((of, _), _)| *of == table)
            .map(|(key, (sums, count))| (key.1, sums[0] as f64 / *count as f64 / 32768.0, uses[key] as f64))
            .collect();
        // Contexts that only the panels of the slowest effort have stay as they are.
        if rows.is_empty() {
            continue;
        }
        for digit in sums_of_digits(&rows, &digits.iter().map(|digit| digit.len()).collect::<Vec<_>>()) {
            println!("{table:?}: {digit:?}");
        }
    }
}

/// Logits by digit, in 1/256, whose sums come nearest to the probabilities of `rows`: value, probability, weight.
fn sums_of_digits(rows: &[(usize, f64, f64)], digits: &[usize]) -> Vec<Vec<i64>> {
    let mut logits: Vec<Vec<f64>> = digits.iter().map(|&digit| vec![0.0; digit]).collect();
    let split = |mut value: usize| -> Vec<usize> {
        let digit = |&digit: &usize| {
            let rest = value % digit;
            value /= digit;
            rest
        };
        let mut found: Vec<usize> = digits.iter().rev().map(digit).collect();
        found.reverse();
        found
    };
    // Newton's method, a digit at a time.
    for _ in 0..100 {
        for k in 0..digits.len() {
            let mut slopes = vec![(0.0, 20.0); digits[k]];
            for &(value, p, weight) in rows {
                let at = split(value);
                let logit: f64 = at.iter().zip(&logits).map(|(&i, digit)| digit[i]).sum();
                let q = 1.0 / (1.0 + (-logit).exp());
                slopes[at[k]].0 += weight * (p - q);
                slopes[at[k]].1 += weight * q * (1.0 - q);
            }
            // A little inertia: what was hardly ever seen says nothing.
            for (logit, (slope, curvature)) in logits[k].iter_mut().zip(slopes) {
                *logit += (slope - 0.5 * *logit) / curvature;
            }
        }
    }
    logits.into_iter().map(|digit| digit.into_iter().map(|x| (256.0 * x).round() as i64).collect()).collect()
}
