//! Levels in groups: any of them can be shown, whichever others are missing.

use crate::common::{Random, drain};
use tercet::{
    Decoder, Effort, EncodeOptions, Encoded, Error, Limits, Mesh, Scheme, Update, encode, shapes, subdivide,
};

fn options() -> EncodeOptions {
    EncodeOptions { bits: Some(12), groups: true, ..EncodeOptions::default() }
}

/// A mesh of a scheme's connectivity whose details are no zeros.
fn rough(scheme: Scheme, base: &Mesh, steps: u32, seed: u64) -> Mesh {
    let mesh = subdivide(base, scheme, steps, &Limits::default()).unwrap();
    shapes::noisy(&mesh, 0.002, seed)
}

fn meshes() -> Vec<(&'static str, Mesh)> {
    vec![
        ("√3", rough(Scheme::Sqrt3, &shapes::scan(100, 1), 4, 1)),
        ("√3 with boundary", rough(Scheme::Sqrt3, &shapes::grid(16, 12), 4, 2)),
        ("butterfly", rough(Scheme::Butterfly, &shapes::grid(12, 10), 3, 3)),
    ]
}

/// Places and bytes of the groups of a level, read off the file as its document describes it.
fn groups(file: &Encoded, level: usize) -> Vec<(u64, &[u8])> {
    let (start, end) = (file.info.levels[level - 1].bytes as usize, file.info.levels[level].bytes as usize);
    let section = &file.bytes[start..end];
    let size = u16::from_le_bytes([section[0], section[1]]) as usize;
    let count = (section.len() - 6) / (size + 2);
    let head = 6 + 2 * count;
    let places = (0..count).map(|i| start + head + i * size);
    places.map(|place| (place as u64, &file.bytes[place..place + size])).collect()
}

/// The finest level of a kind that has groups.
fn finest(file: &Encoded) -> usize {
    let levels = &file.info.levels;
    let is_regular = |level: usize| ["sqrt3", "butterfly"].contains(&levels[level].kind);
    let level = (1..levels.len()).rev().find(|&level| is_regular(level)).unwrap();
    assert!(levels[level].bytes - levels[level - 1].bytes > 4600);
    level
}

/// A decoder that has the level before, and the head of this one.
fn before(file: &Encoded, level: usize) -> Decoder {
    let mut decoder = Decoder::new(Limits::default());
    decoder.push(&file.bytes[..groups(file, level)[0].0 as usize]);
    let (levels, error) = drain(&mut decoder);
    assert!(error.is_none() && levels.len() == level);
    decoder
}

#[test]
fn meshes_in_groups_come_back_in_any_portions() {
    for (name, mesh) in meshes() {
        let updates = [Update::None, Update::Third, Update::Paper].map(|update| (update, Effort::Default));
        for (update, effort) in
            updates.into_iter().chain([(Update::None, Effort::Fast), (Update::None, Effort::Max)])
        {
            let options = EncodeOptions { update, effort, ..options() };
            let grouped = encode(&mesh, &options).unwrap();
            let plain = encode(&mesh, &EncodeOptions { groups: false, ..options }).unwrap();
            let [a, b] =
                [&grouped, &plain].map(|file| tercet::decode(&file.bytes, &Limits::default()).unwrap());
            assert!(a == b, "{name}");
            assert!(grouped.bytes.len() * 100 < plain.bytes.len() * 108, "{name}: {}", grouped.bytes.len());
            for size in [1, 700, 5000] {
                let mut decoder = Decoder::new(Limits::default());
                let mut last = None;
                for portion in grouped.bytes.chunks(size) {
                    decoder.push(portion);
                    last = drain(&mut decoder).0.pop().or(last);
                }
                decoder.finish().unwrap();
                assert!(last.unwrap().mesh == a, "{name}");
            }
        }
    }
}

/// The level as it comes in the end.
fn level(file: &Encoded, level: usize) -> Mesh {
    let mut decoder = Decoder::new(Limits::default());
    decoder.push(&file.bytes[..file.info.levels[level].bytes as usize]);
    drain(&mut decoder).0.pop().unwrap().mesh
}

#[test]
fn any_groups_in_any_order_are_the_level_with_holes() {
    for (name, mesh) in meshes() {
        for update in [Update::None, Update::Third] {
            let file = encode(&mesh, &EncodeOptions { update, ..options() }).unwrap();
            let finest = finest(&file);
            let (all, whole) = (groups(&file, finest), level(&file, finest));
            let mut random = Random(7);
            for _ in 0..6 {
                let mut decoder = before(&file, finest);
                let nothing = decoder.preview().unwrap();
                let mut order: Vec<usize> = (0..all.len()).collect();
                order.sort_by_cached_key(|_| random.next());
                let (mut pending, mut matching) = (nothing.pending, 0);
                for group in order {
                    let (place, bytes) = all[group];
                    assert_eq!(decoder.glimpse(place, bytes), 1, "{name}");
                    let shown = decoder.preview().unwrap();
                    assert_eq!(shown.mesh.faces, whole.faces, "{name}");
                    assert!(shown.pending < pending, "{name}");
                    pending = shown.pending;
                    if update == Update::None {
                        let equal = shown.mesh.positions.iter().zip(&whole.positions).filter(|(a, b)| a == b);
                        let equal = equal.count();
                        assert!(equal > matching, "{name}: a group makes its vertices right");
                        matching = equal;
                    }
                    assert!(decoder.next_level().unwrap().is_none(), "what is glimpsed is not final");
                }
                assert!(pending == 0 && decoder.preview().unwrap().mesh == whole, "{name}");
                decoder.push(&file.bytes[all[0].0 as usize..]);
                let (levels, error) = drain(&mut decoder);
                assert!(error.is_none() && levels[0].mesh == whole, "{name}");
                decoder.finish().unwrap();
            }
        }
    }
}

