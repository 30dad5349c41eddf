//! What a page is told in words and numbers, as JSON.

use std::fmt::Write;

use tercet::{Error, Info, Precision};

/// What a file says of itself: the fields of [`Info`] under their names, with the precision as the
/// command `tercet info --json` names it.
pub fn info(info: &Info) -> String {
    let mut out = String::from("{");
    number(&mut out, "version", info.version.into());
    let (kind, bits) = match info.precision {
        Precision::Lattice { bits, .. } => ("lattice", bits),
        Precision::Decimal { .. } => ("decimal", 0),
        Precision::Binary { .. } => ("binary", 0),
        Precision::Refined { .. } => ("refined", 0),
    };
    text(&mut out, "precision", kind);
    number(&mut out, "bits", bits.into());
    out.push_str(if info.order_kept { "\"orderKept\":true," } else { "\"orderKept\":false," });
    number(&mut out, "vertices", info.vertices.into());
    number(&mut out, "faces", info.faces.into());
    number(&mut out, "bytes", info.bytes);
    out.push_str("\"levels\":[");
    for level in &info.levels {
        out.push('{');
        number(&mut out, "level", level.level.into());
        text(&mut out, "kind", level.kind);
        number(&mut out, "vertices", level.vertices.into());
        number(&mut out, "faces", level.faces.into());
        number(&mut out, "bytes", level.bytes);
        // As bits: printing a fraction would double the code of this module.
        number(&mut out, "errorBits", level.error.to_bits().into());
        close(&mut out, "},");
    }
    close(&mut out, "]}");
    out
}

/// A failure: its `kind`, which is the name of [`Error`]'s variant in lower case, and its `message`.
pub fn error(error: &Error) -> String {
    let kind = match error {
        Error::Io(_) => "io",
        Error::Syntax { .. } => "syntax",
        Error::Mesh { .. } => "mesh",
        Error::Format { .. } => "format",
        Error::Checksum { .. } => "checksum",
        Error::Truncated { .. } => "truncated",
        Error::Unsupported(_) => "unsupported",
        Error::Limit { .. } => "limit",
        Error::Parameter(_) => "parameter",
        _ => "other",
    };
    let mut out = String::from("{");
    text(&mut out, "kind", kind);
    text(&mut out, "message", &error.to_string());
    close(&mut out, "}");
    out
}

/// A list of sentences.
#[cfg(feature = "encoder")]
pub fn sentences(sentences: &[String]) -> String {
    let mut out = String::from("[");
    for sentence in sentences {
        quoted(&mut out, sentence);
        out.push(',');
    }
    close(&mut out, "]");
    out
}

fn number(out: &mut String, name: &str, value: u64) {
    // Writing to a string does not fail.
    let _ = write!(out, "\"{name}\":{value},");
}

fn text(out: &mut String, name: &str, value: &str) {
    let _ = write!(out, "\"{name}\":");
    quoted(out, value);
    out.push(',');
}

fn quoted(out: &mut String, value: &str) {
    out.push('"');
    for c in value.chars() {
        match c {
            '"' | '\\' => out.extend(['\\', c]),
            // Control characters never have a meaning in our sentences.
            c if c < ' ' => out.push(' '),
            c => out.push(c),
        }
    }
    out.push('"');
}

/// Ends a list or object: its last comma gives way to `end`.
fn close(out: &mut String, end: &str) {
    if out.ends_with(',') {
        out.pop();
    }
    out.push_str(end);
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sentences_are_quoted() {
        let error_of = |cause: &str| error(&Error::Unsupported(cause.into()));
        assert_eq!(error_of("a \"b\" \\ \n c"), r#"{"kind":"unsupported","message":"a \"b\" \\   c"}"#);
    }

    #[test]
    fn info_has_every_level() {
        let mesh = tercet::shapes::sphere(1);
        let options = tercet::EncodeOptions { bits: Some(9), ..Default::default() };
        let file = tercet::encode(&mesh, &options).unwrap().bytes;
        let mut decoder = tercet::Decoder::new(tercet::Limits::default());
        decoder.push(&file);
        decoder.next_level().unwrap();
        let known = decoder.info().unwrap();
        let json = info(&known);
        let start =
            format!(r#"{{"version":{},"precision":"lattice","bits":9,"orderKept":false,"#, known.version);
        assert!(json.starts_with(&start), "{json}");
        assert_eq!(json.matches("errorBits").count(), known.levels.len());
        assert!(json.ends_with("}]}"), "{json}");
    }
}
