//! Meshes that are their own mirror images: one of two twins costs next to nothing.

use crate::common::{contents, drain, levels, mirrored};
use tercet::shapes::{join, noisy, shuffled, torus};
use tercet::verify::{Sameness, compare, quantised};
use tercet::{Decoder, Effort, EncodeOptions, LevelScheme, Limits, Mesh, encode};

/// Two halves with noise of these seeds.
fn halves(seeds: [u64; 2]) -> Mesh {
    mirrored([60, 40], 0.01, seeds)
}

fn options(bits: Option<u8>, effort: Effort) -> EncodeOptions {
    EncodeOptions { bits, effort, scheme: LevelScheme::Adaptive, ..EncodeOptions::default() }
}

#[test]
fn mirror_images_come_back_and_cost_little() {
    let mesh = shuffled(&halves([1, 1]), 5);
    let other = shuffled(&halves([1, 2]), 5);
    for bits in [Some(12), None] {
        for effort in [Effort::Fast, Effort::Default, Effort::Max] {
            let options = options(bits, effort);
            let (file, rough) = (encode(&mesh, &options).unwrap(), encode(&other, &options).unwrap());
            let (size, without) = (file.bytes.len(), rough.bytes.len());
            assert!(
                size * 4 < without * 3,
                "{effort:?}, {bits:?} bits: {size} bytes, {without} without symmetry"
            );
            let finest = levels(&file.bytes).pop().unwrap().mesh;
            let original = quantised(&mesh, &file.info.precision);
            assert_eq!(compare(&original, &finest), Sameness::Renumbered, "{effort:?}, {bits:?} bits");
        }
    }
}

#[test]
fn a_plane_beside_the_middle_is_one_through_the_origin() {
    // What only one side has moves the middle, but not the plane.
    let mut accessory = noisy(&torus(60, 40), 0.01, 7);
    accessory.positions.iter_mut().for_each(|p| p[0] += 5.0);
    let mesh = join(&[halves([1, 1]), accessory.clone()]);
    let other = join(&[halves([1, 2]), accessory]);
    let size = |mesh: &Mesh| encode(mesh, &options(Some(14), Effort::Default)).unwrap().bytes.len();
    assert!(size(&mesh) * 5 < size(&other) * 4, "{} of {} bytes", size(&mesh), size(&other));
}

#[test]
fn twins_do_not_depend_on_portions() {
    let mesh = halves([3, 3]);
    let file = encode(&mesh, &options(Some(11), Effort::Default)).unwrap().bytes;
    let whole = levels(&file);
    for portion in [1, 7, 300] {
        let mut decoder = Decoder::new(Limits::default());
        let mut found = Vec::new();
        for bytes in file.chunks(portion) {
            decoder.push(bytes);
            let (levels, error) = drain(&mut decoder);
            assert!(error.is_none(), "{error:?}");
            found.extend(levels);
        }
        assert!(found.iter().map(contents).eq(whole.iter().map(contents)), "portions of {portion} bytes");
    }
}