#[test]
fn groups_cost_little() {
    for bits in [12, 20] {
        for (name, mesh) in meshes() {
            let options = EncodeOptions { bits: Some(bits), ..options() };
            let grouped = encode(&mesh, &options).unwrap().bytes.len();
            let plain = encode(&mesh, &EncodeOptions { groups: false, ..options }).unwrap().bytes.len();
            assert!(grouped * 100 < plain * 105, "{name}, {bits} bits: {grouped} and {plain}");
        }
    }
}

#[test]
fn where_nothing_has_come_vertices_lie_where_they_are_expected() {
    for (name, mesh) in meshes() {
        let file = encode(&mesh, &options()).unwrap();
        let finest = finest(&file);
        let all = groups(&file, finest);
        let mut decoder = Decoder::new(Limits::default());
        decoder.keep_predictions(true);
        decoder.push(&file.bytes[..file.info.levels[finest].bytes as usize]);
        let expected = drain(&mut decoder).0.pop().unwrap().predicted.unwrap();
        let mut decoder = before(&file, finest);
        assert!(decoder.preview().unwrap().mesh.positions == expected, "{name}");
        decoder.glimpse(all[1].0, all[1].1);
        let shown = decoder.preview().unwrap();
        let moved = shown.mesh.positions.iter().zip(&expected).filter(|(a, b)| a != b).count();
        assert!(
            moved > 0 && moved + shown.pending as usize + shown.kept as usize <= expected.len(),
            "{name}"
        );
    }
}

#[test]
fn groups_are_of_use_at_their_level_only() {
    let (_, mesh) = meshes().remove(0);
    let file = encode(&mesh, &options()).unwrap();
    let finest = finest(&file);
    let all = groups(&file, finest);
    let (place, bytes) = all[1];
    assert_eq!(Decoder::new(Limits::default()).glimpse(place, bytes), 0);
    let mut early = Decoder::new(Limits::default());
    early.push(&file.bytes[..file.info.levels[finest - 2].bytes as usize]);
    drain(&mut early);
    assert_eq!(early.glimpse(place, bytes), 0);
    let mut decoder = before(&file, finest);
    assert_eq!(decoder.glimpse(place + 2, bytes), 0);
    assert_eq!(decoder.glimpse(0, bytes), 0);
    assert_eq!(decoder.glimpse(u64::MAX, bytes), 0);
    assert_eq!(decoder.glimpse(place, &bytes[1..]), 0);
    // All at once, and then those that are not decoded already.
    let start = all[0].0;
    let rest = &file.bytes[start as usize..file.info.levels[finest].bytes as usize];
    assert_eq!(decoder.glimpse(start, rest), all.len());
    decoder.push(&rest[..bytes.len()]);
    assert!(decoder.next_level().unwrap().is_none());
    assert_eq!(decoder.glimpse(start, rest), all.len() - 1);
}

/// Whatever was glimpsed, the bytes that are pushed decide.
#[test]
fn forged_groups_do_no_lasting_harm() {
    let (_, mesh) = meshes().remove(0);
    let file = encode(&mesh, &options()).unwrap();
    let finest = finest(&file);
    let (all, whole) = (groups(&file, finest), level(&file, finest));
    let (mut random, mut decoder) = (Random(3), before(&file, finest));
    let faces = decoder.preview().unwrap().mesh.faces;
    for round in 0..300 {
        let (place, bytes) = all[round % all.len()];
        let mut forged = bytes.to_vec();
        for _ in 0..1 + round % 5 {
            let at = random.below(forged.len());
            forged[at] ^= 1 << random.below(8);
        }
        assert_eq!(decoder.glimpse(place, &forged), 0, "its check does not match");
        let end = forged.len() - 4;
        let check = crc32fast::hash(&forged[..end]).to_le_bytes();
        forged[end..].copy_from_slice(&check);
        decoder.glimpse(place, &forged);
        assert_eq!(decoder.preview().unwrap().mesh.faces, faces);
    }
    decoder.push(&file.bytes[all[0].0 as usize..]);
    let (levels, error) = drain(&mut decoder);
    assert!(error.is_none() && levels[0].mesh == whole);
}

#[test]
fn a_damaged_group_is_found_and_may_be_sent_again() {
    let (_, mesh) = meshes().remove(0);
    let file = encode(&mesh, &options()).unwrap();
    let finest = finest(&file);
    let (start, end) = (file.info.levels[finest - 1].bytes as usize, file.info.levels[finest].bytes as usize);
    let whole = level(&file, finest);
    for at in (start..end).step_by(211) {
        let mut harmed = file.bytes.clone();
        harmed[at] ^= 8;
        let mut decoder = Decoder::new(Limits::default());
        decoder.push(&harmed);
        let (levels, error) = drain(&mut decoder);
        assert!(levels.len() == finest && matches!(error, Some(Error::Checksum { .. })), "{at}: {error:?}");
        let from = decoder.discard_damaged().unwrap() as usize;
        assert_eq!(from, start);
        decoder.push(&file.bytes[from..]);
        let (levels, error) = drain(&mut decoder);
        assert!(error.is_none() && levels[0].mesh == whole);
    }
}
