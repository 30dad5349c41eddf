//! Whole files: what is written, what harmed or hostile bytes give.

use proptest::prelude::*;

use super::*;
use crate::mesh::Precision;
use crate::{Effort, Error, Limits, Result};

type Arrived = Vec<(Part, Vec<u8>)>;

const LATTICE: Precision = Precision::Lattice { bits: 12, origin: [-0.5, 0.25, 0.0], side: 1.5 };

const SOURCE: Approximation =
    Approximation { vertices: 20_000, faces: 39_996, digest: 0x0123_4567_89AB_CDEF, rms: 0.5, greatest: 2.0 };

fn level(kind: LevelKind, vertices: u32, faces: u32, error: f32) -> LevelEntry {
    LevelEntry { kind, update: UpdateRule::None, vertices, faces, error }
}

/// A base, two levels and a section of every supplement.
fn sample() -> (Outline, Vec<Vec<u8>>) {
    let outline = Outline {
        order_kept: true,
        effort: Effort::Fast,
        streams: 3,
        precision: LATTICE,
        vertices: 300,
        faces: 596,
        approximation: Some(SOURCE),
        levels: vec![
            level(LevelKind::Base, 30, 56, 0.5),
            LevelEntry { update: UpdateRule::Third, ..level(LevelKind::Sqrt3Even, 88, 172, 0.125) },
            level(LevelKind::Late, 296, 588, 0.0625),
        ],
        supplements: vec![
            Supplement::Positions,
            Supplement::Exactness,
            Supplement::Merges,
            Supplement::Leftovers,
            Supplement::Order,
            Supplement::Optional(200),
        ],
    };
    let payloads = vec![
        vec![1; 20],
        vec![],
        vec![2; 7],
        vec![8; 4],
        vec![3],
        vec![4; 2],
        vec![5],
        vec![6; 3],
        vec![7; 5],
    ];
    (outline, payloads)
}

/// Everything a file gives, pushed in portions of the given sizes, over and over.
fn read_in(portions: &[usize], mut bytes: &[u8], limits: Limits) -> (Arrived, Reader, Result<()>) {
    let mut reader = Reader::new(limits);
    let mut arrived = Vec::new();
    let mut sizes = portions.iter().cycle();
    while !bytes.is_empty() {
        let (portion, rest) = bytes.split_at(bytes.len().min(*sizes.next().unwrap()));
        reader.push(portion);
        arrived.extend(std::iter::from_fn(|| reader.take()));
        bytes = rest;
    }
    let end = reader.check().and_then(|()| reader.finish());
    (arrived, reader, end)
}

fn read(bytes: &[u8]) -> (Arrived, Reader, Result<()>) {
    read_in(&[bytes.len().max(1)], bytes, Limits::default())
}

fn failure(bytes: &[u8]) -> Error {
    read(bytes).2.unwrap_err()
}

/// The sections that a reader gives out for `payloads`: all but the optional ones.
fn expected(outline: &Outline, payloads: &[Vec<u8>]) -> Arrived {
    let levels = (0..outline.levels.len()).map(Part::Level);
    let supplements = outline.supplements.iter().map(|&supplement| Part::Supplement(supplement));
    let all = levels.chain(supplements).zip(payloads.iter().cloned());
    all.filter(|(part, _)| !matches!(part, Part::Supplement(Supplement::Optional(_)))).collect()
}

/// A file with the given header bytes, its length and checksum in order, and no sections.
fn with_header(header: &[u8]) -> Vec<u8> {
    let mut bytes = after_version(&[]);
    varint::write(&mut bytes, header.len() as u64);
    bytes.extend(header);
    bytes.extend(crc32fast::hash(&bytes).to_le_bytes());
    bytes
}

/// The header of a triangle's file up to its section table: order not kept, a decimal
/// lattice of 2 digits with its origin at (0, −1, 1), 3 vertices, 1 face.
const TRIANGLE: [u8; 10] = [0, 1, 1, 2, 0, 0, 1, 2, 3, 1];

