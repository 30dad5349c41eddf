//! What comes out depends on the bytes, not on the portions in which they arrive.

use crate::common::{Random, assert_prefix, drain, levels, meshes, options};
use tercet::shapes::{grid, noisy, scan, soup, torus};
use tercet::{
    Decoder, Effort, EncodeOptions, Error, Limits, Mesh, Progressive, Scheme, Update, encode, subdivide,
};

#[test]
fn any_portions_give_the_same_levels() {
    let mut random = Random(1);
    for (name, mesh) in meshes() {
        for options in options() {
            let file = encode(&mesh, &options).unwrap().bytes;
            let all = levels(&file);
            for longest in [1, 2, 17, file.len()] {
                let mut decoder = Decoder::new(Limits::default());
                let mut found = Vec::new();
                let mut rest = &file[..];
                while !rest.is_empty() {
                    let (portion, after) = rest.split_at((random.below(longest + 1)).min(rest.len()));
                    decoder.push(portion);
                    rest = after;
                    // Sometimes several levels wait at once.
                    if random.below(3) > 0 {
                        found.extend(drain(&mut decoder).0);
                    }
                }
                found.extend(drain(&mut decoder).0);
                decoder.finish().unwrap();
                assert_eq!(found.len(), all.len(), "{name}");
                assert_prefix(&found, &all, name);
            }
        }
    }
}

#[test]
fn a_damaged_section_may_be_sent_again() {
    for (name, mesh) in meshes() {
        let file = encode(&mesh, &EncodeOptions::default()).unwrap().bytes;
        let all = levels(&file);
        let mut damaged = file.clone();
        *damaged.last_mut().unwrap() ^= 1;
        let mut decoder = Decoder::new(Limits::default());
        assert_eq!(decoder.discard_damaged(), None);
        decoder.push(&damaged);
        let (mut found, error) = drain(&mut decoder);
        assert!(matches!(error, Some(Error::Checksum { .. })), "{name}: {error:?}");
        let start = decoder.discard_damaged().unwrap();
        assert!(start < file.len() as u64, "{name}");
        decoder.push(&file[start as usize..]);
        found.extend(drain(&mut decoder).0);
        decoder.finish().unwrap();
        assert_eq!(found.len(), all.len(), "{name}");
        assert_prefix(&found, &all, name);
    }
}

/// Large enough for sections of many pieces, with late levels, levels of their own and a large base.
fn long_files() -> Vec<(&'static str, Vec<u8>)> {
    let plain = EncodeOptions { bits: Some(14), ..EncodeOptions::default() };
    let file = |mesh: &Mesh, options: EncodeOptions| encode(mesh, &options).unwrap().bytes;
    let scan = scan(12_000, 7);
    let refined = noisy(&subdivide(&torus(20, 15), Scheme::Sqrt3, 3, &Limits::default()).unwrap(), 0.002, 1);
    vec![
        ("scan", file(&scan, plain)),
        (
            "late",
            file(
                &noisy(&grid(90, 80), 0.002, 2),
                EncodeOptions { progressive: Progressive::Smallest, ..plain },
            ),
        ),
        ("fast", file(&scan, EncodeOptions { effort: Effort::Fast, ..plain })),
        ("sqrt3", file(&refined, EncodeOptions { update: Update::Third, ..plain })),
        ("groups", file(&refined, EncodeOptions { groups: true, ..plain })),
        ("soup", file(&soup(800, 3), plain)),
    ]
}

#[test]
fn a_preview_grows_from_what_is_expected_to_the_level() {
    for (name, file) in long_files() {
        let all = levels(&file);
        let mut decoder = Decoder::new(Limits::default());
        let (mut found, mut previews) = (Vec::new(), 0);
        let mut before: Option<(u32, u32)> = None;
        for portion in file.chunks(1500) {
            decoder.push(portion);
            found.extend(drain(&mut decoder).0);
            let Some(preview) = decoder.preview() else { continue };
            // Of one level there are never more to come than before.
            let now = (preview.level, u32::MAX - preview.pending);
            assert!(before.is_none_or(|before| before <= now), "{name}: {before:?}, {now:?}");
            before = Some(now);
            let level = all.iter().find(|level| level.level == preview.level).unwrap();
            assert_eq!(preview.mesh.faces, level.mesh.faces, "{name}");
            assert_eq!(preview.mesh.positions.len(), level.mesh.positions.len(), "{name}");
            previews += (preview.pending > 0 && preview.pending < preview.mesh.positions.len() as u32) as u32;
        }
        assert!(previews > 1 || name == "soup", "{name}");
        assert!(decoder.preview().is_none());
        assert_prefix(&found, &all, name);
        assert_eq!(found.len(), all.len(), "{name}");
    }
}

