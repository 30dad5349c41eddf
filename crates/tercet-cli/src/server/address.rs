//! The addresses under which things are found on the server.

use percent_encoding::{AsciiSet, NON_ALPHANUMERIC, utf8_percent_encode};

use super::rendition::Digest;

/// Everything but what needs no escape in a path (RFC 3986, `unreserved`) and its slashes.
const PATH: &AsciiSet = &NON_ALPHANUMERIC.remove(b'-').remove(b'.').remove(b'_').remove(b'~').remove(b'/');

/// Addresses below the path at which the server is mounted: "" or "/some/path".
#[derive(Clone, Debug, Default)]
pub struct Addresses {
    base: String,
}

impl Addresses {
    pub fn new(base: &str) -> Self {
        Addresses { base: base.trim_end_matches('/').into() }
    }

    /// The file or folder `name`, whatever it holds.
    pub fn plain(&self, name: &str) -> String {
        format!("{}/{}", self.base, utf8_percent_encode(name, PATH))
    }

    /// The file `name` with this content and no other.
    pub fn fixed(&self, digest: &Digest, name: &str) -> String {
        self.plain(&format!("d/{}/{name}", digest.as_str()))
    }

    /// A picture of the file `name`.
    pub fn thumbnail(&self, name: &str) -> String {
        self.plain(&format!("thumbnail/{name}"))
    }

    /// The viewer, showing the file at `url`.
    pub fn viewer(&self, url: &str) -> String {
        // As a query's value, a percent sign of the path is escaped once more.
        format!("{}/view/?src={}", self.base, utf8_percent_encode(url, PATH))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_are_escaped() {
        let root = Addresses::default();
        assert_eq!(root.plain("a b/ü#?%.tct"), "/a%20b/%C3%BC%23%3F%25.tct");
        assert_eq!(root.viewer("/a%20b.tct"), "/view/?src=/a%2520b.tct");
        assert_eq!(root.viewer("http://h/a.tct"), "/view/?src=http%3A//h/a.tct");
        assert_eq!(Addresses::new("/meshes/").plain("a.tct"), "/meshes/a.tct");
    }
}
