//! Large meshes, whose positions come in several streams.

use tercet::shapes::scan;
use tercet::{Decoder, Effort, EncodeOptions, Level, Limits, Mesh, decode, encode};

/// Enough vertices for two streams, of which two levels and the pass of late ones make use.
const VERTICES: usize = 110_000;

fn options(effort: Effort) -> EncodeOptions {
    EncodeOptions { bits: Some(12), effort, ..EncodeOptions::default() }
}

/// The last level, and how many previews there were in which some of its vertices were still to come.
fn in_portions(file: &[u8], size: usize) -> (Level, usize) {
    let mut decoder = Decoder::new(Limits::default());
    let (mut last, mut previews) = (None, 0);
    for portion in file.chunks(size) {
        decoder.push(portion);
        while let Some(level) = decoder.next_level().unwrap() {
            last = Some(level);
        }
        if let Some(preview) = decoder.preview() {
            assert!(preview.pending as usize <= preview.mesh.positions.len());
            previews += (preview.pending > 0) as usize;
        }
    }
    decoder.finish().unwrap();
    (last.unwrap(), previews)
}

fn check(mesh: &Mesh, options: &EncodeOptions) {
    let file = encode(mesh, options).unwrap().bytes;
    assert_eq!(encode(mesh, options).unwrap().bytes, file);
    let whole = decode(&file, &Limits::default()).unwrap();
    assert_eq!(whole.positions.len(), mesh.positions.len());
    let (level, previews) = in_portions(&file, 20_000);
    assert!(level.restored && level.mesh == whole);
    assert!(previews > 3, "{previews} previews");
}

#[test]
fn streams_give_the_same_mesh_at_once_and_one_after_the_other() {
    let mesh = scan(VERTICES, 7);
    check(&mesh, &options(Effort::Default));
}
