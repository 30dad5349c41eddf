//! One file for each command.

mod decode;
mod demo;
mod encode;
mod info;
mod metrics;
mod simulate;
mod subdivide;
mod verify;

pub use decode::{DecodeArgs, decode};
pub use demo::{DemoArgs, demo};
pub use encode::{EncodeArgs, encode};
pub use info::{InfoArgs, info};
pub use metrics::{MetricsArgs, metrics};
pub use simulate::{SimulateArgs, simulate};
pub use subdivide::{SubdivideArgs, subdivide};
pub use verify::{VerifyArgs, verify};
