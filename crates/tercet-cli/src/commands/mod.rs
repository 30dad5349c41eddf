//! One file for each command.

mod compare;
mod decode;
mod demo;
mod encode;
mod info;
mod metrics;
mod render;
mod report;
mod subdivide;
mod verify;

pub use compare::{CompareArgs, Plan, Schemes, compare};
pub use decode::{DecodeArgs, decode};
pub use demo::{DemoArgs, demo};
pub use encode::{EncodeArgs, encode, encode_shown};
pub use info::{InfoArgs, info};
pub use metrics::{MetricsArgs, metrics};
pub use render::{RenderArgs, diagonal, render};
pub use report::{ReportArgs, report};
pub use subdivide::{SubdivideArgs, subdivide};
pub use verify::{VerifyArgs, verify};
