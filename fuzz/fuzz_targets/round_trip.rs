//! Any mesh that the encoder takes comes back equal, in each mode.

#![no_main]

use arbitrary::Arbitrary;
use libfuzzer_sys::fuzz_target;
use tercet::{EncodeOptions, Update};
use tercet_fuzz::LIMITS;

#[derive(Arbitrary, Debug)]
struct Input {
    positions: Vec<[i8; 3]>,
    faces: Vec<[u8; 3]>,
    exponent: i8,
    bits: Option<u8>,
    keep_order: bool,
    update: u8,
}

fuzz_target!(|input: Input| {
    let mesh = tercet_fuzz::mesh(&input.positions, &input.faces, input.exponent);
    let mut options = EncodeOptions::default();
    options.bits = input.bits.map(|bits| 4 + bits % 21);
    options.keep_order = input.keep_order;
    options.update = [Update::None, Update::Third, Update::Paper][usize::from(input.update % 3)];

    let encoded = tercet::encode(&mesh, &options).expect("a valid mesh is encoded");
    let decoded = tercet::decode(&encoded.bytes, &LIMITS).expect("what was encoded is decoded").mesh;
    if options.bits.is_none() {
        assert!(tercet::verify::equal(&mesh, &decoded), "the exact mode changed the mesh");
        assert!(!options.keep_order || mesh == decoded, "the order was to be kept");
    } else {
        assert_eq!(mesh.positions.len(), decoded.positions.len());
        assert_eq!(mesh.faces.len(), decoded.faces.len());
    }
});
