//! Progressive, lossless compression of triangle meshes by reverse interpolatory √3 subdivision.

mod coding;
mod container;
mod decode;
mod encode;
mod entropy;
mod error;
pub mod io;
mod limits;
mod mesh;
mod metrics;
mod reverse;
pub mod shapes;
mod subdivide;
pub mod verify;

pub use container::Precision;
pub use decode::{Decoder, Info, Level, LevelInfo, decode};
pub use encode::{EncodeOptions, Encoded, Progress, encode, encode_with};
pub use error::{Error, Result};
pub use limits::Limits;
pub use mesh::Mesh;
pub use subdivide::{Update, subdivide};
