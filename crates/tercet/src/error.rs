//! What can go wrong, grouped by who can act on it.

use std::io;

/// The library's result type.
pub type Result<T> = std::result::Result<T, Error>;

/// Any failure of the library.
///
/// The variants answer "who can act on this": the caller's disk or network
/// ([`Io`](Error::Io)), the author of a mesh file ([`Syntax`](Error::Syntax),
/// [`Mesh`](Error::Mesh)), the sender of a `.tct` file ([`Format`](Error::Format),
/// [`Checksum`](Error::Checksum), [`Truncated`](Error::Truncated),
/// [`Unsupported`](Error::Unsupported)), or the caller's own arguments
/// ([`Limit`](Error::Limit), [`Parameter`](Error::Parameter)).
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum Error {
    /// Reading or writing failed below the library.
    // A page reads no files: the words for all that can happen to them would be a hundredth of its decoder.
    #[cfg_attr(target_arch = "wasm32", error("reading or writing failed"))]
    #[cfg_attr(not(target_arch = "wasm32"), error(transparent))]
    Io(#[from] io::Error),
    /// A mesh file breaks the rules of its own format.
    #[error("{place}: {cause}")]
    Syntax {
        /// Where: "line 12", "byte 4096", "element face".
        place: String,
        /// What is wrong there.
        cause: String,
    },
    /// A mesh was read, but what it says cannot be a mesh of finite positions.
    #[error("{place}: {cause}")]
    Mesh {
        /// Which vertex or face, counted from 0: "vertex 7".
        place: String,
        /// What is wrong with it.
        cause: String,
    },
    /// Bytes that are not a valid `.tct` file.
    #[error("{place}: {cause}")]
    Format {
        /// Which field or section: "header", "level 3".
        place: String,
        /// What is wrong with it.
        cause: String,
    },
    /// A section's bytes are not the ones that were written.
    #[error("{place}: checksum mismatch (stored {stored:08x}, computed {computed:08x})")]
    Checksum {
        /// Which section.
        place: String,
        /// The checksum in the file.
        stored: u32,
        /// The checksum of the bytes received.
        computed: u32,
    },
    /// The bytes end before what was asked for is complete.
    #[error("{place}: the data ends after {have} of {need} bytes")]
    Truncated {
        /// Which section is cut short.
        place: String,
        /// Bytes present.
        have: u64,
        /// Bytes needed.
        need: u64,
    },
    /// A valid file of a version or with a feature that this build does not know, or an option that asks for one.
    #[error("{0}")]
    Unsupported(String),
    /// The input asks for more than [`Limits`](crate::Limits) allow.
    #[error("{what}: {needed} needed, the limit is {allowed}")]
    Limit {
        /// The resource.
        what: &'static str,
        /// What the input asks for.
        needed: u64,
        /// What the caller allows.
        allowed: u64,
    },
    /// An argument out of its range.
    #[error("{0}")]
    Parameter(String),
}

impl Error {
    pub(crate) fn syntax(place: impl Into<String>, cause: impl Into<String>) -> Self {
        Error::Syntax { place: place.into(), cause: cause.into() }
    }

    /// Adds which vertex (from 0) a syntax error was found in.
    pub(crate) fn in_vertex(self, vertex: usize) -> Self {
        match self {
            Error::Syntax { place, cause } => {
                Error::Syntax { place: format!("{place}, vertex {vertex}"), cause }
            }
            other => other,
        }
    }

    pub(crate) fn mesh(place: impl Into<String>, cause: impl Into<String>) -> Self {
        Error::Mesh { place: place.into(), cause: cause.into() }
    }

    pub(crate) fn format(place: impl Into<String>, cause: impl Into<String>) -> Self {
        Error::Format { place: place.into(), cause: cause.into() }
    }
}
