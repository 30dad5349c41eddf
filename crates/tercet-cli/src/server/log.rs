//! The server's log, on standard error.

use tracing_subscriber::fmt;

/// How each event of the log is written.
#[derive(Clone, Copy, Debug, PartialEq, Eq, clap::ValueEnum)]
pub enum LogFormat {
    /// A line for people.
    Text,
    /// A JSON object on a line.
    Json,
}

/// Begins the log of this process. Where one has begun already, that one goes on.
pub fn start(format: LogFormat, most: tracing::Level) {
    let builder = fmt().with_writer(std::io::stderr).with_max_level(most).with_target(false);
    // An error means that there is a log already.
    let _ = match format {
        LogFormat::Text => builder.with_ansi(false).try_init(),
        LogFormat::Json => builder.json().flatten_event(true).try_init(),
    };
}
