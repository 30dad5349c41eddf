//! What comes out depends on the bytes, not on the portions in which they arrive.

mod common;

use common::{Random, assert_prefix, drain, levels, meshes, options};
use tercet::{Decoder, EncodeOptions, Error, Limits, encode};

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

#[test]
fn only_what_a_checksum_refused_may_be_sent_again() {
    let mut decoder = Decoder::new(Limits::default());
    decoder.push(b"not a file of ours");
    assert!(decoder.next_level().is_err());
    assert_eq!(decoder.discard_damaged(), None);
    assert!(decoder.next_level().is_err());
}
