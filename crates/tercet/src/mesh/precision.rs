//! What the integer coordinates of a file stand for.

/// How the integer coordinates `q` of a file become positions, axis by axis.
#[derive(Clone, Debug, PartialEq)]
pub enum Precision {
    /// Lossy, a cubic lattice over the bounding box: `origin + q · side / (2^bits − 1)`.
    Lattice {
        /// Bits of the longest side, 4..=24.
        bits: u8,
        /// The least corner of the bounding box; finite.
        origin: [f32; 3],
        /// The longest side of the bounding box, or more in a lossy file; finite, not negative, 0 for a single point.
        side: f64,
    },
    /// Exact: `(origin + q · 10^digits) / 10^exponent`, the quotient of two `f64` rounded to `f32`,
    /// unless a section after the levels says otherwise.
    Decimal {
        /// Digits after the decimal point, 0..=9.
        exponent: u8,
        /// How many of them the levels lack, 0..=5; the section has them.
        digits: u8,
        /// In units of the last digit; of magnitude at most 2^62.
        origin: [i64; 3],
    },
    /// Exact: `(origin + q) · 2^exponent`.
    Binary {
        /// Exponent of the lattice's step, −149..=127.
        exponent: i16,
        /// Of magnitude at most 2^62.
        origin: [i64; 3],
    },
    /// Exact, in two stages: levels lie on the lattice `(origin + q) · 2^exponent`,
    /// and a section after them restores the bits that the lattice lacks.
    Refined {
        /// Exponent of the lattice's step, −149..=127.
        exponent: i16,
        /// Of magnitude at most 2^62.
        origin: [i64; 3],
    },
}
