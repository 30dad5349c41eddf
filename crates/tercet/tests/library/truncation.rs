//! A file cut short gives the levels that arrived, and says that there should be more.

use crate::common::{assert_prefix, drain, levels, meshes, options};
use tercet::{Decoder, Error, Limits, decode, encode};

#[test]
fn every_prefix_gives_the_levels_that_end_within_it() {
    for (name, mesh) in meshes() {
        for options in options() {
            let file = encode(&mesh, &options).unwrap();
            let all = levels(&file.bytes);
            let mut last = usize::MAX;
            for length in 0..file.bytes.len() {
                let what = format!("{name}, {options:?}, {length} of {} bytes", file.bytes.len());
                // Decoding takes most of the time: the levels themselves are compared where their
                // number changes, and at some other lengths.
                let arrived = file.info.levels.iter().filter(|l| l.bytes <= length as u64).count();
                let mut decoder = Decoder::new(Limits::default());
                decoder.push(&file.bytes[..length]);
                if arrived != last || length % 13 == 0 {
                    let (found, error) = drain(&mut decoder);
                    assert!(error.is_none(), "{what}: {error:?}");
                    // A finest level whose positions come late is there twice once they have arrived.
                    let again = found.windows(2).filter(|pair| pair[0].level == pair[1].level).count();
                    assert_eq!(found.len() - again, arrived, "{what}");
                    assert!(found.iter().all(|l| !l.restored), "{what}");
                    for (found, level) in found.iter().zip(&all) {
                        assert_eq!((found.level, &found.mesh), (level.level, &level.mesh), "{what}");
                    }
                    last = arrived;
                }
                assert!(matches!(decoder.finish(), Err(Error::Truncated { .. })), "{what}");
            }
            assert_prefix(&levels(&file.bytes), &all, name);
        }
    }
}

#[test]
fn decoding_all_of_a_part_is_an_error() {
    let file = encode(&tercet::shapes::scan(60, 1), &Default::default()).unwrap().bytes;
    for length in 0..file.len() {
        let result = decode(&file[..length], &Limits::default());
        assert!(matches!(result, Err(Error::Truncated { .. })), "{length}: {result:?}");
    }
}
