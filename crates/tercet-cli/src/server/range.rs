//! The part of a file that a request asks for (RFC 9110, section 14).

use std::ops::Range;

/// What a `Range` field asks for of a file.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Wanted {
    /// All of it: there is no field, it breaks the rules, or it asks for several parts at once,
    /// which a server may answer with the whole.
    Whole,
    /// One part, not empty and within the file.
    Part(Range<u64>),
    /// Nothing that the file has.
    Unsatisfiable,
}

/// Several parts are looked at up to this number; a request for more is malformed or malicious.
const MOST_PARTS: usize = 16;

/// Reads the field for a file of `size` bytes. Takes time linear in the field.
pub fn wanted(field: Option<&str>, size: u64) -> Wanted {
    let Some(list) = field.and_then(bytes_unit) else { return Wanted::Whole };
    let mut parts = Vec::new();
    for part in list.split(',').map(|part| part.trim_matches([' ', '\t'])).filter(|part| !part.is_empty()) {
        match range(part, size) {
            Some(range) if parts.len() < MOST_PARTS => parts.push(range),
            _ => return Wanted::Whole,
        }
    }
    match &parts[..] {
        [] => Wanted::Whole,
        [only] if !only.is_empty() => Wanted::Part(only.clone()),
        parts if parts.iter().all(Range::is_empty) => Wanted::Unsatisfiable,
        _ => Wanted::Whole,
    }
}

/// What follows `bytes=`; the unit's name is of any letter case.
fn bytes_unit(field: &str) -> Option<&str> {
    let (unit, list) = field.split_once('=')?;
    unit.eq_ignore_ascii_case("bytes").then_some(list)
}

/// `first-last`, `first-` or `-suffix` within the file, empty if the file has nothing of it;
/// `None` if it is none of the three.
fn range(part: &str, size: u64) -> Option<Range<u64>> {
    let (first, last) = part.split_once('-')?;
    if first.is_empty() {
        return Some(size.saturating_sub(number(last)?)..size);
    }
    let first = number(first)?;
    let end = if last.is_empty() { size } else { number(last)?.saturating_add(1) };
    if !last.is_empty() && end <= first {
        return None;
    }
    Some(first.min(size)..end.min(size))
}

/// Digits and nothing else. What is too large for 64 bits lies beyond every file.
fn number(digits: &str) -> Option<u64> {
    let valid = !digits.is_empty() && digits.bytes().all(|byte| byte.is_ascii_digit());
    valid.then(|| digits.parse().unwrap_or(u64::MAX))
}

#[cfg(test)]
mod tests {
    use super::*;
    use Wanted::*;

    #[test]
    fn one_part_is_cut_to_the_file() {
        for (field, part) in [
            ("bytes=0-0", 0..1),
            ("bytes=10-19", 10..20),
            ("bytes=10-", 10..100),
            ("bytes=-10", 90..100),
            ("bytes=-1000", 0..100),
            ("bytes=99-99999999999999999999999999", 99..100),
            ("Bytes= 5-6 , ", 5..7),
        ] {
            assert_eq!(wanted(Some(field), 100), Part(part), "{field}");
        }
    }

    #[test]
    fn what_the_file_has_not_cannot_be_satisfied() {
        for field in
            ["bytes=100-", "bytes=100-200", "bytes=-0", "bytes=99999999999999999999-", "bytes=100-,200-"]
        {
            assert_eq!(wanted(Some(field), 100), Unsatisfiable, "{field}");
        }
        assert_eq!(wanted(Some("bytes=0-"), 0), Unsatisfiable);
    }

    #[test]
    fn malformed_and_several_parts_mean_the_whole() {
        let many = format!("bytes={}", "0-0,".repeat(100_000));
        for field in [
            "",
            "bytes",
            "bytes=",
            "bytes=-",
            "bytes=a-b",
            "bytes=5-4",
            "bytes=+1-2",
            "bytes=1--2",
            "bytes=0x1-2",
            "lines=0-1",
            "bytes=0-1,5-6",
            "bytes=0-1,100-",
            "bytes=0-1,x",
            &many,
        ] {
            assert_eq!(wanted(Some(field), 100), Whole, "{}", &field[..field.len().min(30)]);
        }
        assert_eq!(wanted(None, 100), Whole);
    }
}
