//! The body: numbers as text, or binary in either byte order.

use super::super::text::{Text, quote};
use super::header::{Element, Kind};
use crate::{Error, Result};

/// A coordinate as a 32-bit float.
pub(super) struct Coordinate {
    pub value: f32,
    /// Whether the file's value was another.
    pub rounded: bool,
}

/// Numbers in the order of a file. Each is read as the type that the header declares.
pub(super) trait Body {
    /// Goes to the first number of the next item.
    fn start_item(&mut self) -> Result<()>;

    /// Makes sure that the item has no further numbers.
    fn end_item(&mut self) -> Result<()>;

    /// A number of an integer type.
    fn integer(&mut self, kind: Kind) -> Result<i64>;

    /// A number of any type.
    fn coordinate(&mut self, kind: Kind) -> Result<Coordinate>;

    /// Passes over numbers.
    fn skip(&mut self, kind: Kind, count: u64) -> Result<()>;

    /// The fewest bytes an item of this element can take.
    fn least_bytes(element: &Element) -> u64;

    /// Bytes left.
    fn rest(&self) -> usize;

    /// A syntax error at this place.
    fn error(&self, cause: String) -> Error;

    /// The length of a list.
    fn length(&mut self, kind: Kind) -> Result<u64> {
        let length = self.integer(kind)?;
        u64::try_from(length).map_err(|_| self.error(format!("{length} is not the length of a list")))
    }
}

/// A text body: one line an item.
pub(super) struct Ascii<'a> {
    pub text: Text<'a>,
}

impl Ascii<'_> {
    fn missing(&self) -> Error {
        self.text.error("a number is missing at the end of the line")
    }
}

impl Body for Ascii<'_> {
    fn start_item(&mut self) -> Result<()> {
        if self.text.seek_word() { Ok(()) } else { Err(self.text.error("the text ends too early")) }
    }

    fn end_item(&mut self) -> Result<()> {
        match self.text.word() {
            None => Ok(()),
            Some(word) => Err(self.text.error(format!("{} is one number too many", quote(word)))),
        }
    }

    fn integer(&mut self, _: Kind) -> Result<i64> {
        self.text.integer()
    }

    fn coordinate(&mut self, kind: Kind) -> Result<Coordinate> {
        let word = self.text.word().ok_or_else(|| self.missing())?;
        // From the decimals at once: by way of f64 they would be rounded twice.
        let value = self.text.parse_number(word)?;
        // A declared float is rounded by its writer, any other type here.
        let exact = if kind == Kind::F32 { None } else { std::str::from_utf8(word).ok() };
        let exact = exact.and_then(|word| word.parse::<f64>().ok());
        Ok(Coordinate { value, rounded: exact.is_some_and(|exact| exact != f64::from(value)) })
    }

    fn skip(&mut self, _: Kind, count: u64) -> Result<()> {
        for _ in 0..count {
            self.text.word().ok_or_else(|| self.missing())?;
        }
        Ok(())
    }

    /// Each number takes a digit and a separator. The last of all needs none, so that a
    /// text may be one byte shorter than the sum over its items.
    fn least_bytes(element: &Element) -> u64 {
        2 * element.properties.len() as u64
    }

    fn rest(&self) -> usize {
        self.text.rest().len()
    }

    fn error(&self, cause: String) -> Error {
        self.text.error(cause)
    }
}

/// A binary body.
pub(super) struct Binary<'a> {
    pub bytes: &'a [u8],
    /// Where in the file `bytes` starts.
    pub offset: usize,
    pub big_endian: bool,
}

impl Binary<'_> {
    /// The next `N` bytes, least significant first.
    fn take<const N: usize>(&mut self) -> Result<[u8; N]> {
        let Some((&(mut bytes), rest)) = self.bytes.split_first_chunk::<N>() else {
            return Err(self.error(format!("the file ends inside a number of {N} bytes")));
        };
        self.bytes = rest;
        self.offset += N;
        if self.big_endian {
            bytes.reverse();
        }
        Ok(bytes)
    }
}

impl Body for Binary<'_> {
    fn start_item(&mut self) -> Result<()> {
        Ok(())
    }

    fn end_item(&mut self) -> Result<()> {
        Ok(())
    }

    fn integer(&mut self, kind: Kind) -> Result<i64> {
        Ok(match kind {
            Kind::I8 => i8::from_le_bytes(self.take()?).into(),
            Kind::U8 => u8::from_le_bytes(self.take()?).into(),
            Kind::I16 => i16::from_le_bytes(self.take()?).into(),
            Kind::U16 => u16::from_le_bytes(self.take()?).into(),
            Kind::I32 => i32::from_le_bytes(self.take()?).into(),
            Kind::U32 => u32::from_le_bytes(self.take()?).into(),
            Kind::F32 | Kind::F64 => return Err(self.error("an integer type is needed here".into())),
        })
    }

    fn coordinate(&mut self, kind: Kind) -> Result<Coordinate> {
        // Every type but `double` fits into f64 exactly, and so does a `double`.
        let exact = match kind {
            Kind::F32 => f32::from_le_bytes(self.take()?).into(),
            Kind::F64 => f64::from_le_bytes(self.take()?),
            _ => self.integer(kind)? as f64,
        };
        let value = exact as f32;
        Ok(Coordinate { value, rounded: f64::from(value) != exact })
    }

    fn skip(&mut self, kind: Kind, count: u64) -> Result<()> {
        let bytes = count.saturating_mul(kind.size() as u64);
        match usize::try_from(bytes).ok().and_then(|n| self.bytes.get(n..)) {
            Some(rest) => {
                self.offset += self.bytes.len() - rest.len();
                self.bytes = rest;
                Ok(())
            }
            None => Err(self.error(format!("{bytes} bytes declared here, {} left", self.bytes.len()))),
        }
    }

    fn least_bytes(element: &Element) -> u64 {
        element.properties.iter().map(|property| property.length.unwrap_or(property.kind).size() as u64).sum()
    }

    fn rest(&self) -> usize {
        self.bytes.len()
    }

    fn error(&self, cause: String) -> Error {
        Error::syntax(format!("byte {}", self.offset), cause)
    }
}
