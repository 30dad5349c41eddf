//! The block of the header that states the precision.

use super::fields::{Fields, malformed};
use super::varint;
use crate::Result;
use crate::mesh::Precision;

/// Largest magnitude of an integer origin: origin + q cannot leave an `i64` for any `q` < 2^62.
const MAX_ORIGIN: u64 = 1 << 62;
/// Exponents of the least and the greatest power of two that an `f32` can hold.
const BINARY_EXPONENTS: std::ops::RangeInclusive<i64> = -149..=127;
/// Longest side of a box of finite `f32` corners, the two largest apart.
const MAX_SIDE: f64 = 2.0 * f32::MAX as f64;

impl Precision {
    /// Appends the precision block: a tag byte and the fields of that tag.
    pub(super) fn write(&self, out: &mut Vec<u8>) {
        match *self {
            Precision::Lattice { bits, origin, side } => {
                out.extend([0, bits]);
                out.extend(origin.iter().flat_map(|x| x.to_le_bytes()));
                out.extend(side.to_le_bytes());
            }
            Precision::Decimal { exponent, digits, origin } => {
                out.extend([1, exponent, digits]);
                write_origin(out, origin);
            }
            Precision::Binary { exponent, origin } => {
                out.push(2);
                varint::write_signed(out, exponent.into());
                write_origin(out, origin);
            }
            Precision::Refined { exponent, origin } => {
                out.push(3);
                varint::write_signed(out, exponent.into());
                write_origin(out, origin);
            }
        }
    }

    /// Reads a precision block; the result has passed [`Precision::check`].
    pub(super) fn read(fields: &mut Fields) -> Result<Self> {
        let precision = match fields.byte("precision")? {
            0 => {
                let [bits] = fields.array("lattice bits")?;
                let mut origin = [0.0; 3];
                for x in &mut origin {
                    *x = f32::from_le_bytes(fields.array("lattice origin")?);
                }
                Precision::Lattice { bits, origin, side: f64::from_le_bytes(fields.array("lattice side")?) }
            }
            1 => Precision::Decimal {
                exponent: fields.byte("decimal exponent")?,
                digits: fields.byte("decimal digits")?,
                origin: read_origin(fields)?,
            },
            2 => Precision::Binary { exponent: read_exponent(fields)?, origin: read_origin(fields)? },
            3 => Precision::Refined { exponent: read_exponent(fields)?, origin: read_origin(fields)? },
            tag => return Err(super::unsupported(format!("precision {tag}"))),
        };
        precision.check()?;
        Ok(precision)
    }

    /// Fails if a field is out of the range that its documentation states.
    pub(super) fn check(&self) -> Result<()> {
        match self {
            Precision::Lattice { bits, origin, side } => {
                if !(4..=24).contains(bits) {
                    return Err(malformed("lattice bits", format!("{bits} is not in 4..=24")));
                }
                // Fractions are not printed: the code for that is a tenth of a decoder on the web.
                if !origin.iter().all(|x| x.is_finite()) {
                    return Err(malformed("lattice origin", "not a finite number"));
                }
                if !(0.0..=MAX_SIDE).contains(side) || side.is_sign_negative() {
                    return Err(malformed("lattice side", "not the side of a box"));
                }
                Ok(())
            }
            Precision::Decimal { exponent, digits, origin } => {
                if *exponent > 9 {
                    return Err(malformed("decimal exponent", format!("{exponent} is not in 0..=9")));
                }
                if *digits > 5 {
                    return Err(malformed("decimal digits", format!("{digits} is not in 0..=5")));
                }
                check_origin(origin)
            }
            Precision::Binary { exponent, origin } | Precision::Refined { exponent, origin } => {
                check_exponent(i64::from(*exponent))?;
                check_origin(origin)
            }
        }
    }
}

fn write_origin(out: &mut Vec<u8>, origin: [i64; 3]) {
    for x in origin {
        varint::write_signed(out, x);
    }
}

