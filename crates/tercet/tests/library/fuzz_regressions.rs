//! Replays the fuzz targets' seeds and every input that one of them once failed on.

#[path = "../../../../fuzz/src/lib.rs"]
mod targets;

use std::fs;
use std::path::Path;

fn replay(target: &str, run: fn(&[u8])) {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../fuzz");
    let seeds = inputs(&folder.join("seeds").join(target));
    assert!(!seeds.is_empty(), "{target} has no seeds");
    for (name, bytes) in seeds.into_iter().chain(inputs(&folder.join("regressions").join(target))) {
        println!("{target}: {name}");
        run(&bytes);
    }
}

/// Names and contents of a folder's files; nothing if there is no such folder.
fn inputs(folder: &Path) -> Vec<(String, Vec<u8>)> {
    let Ok(entries) = fs::read_dir(folder) else { return Vec::new() };
    let paths = entries.map(|entry| entry.expect("the folder can be listed").path());
    paths.map(|path| (path.display().to_string(), fs::read(path).expect("the file can be read"))).collect()
}

#[test]
fn inputs_of_the_decoder_give_a_mesh_or_an_error() {
    replay("decode", targets::decode);
}

#[test]
fn files_among_the_seeds_are_of_the_present_format() {
    let mut files = inputs(&Path::new(env!("CARGO_MANIFEST_DIR")).join("../../fuzz/seeds/decode"));
    files.retain(|(name, _)| name.ends_with(".tct"));
    assert!(!files.is_empty());
    for (name, bytes) in files {
        // Old files would be refused at once, and the fuzzer would have to start from nothing.
        let decoded = tercet::decode(&bytes, &tercet::Limits::default());
        decoded.unwrap_or_else(|error| panic!("{name}: {error}; write it anew: cargo xtask seeds"));
    }
}

#[test]
fn inputs_of_the_readers_give_a_mesh_or_an_error() {
    replay("read_obj", targets::read_obj);
    replay("read_off", targets::read_off);
    replay("read_ply", targets::read_ply);
    replay("read_stl", targets::read_stl);
}

#[cfg(feature = "transport")]
#[test]
fn inputs_of_the_receiver_give_out_no_wrong_byte() {
    replay("receive", targets::receive);
}

#[test]
fn inputs_of_the_round_trip_come_back() {
    replay("round_trip", targets::round_trip);
}
