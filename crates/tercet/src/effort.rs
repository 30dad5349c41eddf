//! How much work a file takes to write and to read.

/// A point between speed and size. The profiles differ in how many opinions are asked about each
/// number, not in what a file is: levels and sections are the same.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
#[non_exhaustive]
pub enum Effort {
    /// One adaptive table for each kind of decision.
    Fast,
    /// Several models, mixed.
    #[default]
    Default,
    /// As many models as pay at all.
    Max,
}
