//! The lines of the control stream of a session on WebTransport.

use std::fmt;
use std::str::FromStr;

use tercet::transport::FileId;

use super::command::number;

/// The version of the sessions that this program speaks.
const VERSION: u32 = 1;
/// Bytes of the longest line that a server sends, and some more.
pub const MOST_LINE: u64 = 4096;

/// The client's line.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Open {
    /// The file, as it is written in an address, without the slash before it.
    pub path: String,
    /// The digest that the file must have.
    pub digest: Option<String>,
}

impl fmt::Display for Open {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "OPEN {}", self.path)?;
        self.digest.iter().try_for_each(|digest| write!(f, " {digest}"))
    }
}

/// `None` of any other line.
impl Open {
    pub fn read(line: &str) -> Option<Open> {
        let mut words = line.split(' ');
        let (word, path, digest) = (words.next()?, words.next()?, words.next());
        let valid = word == "OPEN" && !path.is_empty() && words.next().is_none();
        valid.then(|| Open { path: path.into(), digest: digest.map(str::to_owned) })
    }
}

/// The server's line: what it says of the file.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Greeting {
    /// Size of the file.
    pub bytes: u64,
    /// Bytes of its opening, which follow the line.
    pub opening: u32,
    /// Its SHA-256 in hexadecimal digits.
    pub digest: String,
    /// What its blocks are measured by.
    pub id: FileId,
}

impl fmt::Display for Greeting {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "HELLO {VERSION} {} {} {} {}", self.bytes, self.opening, self.digest, self.id)
    }
}

impl FromStr for Greeting {
    type Err = String;

    fn from_str(line: &str) -> Result<Self, String> {
        let refused = || "the server's first words are not HELLO".to_string();
        let words: Vec<&str> = line.split(' ').collect();
        let ["HELLO", version, rest @ ..] = &words[..] else { return Err(refused()) };
        if number(version) != Ok(VERSION) {
            return Err(format!("the server's sessions have version {version}, not {VERSION}"));
        }
        let [bytes, opening, digest, id] = rest else { return Err(refused()) };
        Ok(Greeting {
            bytes: number(bytes).map_err(|_| refused())?,
            opening: number(opening).map_err(|_| refused())?,
            digest: digest.to_string(),
            id: id.parse().map_err(|_| refused())?,
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lines_are_read_as_they_are_written() {
        for digest in [None, Some("ab".to_string())] {
            let open = Open { path: "a%20b/c.tct".into(), digest };
            assert_eq!(Open::read(&open.to_string()), Some(open));
        }
        let greeting = Greeting { bytes: 1000, opening: 700, digest: "ab".into(), id: FileId([0xC5; 32]) };
        let line = greeting.to_string();
        assert_eq!(line, format!("HELLO 1 1000 700 ab {}", "c5".repeat(32)));
        assert_eq!(line.parse(), Ok(greeting));
    }

    #[test]
    fn nothing_else_is_a_line() {
        for bad in ["", "OPEN", "OPEN ", "OPEN a b c", "open a", " OPEN a", "NEXT"] {
            assert_eq!(Open::read(bad), None, "{bad}");
        }
        let id = "c5".repeat(32);
        for bad in ["", "HELLO", "HELLO 2 1 1 a b", "HELLO 1 1 1 a b", "ERROR busy later"] {
            assert!(bad.parse::<Greeting>().is_err(), "{bad}");
        }
        assert!(format!("HELLO 1 -1 1 a {id}").parse::<Greeting>().is_err());
        assert!(format!("HELLO 1 1 1 a {id} x").parse::<Greeting>().is_err());
    }
}
