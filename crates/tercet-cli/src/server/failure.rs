//! Why a request cannot be answered with what it asks for.

use axum::http::{HeaderValue, StatusCode, header};
use axum::response::{IntoResponse, Response};

/// How long a client that finds the server busy should wait, in seconds.
const RETRY_AFTER: HeaderValue = HeaderValue::from_static("5");

/// Why there is no file to send. Cheap to clone: it is handed to all who wait for the same work.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum Failure {
    /// There is nothing of that name, or nothing that could be one.
    #[error("there is no such file")]
    NotFound,
    /// A mesh file was asked for as it is.
    #[error("there is no such file: meshes are sent encoded, as files of their names with .tct behind them")]
    NotEncoded,
    /// A mesh file that cannot be read or encoded; the text says why.
    #[error("{0}")]
    Mesh(String),
    /// Too much to do at the moment.
    #[error("the server is busy: try again later")]
    Busy,
    /// The file was replaced while it was read.
    #[error("the file was replaced while it was read: try again")]
    Replaced,
    /// The store or the disk of the cache failed; the text is for the log, not for clients.
    #[error("the store failed")]
    Store(String),
}

impl Failure {
    /// Whether the same bytes would fail in the same way again.
    pub fn is_lasting(&self) -> bool {
        matches!(self, Failure::Mesh(_))
    }

    fn status(&self) -> StatusCode {
        match self {
            Failure::NotFound | Failure::NotEncoded => StatusCode::NOT_FOUND,
            Failure::Mesh(_) => StatusCode::UNPROCESSABLE_ENTITY,
            Failure::Busy | Failure::Replaced => StatusCode::SERVICE_UNAVAILABLE,
            Failure::Store(_) => StatusCode::BAD_GATEWAY,
        }
    }
}

impl From<object_store::Error> for Failure {
    fn from(error: object_store::Error) -> Self {
        match error {
            object_store::Error::NotFound { .. } | object_store::Error::InvalidPath { .. } => {
                Failure::NotFound
            }
            object_store::Error::Precondition { .. } => Failure::Replaced,
            other => Failure::Store(other.to_string()),
        }
    }
}

impl IntoResponse for Failure {
    fn into_response(self) -> Response {
        if let Failure::Store(cause) = &self {
            tracing::error!(cause, "store");
        }
        let status = self.status();
        let mut response = (status, format!("{self}\n")).into_response();
        let headers = response.headers_mut();
        headers.insert(header::CACHE_CONTROL, HeaderValue::from_static("no-store"));
        if status == StatusCode::SERVICE_UNAVAILABLE {
            headers.insert(header::RETRY_AFTER, RETRY_AFTER);
        }
        response
    }
}