/// [`TRIANGLE`] followed by the given section table.
fn with_table(table: &[&[u8]]) -> Vec<u8> {
    with_header(&[&TRIANGLE[..], &table.concat()].concat())
}

/// A table entry: a base of 3 vertices and 1 face without payload.
const BASE: &[u8] = &[1, 0, 0, 0, 0, 0, 0, 3, 1, 0, 0];

#[test]
fn a_tiny_file_has_these_bytes() {
    let outline = Outline {
        order_kept: false,
        effort: Effort::Default,
        streams: 1,
        precision: Precision::Decimal { exponent: 2, digits: 0, origin: [0, -1, 1] },
        vertices: 3,
        faces: 1,
        approximation: None,
        levels: vec![level(LevelKind::Base, 3, 1, 0.0)],
        supplements: vec![Supplement::Merges],
    };
    let payloads = vec![b"123456789".to_vec(), vec![]];
    let golden = [
        &[0x8A, b'T', b'C', b'T'][..], // magic
        &[VERSION],                    // format version
        &[28],                         // header length
        &[0],                          // flags: the order is not kept
        &[1],                          // streams in a level
        &[1, 2, 0],                    // precision: decimal, 2 digits, all of them in the levels
        &[0, 1, 2],                    //   origin 0, −1, 1
        &[3, 1],                       // vertices and faces of the original
        &[2],                          // sections
        &[1, 9],                       // level, 9 bytes
        &[0x26, 0x39, 0xF4, 0xCB],     //   CRC-32 of "123456789", cbf43926
        &[0, 3, 1],                    //   base without update, 3 vertices, 1 face
        &[0, 0],                       //   geometric error 0
        &[4, 0],                       // merges, 0 bytes
        &[0, 0, 0, 0],                 //   CRC-32 of nothing
        &HEADER_CRC,                   // header checksum
        b"123456789",                  // the base
    ]
    .concat();
    assert_eq!(write(&outline, &payloads).unwrap(), golden);
    let (arrived, reader, end) = read(&golden);
    end.unwrap();
    assert_eq!(arrived, expected(&outline, &payloads));
    assert_eq!(reader.header().unwrap().outline, outline);
}

#[test]
fn the_mark_of_a_lossy_file_has_these_bytes() {
    let mut mark = Vec::new();
    SOURCE.write(&mut mark);
    let printed = [
        &[0xA0, 0x9C, 0x01][..],                           // vertices of the source
        &[0xBC, 0xB8, 0x02],                               // faces of the source
        &[0xEF, 0xCD, 0xAB, 0x89, 0x67, 0x45, 0x23, 0x01], // digest of the source
        &[0x00, 0x3F],                                     // root mean square distance
        &[0x00, 0x40],                                     // greatest distance
    ];
    assert_eq!(mark, printed.concat());
    let header = [&[2u8][..], &TRIANGLE[1..], &mark, &[1], BASE].concat();
    let (_, reader, end) = read(&with_header(&header));
    end.unwrap();
    assert_eq!(reader.header().unwrap().outline.approximation, Some(SOURCE));
    // Without the mark that the flag announces, the table is taken for it.
    let lacking = [&[2u8][..], &TRIANGLE[1..], &[1], BASE].concat();
    assert!(matches!(failure(&with_header(&lacking)), Error::Format { .. }));
    let infinite = [&[2u8][..], &TRIANGLE[1..], &mark[..14], &[0x80, 0x7F, 0, 0], &[1], BASE].concat();
    assert!(matches!(failure(&with_header(&infinite)), Error::Format { .. }));
}

/// Checksum of the golden file's header, as printed in the format document.
const HEADER_CRC: [u8; 4] = [0x7E, 0x63, 0x89, 0xBC];

