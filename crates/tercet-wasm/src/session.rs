//! One file on its way from bytes to levels.

use tercet::{Decoder, Error, Level, Limits, Mesh, Result};

/// A decoder, the level that it reached last, and what went wrong last.
pub struct Session {
    /// Bytes on their way in.
    pub input: Vec<u8>,
    decoder: Decoder,
    level: Option<Level>,
    failure: Option<Error>,
}

impl Session {
    /// A session that holds no more than `max_memory` bytes; see [`Decoder::keep_predictions`].
    pub fn new(max_memory: u64, keep_predictions: bool) -> Self {
        let mut decoder = Decoder::new(Limits { max_memory });
        decoder.keep_predictions(keep_predictions);
        Session { input: Vec::new(), decoder, level: None, failure: None }
    }

    /// The input, made at least `length` bytes long.
    pub fn input(&mut self, length: usize) -> &mut [u8] {
        if self.input.len() < length {
            // The old bytes are of no use: do not copy them.
            self.input = vec![0; length];
        }
        &mut self.input
    }

    /// Hands the first `length` bytes of the input to the decoder.
    pub fn push(&mut self, length: usize) {
        let length = length.min(self.input.len());
        self.decoder.push(&self.input[..length]);
    }

    /// Goes on to the next level whose bytes have arrived, if any; the level before is dropped first.
    pub fn advance(&mut self) -> Option<bool> {
        self.level = None;
        let next = self.decoder.next_level();
        self.level = self.noted(next)?;
        Some(self.level.is_some())
    }

    /// Looks at the first `length` bytes of the input, which lie at `place` in the file, before their turn; see
    /// [`Decoder::glimpse`].
    #[cfg(feature = "encoder")]
    pub fn glimpse(&mut self, place: u64, length: usize) -> usize {
        let length = length.min(self.input.len());
        self.decoder.glimpse(place, &self.input[..length])
    }

    /// Makes the next level, as far as it has come, the one that was reached last; whether there is one.
    #[cfg(feature = "encoder")]
    pub fn preview(&mut self) -> bool {
        // Not two of them at a time.
        self.level = None;
        self.level = self.decoder.preview();
        self.level.is_some()
    }

    /// The level that was reached last.
    pub fn level(&self) -> Option<&Level> {
        self.level.as_ref()
    }

    /// What the file says of itself, once its header has arrived.
    pub fn info(&self) -> Option<tercet::Info> {
        self.decoder.info()
    }

    /// Whether the whole file has arrived unharmed; otherwise the failure tells what is missing.
    pub fn finish(&mut self) -> bool {
        let finished = self.decoder.finish();
        self.noted(finished).is_some()
    }

    /// See [`Decoder::discard_damaged`].
    pub fn discard_damaged(&mut self) -> Option<u64> {
        self.decoder.discard_damaged()
    }

    /// What went wrong last.
    pub fn failure(&self) -> Option<&Error> {
        self.failure.as_ref()
    }

    fn noted<T>(&mut self, result: Result<T>) -> Option<T> {
        result.map_err(|error| self.failure = Some(error)).ok()
    }
}

/// FNV-1a in 64 bits over every coordinate, then every index, as little-endian words.
pub fn digest(mesh: &Mesh) -> u64 {
    let coordinates = mesh.positions.as_flattened().iter().map(|x| x.to_bits());
    let words = coordinates.chain(mesh.faces.as_flattened().iter().copied());
    words.flat_map(u32::to_le_bytes).fold(0xCBF2_9CE4_8422_2325, |hash, byte| {
        (hash ^ u64::from(byte)).wrapping_mul(0x0000_0100_0000_01B3)
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use tercet::{EncodeOptions, encode, shapes};

    fn write(session: &mut Session, bytes: &[u8]) {
        session.input(bytes.len())[..bytes.len()].copy_from_slice(bytes);
        session.push(bytes.len());
    }

    #[test]
    fn a_file_in_portions_ends_in_the_original() {
        let mesh = shapes::scan(300, 1);
        let options = EncodeOptions { keep_order: true, ..EncodeOptions::default() };
        let file = encode(&mesh, &options).unwrap().bytes;
        let mut session = Session::new(1 << 30, true);
        let mut last = None;
        for portion in file.chunks(97) {
            write(&mut session, portion);
            while session.advance() == Some(true) {
                last = session.level().cloned();
            }
        }
        assert!(session.finish());
        assert_eq!(digest(&last.unwrap().mesh), digest(&mesh));
    }

    #[cfg(feature = "encoder")]
    #[test]
    fn a_level_in_groups_is_previewed_and_then_what_it_is_anyway() {
        let limits = Limits::default();
        let smooth = tercet::subdivide(&shapes::scan(100, 1), tercet::Scheme::Sqrt3, 4, &limits).unwrap();
        let options = EncodeOptions { bits: Some(12), groups: true, ..EncodeOptions::default() };
        let file = encode(&shapes::noisy(&smooth, 0.002, 1), &options).unwrap().bytes;
        let exact = tercet::decode(&file, &limits).unwrap();

        let mut session = Session::new(1 << 30, false);
        assert!(!session.preview());
        // The last eighth of the file is of its finest level; its first bytes are still to come.
        let (order, ahead) = file.split_at(file.len() / 2);
        let place = file.len() - file.len() / 8;
        write(&mut session, order);
        while session.advance() == Some(true) {}
        assert!(session.preview());
        let before = session.level().unwrap().pending;
        let late = &file[place..];
        session.input(late.len())[..late.len()].copy_from_slice(late);
        assert!(session.glimpse(place as u64, late.len()) > 0);
        assert!(session.preview());
        assert!(session.level().unwrap().pending < before);
        write(&mut session, ahead);
        let mut last = None;
        while session.advance() == Some(true) {
            last = session.level().cloned();
        }
        assert!(session.finish());
        assert_eq!(digest(&last.unwrap().mesh), digest(&exact));
    }

    #[test]
    fn what_is_wrong_is_told_and_damage_may_be_mended() {
        let file = encode(&shapes::sphere(2), &EncodeOptions::default()).unwrap().bytes;
        let mut damaged = file.clone();
        *damaged.last_mut().unwrap() ^= 1;
        let mut session = Session::new(1 << 30, false);
        write(&mut session, &damaged);
        while session.advance() == Some(true) {}
        assert!(matches!(session.failure(), Some(Error::Checksum { .. })));
        let start = session.discard_damaged().unwrap() as usize;
        write(&mut session, &file[start..]);
        while session.advance() == Some(true) {}
        assert!(session.finish());

        let mut session = Session::new(10, false);
        write(&mut session, &file);
        assert_eq!(session.advance(), None);
        assert!(matches!(session.failure(), Some(Error::Limit { .. })));
    }
}
