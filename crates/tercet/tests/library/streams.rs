//! Large meshes, whose positions come in several streams.

use crate::common::drain;
use tercet::shapes::{noisy, scan, sphere};
use tercet::{
    Decoder, Effort, EncodeOptions, Encoded, Error, Level, LevelScheme, Limits, Mesh, Progressive, decode,
    encode, verify,
};

fn options(effort: Effort) -> EncodeOptions {
    EncodeOptions { bits: Some(12), effort, keep_order: true, ..EncodeOptions::default() }
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

/// Encodes a mesh whose positions come in several streams, after it has come back in several ways.
fn check(mesh: &Mesh, options: &EncodeOptions) -> Encoded {
    let encoded = encode(mesh, options).unwrap();
    let whole = decode(&encoded.bytes, &Limits::default()).unwrap();
    assert!(whole == verify::quantised(mesh, &encoded.info.precision));
    let (level, previews) = in_portions(&encoded.bytes, 8_000);
    assert!(level.restored && level.mesh == whole);
    assert!(previews > 3, "{previews} previews");
    encoded
}

fn is_late(encoded: &Encoded) -> bool {
    encoded.info.levels.iter().any(|level| level.kind == "late")
}

#[test]
fn levels_of_several_streams_come_back_at_once_and_one_after_the_other() {
    assert!(!is_late(&check(&scan(110_000, 7), &options(Effort::Default))));
}

#[test]
fn late_positions_do_so_too() {
    // Few of the vertices are known at first, so that some know no neighbour of their region.
    let mesh = noisy(&sphere(7), 0.0005, 1);
    let options = EncodeOptions {
        scheme: LevelScheme::Adaptive,
        progressive: Progressive::Smallest,
        ..options(Effort::Default)
    };
    let encoded = check(&mesh, &options);
    assert!(is_late(&encoded));
    let levels = encoded.info.levels.len();
    // A level takes 250 bytes a vertex, and regions that are coded one after the other 104 besides.
    let within = |bytes_each: u64| {
        let mut decoder = Decoder::new(Limits { max_memory: bytes_each * mesh.positions.len() as u64 });
        decoder.push(&encoded.bytes);
        drain(&mut decoder)
    };
    let (found, error) = within(300);
    assert_eq!(found.len(), levels);
    assert!(matches!(error, Some(Error::Limit { .. })), "{error:?}");
    let (found, error) = within(360);
    assert!(found.len() > levels, "{error:?}");
}

/// Large enough that all that threads share is shared.
#[cfg(feature = "rayon")]
#[test]
fn bytes_and_mesh_do_not_depend_on_the_number_of_threads() {
    let mesh = scan(110_000, 7);
    for effort in [Effort::Fast, Effort::Default] {
        let coded = |threads| {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
            pool.install(|| {
                let bytes = encode(&mesh, &options(effort)).unwrap().bytes;
                let decoded = decode(&bytes, &Limits::default()).unwrap();
                (bytes, decoded)
            })
        };
        let one = coded(1);
        (2..4).for_each(|threads| assert!(coded(threads) == one, "{threads} threads, {effort:?}"));
    }
}
