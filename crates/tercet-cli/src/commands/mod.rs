//! One file for each command.

mod decode;
mod demo;
mod encode;
mod info;
mod subdivide;
mod verify;

pub use decode::decode;
pub use demo::demo;
pub use encode::encode;
pub use info::info;
pub use subdivide::subdivide;
pub use verify::verify;
