//! Why a session does not go on.

use std::fmt;

use wtransport::error::{ConnectionError, StreamWriteError};

use crate::server::failure::Failure;

/// Characters of the longest reason.
const MOST_WORDS: usize = 200;

/// Why a session ends before the client ends it.
#[derive(Debug)]
pub enum End {
    /// The client is told.
    Refused(Refusal),
    /// The client is gone.
    Broken,
}

/// Why the server ends a session.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Refusal {
    /// A line that is not OPEN, or none.
    Usage,
    /// There is nothing to send.
    File(Failure),
    /// The file would take more memory than there is for all.
    Large,
    /// There is no way for packets.
    Datagrams,
    /// No report came.
    Idle,
    /// Nothing seems to arrive.
    Futile,
    /// The server stops.
    Stopping,
}

impl Refusal {
    /// The word for programs.
    pub fn code(&self) -> &'static str {
        match self {
            Refusal::Usage => "usage",
            Refusal::File(Failure::NotFound | Failure::NotEncoded) => "missing",
            Refusal::File(Failure::Mesh(_)) => "mesh",
            Refusal::File(Failure::Busy) => "busy",
            Refusal::File(Failure::Replaced) => "replaced",
            Refusal::File(Failure::Store(_)) => "store",
            Refusal::Large => "large",
            Refusal::Datagrams => "datagrams",
            Refusal::Idle => "idle",
            Refusal::Futile => "futile",
            Refusal::Stopping => "stopping",
        }
    }

    /// The line that tells the client.
    pub fn line(&self) -> String {
        let words = self.to_string();
        let words: String = words.chars().filter(|c| !c.is_control()).take(MOST_WORDS).collect();
        format!("ERROR {} {words}\n", self.code())
    }
}

/// The words for people.
impl fmt::Display for Refusal {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Refusal::File(failure) => return failure.fmt(f),
            Refusal::Usage => "a session begins with OPEN",
            Refusal::Large => "the file is too large for a session",
            Refusal::Datagrams => "packets do not fit into the connection's datagrams",
            Refusal::Idle => "no reports come",
            Refusal::Futile => "nothing seems to arrive",
            Refusal::Stopping => "the server stops",
        })
    }
}

impl From<Refusal> for End {
    fn from(refusal: Refusal) -> Self {
        End::Refused(refusal)
    }
}

impl From<Failure> for End {
    fn from(failure: Failure) -> Self {
        if let Failure::Store(cause) = &failure {
            tracing::error!(cause, "store");
        }
        Refusal::File(failure).into()
    }
}

impl From<ConnectionError> for End {
    fn from(_: ConnectionError) -> Self {
        End::Broken
    }
}

impl From<StreamWriteError> for End {
    fn from(_: StreamWriteError) -> Self {
        End::Broken
    }
}