#[test]
fn sections_lie_end_to_end_behind_the_header() {
    let (outline, payloads) = sample();
    let bytes = write(&outline, &payloads).unwrap();
    let (_, reader, _) = read(&bytes);
    let sections = &reader.header().unwrap().sections;
    assert_eq!(sections.len(), payloads.len());
    for (section, payload) in sections.iter().zip(&payloads) {
        assert_eq!(bytes[section.offset as usize..section.end() as usize], payload[..]);
    }
    assert_eq!(sections.last().unwrap().end(), bytes.len() as u64);
}

#[test]
fn overhead_is_a_few_bytes() {
    let mut outline = Outline { levels: vec![], supplements: vec![], approximation: None, ..sample().0 };
    let lattice = 1 + 1 + 3 * 4 + 8;
    for levels in 1..=6u32 {
        let vertices = 100 * levels;
        let kind = if levels == 1 { LevelKind::Base } else { LevelKind::Adaptive };
        outline.levels.push(level(kind, vertices, 2 * vertices, 0.1));
        let payloads = vec![vec![0; 200]; levels as usize];
        let bytes = write(&outline, &payloads).unwrap().len();
        // The fixed part, 2 + 2 bytes for the counts of the original, 14 bytes a level.
        assert!(bytes - 200 * levels as usize <= 14 + lattice + 4 + 14 * levels as usize);
    }
}

#[test]
fn every_portion_size_gives_the_same_sections() {
    let (outline, payloads) = sample();
    let bytes = write(&outline, &payloads).unwrap();
    for size in 1..=bytes.len() {
        let (arrived, _, end) = read_in(&[size], &bytes, Limits::default());
        end.unwrap();
        assert_eq!(arrived, expected(&outline, &payloads), "portions of {size} bytes");
    }
}

#[test]
fn a_section_is_given_out_with_its_last_byte() {
    let (outline, payloads) = sample();
    let bytes = write(&outline, &payloads).unwrap();
    let (_, whole, _) = read(&bytes);
    let sections = &whole.header().unwrap().sections;
    let mut reader = Reader::new(Limits::default());
    let mut arrived = 0;
    for (i, &byte) in bytes.iter().enumerate() {
        reader.push(&[byte]);
        reader.check().unwrap();
        arrived += std::iter::from_fn(|| reader.take()).count();
        let through = i as u64 + 1;
        let complete = sections.iter().filter(|s| through >= sections[0].offset && through >= s.end());
        let given = complete.filter(|s| s.part != Part::Supplement(Supplement::Optional(200)));
        assert_eq!(arrived, given.count(), "after {through} bytes");
    }
}

#[test]
fn every_truncation_is_reported_after_its_verified_sections() {
    let (outline, payloads) = sample();
    let bytes = write(&outline, &payloads).unwrap();
    let (all, whole, _) = read(&bytes);
    for cut in 0..bytes.len() {
        let (arrived, reader, end) = read(&bytes[..cut]);
        assert!(all.starts_with(&arrived));
        let Err(Error::Truncated { place, have, need }) = end else {
            panic!("{cut} bytes gave {end:?}");
        };
        assert!(have < need);
        let Some(header) = reader.header() else {
            assert_eq!((&place[..], have), ("header", cut as u64));
            continue;
        };
        assert_eq!(header, whole.header().unwrap());
        let section = header.sections.iter().find(|s| s.end() > cut as u64).unwrap();
        assert_eq!((place, need), (section.part.to_string(), section.length.into()));
        assert_eq!(have, cut as u64 - section.offset);
    }
}

#[test]
fn every_changed_byte_is_reported_after_verified_sections() {
    let (outline, payloads) = sample();
    let bytes = write(&outline, &payloads).unwrap();
    let (all, whole, _) = read(&bytes);
    for at in 0..bytes.len() {
        for change in 1..=255u8 {
            let mut harmed = bytes.clone();
            harmed[at] ^= change;
            let (arrived, reader, end) = read(&harmed);
            end.expect_err("a changed byte passed");
            assert!(all.starts_with(&arrived), "byte {at} ^ {change:#x}");
            assert!(reader.header().is_none_or(|header| header == whole.header().unwrap()));
            assert_eq!(read_in(&[1], &harmed, Limits::default()).0, arrived);
        }
    }
}

