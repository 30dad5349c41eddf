//! One file for each command.

mod decode;
mod demo;
mod encode;
#[cfg(feature = "fetch")]
mod fetch;
mod info;
mod metrics;
#[cfg(feature = "serve")]
mod serve;
mod subdivide;
mod verify;
#[cfg(feature = "serve")]
mod view;

pub use decode::{DecodeArgs, decode};
pub use demo::{DemoArgs, demo};
pub use encode::{EncodeArgs, encode};
#[cfg(feature = "fetch")]
pub use fetch::{FetchArgs, fetch};
pub use info::{InfoArgs, info};
pub use metrics::{MetricsArgs, metrics};
#[cfg(feature = "serve")]
pub use serve::{ServeArgs, serve};
pub use subdivide::{SubdivideArgs, subdivide};
pub use verify::{VerifyArgs, verify};
#[cfg(feature = "serve")]
pub use view::{ViewArgs, view};
