//! One file for each command.

mod compare;
mod decode;
mod demo;
mod encode;
#[cfg(feature = "fetch")]
mod fetch;
mod info;
mod metrics;
mod remesh;
mod render;
mod report;
#[cfg(feature = "serve")]
mod serve;
mod simulate;
mod subdivide;
mod verify;
#[cfg(feature = "serve")]
mod view;

pub use compare::{CompareArgs, Plan, Schemes, compare};
pub use decode::{DecodeArgs, decode};
pub use demo::{DemoArgs, demo};
pub use encode::{EncodeArgs, encode, encode_shown};
#[cfg(feature = "fetch")]
pub use fetch::{FetchArgs, fetch};
pub use info::{InfoArgs, info};
pub use metrics::{MetricsArgs, metrics};
pub use remesh::{RemeshArgs, remesh};
pub use render::{RenderArgs, diagonal, render};
pub use report::{ReportArgs, report};
#[cfg(feature = "serve")]
pub use serve::{ServeArgs, serve};
pub use simulate::{SimulateArgs, simulate};
pub use subdivide::{SubdivideArgs, subdivide};
pub use verify::{VerifyArgs, verify};
#[cfg(feature = "serve")]
pub use view::{ViewArgs, view};
