//! The header: a text that lists elements and the properties of each.

use super::super::text::{Text, quote};
use crate::{Error, Result};

/// A header may take this many bytes. Real ones take hundreds; the bound keeps what is
/// quadratic in the number of properties (the search for a repeated name) small.
const LONGEST: usize = 1 << 16;

/// How the body is written.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Encoding {
    Ascii,
    LittleEndian,
    BigEndian,
}

/// The type of a number.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Kind {
    I8,
    U8,
    I16,
    U16,
    I32,
    U32,
    F32,
    F64,
}

impl Kind {
    fn from_name(name: &[u8]) -> Option<Kind> {
        Some(match name {
            b"char" | b"int8" => Kind::I8,
            b"uchar" | b"uint8" => Kind::U8,
            b"short" | b"int16" => Kind::I16,
            b"ushort" | b"uint16" => Kind::U16,
            b"int" | b"int32" => Kind::I32,
            b"uint" | b"uint32" => Kind::U32,
            b"float" | b"float32" => Kind::F32,
            b"double" | b"float64" => Kind::F64,
            _ => return None,
        })
    }

    /// Bytes in a binary body.
    pub fn size(self) -> usize {
        match self {
            Kind::I8 | Kind::U8 => 1,
            Kind::I16 | Kind::U16 => 2,
            Kind::I32 | Kind::U32 | Kind::F32 => 4,
            Kind::F64 => 8,
        }
    }

    pub fn is_integer(self) -> bool {
        !matches!(self, Kind::F32 | Kind::F64)
    }
}

/// One number, or a list of them, in each item of an element.
#[derive(Debug, PartialEq)]
pub(super) struct Property<'a> {
    pub name: &'a [u8],
    /// The type of the number or of a list's items.
    pub kind: Kind,
    /// For a list, the type of its length, an integer.
    pub length: Option<Kind>,
}

/// A run of `count` items with the same properties.
#[derive(Debug, PartialEq)]
pub(super) struct Element<'a> {
    pub name: &'a [u8],
    pub count: u64,
    pub properties: Vec<Property<'a>>,
}

impl<'a> Element<'a> {
    /// The place of a complaint about this element.
    pub fn place(&self) -> String {
        format!("element {}", quote(self.name))
    }

    /// The position of the property of that name.
    pub fn find(&self, name: &[u8]) -> Option<usize> {
        self.properties.iter().position(|property| property.name == name)
    }
}

/// What a header says.
#[derive(Debug, PartialEq)]
pub(super) struct Header<'a> {
    pub encoding: Encoding,
    pub elements: Vec<Element<'a>>,
}

/// Reads a header and leaves `text` at the first byte of the body.
pub(super) fn read<'a>(text: &mut Text<'a>) -> Result<Header<'a>> {
    if text.word() != Some(b"ply") || !text.next_line() {
        return Err(text.error("a PLY file starts with a line \"ply\""));
    }
    let mut encoding = None;
    let mut elements: Vec<Element> = Vec::new();
    loop {
        match text.word() {
            Some(b"format") => encoding = Some(format(text)?),
            Some(b"element") => {
                let element = element(text)?;
                if elements.iter().any(|other| other.name == element.name) {
                    return Err(text.error(format!("{} is declared twice", element.place())));
                }
                elements.push(element);
            }
            Some(b"property") => match elements.last_mut() {
                Some(element) => property(text, element)?,
                None => return Err(text.error("a property before the first element")),
            },
            Some(b"end_header") => break,
            Some(b"comment" | b"obj_info") | None => {}
            Some(word) => return Err(text.error(format!("{} is no keyword of a PLY header", quote(word)))),
        }
        if !text.next_line() {
            return Err(text.error("the file ends inside the header"));
        }
        if text.offset() > LONGEST {
            return Err(text.error(format!("the header is longer than {LONGEST} bytes")));
        }
    }
    let encoding = encoding.ok_or_else(|| text.error("the header has no line \"format\""))?;
    text.next_line();
    Ok(Header { encoding, elements })
}

fn required<'a>(text: &mut Text<'a>, what: &str) -> Result<&'a [u8]> {
    text.word().ok_or_else(|| text.error(format!("{what} is missing at the end of the line")))
}

