//! Lossy files, on purpose and bounded: the smallest within an error, or the nearest within a size.
//!
//! A file codes a mesh without loss, up to its lattice. Here another mesh is put into it than the one
//! given, the *source*: the source on a coarse lattice, a simplified one, or a remesh whose connectivity costs
//! nothing; the `search` tries sizes of each. Of simplified meshes and remeshes the vertices are moved to
//! where their triangles are nearest to the source (`fit`). What was found is decoded again and measured
//! (`gauge`; in the end [`metrics::compare`](crate::metrics::compare)), and the file says how far it is
//! from what.

mod candidate;
mod fit;
mod gauge;
mod search;

use crate::metrics::Comparison;
use crate::{EncodeOptions, Encoded, Error, Limits, Mesh, Progress, Result, Scheme};

/// What a lossy file must keep to.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Bound {
    /// The root mean square of the distances between the decoded surface and the source, the larger of both
    /// directions, is at most this part of the diagonal of the source's bounding box: as
    /// [`metrics::compare`](crate::metrics::compare) measures it with its usual options.
    MaxError(f64),
    /// The file has at most so many bytes.
    MaxBytes(u64),
}

/// What a lossy file was made of.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Method {
    /// The source with every bit of its coordinates: nothing else is near enough, or it is small enough.
    Exact,
    /// The source on a lattice.
    Rounded,
    /// The source with fewer vertices.
    Simplified,
    /// A base refined by so many steps of a subdivision scheme, onto the source.
    Remeshed(Scheme, u32),
}

/// A lossy file, and how it came about.
#[derive(Clone, Debug)]
pub struct Approximated {
    /// The file; [`Info::approximation`](crate::Info::approximation) says how far it is from what.
    pub encoded: Encoded,
    /// What it holds.
    pub method: Method,
    /// How far the decoded mesh, B, is from the source, A.
    pub comparison: Comparison,
    /// Files that were made to choose from.
    pub trials: usize,
    /// Why the source was not remeshed, if it could not be.
    pub not_remeshed: Option<String>,
}

/// Makes a lossy file of `mesh` that keeps to `bound`: of all that are tried the smallest one, or the
/// nearest one. The same input gives the same file.
///
/// `options` say how the file is coded; its lattice is chosen here. O(n log n) time for each of some twenty trials.
///
/// # Errors
/// [`Error::Mesh`] if `mesh` has no surface, an index out of range or a coordinate that is not finite;
/// [`Error::Parameter`] for a bound that is not a positive number, for a size that nothing found fits, and for
/// `options` that ask for bits or the order of the source; [`Error::Limit`] if the trials would not fit.
pub fn approximate(
    mesh: &Mesh,
    bound: Bound,
    options: &EncodeOptions,
    limits: &Limits,
    progress: &mut dyn FnMut(Progress),
) -> Result<Approximated> {
    mesh.check()?;
    if let Bound::MaxError(error) = bound
        && !(error > 0.0 && error.is_finite())
    {
        return Err(Error::Parameter("the largest error must be a number above 0".into()));
    }
    if options.bits.is_some() || options.keep_order {
        let cause = "a lossy file has a lattice and an order of its own";
        return Err(Error::Parameter(cause.into()));
    }
    limits.check("bytes of the search", mesh.faces.len() as u64, BYTES_PER_FACE)?;
    search::search(mesh, bound, options, progress)
}

/// Memory that a face of the source takes: search trees, surfaces, a candidate of the same size.
const BYTES_PER_FACE: u64 = 1200;
