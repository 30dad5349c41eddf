//! Words and lines of a text, taken from a byte slice without copying.

use crate::{Error, Result};

/// Bytes of a name or word from a file that a message or note may repeat.
const QUOTED: usize = 32;

/// Names that one note may list.
const LISTED: usize = 8;

/// A position in a text. Words are separated by bytes up to 0x20; a line ends with LF,
/// CR LF or CR.
pub(super) struct Text<'a> {
    bytes: &'a [u8],
    at: usize,
    line: u64,
    comments: bool,
    continuations: bool,
}

impl<'a> Text<'a> {
    pub fn new(bytes: &'a [u8]) -> Self {
        Text { bytes, at: 0, line: 1, comments: false, continuations: false }
    }

    /// A word that starts with `#` ends its line.
    pub fn with_comments(self) -> Self {
        Text { comments: true, ..self }
    }

    /// A backslash before a line end joins the next line to this one.
    pub fn with_continuations(self) -> Self {
        Text { continuations: true, ..self }
    }

    /// The next word of this line.
    pub fn word(&mut self) -> Option<&'a [u8]> {
        self.skip_blanks();
        let start = self.at;
        while self.bytes.get(self.at).is_some_and(|&b| b > b' ') && self.continuation() == 0 {
            self.at += 1;
        }
        (self.at > start).then(|| &self.bytes[start..self.at])
    }

    /// Goes to the start of the next line; false at the end of the text.
    pub fn next_line(&mut self) -> bool {
        while self.word().is_some() {}
        let end = self.line_end(self.at);
        self.at += end;
        self.line += 1;
        end > 0
    }

    /// Goes to the next word, on whichever line it is; false at the end of the text.
    pub fn seek_word(&mut self) -> bool {
        loop {
            self.skip_blanks();
            match self.line_end(self.at) {
                0 => return self.at < self.bytes.len(),
                end => self.at += end,
            }
            self.line += 1;
        }
    }

    /// The next word of this line, which must be a finite decimal number: the nearest `f32`.
    pub fn number(&mut self) -> Result<f32> {
        match self.word() {
            Some(word) => self.parse_number(word),
            None => Err(self.error("a number is missing at the end of the line")),
        }
    }

    /// Takes a word as a finite decimal number.
    pub fn parse_number(&self, word: &[u8]) -> Result<f32> {
        let value = std::str::from_utf8(word).ok().and_then(|word| word.parse::<f32>().ok());
        match value {
            Some(value) if value.is_finite() => Ok(value),
            Some(_) => Err(self.error(format!("{} is not a finite 32-bit float", quote(word)))),
            None => Err(self.error(format!("{} is not a number", quote(word)))),
        }
    }

    /// The next word of this line, which must be an integer.
    pub fn integer(&mut self) -> Result<i64> {
        match self.word() {
            Some(word) => self.parse_integer(word),
            None => Err(self.error("an integer is missing at the end of the line")),
        }
    }

    /// Takes a word as an integer.
    pub fn parse_integer(&self, word: &[u8]) -> Result<i64> {
        std::str::from_utf8(word)
            .ok()
            .and_then(|word| word.parse().ok())
            .ok_or_else(|| self.error(format!("{} is not an integer", quote(word))))
    }

    /// Takes a word as a number of items.
    pub fn parse_count(&self, word: &[u8]) -> Result<u64> {
        u64::try_from(self.parse_integer(word)?)
            .map_err(|_| self.error(format!("{} is not a count", quote(word))))
    }

    /// Bytes before the position.
    pub fn offset(&self) -> usize {
        self.at
    }

    /// Bytes from the position on.
    pub fn rest(&self) -> &'a [u8] {
        &self.bytes[self.at..]
    }

    /// The line of the position, counted from 1.
    pub fn line(&self) -> u64 {
        self.line
    }

    /// A syntax error on this line.
    pub fn error(&self, cause: impl Into<String>) -> Error {
        Error::syntax(format!("line {}", self.line), cause)
    }

    fn skip_blanks(&mut self) {
        while let Some(&b) = self.bytes.get(self.at) {
            let joined = self.continuation();
            if joined > 0 {
                self.at += joined;
                self.line += 1;
            } else if b == b'#' && self.comments {
                let comment = self.rest().iter().position(|&b| b == b'\n' || b == b'\r');
                self.at = comment.map_or(self.bytes.len(), |n| self.at + n);
                return;
            } else if b > b' ' || b == b'\n' || b == b'\r' {
                return;
            } else {
                self.at += 1;
            }
        }
    }

    /// Length of the line end at `at`; 0 if there is none.
    fn line_end(&self, at: usize) -> usize {
        match self.bytes.get(at) {
            Some(b'\r') if self.bytes.get(at + 1) == Some(&b'\n') => 2,
            Some(b'\n' | b'\r') => 1,
            _ => 0,
        }
    }

    /// Length of a backslash and line end at the position; 0 if they are not there.
    fn continuation(&self) -> usize {
        if !self.continuations || self.bytes[self.at] != b'\\' {
            return 0;
        }
        match self.line_end(self.at + 1) {
            0 => 0,
            end => 1 + end,
        }
    }
}

