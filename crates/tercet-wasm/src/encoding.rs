//! From a mesh file to a `.tct` file.

use tercet::io::{self, Format};
use tercet::{EncodeOptions, Error, Limits, Result, encode};

/// Formats in the order in which a page numbers them.
const FORMATS: [Format; 4] = [Format::Obj, Format::Ply, Format::Stl, Format::Off];
/// A page has 4 GiB of addresses; reading takes a part of them and encoding another.
const MAX_MEMORY: u64 = 1 << 30;

/// What became of the last mesh file.
#[derive(Default)]
pub struct Encoding {
    /// The `.tct` file.
    pub bytes: Vec<u8>,
    /// What the reader had to change or leave out.
    pub notes: Vec<String>,
    /// What went wrong.
    pub failure: Option<Error>,
}

impl Encoding {
    /// Encodes a mesh file; whether that could be done. `bits` is 0 to keep every bit.
    pub fn run(&mut self, mesh_file: &[u8], format: u32, bits: u32) -> bool {
        *self = match encoded(mesh_file, format, bits) {
            Ok((bytes, notes)) => Encoding { bytes, notes, failure: None },
            Err(error) => Encoding { failure: Some(error), ..Encoding::default() },
        };
        self.failure.is_none()
    }
}

fn encoded(mesh_file: &[u8], format: u32, bits: u32) -> Result<(Vec<u8>, Vec<String>)> {
    let format = FORMATS.get(format as usize).ok_or_else(|| Error::Parameter(format!("format {format}")))?;
    let loaded = io::read(mesh_file, *format, &Limits { max_memory: MAX_MEMORY })?;
    // What is no number of bits is left to the encoder to refuse.
    let bits = (bits != 0).then(|| u8::try_from(bits).unwrap_or(u8::MAX));
    let options = EncodeOptions { bits, ..EncodeOptions::default() };
    Ok((encode(&loaded.mesh, &options)?.bytes, loaded.notes))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_mesh_file_becomes_a_tct_file() {
        let mut encoding = Encoding::default();
        assert!(encoding.run(b"v 0 0 0\nv 1 0 0\nv 0 1 0\nvn 0 0 1\nf 1 2 3\n", 0, 0));
        assert_eq!(encoding.notes.len(), 1, "{:?}", encoding.notes);
        let mesh = tercet::decode(&encoding.bytes, &Limits::default()).unwrap();
        assert_eq!((mesh.positions.len(), mesh.faces.len()), (3, 1));
    }

    #[test]
    fn what_cannot_be_encoded_is_refused() {
        let mut encoding = Encoding::default();
        assert!(!encoding.run(b"v 0 0", 0, 0));
        assert!(matches!(encoding.failure, Some(Error::Syntax { .. })));
        for (format, bits) in [(9, 0), (3, 3), (3, 300)] {
            assert!(!encoding.run(b"OFF 0 0 0", format, bits));
            assert!(matches!(encoding.failure, Some(Error::Parameter(_))), "{:?}", encoding.failure);
        }
    }
}