#[test]
fn a_fault_is_reported_again_and_again() {
    let (outline, payloads) = sample();
    let mut bytes = write(&outline, &payloads).unwrap();
    let (_, whole, _) = read(&bytes);
    bytes[whole.header().unwrap().sections[2].offset as usize] ^= 1;
    let (arrived, mut reader, end) = read(&bytes);
    assert_eq!(arrived.len(), 2);
    assert!(matches!(end, Err(Error::Checksum { place, .. }) if place == "level 2"));
    reader.push(&bytes);
    assert!(matches!(reader.check(), Err(Error::Checksum { .. })));
    assert!(matches!(reader.finish(), Err(Error::Checksum { .. })));
}

#[test]
fn bytes_after_the_last_section_are_a_fault() {
    let (outline, payloads) = sample();
    let mut bytes = write(&outline, &payloads).unwrap();
    bytes.push(0);
    let (arrived, _, end) = read(&bytes);
    assert_eq!(arrived, expected(&outline, &payloads));
    assert!(matches!(end, Err(Error::Format { .. })));
}

#[test]
fn another_format_or_version_is_named_at_once() {
    assert!(matches!(failure(b"ply\nformat"), Error::Format { place, .. } if place == "magic"));
    assert!(matches!(failure(b"\x8AX"), Error::Format { place, .. } if place == "magic"));
    assert!(matches!(failure(b"\x8ATCT\x01"), Error::Unsupported(_)));
    assert!(matches!(failure(b"\x8ATCT\x00"), Error::Unsupported(_)));
}

