//! Files that are hostile in what checksums do not see.

use super::*;
use crate::container::{self, Reader};
use crate::shapes::{Random, noisy, scan};
use crate::{EncodeOptions, Scheme, encode, subdivide};

/// A file with levels in groups, taken apart.
fn grouped() -> (Outline, Vec<Vec<u8>>) {
    let mesh = subdivide(&scan(100, 1), Scheme::Sqrt3, 4, &Limits::default()).unwrap();
    let options = EncodeOptions { bits: Some(12), groups: true, ..EncodeOptions::default() };
    let mut reader = Reader::new(Limits::default());
    reader.push(&encode(&noisy(&mesh, 0.002, 1), &options).unwrap().bytes);
    let payloads = std::iter::from_fn(|| reader.take()).map(|(_, payload)| payload).collect();
    (reader.header().unwrap().outline.clone(), payloads)
}

fn stamp(bytes: &mut [u8]) {
    let end = bytes.len() - 4;
    let check = crc32fast::hash(&bytes[..end]).to_le_bytes();
    bytes[end..].copy_from_slice(&check);
}

#[test]
fn groups_with_right_checks_and_wrong_contents_give_an_error_or_a_mesh_of_the_same_faces() {
    let (outline, payloads) = grouped();
    let faces = decode(&container::write(&outline, &payloads).unwrap(), &Limits::default()).unwrap().faces;
    let level = outline.levels.iter().rposition(|level| level.grouped).unwrap();
    let size = usize::from(u16::from_le_bytes([payloads[level][0], payloads[level][1]]));
    let count = (payloads[level].len() - 6) / (size + 2);
    let head = 6 + 2 * count;
    let mut random = Random::new(5);
    let (mut refused, mut decoded) = (0, 0);
    for round in 0..200 {
        let mut payloads = payloads.clone();
        let payload = &mut payloads[level];
        match round % 4 {
            0 => payload[random.below(head - 4)] ^= 1 << random.below(8),
            1 => payload.truncate(head + size * random.below(count)),
            2 => payload[head + size * (count - 1)..].fill(random.below(256) as u8),
            _ => payload[head + random.below(count * size)] ^= 1 << random.below(8),
        }
        if payload.len() >= head {
            let (head, groups) = payload.split_at_mut(head);
            stamp(head);
            groups.chunks_exact_mut(size).for_each(stamp);
        }
        match decode(&container::write(&outline, &payloads).unwrap(), &Limits::default()) {
            Ok(mesh) => {
                assert_eq!(mesh.faces, faces, "{round}");
                decoded += 1;
            }
            Err(Error::Format { .. }) => refused += 1,
            Err(other) => panic!("{round}: {other:?}"),
        }
    }
    assert!(refused > 50 && decoded > 30, "{refused} {decoded}");
}

#[test]
fn a_level_in_no_groups_at_all_is_refused_if_it_adds_vertices() {
    let (outline, mut payloads) = grouped();
    let level = outline.levels.iter().rposition(|level| level.grouped).unwrap();
    payloads[level] = [512u16.to_le_bytes().as_slice(), &[0; 4]].concat();
    stamp(&mut payloads[level]);
    let error = decode(&container::write(&outline, &payloads).unwrap(), &Limits::default()).unwrap_err();
    assert!(matches!(error, Error::Format { .. }), "{error:?}");
}
