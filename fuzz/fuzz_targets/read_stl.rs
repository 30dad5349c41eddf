//! Any bytes read as STL give a valid mesh or a typed error.

#![no_main]

use libfuzzer_sys::fuzz_target;
use tercet::io::Format;

fuzz_target!(|bytes: &[u8]| tercet_fuzz::read(bytes, Format::Stl));
