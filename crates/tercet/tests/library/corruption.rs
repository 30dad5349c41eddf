//! A damaged file is never taken for another one.

use crate::common::{assert_prefix, drain, holed, levels, options};
use tercet::shapes::{scan, soup};
use tercet::{Decoder, Limits, Mesh, encode};

/// Pushes `bytes`; fails unless all that comes out are true levels and then an error.
fn assert_detected(bytes: &[u8], all: &[tercet::Level], what: &str) {
    let mut decoder = Decoder::new(Limits::default());
    decoder.push(bytes);
    let (found, error) = drain(&mut decoder);
    assert_prefix(&found, all, what);
    assert!(found.iter().all(|l| !l.restored), "{what}: called restored");
    match error {
        Some(first) => {
            let again = decoder.next_level().expect_err(what);
            assert_eq!(again.to_string(), first.to_string(), "{what}");
            assert!(decoder.finish().is_err(), "{what}");
        }
        None => assert!(decoder.finish().is_err(), "{what}: nothing noticed"),
    }
}

fn meshes() -> [(&'static str, Mesh); 3] {
    [("scan", scan(60, 2)), ("soup", soup(14, 4)), ("holed", holed())]
}

#[test]
fn every_flipped_byte_is_noticed() {
    for (name, mesh) in meshes() {
        for options in options() {
            let file = encode(&mesh, &options).unwrap().bytes;
            let all = levels(&file);
            for at in 0..file.len() {
                for by in [0x01, 0x80, 0xFF] {
                    let mut damaged = file.clone();
                    damaged[at] ^= by;
                    let what = format!("{name}, {options:?}, byte {at} ^ {by:#x}");
                    assert_detected(&damaged, &all, &what);
                }
            }
        }
    }
}

#[test]
fn bytes_after_the_end_missing_bytes_and_swapped_bytes_are_noticed() {
    for (name, mesh) in meshes() {
        let file = encode(&mesh, &Default::default()).unwrap().bytes;
        let all = levels(&file);
        for at in (0..file.len()).step_by(5) {
            let mut damaged = file.clone();
            damaged.remove(at);
            assert_detected(&damaged, &all, &format!("{name} without byte {at}"));
            let mut damaged = file.clone();
            damaged.insert(at, 0x5A);
            assert_detected(&damaged, &all, &format!("{name} with a byte at {at}"));
            if at + 9 < file.len() && file[at] != file[at + 9] {
                let mut damaged = file.clone();
                damaged.swap(at, at + 9);
                assert_detected(&damaged, &all, &format!("{name}, bytes {at} and {} swapped", at + 9));
            }
        }
        let mut longer = file.clone();
        longer.push(0);
        let mut decoder = Decoder::new(Limits::default());
        decoder.push(&longer);
        let (found, error) = drain(&mut decoder);
        assert_prefix(&found, &all, name);
        assert!(error.is_some(), "{name}: a byte after the end");
    }
}
