//! Weights around an extraordinary vertex, as integers.
//!
//! Labsik and Greiner ("Interpolatory √3-subdivision", 2000) choose, for a vertex of valence n,
//! n ≥ 5, with a = ⅔ cos(π/n): centre 1 − a², and on ring member j, counted so that 0 and 1 are
//! the face's two other corners,
//! (a² + 2a cos t + 2a² cos 2t) / n with t = (2j − 1)π/n. Valences 3 and 4 have weights of
//! their own: 8/9 and 4/27, 4/27, −5/27; 7/9 and 2/9, 2/9, −1/9, −1/9.
//!
//! The table holds them at scale 2^24, the ring rounded to nearest and the centre set to what
//! is missing from 2^24, so that every row sums to one exactly and prediction commutes with
//! translation. Cosines come from integer series: the table is the same on every machine.

/// Scale of the table: a weight of one.
pub(super) const ONE: i32 = 1 << 24;

/// Largest valence with a row. A vertex of larger valence would cost its valence for each of
/// its faces; its ring weights are below 1/24 each by then and the stencil does without them.
pub(super) const MAX_VALENCE: usize = 64;

/// The weights of valence n: centre first, then the ring. Rows 3 to 64 are filled.
pub(super) static ROWS: [[i32; MAX_VALENCE + 1]; MAX_VALENCE + 1] = rows();

/// Fraction bits of the fixed-point numbers below.
pub(super) const BITS: u32 = 60;
/// π, rounded down.
pub(super) const PI: i128 = 0x3243_F6A8_885A_308D;

pub(super) const fn mul(a: i128, b: i128) -> i128 {
    (a * b) >> BITS
}

/// A weight at the table's scale, rounded to nearest.
pub(super) const fn at_table_scale(weight: i128) -> i32 {
    ((weight + (1 << (BITS - 25))) >> (BITS - 24)) as i32
}

/// Cosine of 0 ≤ x < 1 by its Taylor series.
pub(super) const fn cosine(x: i128) -> i128 {
    let square = mul(x, x);
    let mut term = 1 << BITS;
    let mut sum = term;
    let mut k = 1;
    while term != 0 && k < 40 {
        term = -mul(term, square) / (k * (k + 1));
        sum += term;
        k += 2;
    }
    sum
}

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
    let c = cosine(PI / n as i128);
    let a = 2 * c / 3;
    // cos((2j+1)θ) = 2 cos 2θ · cos((2j−1)θ) − cos((2j−3)θ), started by cos(±θ).
    let (mut before, mut now) = (c, c);
    let twice = 2 * (2 * mul(c, c) - unit);
    let mut row = [0; MAX_VALENCE + 1];
    let mut centre = ONE;
    let mut j = 0;
    while j < n {
        let weight = match n {
            3 => [4, 4, -5][j] * unit / 27,
            4 => [2, 2, -1, -1][j] * unit / 9,
            _ => {
                let double = 2 * mul(before, before) - unit;
                (mul(a, a) + 2 * mul(a, before) + 2 * mul(mul(a, a), double)) / n as i128
            }
        };
        row[j + 1] = at_table_scale(weight);
        centre -= row[j + 1];
        (before, now) = (now, mul(twice, now) - before);
        j += 1;
    }
    row[0] = centre;
    row
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::f64::consts::PI;

    fn close(value: i32, expected: f64) {
        let error = (f64::from(value) / f64::from(ONE) - expected).abs();
        assert!(error < 0.51 / f64::from(ONE), "{value} is not {expected}");
    }

    #[test]
    fn rows_three_to_eight_are_the_hand_computed_ones() {
        let third = |x: f64| x / 27.0;
        for (j, w) in [third(4.0), third(4.0), third(-5.0)].into_iter().enumerate() {
            close(ROWS[3][j + 1], w);
        }
        for (j, w) in [2.0 / 9.0, 2.0 / 9.0, -1.0 / 9.0, -1.0 / 9.0].into_iter().enumerate() {
            close(ROWS[4][j + 1], w);
        }
        // n = 5: cos 36° = φ/2, so a = φ/3, a² = (φ+1)/9.
        let phi = (1.0 + 5f64.sqrt()) / 2.0;
        let a2 = (phi + 1.0) / 9.0;
        close(ROWS[5][1], (a2 + phi * phi / 3.0 + a2 * (phi - 1.0)) / 5.0);
        close(ROWS[5][4], (a2 - 2.0 * phi / 3.0 + 2.0 * a2) / 5.0);
        // n = 6: a² = 1/3, cos 30°, 90°, 150°.
        close(ROWS[6][1], (1.0 / 3.0 + 1.0 + 1.0 / 3.0) / 6.0);
        close(ROWS[6][3], (1.0 / 3.0 - 2.0 / 3.0) / 6.0);
        close(ROWS[6][4], (1.0 / 3.0 - 1.0 + 1.0 / 3.0) / 6.0);
        // n = 7, by a pocket calculator: cos(π/7) = 0.900968868, a = 0.600645912.
        for (j, w) in
            [0.2704259644, 0.2704259644, -0.0031438455, -0.0783968425, -0.0169950413].into_iter().enumerate()
        {
            close(ROWS[7][j + 1], w);
        }
        // n = 8: a² = (2 + √2)/9, a cos 22.5° = (2 + √2)/6, cos 45° = √½.
        let r = 2f64.sqrt();
        close(ROWS[8][1], ((2.0 + r) / 9.0 + (2.0 + r) / 3.0 + (2.0 * r + 2.0) / 9.0) / 8.0);
    }

    #[test]
    fn every_row_is_the_formula_to_half_a_unit_and_sums_to_one() {
        for n in 3..=MAX_VALENCE {
            let a = 2.0 / 3.0 * (PI / n as f64).cos();
            assert_eq!(ROWS[n].iter().sum::<i32>(), ONE);
            assert!(ROWS[n][n + 1..].iter().all(|&w| w == 0));
            if n > 4 {
                for j in 0..n {
                    let t = (2.0 * j as f64 - 1.0) * PI / n as f64;
                    close(
                        ROWS[n][j + 1],
                        (a * a + 2.0 * a * t.cos() + 2.0 * a * a * (2.0 * t).cos()) / n as f64,
                    );
                }
                let drift = f64::from(ROWS[n][0]) / f64::from(ONE) - (1.0 - a * a);
                assert!(drift.abs() < 0.5 * n as f64 / f64::from(ONE));
            }
        }
    }

    #[test]
    fn rows_are_symmetric_about_the_face() {
        for n in 3..=MAX_VALENCE {
            for j in 0..n {
                assert_eq!(ROWS[n][1 + j], ROWS[n][1 + (n + 1 - j) % n]);
            }
        }
    }
}
