//! Progressive, lossless compression of triangle meshes by reverse interpolatory √3 subdivision.
//!
//! [`encode()`] turns a [`Mesh`] into the bytes of a `.tct` file: a base mesh and levels that refine it.
//! [`decode()`] gives the mesh back; a [`Decoder`] takes the bytes in portions, any number of them, and
//! hands out each [`Level`] as soon as it is complete. [`io`] reads and writes other formats,
//! [`verify`] says whether two meshes are equal, [`metrics`] how far apart they are, [`shapes`]
//! generates some, [`subdivide()`] refines them.
//!
//! ```
//! use tercet::{EncodeOptions, Limits, decode, encode, shapes};
//!
//! let mesh = shapes::torus(20, 10);
//! let options = EncodeOptions { keep_order: true, ..EncodeOptions::default() };
//! let file = encode(&mesh, &options)?.bytes;
//! assert_eq!(decode(&file, &Limits::default())?, mesh);
//! # Ok::<(), tercet::Error>(())
//! ```
//!
//! Any mesh can be encoded and any bytes decoded: what cannot be done is an [`Error`], and nothing
//! panics or asks for more memory than the [`Limits`] allow. Time and memory are linear in the mesh.
//!
//! | feature | adds | by default |
//! |---|---|---|
//! | `groups` | levels in groups, for links that lose packets: [`EncodeOptions::groups`], [`Decoder::glimpse`] | yes |
//! | `max` | files of the slowest effort: [`Effort::Max`] | yes |
//! | `rayon` | large meshes on several threads, those of rayon's pool; the same bytes | no |
//! | `remesh` | the modules `remesh`, resampling to subdivision connectivity, and `approximate`, lossy files | no |
//! | `transport` | the module `transport`, files over datagrams | no |
//!
//! Without `groups` or `max`, files that need it are refused as [`Error::Unsupported`].

#[cfg(feature = "remesh")]
pub mod approximate;
mod coding;
mod container;
mod decode;
mod effort;
mod encode;
mod entropy;
mod error;
mod info;
pub mod io;
mod limits;
mod memory;
mod mesh;
pub mod metrics;
mod parallel;
#[cfg(feature = "remesh")]
pub mod remesh;
mod reverse;
pub mod shapes;
mod subdivide;
#[cfg(feature = "transport")]
pub mod transport;
pub mod verify;

pub use container::{Approximation, VERSION as FORMAT_VERSION};
pub use decode::{Decoder, Level, decode};
pub use effort::Effort;
pub use encode::{EncodeOptions, Encoded, Progress, Progressive, encode, encode_with};
pub use error::{Error, Result};
pub use info::{Info, LevelInfo};
pub use limits::Limits;
pub use mesh::{Mesh, Precision};
pub use reverse::LevelScheme;
pub use subdivide::{Scheme, Update, subdivide};

/// The README's Rust is compiled and run with the documentation's.
#[cfg(doctest)]
#[doc = include_str!("../../../README.md")]
struct Readme;

/// Whether this build knows levels in groups: a small decoder may do without.
const GROUPS: bool = cfg!(feature = "groups");
