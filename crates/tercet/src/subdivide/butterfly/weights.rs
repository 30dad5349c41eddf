//! Weights around an extraordinary vertex of the butterfly scheme, as integers.
//!
//! Zorin, Schröder and Sweldens ("Interpolating subdivision for meshes with arbitrary topology",
//! 1996) choose for the vertex in the middle of an edge with one end of valence n, n ≥ 5: that end
//! 3/4, and ring member j, where member 0 is the other end, (1/4 + cos t + ½ cos 2t) / n with
//! t = 2πj/n. Valences 3 and 4 have ring weights of their own: 5/12, −1/12, −1/12 and
//! 3/8, 0, −1/8, 0. In exact numbers every row's ring sums to 1/4.
//!
//! As in the table of the √3 scheme the ring is rounded to nearest at scale 2^24 and the centre is
//! what is missing from 2^24.

use super::super::weights::{BITS, MAX_VALENCE, ONE, PI, at_table_scale, cosine, mul};

/// The weights of valence n: centre first, then the ring. Rows 3 to 64 are filled.
pub(super) static ROWS: [[i32; MAX_VALENCE + 1]; MAX_VALENCE + 1] = rows();

const fn rows() -> [[i32; MAX_VALENCE + 1]; MAX_VALENCE + 1] {
    let mut rows = [[0; MAX_VALENCE + 1]; MAX_VALENCE + 1];
    let mut n = 3;
    while n <= MAX_VALENCE {
        rows[n] = row(n);
        n += 1;
    }
    rows
}

const fn row(n: usize) -> [i32; MAX_VALENCE + 1] {
    let unit = 1i128 << BITS;
    let half_turn = cosine(PI / n as i128);
    let turn = 2 * mul(half_turn, half_turn) - unit;
    // cos (j+1)θ = 2 cos θ · cos jθ − cos (j−1)θ with θ = 2π/n, started by cos(∓θ) and cos 0.
    let (mut before, mut now) = (turn, unit);
    let mut row = [0; MAX_VALENCE + 1];
    let mut centre = ONE;
    let mut j = 0;
    while j < n {
        let weight = match n {
            3 => [5, -1, -1][j] * unit / 12,
            4 => [3, 0, -1, 0][j] * unit / 8,
            // ½ cos 2t = cos² t − ½.
            _ => (unit / 4 + now + mul(now, now) - unit / 2) / n as i128,
        };
        row[j + 1] = at_table_scale(weight);
        centre -= row[j + 1];
        (before, now) = (now, 2 * mul(turn, now) - before);
        j += 1;
    }
    row[0] = centre;
    row
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::f64::consts::TAU;

    fn close(value: i32, expected: f64) {
        let error = (f64::from(value) / f64::from(ONE) - expected).abs();
        assert!(error < 0.51 / f64::from(ONE), "{value} is not {expected}");
    }

    #[test]
    fn rows_three_to_eight_are_the_hand_computed_ones() {
        for (n, ring) in [
            (3, vec![5.0 / 12.0, -1.0 / 12.0, -1.0 / 12.0]),
            (4, vec![0.375, 0.0, -0.125, 0.0]),
            // cos 60° = ½, cos 120° = −½, cos 180° = −1.
            (6, [7.0, 2.0, -2.0, -1.0, -2.0, 2.0].map(|w| w / 24.0).to_vec()),
        ] {
            for (j, w) in ring.into_iter().enumerate() {
                close(ROWS[n][j + 1], w);
            }
        }
        // cos 72° = (√5 − 1)/4, cos 144° = −(√5 + 1)/4.
        let r = 5f64.sqrt();
        let (c, d) = ((r - 1.0) / 4.0, -(r + 1.0) / 4.0);
        for (j, w) in [0.25 + 1.5, 0.25 + c + d / 2.0, 0.25 + d + c / 2.0].into_iter().enumerate() {
            close(ROWS[5][j + 1], w / 5.0);
        }
        // By a pocket calculator: cos 360°/7 = 0.623489802, cos 720°/7 = −0.222520934,
        // cos 1080°/7 = −0.900968868.
        for (j, w) in [0.25, 0.1088899050, -0.0604293383, -0.0484605667].into_iter().enumerate() {
            close(ROWS[7][j + 1], w);
        }
        // cos 45° = √½, cos 90° = 0.
        let h = 0.5f64.sqrt();
        for (j, w) in [1.75, 0.25 + h, -0.25, 0.25 - h, -0.25].into_iter().enumerate() {
            close(ROWS[8][j + 1], w / 8.0);
        }
    }

    #[test]
    fn every_row_is_the_formula_to_half_a_unit_and_sums_to_one() {
        for n in 3..=MAX_VALENCE {
            assert_eq!(ROWS[n].iter().sum::<i32>(), ONE);
            assert!(ROWS[n][n + 1..].iter().all(|&w| w == 0));
            let drift = f64::from(ROWS[n][0]) / f64::from(ONE) - 0.75;
            assert!(drift.abs() < 0.5 * n as f64 / f64::from(ONE));
            for j in (0..n).filter(|_| n > 4) {
                let t = j as f64 * TAU / n as f64;
                close(ROWS[n][j + 1], (0.25 + t.cos() + 0.5 * (2.0 * t).cos()) / n as f64);
            }
        }
    }

    #[test]
    fn the_table_is_the_one_that_the_format_document_prints() {
        let rows = (3..=MAX_VALENCE).flat_map(|n| &ROWS[n][..=n]);
        let bytes: Vec<u8> = rows.flat_map(|weight| weight.to_le_bytes()).collect();
        assert_eq!(crc32fast::hash(&bytes), 0xABA338F8);
    }

    #[test]
    fn rows_are_symmetric_about_the_edge() {
        for n in 3..=MAX_VALENCE {
            for j in 1..n {
                assert_eq!(ROWS[n][1 + j], ROWS[n][1 + n - j]);
            }
        }
    }
}
