//! What can go wrong on the way, by what is to be done about it.

use std::error::Error;
use std::io;
use std::time::Duration;

use anyhow::anyhow;
use reqwest::StatusCode;

/// Why no more bytes come.
#[derive(Debug)]
pub enum Fault {
    /// Asking again would be answered in the same way.
    Fatal(anyhow::Error),
    /// Asking again may help, after some time if the server names one.
    Transient { cause: anyhow::Error, wait: Option<Duration> },
    /// The file is not the one that a part is there of.
    Replaced,
}

impl Fault {
    pub fn transient(cause: impl Into<anyhow::Error>) -> Self {
        Fault::Transient { cause: cause.into(), wait: None }
    }

    /// What an answer's status means; `words` is what the server says of it, `wait` its
    /// `Retry-After` field.
    pub fn of_status(status: StatusCode, words: &str, wait: Option<&str>) -> Self {
        let words = words.lines().next().unwrap_or_default().trim();
        let cause = match words {
            "" => anyhow!("the server answers {status}"),
            words => anyhow!("the server answers {status}: {words}"),
        };
        let again = [StatusCode::REQUEST_TIMEOUT, StatusCode::TOO_MANY_REQUESTS];
        if status.is_server_error() || again.contains(&status) {
            let wait = wait.and_then(|seconds| seconds.trim().parse().ok()).map(Duration::from_secs);
            return Fault::Transient { cause, wait };
        }
        match status {
            StatusCode::PRECONDITION_FAILED | StatusCode::RANGE_NOT_SATISFIABLE => Fault::Replaced,
            _ => Fault::Fatal(cause),
        }
    }
}

/// The disk.
impl From<io::Error> for Fault {
    fn from(error: io::Error) -> Self {
        Fault::Fatal(error.into())
    }
}

impl From<reqwest::Error> for Fault {
    fn from(error: reqwest::Error) -> Self {
        // The address stands at the line's beginning already.
        let error = error.without_url();
        if error.is_builder() || error.is_redirect() {
            return Fault::Fatal(error.into());
        }
        if error.is_connect() {
            // Each layer below says once more that it could not connect.
            return Fault::transient(anyhow!("cannot connect: {}", root(&error)));
        }
        Fault::transient(error)
    }
}

/// What an error comes from.
fn root(error: &dyn Error) -> &dyn Error {
    match error.source() {
        Some(source) => root(source),
        None => error,
    }
}
