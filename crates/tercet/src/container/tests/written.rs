//! What is written: every byte of small files.

use super::*;

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
const HEADER_CRC: [u8; 4] = [0x57, 0x12, 0x1C, 0x49];

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