fn read_origin(fields: &mut Fields) -> Result<[i64; 3]> {
    Ok([fields.i64("origin x")?, fields.i64("origin y")?, fields.i64("origin z")?])
}

fn read_exponent(fields: &mut Fields) -> Result<i16> {
    let exponent = fields.i64("binary exponent")?;
    check_exponent(exponent)?;
    // The cast keeps the value: the range just checked lies within an i16.
    Ok(exponent as i16)
}

fn check_exponent(exponent: i64) -> Result<()> {
    if !BINARY_EXPONENTS.contains(&exponent) {
        return Err(malformed("binary exponent", format!("{exponent} is not in −149..=127")));
    }
    Ok(())
}

fn check_origin(origin: &[i64; 3]) -> Result<()> {
    match origin.iter().find(|x| x.unsigned_abs() > MAX_ORIGIN) {
        Some(x) => Err(malformed("origin", format!("{x} is beyond 2^62"))),
        None => Ok(()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Error;

    fn refusal(precision: Precision) -> String {
        let mut bytes = Vec::new();
        precision.write(&mut bytes);
        match Precision::read(&mut Fields::new(&bytes)) {
            Err(Error::Format { cause, .. }) => cause,
            other => panic!("{precision:?} was read as {other:?}"),
        }
    }

    #[test]
    fn fields_out_of_range_are_refused() {
        let lattice = |bits, x, side| Precision::Lattice { bits, origin: [0.0, x, 0.0], side };
        assert!(refusal(lattice(3, 0.0, 1.0)).starts_with("lattice bits: 3"));
        assert!(refusal(lattice(25, 0.0, 1.0)).starts_with("lattice bits: 25"));
        assert!(refusal(lattice(12, f32::NAN, 1.0)).starts_with("lattice origin: "));
        assert!(refusal(lattice(12, f32::INFINITY, 1.0)).starts_with("lattice origin: "));
        for side in [f64::NAN, f64::INFINITY, -1.0, -0.0, 1e39] {
            assert!(refusal(lattice(12, 0.0, side)).starts_with("lattice side: "), "{side}");
        }
        let far = (1i64 << 62) + 1;
        let decimal = |exponent, digits, origin| Precision::Decimal { exponent, digits, origin };
        assert!(refusal(decimal(10, 0, [0; 3])).starts_with("decimal exponent: 10"));
        assert!(refusal(decimal(9, 6, [0; 3])).starts_with("decimal digits: 6"));
        assert!(refusal(decimal(9, 0, [0, 0, far])).starts_with("origin: "));
        assert!(
            refusal(Precision::Binary { exponent: -150, origin: [0; 3] })
                .starts_with("binary exponent: -150")
        );
        assert!(
            refusal(Precision::Refined { exponent: 128, origin: [0; 3] }).starts_with("binary exponent: 128")
        );
        assert!(
            refusal(Precision::Refined { exponent: 0, origin: [i64::MIN, 0, 0] }).starts_with("origin: ")
        );
    }

    #[test]
    fn the_ends_of_every_range_are_accepted() {
        let far = 1i64 << 62;
        for precision in [
            Precision::Lattice { bits: 4, origin: [f32::MIN, -0.0, f32::MAX], side: 0.0 },
            Precision::Lattice { bits: 24, origin: [0.0; 3], side: MAX_SIDE },
            Precision::Decimal { exponent: 0, digits: 0, origin: [far, -far, 0] },
            Precision::Decimal { exponent: 9, digits: 5, origin: [0; 3] },
            Precision::Binary { exponent: -149, origin: [far, -far, 0] },
            Precision::Refined { exponent: 127, origin: [-1, 1, 0] },
        ] {
            let mut bytes = Vec::new();
            precision.write(&mut bytes);
            let mut fields = Fields::new(&bytes);
            assert_eq!(Precision::read(&mut fields).unwrap(), precision);
            fields.end().unwrap();
        }
    }

    #[test]
    fn an_unknown_precision_is_a_feature_of_a_later_version() {
        assert!(matches!(Precision::read(&mut Fields::new(&[4])), Err(Error::Unsupported(_))));
    }
}