#[test]
fn a_preview_shows_what_has_arrived_and_expects_the_rest() {
    let mesh = scan(12_000, 7);
    let file = encode(&mesh, &EncodeOptions { bits: Some(12), ..EncodeOptions::default() }).unwrap();
    let finest = &file.info.levels[file.info.levels.len() - 2..];
    let [from, to] = [0, 1].map(|i| finest[i].bytes as usize);
    let whole = levels(&file.bytes).pop().unwrap();
    let mut decoder = Decoder::new(Limits::default());
    decoder.push(&file.bytes[..(from + 2 * to) / 3]);
    drain(&mut decoder);
    let preview = decoder.preview().unwrap();
    let equal = preview.mesh.positions.iter().zip(&whole.mesh.positions).filter(|(a, b)| a == b).count();
    assert!(equal >= whole.mesh.positions.len() - preview.pending as usize);
    assert!(preview.pending > 0);
}

#[test]
fn a_damaged_piece_may_be_sent_again() {
    let mut random = Random(5);
    for (name, file) in long_files() {
        let all = levels(&file);
        for _ in 0..8 {
            let at = random.below(file.len());
            let mut damaged = file.clone();
            damaged[at] ^= 0x20;
            let mut decoder = Decoder::new(Limits::default());
            let mut found = Vec::new();
            let mut error = None;
            for portion in damaged.chunks(1 + random.below(9000)) {
                decoder.push(portion);
                let (levels, failure) = drain(&mut decoder);
                found.extend(levels);
                error = error.or(failure);
            }
            if !matches!(error, Some(Error::Checksum { .. })) {
                // The magic, the version or the length of the header.
                assert!(error.is_some() && at < 8, "{name}: {error:?}");
                continue;
            }
            let start = decoder.discard_damaged().unwrap() as usize;
            let near = start == 0 || at - start <= 4100 || name == "groups";
            assert!(start <= at && near, "{name}: {start}, {at}");
            decoder.push(&file[start..]);
            found.extend(drain(&mut decoder).0);
            decoder.finish().unwrap();
            assert_prefix(&found, &all, name);
            assert_eq!(found.len(), all.len(), "{name}");
        }
    }
}

#[test]
fn a_fault_and_the_preview_before_it_do_not_depend_on_portions() {
    let mut random = Random(6);
    for (name, file) in long_files() {
        for _ in 0..4 {
            let mut damaged = file.clone();
            damaged[8 + random.below(file.len() - 8)] ^= 0x20;
            let outcome = |size: usize| {
                let mut decoder = Decoder::new(Limits::default());
                let (mut count, mut error) = (0, None);
                for portion in damaged.chunks(size) {
                    decoder.push(portion);
                    let (levels, failure) = drain(&mut decoder);
                    count += levels.len();
                    error = error.or(failure.map(|error| error.to_string()));
                }
                let preview = decoder.preview();
                (count, error.unwrap(), preview.map(|preview| (preview.level, preview.pending, preview.mesh)))
            };
            let expected = outcome(file.len());
            for size in [700, 5000, 20_000] {
                assert!(outcome(size) == expected, "{name}, portions of {size}: {}", expected.1);
            }
        }
    }
}

#[test]
fn only_what_a_checksum_refused_may_be_sent_again() {
    let mut decoder = Decoder::new(Limits::default());
    decoder.push(b"not a file of ours");
    assert!(decoder.next_level().is_err());
    assert_eq!(decoder.discard_damaged(), None);
    assert!(decoder.next_level().is_err());
}
