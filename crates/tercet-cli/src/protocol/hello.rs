//! The server's first words.

use std::fmt;

/// The version that this program speaks.
const VERSION: u32 = 1;

/// What the server says of the file.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Hello {
    /// Size of the file.
    pub bytes: u64,
    /// Bytes before its first section.
    pub header: u64,
    /// Its SHA-256 in hexadecimal digits.
    pub digest: String,
}

impl fmt::Display for Hello {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "HELLO {VERSION} {} {} {}", self.bytes, self.header, self.digest)
    }
}

#[cfg(feature = "fetch")]
impl std::str::FromStr for Hello {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        use super::command::number;

        let words: Vec<&str> = text.split(' ').collect();
        let refused = || "the server's first words are not HELLO".to_string();
        let ["HELLO", version, rest @ ..] = &words[..] else { return Err(refused()) };
        if number(version) != Ok(VERSION) {
            return Err(format!(
                "the server speaks version {version} of the protocol, this program {VERSION}"
            ));
        }
        match rest {
            [bytes, header, digest] => Ok(Hello {
                bytes: number(bytes).map_err(|_| refused())?,
                header: number(header).map_err(|_| refused())?,
                digest: digest.to_string(),
            }),
            _ => Err(refused()),
        }
    }
}

#[cfg(all(test, feature = "fetch"))]
mod tests {
    use super::*;

    #[test]
    fn hello_is_read_as_it_is_written() {
        let hello = Hello { bytes: 1000, header: 60, digest: "ab".into() };
        assert_eq!(hello.to_string(), "HELLO 1 1000 60 ab");
        assert_eq!(hello.to_string().parse(), Ok(hello));
        for bad in [
            "",
            "HELLO",
            "HELLO 2 1 1 a",
            "HELLO 1 1 1",
            "HELLO 1 -1 1 a",
            "HELLO 1 1 1 a b",
            "hello 1 1 1 a",
        ] {
            assert!(bad.parse::<Hello>().is_err(), "{bad}");
        }
    }
}
