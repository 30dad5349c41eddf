//! Headers that are refused, and outlines that are not written.

use super::*;

#[test]
fn another_format_or_version_is_named_at_once() {
    assert!(matches!(failure(b"ply\nformat"), Error::Format { place, .. } if place == "magic"));
    assert!(matches!(failure(b"\x8AX"), Error::Format { place, .. } if place == "magic"));
    assert!(matches!(failure(b"\x8ATCT\x01"), Error::Unsupported(_)));
    assert!(matches!(failure(b"\x8ATCT\x00"), Error::Unsupported(_)));
}

#[test]
fn a_header_length_is_bounded_and_canonical() {
    let too_long = failure(&after_version(&[0x81, 0x80, 0x04]));
    assert!(matches!(too_long, Error::Format { place, .. } if place == "header length"));
    assert!(matches!(failure(&after_version(&[0x81, 0x00])), Error::Format { .. }));
    assert!(matches!(failure(&after_version(&[0xFF; 5])), Error::Format { .. }));
    // 65536 bytes are allowed, and waited for.
    assert!(matches!(failure(&after_version(&[0x80, 0x80, 0x04])), Error::Truncated { need: 65548, .. }));
}

#[test]
fn a_short_file_that_asks_for_gigabytes_is_refused_before_they_are_sent() {
    // A base of u32::MAX bytes.
    let bytes = with_table(&[&[1], &[1, 0xFF, 0xFF, 0xFF, 0xFF, 0x0F, 0, 0, 0, 0, 0, 3, 1, 0, 0]]);
    let limits = Limits { max_memory: 1 << 20 };
    let (_, reader, end) = read_in(&[7], &bytes, limits);
    assert!(matches!(end, Err(Error::Limit { needed: 0xFFFF_FFFF, allowed: 0x10_0000, .. })));
    assert!(reader.header().is_none());
    // A limit that allows it waits for the bytes without reserving room for them.
    let (_, reader, end) = read_in(&[7], &[&bytes[..], &[0; 100]].concat(), Limits::default());
    assert!(matches!(end, Err(Error::Truncated { have: 100, need: 0xFFFF_FFFF, .. })));
    assert!(reader.memory() < 1000);
}

#[test]
fn features_of_later_versions_are_unsupported() {
    let unsupported = |bytes: &[u8]| matches!(failure(bytes), Error::Unsupported(_));
    let changed = |at: usize, byte: u8| {
        let mut header = [&TRIANGLE[..], &[1], BASE].concat();
        header[at] = byte;
        with_header(&header)
    };
    let kind = TRIANGLE.len() + 1 + 6;
    read(&changed(0, 1)).2.unwrap();
    assert!(unsupported(&changed(0, 0x80)), "a reserved flag");
    read(&changed(1, 16)).2.unwrap();
    assert!(matches!(failure(&changed(0, 0x10)), Error::Format { .. }), "groups that no level has");
    assert!(unsupported(&changed(1, 0)), "no stream");
    assert!(unsupported(&changed(1, 17)), "seventeen streams");
    assert!(unsupported(&changed(2, 4)), "a precision");
    assert!(unsupported(&changed(kind, 9)), "a level kind");
    assert!(unsupported(&changed(kind, 0x30)), "an update rule");
    for code in [0, 7, 127] {
        assert!(unsupported(&with_table(&[&[2], BASE, &[code, 0, 0, 0, 0, 0]])), "section type {code}");
    }
}

#[test]
fn headers_that_break_a_rule_are_refused() {
    let level = |kind: u8, vertices: u8, faces: u8| [1, 0, 0, 0, 0, 0, kind, vertices, faces, 0, 0];
    let merges = [4, 0, 0, 0, 0, 0];
    let order = [6, 0, 0, 0, 0, 0];
    let optional = [128, 0, 0, 0, 0, 0];
    let refused = |what: &str, table: &[&[u8]]| {
        let end = failure(&with_table(table));
        assert!(matches!(end, Error::Format { .. }), "{what}: {end:?}");
    };
    refused("no section", &[&[0]]);
    refused("no base", &[&[1], &merges]);
    refused("first level not a base", &[&[1], &level(1, 3, 1)]);
    refused("a second base", &[&[2], BASE, &level(0, 3, 1)]);
    refused("a base with an update", &[&[1], &level(0x10, 3, 1)]);
    refused("fewer vertices", &[&[2], BASE, &level(1, 2, 1)]);
    refused("fewer faces", &[&[2], BASE, &level(1, 3, 0)]);
    refused("a level after a supplement", &[&[3], BASE, &merges, &level(1, 3, 1)]);
    refused("a supplement twice", &[&[3], BASE, &merges, &merges]);
    refused("types out of order", &[&[3], BASE, &optional, &merges]);
    refused("an order section without the flag", &[&[2], BASE, &order]);
    refused("late levels without positions", &[&[2], BASE, &level(5, 3, 1)]);
    refused("positions without late levels", &[&[2], BASE, &[2, 0, 0, 0, 0, 0]]);
    refused("a byte after the table", &[&[1], BASE, &[0]]);
    refused("a table cut short", &[&[2], BASE]);
    refused("a count padded", &[&[0x81, 0x00], BASE]);
    refused("the count u32::MAX", &[&[1], &BASE[..7], &[0xFF, 0xFF, 0xFF, 0xFF, 0x0F], &BASE[8..]]);
    refused("an infinite error", &[&[1], &BASE[..9], &[0x80, 0x7F]]);
    refused("a negative error", &[&[1], &BASE[..9], &[0x00, 0x80]]);
    read(&with_table(&[&[4], BASE, &merges, &optional, &optional])).2.unwrap();
}

#[test]
fn an_outline_that_breaks_a_rule_is_not_written() {
    let refused = |outline: Outline| {
        let payloads = vec![vec![]; outline.levels.len() + outline.supplements.len()];
        assert!(matches!(write(&outline, &payloads), Err(Error::Format { .. })), "{outline:?}");
    };
    let (good, _) = sample();
    refused(Outline { levels: vec![], ..good.clone() });
    refused(Outline { order_kept: false, ..good.clone() });
    refused(Outline { vertices: u32::MAX, ..good.clone() });
    refused(Outline { levels: vec![level(LevelKind::Base, 0, 0, f32::NAN)], ..good.clone() });
    refused(Outline { supplements: vec![Supplement::Positions, Supplement::Optional(127)], ..good.clone() });
    refused(Outline { supplements: vec![], ..good.clone() });
    refused(Outline { levels: good.levels[..2].to_vec(), ..good.clone() });
    let mut mixed = good.levels.clone();
    mixed.extend([level(LevelKind::Adaptive, 300, 596, 0.0), good.levels[2]]);
    refused(Outline { levels: mixed, ..good.clone() });
    refused(Outline { precision: Precision::Decimal { exponent: 10, digits: 0, origin: [0; 3] }, ..good });
}

#[test]
fn a_header_beyond_its_limit_is_not_written() {
    let (mut outline, _) = sample();
    // A late level is the last one.
    let late = outline.levels.pop();
    outline.levels.resize(7000, level(LevelKind::Adaptive, 296, 588, 0.0));
    outline.levels.extend(late);
    let payloads = vec![vec![]; outline.levels.len() + outline.supplements.len()];
    assert!(matches!(write(&outline, &payloads), Err(Error::Limit { allowed: 65536, .. })));
}
