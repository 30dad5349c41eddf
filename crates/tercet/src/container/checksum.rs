//! CRC-32 as in PNG and zip (ISO-HDLC).
//!
//! One table of 1 KB, on the web none: decoding a byte takes a thousand times longer than checking it, and
//! the 16 KB of a faster implementation would be a fifth of the web's decoder.

use crc::{CRC_32_ISO_HDLC, Crc, Digest, Table};

type Tables = Table<{ if cfg!(target_arch = "wasm32") { 0 } else { 1 } }>;

static CRC: Crc<u32, Tables> = Crc::<u32, Tables>::new(&CRC_32_ISO_HDLC);

/// The checksum of bytes that come in portions.
#[derive(Clone)]
pub(super) struct Checksum(Digest<'static, u32, Tables>);

impl Default for Checksum {
    fn default() -> Self {
        Checksum(CRC.digest())
    }
}

impl Checksum {
    pub(super) fn update(&mut self, bytes: &[u8]) {
        self.0.update(bytes);
    }

    /// Of the bytes so far.
    pub(super) fn value(&self) -> u32 {
        self.0.clone().finalize()
    }
}

/// The checksum of `bytes`.
pub(crate) fn checksum(bytes: &[u8]) -> u32 {
    CRC.checksum(bytes)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn it_is_the_one_that_others_compute() {
        let bytes: Vec<u8> = (0..1000u32).map(|i| ((i * i) >> 3) as u8).collect();
        let mut portions = Checksum::default();
        bytes.chunks(7).for_each(|portion| portions.update(portion));
        assert_eq!(portions.value(), crc32fast::hash(&bytes));
        assert_eq!(checksum(b"123456789"), 0xCBF4_3926);
    }
}
