//! `.tct` files by HTTP: `GET` and `HEAD` with ranges and conditions.

use axum::body::Body;
use axum::http::{HeaderMap, HeaderValue, Method, StatusCode, header};
use axum::response::{IntoResponse, Response};
use futures_util::TryStreamExt;

use super::Shared;
use super::etag::{self, Verdict};
use super::failure::Failure;
use super::range::{self, Wanted};
use super::rendition::Rendition;

/// The media type of `.tct` files.
pub const MEDIA_TYPE: &str = "model/vnd.tercet";

/// An address that names a digest never has other content.
const FOREVER: &str = "public, max-age=31536000, immutable";
/// The file of a plain name may be replaced: ask whether it was.
const REVALIDATE: &str = "no-cache";

/// Answers a request for the file of that name, if it has the digest, where one is given.
pub async fn send(
    shared: &Shared,
    name: &str,
    digest: Option<&str>,
    method: &Method,
    headers: &HeaderMap,
) -> Result<Response, Failure> {
    match attempt(shared, name, digest, method, headers).await {
        // Replaced between being found and being read: what is there now is as good.
        Err(Failure::Replaced) => attempt(shared, name, digest, method, headers).await,
        done => done,
    }
}

async fn attempt(
    shared: &Shared,
    name: &str,
    digest: Option<&str>,
    method: &Method,
    headers: &HeaderMap,
) -> Result<Response, Failure> {
    let rendition = shared.catalogue.find(name).await?;
    if digest.is_some_and(|digest| digest != rendition.digest.as_str()) {
        return Err(Failure::NotFound);
    }
    let tag = rendition.digest.etag();
    let verdict = etag::judge(headers, tag.to_str().unwrap_or_default());
    let mut response = match verdict {
        Verdict::Failed => StatusCode::PRECONDITION_FAILED.into_response(),
        Verdict::NotModified => StatusCode::NOT_MODIFIED.into_response(),
        Verdict::Send { part_is_valid } => {
            // Only GET has ranges.
            let field = headers.get(header::RANGE).filter(|_| part_is_valid && method == Method::GET);
            let wanted = range::wanted(field.and_then(|field| field.to_str().ok()), rendition.bytes());
            content(shared, &rendition, wanted, method).await?
        }
    };
    let caching = if digest.is_some() { FOREVER } else { REVALIDATE };
    let fields = response.headers_mut();
    fields.insert(header::ETAG, tag);
    fields.insert(header::CACHE_CONTROL, HeaderValue::from_static(caching));
    fields.insert(header::ACCEPT_RANGES, HeaderValue::from_static("bytes"));
    if let Ok(address) = HeaderValue::from_str(&shared.addresses.fixed(&rendition.digest, name)) {
        fields.insert(header::CONTENT_LOCATION, address);
    }
    Ok(response)
}

async fn content(
    shared: &Shared,
    rendition: &Rendition,
    wanted: Wanted,
    method: &Method,
) -> Result<Response, Failure> {
    let size = rendition.bytes();
    let (status, range) = match wanted {
        Wanted::Unsatisfiable => {
            let field = [(header::CONTENT_RANGE, format!("bytes */{size}"))];
            return Ok((StatusCode::RANGE_NOT_SATISFIABLE, field).into_response());
        }
        Wanted::Whole => (StatusCode::OK, 0..size),
        Wanted::Part(range) => (StatusCode::PARTIAL_CONTENT, range),
    };
    let mut fields = HeaderMap::new();
    fields.insert(header::CONTENT_TYPE, HeaderValue::from_static(MEDIA_TYPE));
    fields.insert(header::CONTENT_LENGTH, (range.end - range.start).into());
    if status == StatusCode::PARTIAL_CONTENT {
        let part = format!("bytes {}-{}/{size}", range.start, range.end - 1);
        fields.insert(header::CONTENT_RANGE, HeaderValue::try_from(part).expect("digits"));
    }
    if method == Method::HEAD {
        return Ok((status, fields).into_response());
    }
    let metrics = shared.metrics.clone();
    let bytes = rendition.object.read(range).await?.inspect_ok(move |chunk| metrics.sent(chunk.len()));
    // A failure after the head cannot be told any more: the connection ends short of its length.
    let bytes = bytes.inspect_err(|failure| tracing::error!(%failure, "while sending"));
    Ok((status, fields, Body::from_stream(bytes)).into_response())
}
