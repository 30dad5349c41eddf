//! Any bytes give a mesh or a typed error.

#![no_main]

use libfuzzer_sys::fuzz_target;
use tercet_fuzz::LIMITS;

fuzz_target!(|bytes: &[u8]| {
    if let Ok(decoded) = tercet::decode(bytes, &LIMITS) {
        decoded.mesh.check().expect("the decoder hands out checked meshes");
    }
});
