//! What is given out as a file arrives, whole or harmed.

use super::*;

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