/// A word from a file as one printable piece of bounded length.
pub(super) fn quote(word: &[u8]) -> String {
    let (shown, more) = if word.len() > QUOTED { (&word[..QUOTED], "…") } else { (word, "") };
    format!("\"{}{more}\"", shown.escape_ascii())
}

/// "1 face is", "2 faces are".
pub(super) fn count(n: u64, one: &str, many: &str) -> String {
    format!("{n} {}", if n == 1 { one } else { many })
}

/// Distinct names for a note, of which only the first few are kept.
#[derive(Default)]
pub(super) struct Names<'a> {
    first: Vec<&'a [u8]>,
    more: bool,
}

impl<'a> Names<'a> {
    pub fn add(&mut self, name: &'a [u8]) {
        if self.first.contains(&name) {
            return;
        }
        if self.first.len() < LISTED {
            self.first.push(name);
        } else {
            self.more = true;
        }
    }

    pub fn is_empty(&self) -> bool {
        self.first.is_empty()
    }
}

impl std::fmt::Display for Names<'_> {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let names: Vec<String> = self.first.iter().map(|name| quote(name)).collect();
        f.write_str(&names.join(", "))?;
        if self.more { f.write_str(" and others") } else { Ok(()) }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn words(mut text: Text) -> Vec<(u64, Vec<u8>)> {
        let mut found = Vec::new();
        while text.seek_word() {
            let word = text.word().expect("a word was sought");
            found.push((text.line(), word.to_vec()));
        }
        found
    }

    #[test]
    fn lines_end_with_lf_crlf_or_cr() {
        let expected = [(1, b"a".to_vec()), (1, b"b".to_vec()), (3, b"c".to_vec())];
        for newline in ["\n", "\r\n", "\r"] {
            let text = format!(" a\tb{newline}{newline}c");
            assert_eq!(words(Text::new(text.as_bytes())), expected, "{newline:?}");
        }
    }

    #[test]
    fn comments_run_to_the_line_end_and_a_backslash_joins_lines() {
        let text = b"a # b \\\nc\\\r\nd \\x";
        let words = words(Text::new(text).with_comments().with_continuations());
        let expected: [(u64, &[u8]); 4] = [(1, b"a"), (2, b"c"), (3, b"d"), (3, b"\\x")];
        assert_eq!(words, expected.map(|(line, word)| (line, word.to_vec())));
    }

    #[test]
    fn next_line_skips_what_was_not_read() {
        let mut text = Text::new(b"a b\\\nc\nd").with_continuations();
        assert!(text.next_line());
        assert_eq!((text.line(), text.word()), (3, Some(&b"d"[..])));
        assert!(!text.next_line());
    }

    #[test]
    fn numbers_are_the_nearest_float_and_finite() {
        let text = Text::new(b"");
        assert_eq!(text.parse_number(b"0.1").unwrap(), 0.1f32);
        assert_eq!(text.parse_number(b"-0").unwrap().to_bits(), (-0.0f32).to_bits());
        // Halfway between two floats but for a last digit that a detour over f64 would lose.
        assert_eq!(text.parse_number(b"1.00000005960464477540").unwrap(), 1.0 + f32::EPSILON);
        for word in ["inf", "-infinity", "NaN", "1e39", "0x10", "1,5", "", "\u{e9}"] {
            let error = text.parse_number(word.as_bytes()).unwrap_err().to_string();
            assert!(error.starts_with("line 1: "), "{error}");
        }
    }

    #[test]
    fn long_or_unprintable_words_are_shortened_and_escaped() {
        assert_eq!(quote(b"a\x1b\""), r#""a\x1b\"""#);
        assert_eq!(quote(&[b'x'; 1000]).chars().count(), QUOTED + 3);
    }
}