fn after_version(bytes: &[u8]) -> Vec<u8> {
    [&[0x8A, b'T', b'C', b'T', VERSION], bytes].concat()
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
fn an_optional_section_of_any_length_takes_no_memory() {
    let optional = [200, 0xFF, 0xFF, 0xFF, 0xFF, 0x0F, 0, 0, 0, 0];
    let bytes = with_table(&[&[2], BASE, &optional]);
    let mut reader = Reader::new(Limits { max_memory: 1 << 10 });
    reader.push(&bytes);
    reader.push(&[0; 4000]);
    assert_eq!(reader.take(), Some((Part::Level(0), vec![])));
    assert_eq!(reader.take(), None);
    reader.check().unwrap();
    assert!(matches!(reader.finish(), Err(Error::Truncated { have: 4000, .. })));
    assert_eq!(reader.memory(), 0);
}

#[test]
fn a_section_in_flight_never_holds_more_than_its_length() {
    let base = [1, 100, 0, 0, 0, 0, 0, 3, 1, 0, 0];
    let bytes = with_table(&[&[1], &base]);
    let mut reader = Reader::new(Limits::default());
    reader.push(&bytes);
    for sent in 1..100 {
        reader.push(&[0]);
        assert!(reader.memory() <= (2 * sent).clamp(1, 100));
    }
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
    assert!(unsupported(&changed(1, 0)), "no stream");
    assert!(unsupported(&changed(1, 17)), "seventeen streams");
    assert!(unsupported(&changed(2, 4)), "a precision");
    assert!(unsupported(&changed(kind, 6)), "a level kind");
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

fn precisions() -> impl Strategy<Value = Precision> {
    let origin = || prop::array::uniform3(-(1i64 << 62)..=1 << 62);
    let corner = prop::array::uniform3(prop::num::f32::NORMAL | prop::num::f32::ZERO);
    prop_oneof![
        (4..=24u8, corner, 0.0..6e38).prop_map(|(bits, origin, side)| Precision::Lattice {
            bits,
            origin,
            side
        }),
        (0..=9u8, 0..=5u8, origin()).prop_map(|(exponent, digits, origin)| Precision::Decimal {
            exponent,
            digits,
            origin
        }),
        (-149..=127i16, origin()).prop_map(|(exponent, origin)| Precision::Binary { exponent, origin }),
        (-149..=127i16, origin()).prop_map(|(exponent, origin)| Precision::Refined { exponent, origin }),
    ]
}

fn level_lists() -> impl Strategy<Value = Vec<LevelEntry>> {
    use LevelKind::{Adaptive, Butterfly, Sqrt3Even, Sqrt3Odd};
    let kinds = prop::sample::select(vec![Adaptive, Sqrt3Even, Sqrt3Odd, Butterfly]);
    let updates = prop::sample::select(vec![UpdateRule::None, UpdateRule::Third, UpdateRule::Paper]);
    let entry = (kinds, updates, 0..1u32 << 28, 0..1u32 << 28, 0.0f32..1e9);
    prop::collection::vec(entry, 1..9).prop_map(|entries| {
        let (mut vertices, mut faces) = (0, 0);
        let entries =
            entries.into_iter().enumerate().map(|(i, (kind, update, more_vertices, more_faces, error))| {
                vertices += more_vertices;
                faces += more_faces;
                let error = round_error_up(error);
                let base = level(LevelKind::Base, vertices, faces, error);
                if i == 0 { base } else { LevelEntry { kind, update, ..base } }
            });
        entries.collect()
    })
}

fn outlines() -> impl Strategy<Value = Outline> {
    let known = prop::sample::subsequence(
        vec![Supplement::Exactness, Supplement::Merges, Supplement::Leftovers, Supplement::Order],
        0..=4,
    );
    let optional = prop::collection::vec(128..=255u8, 0..3);
    let counts = (0..u32::MAX, 0..u32::MAX);
    let sources = (0..u32::MAX, 0..u32::MAX, any::<u64>(), 0.0f32..9.0, 0.0f32..9.0);
    let sources = sources.prop_map(|(vertices, faces, digest, rms, greatest)| {
        let [rms, greatest] = [rms, greatest].map(round_error_up);
        Approximation { vertices, faces, digest, rms, greatest }
    });
    let approximations = prop::option::of(sources);
    (any::<bool>(), precisions(), counts, approximations, level_lists(), known, optional).prop_map(
        |(kept, precision, (vertices, faces), approximation, levels, mut supplements, mut optional)| {
            optional.sort();
            let order_kept = kept || supplements.contains(&Supplement::Order);
            supplements.extend(optional.into_iter().map(Supplement::Optional));
            let (effort, streams) = (Effort::Fast, levels.len().min(MOST_STREAMS as usize) as u32);
            Outline {
                order_kept,
                effort,
                streams,
                precision,
                vertices,
                faces,
                approximation,
                levels,
                supplements,
            }
        },
    )
}

proptest! {
    #[test]
    fn what_is_written_is_read_in_any_portions(
        outline in outlines(),
        payloads in prop::collection::vec(prop::collection::vec(any::<u8>(), 0..40), 14),
        portions in prop::collection::vec(1usize..50, 1..20),
    ) {
        let payloads = &payloads[..outline.levels.len() + outline.supplements.len()];
        let bytes = write(&outline, payloads).unwrap();
        let (arrived, reader, end) = read_in(&portions, &bytes, Limits::default());
        prop_assert!(end.is_ok(), "{:?}", end);
        prop_assert_eq!(arrived, expected(&outline, payloads));
        prop_assert_eq!(&reader.header().unwrap().outline, &outline);
    }

    #[test]
    fn any_header_is_refused_or_is_the_one_its_outline_gives(header in prop::collection::vec(any::<u8>(), 0..80)) {
        // The first fields are given, so that some headers get as far as the table.
        for start in [0, 2, TRIANGLE.len()] {
            let bytes = with_header(&[&TRIANGLE[..start], &header].concat());
            let mut reader = Reader::new(Limits::default());
            reader.push(&bytes);
            if let Some(header) = reader.header() {
                let extents: Vec<_> = header.sections.iter().map(|s| (s.length, s.crc)).collect();
                prop_assert_eq!(with_header(&header.outline.write(&extents)), bytes);
            }
        }
    }
}
