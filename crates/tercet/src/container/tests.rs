//! Whole files: what is written, what harmed or hostile bytes give.

mod arriving;
mod random;
mod refused;
mod written;

use super::*;
use crate::mesh::Precision;
use crate::{Effort, Error, Limits, Result};

type Arrived = Vec<(Part, Vec<u8>)>;

const LATTICE: Precision = Precision::Lattice { bits: 12, origin: [-0.5, 0.25, 0.0], side: 1.5 };

const SOURCE: Approximation =
    Approximation { vertices: 20_000, faces: 39_996, digest: 0x0123_4567_89AB_CDEF, rms: 0.5, greatest: 2.0 };

fn level(kind: LevelKind, vertices: u32, faces: u32, error: f32) -> LevelEntry {
    LevelEntry { kind, grouped: false, update: UpdateRule::None, vertices, faces, error }
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

/// A file's magic and version, and `bytes`.
fn after_version(bytes: &[u8]) -> Vec<u8> {
    [&[0x8A, b'T', b'C', b'T', VERSION], bytes].concat()
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
fn the_format_document_describes_this_version() {
    let path = concat!(env!("CARGO_MANIFEST_DIR"), "/../../spec/format.md");
    let document = std::fs::read_to_string(path).unwrap();
    for line in [
        format!("- Document version: **{VERSION}."),
        format!("- Format version described: **{VERSION}** "),
        format!("| format version | `u8` | {VERSION} |"),
    ] {
        assert!(document.contains(&line), "{line}");
    }
}