/// `format ENCODING 1.0`
fn format(text: &mut Text) -> Result<Encoding> {
    let encoding = match required(text, "an encoding")? {
        b"ascii" => Encoding::Ascii,
        b"binary_little_endian" => Encoding::LittleEndian,
        b"binary_big_endian" => Encoding::BigEndian,
        word => return Err(text.error(format!("{} is not an encoding", quote(word)))),
    };
    match required(text, "a version")? {
        b"1.0" => Ok(encoding),
        version => Err(Error::Unsupported(format!("PLY version {} is not read, only 1.0", quote(version)))),
    }
}

/// `element NAME COUNT`
fn element<'a>(text: &mut Text<'a>) -> Result<Element<'a>> {
    let name = required(text, "a name")?;
    let count = required(text, "a count")?;
    Ok(Element { name, count: text.parse_count(count)?, properties: Vec::new() })
}

/// `property TYPE NAME` or `property list TYPE TYPE NAME`
fn property<'a>(text: &mut Text<'a>, element: &mut Element<'a>) -> Result<()> {
    let mut word = required(text, "a type")?;
    let mut length = None;
    if word == b"list" {
        let kind = required(text, "a type")?;
        length = Some(self::kind(text, kind)?);
        if length.is_some_and(|kind| !kind.is_integer()) {
            return Err(text.error("the length of a list must be of an integer type"));
        }
        word = required(text, "a type")?;
    }
    let kind = self::kind(text, word)?;
    let name = required(text, "a name")?;
    if element.find(name).is_some() {
        return Err(text.error(format!("property {} is declared twice", quote(name))));
    }
    element.properties.push(Property { name, kind, length });
    Ok(())
}

fn kind(text: &Text, word: &[u8]) -> Result<Kind> {
    Kind::from_name(word).ok_or_else(|| text.error(format!("{} is not a type", quote(word))))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn header(text: &str) -> Result<Header<'_>> {
        read(&mut Text::new(text.as_bytes()))
    }

    #[test]
    fn the_body_starts_after_the_line_end_of_end_header() {
        for newline in ["\n", "\r\n"] {
            let lines = ["ply", "format binary_big_endian 1.0", "comment", "obj_info a b", "end_header", ""];
            let bytes = lines.join(newline) + "\nbody";
            let mut text = Text::new(bytes.as_bytes());
            assert_eq!(read(&mut text).unwrap(), Header { encoding: Encoding::BigEndian, elements: vec![] });
            assert_eq!(text.rest(), b"\nbody");
        }
    }

    #[test]
    fn every_type_has_two_names() {
        let names = ["char", "uchar", "short", "ushort", "int", "uint", "float", "double"];
        let sized = ["int8", "uint8", "int16", "uint16", "int32", "uint32", "float32", "float64"];
        for (name, sized) in names.iter().zip(sized) {
            let kind = Kind::from_name(name.as_bytes()).unwrap();
            assert_eq!(Kind::from_name(sized.as_bytes()), Some(kind));
            let bits = sized.trim_start_matches(|c: char| !c.is_ascii_digit());
            assert_eq!(bits.parse(), Ok(8 * kind.size()));
        }
    }

    #[test]
    fn a_bad_header_is_refused_with_its_line() {
        let cases = [
            ("", "line 1"),
            ("ply\nformat ascii 1.0\nelement vertex -1\nend_header\n", "line 3"),
            ("ply\nformat ascii 1.0\nelement vertex\nend_header\n", "line 3"),
            ("ply\nformat ascii 1.0\nproperty float x\nend_header\n", "line 3"),
            ("ply\nformat ascii 1.0\nelement a 1\nproperty list float int x\nend_header\n", "line 4"),
            ("ply\nformat ascii 1.0\nelement a 1\nproperty half x\nend_header\n", "line 4"),
            ("ply\nformat ascii 1.0\nelement a 1\nproperty int x\nproperty int x\nend_header\n", "line 5"),
            ("ply\nformat ascii 1.0\nelement a 1\nelement a 1\nend_header\n", "line 4"),
            ("ply\nformat ascii 1.0\nvertices 3\nend_header\n", "line 3"),
            ("ply\nend_header\n", "line 2"),
            ("ply\nformat ascii 2.0\nend_header\n", "PLY version"),
        ];
        for (text, place) in cases {
            let error = header(text).unwrap_err().to_string();
            assert!(error.starts_with(place), "{text:?}: {error}");
        }
    }

    #[test]
    fn an_endless_header_is_refused() {
        let text = format!("ply\nformat ascii 1.0\n{}", "comment\n".repeat(LONGEST));
        assert!(header(&text).unwrap_err().to_string().contains("longer than"));
    }
}
