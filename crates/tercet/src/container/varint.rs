//! Integers of variable length: LEB128, least significant group first, canonical form only.
//!
//! Seven bits a byte; the high bit says that another byte follows. Every value has
//! exactly one spelling, the shortest, so that equal headers are equal bytes and a
//! reader cannot be fed a field padded to any length.

/// Why bytes are not a varint; the texts complete "vertices: ".
const OVERLONG: &str = "not the shortest form of its value";
const OVERFLOW: &str = "does not fit its type";

/// Appends `value`, in 1 byte for every 7 bits of it (at least 1, at most 10).
pub(crate) fn write(out: &mut Vec<u8>, mut value: u64) {
    while value >= 0x80 {
        out.push(value as u8 | 0x80);
        value >>= 7;
    }
    out.push(value as u8);
}

/// Appends a signed value, its sign in the lowest bit so that small magnitudes stay short.
pub(crate) fn write_signed(out: &mut Vec<u8>, value: i64) {
    write(out, zigzag(value));
}

/// Reads a value of at most `bits` bits (1..=64) from the start of `bytes`.
///
/// Returns the value and its length in bytes, or `None` where `bytes` end inside it.
/// At most ⌈`bits` / 7⌉ bytes are looked at. Which error is found does not depend on
/// how many bytes follow it.
///
/// # Errors
/// The cause, if the bytes are not the shortest form or the value has more than `bits` bits.
pub(crate) fn read(bytes: &[u8], bits: u32) -> Result<Option<(u64, usize)>, &'static str> {
    let mut value = 0u64;
    let mut shift = 0;
    for (i, &byte) in bytes.iter().enumerate() {
        let group = u64::from(byte & 0x7F);
        let room = bits - shift;
        let last = byte < 0x80;
        if room < 7 && group >> room != 0 || room <= 7 && !last {
            return Err(OVERFLOW);
        }
        if last && byte == 0 && i > 0 {
            return Err(OVERLONG);
        }
        value |= group << shift;
        if last {
            return Ok(Some((value, i + 1)));
        }
        shift += 7;
    }
    Ok(None)
}

/// Maps 0, −1, 1, −2, … to 0, 1, 2, 3, …
fn zigzag(value: i64) -> u64 {
    (value << 1 ^ value >> 63) as u64
}

/// The inverse of [`write_signed`]'s mapping.
pub(crate) fn unzigzag(code: u64) -> i64 {
    (code >> 1) as i64 ^ -((code & 1) as i64)
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn spelled(value: u64) -> Vec<u8> {
        let mut out = Vec::new();
        write(&mut out, value);
        out
    }

    #[test]
    fn known_values_have_known_spellings() {
        assert_eq!(spelled(0), [0]);
        assert_eq!(spelled(127), [0x7F]);
        assert_eq!(spelled(128), [0x80, 0x01]);
        assert_eq!(spelled(300), [0xAC, 0x02]);
        assert_eq!(spelled(u32::MAX.into()), [0xFF, 0xFF, 0xFF, 0xFF, 0x0F]);
        assert_eq!(spelled(u64::MAX).len(), 10);
        for (value, code) in
            [(0, 0), (-1, 1), (1, 2), (-2, 3), (i64::MAX, u64::MAX - 1), (i64::MIN, u64::MAX)]
        {
            assert_eq!(zigzag(value), code);
            assert_eq!(unzigzag(code), value);
        }
    }

    #[test]
    fn a_padded_spelling_is_refused() {
        assert_eq!(read(&[0x80, 0x00], 64), Err(OVERLONG));
        assert_eq!(read(&[0xFF, 0x80, 0x00], 32), Err(OVERLONG));
        assert_eq!(read(&[0x00, 0x00], 32), Ok(Some((0, 1))));
    }

    #[test]
    fn a_value_beyond_its_type_is_refused_at_the_byte_that_leaves_it() {
        assert_eq!(read(&[0xFF, 0xFF, 0xFF, 0xFF, 0x10], 32), Err(OVERFLOW));
        assert_eq!(read(&[0xFF, 0xFF, 0xFF, 0xFF, 0x8F], 32), Err(OVERFLOW));
        assert_eq!(read(&[0xFF, 0xFF, 0xFF, 0xFF], 32), Ok(None));
        assert_eq!(read(&[0xFF; 9], 64), Ok(None));
        assert_eq!(read(&[0xFF; 10], 64), Err(OVERFLOW));
        assert_eq!(read(&[0x80, 0x02], 8), Err(OVERFLOW));
        assert_eq!(read(&[0xFF, 0x01], 8), Ok(Some((255, 2))));
        assert_eq!(read(&[0x80], 7), Err(OVERFLOW));
    }

    proptest! {
        #[test]
        fn what_is_written_is_read(value: u64, shift in 0u32..64, tail: Vec<u8>) {
            let value = value >> shift;
            let mut bytes = spelled(value);
            let length = bytes.len();
            for cut in 0..length {
                prop_assert_eq!(read(&bytes[..cut], 64), Ok(None));
            }
            bytes.extend(tail);
            prop_assert_eq!(read(&bytes, 64), Ok(Some((value, length))));
        }

        #[test]
        fn what_is_read_would_be_written_the_same(bytes in prop::collection::vec(any::<u8>(), 0..12), bits in 1u32..=64) {
            if let Ok(Some((value, length))) = read(&bytes, bits) {
                prop_assert_eq!(&spelled(value)[..], &bytes[..length]);
                prop_assert!(bits == 64 || value >> bits == 0);
            }
        }

        #[test]
        fn signs_survive(value: i64, shift in 0u32..64) {
            prop_assert_eq!(unzigzag(zigzag(value >> shift)), value >> shift);
        }
    }
}
