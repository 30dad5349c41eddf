//! Reading the fields of a header, one after the other, from bytes that are all there.

use super::varint;
use crate::{Error, Result};

/// Fields not read yet. Every method takes the next field off the front and is given the
/// field's name, which a failure reports.
pub(crate) struct Fields<'a> {
    rest: &'a [u8],
}

impl<'a> Fields<'a> {
    pub(crate) fn new(bytes: &'a [u8]) -> Self {
        Fields { rest: bytes }
    }

    /// A field of `N` bytes as they stand.
    pub(crate) fn array<const N: usize>(&mut self, name: &str) -> Result<[u8; N]> {
        let (field, rest) = self.rest.split_first_chunk().ok_or_else(|| cut_short(name))?;
        self.rest = rest;
        Ok(*field)
    }

    /// A field of one byte.
    pub(crate) fn byte(&mut self, name: &str) -> Result<u8> {
        self.array(name).map(|[byte]| byte)
    }

    /// A varint of at most 32 bits.
    pub(crate) fn u32(&mut self, name: &str) -> Result<u32> {
        // The cast keeps every bit: 32 were asked for.
        self.varint(name, 32).map(|value| value as u32)
    }

    /// A varint of at most 64 bits that carries its sign in the lowest bit.
    pub(crate) fn i64(&mut self, name: &str) -> Result<i64> {
        self.varint(name, 64).map(varint::unzigzag)
    }

    /// Fails unless every byte has been read.
    pub(crate) fn end(&self) -> Result<()> {
        match self.rest.len() {
            0 => Ok(()),
            n => Err(Error::format("header", format!("{n} bytes follow its last field"))),
        }
    }

    fn varint(&mut self, name: &str, bits: u32) -> Result<u64> {
        let found = varint::read(self.rest, bits);
        let (value, length) =
            found.map_err(|cause| malformed(name, cause))?.ok_or_else(|| cut_short(name))?;
        self.rest = &self.rest[length..];
        Ok(value)
    }
}

/// A header field whose value breaks its rule.
pub(crate) fn malformed(name: &str, cause: impl std::fmt::Display) -> Error {
    Error::format("header", format!("{name}: {cause}"))
}

fn cut_short(name: &str) -> Error {
    malformed(name, "the header ends inside this field")
}
