//! Bytes of the file on their way.

use bytes::{Buf, BufMut, Bytes, BytesMut};

/// Most bytes of the file in one message.
pub const MOST_BYTES: usize = 1 << 14;
/// Bytes before them: the offset and the checksum.
const HEAD: usize = 12;

/// Some consecutive bytes of the file.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Data {
    /// Where in the file they begin.
    pub offset: u64,
    pub bytes: Bytes,
}

impl Data {
    /// The message that carries them.
    #[cfg(any(feature = "serve", test))]
    pub fn message(&self) -> Bytes {
        let mut message = BytesMut::with_capacity(HEAD + self.bytes.len());
        message.put_u64_le(self.offset);
        message.put_u32_le(crc32fast::hash(&self.bytes));
        message.put_slice(&self.bytes);
        message.freeze()
    }

    /// Reads a message; `None` if it is none, or has been damaged.
    #[cfg(feature = "fetch")]
    pub fn read(mut message: Bytes) -> Option<Data> {
        if !(HEAD + 1..=HEAD + MOST_BYTES).contains(&message.len()) {
            return None;
        }
        let offset = message.get_u64_le();
        let checksum = message.get_u32_le();
        (crc32fast::hash(&message) == checksum).then_some(Data { offset, bytes: message })
    }
}

#[cfg(all(test, feature = "fetch"))]
mod tests {
    use super::*;

    #[test]
    fn a_message_is_read_as_it_was_written_and_not_if_it_was_changed() {
        let data = Data { offset: 1 << 40, bytes: Bytes::from_static(b"123456789") };
        let message = data.message();
        assert_eq!(message[..12], [0, 0, 0, 0, 0, 1, 0, 0, 0x26, 0x39, 0xF4, 0xCB]);
        assert_eq!(Data::read(message.clone()), Some(data));
        for length in 0..message.len() {
            assert_eq!(Data::read(message.slice(..length)), None, "{length}");
        }
        let mut damaged = message.to_vec();
        damaged[15] ^= 1;
        assert_eq!(Data::read(damaged.into()), None);
        let long = Data { offset: 0, bytes: vec![0; MOST_BYTES + 1].into() };
        assert_eq!(Data::read(long.message()), None);
    }
}
