//! How much an input may ask for.

use crate::{Error, Result};

/// Bounds on what a decoder or reader allocates for an input it does not trust.
///
/// Sizes that an input declares are checked before anything is allocated for them,
/// so that a short file cannot ask for gigabytes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Limits {
    /// Bytes of memory that decoding may hold at once. Default: 4 GiB.
    pub max_memory: u64,
}

impl Default for Limits {
    fn default() -> Self {
        Limits { max_memory: 4 << 30 }
    }
}

impl Limits {
    /// Fails if holding `count` items of `bytes_each` would exceed the memory limit.
    pub(crate) fn check(&self, what: &'static str, count: u64, bytes_each: u64) -> Result<()> {
        let needed = count.saturating_mul(bytes_each);
        if needed > self.max_memory {
            return Err(Error::Limit { what, needed, allowed: self.max_memory });
        }
        Ok(())
    }
}
