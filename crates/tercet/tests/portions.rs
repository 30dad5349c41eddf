//! What comes out depends on the bytes, not on the portions in which they arrive.

mod common;

use common::{Random, assert_prefix, drain, levels, meshes, options};
use tercet::{Decoder, Limits, encode};

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
