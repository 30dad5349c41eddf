//! The viewer page that is built into the program.

use axum::extract::Path;
use axum::http::{HeaderValue, StatusCode, header};
use axum::response::{IntoResponse, Response};

// `FILES: &[(&str, &[u8])]`: the files below assets/viewer by their paths, which the build
// script has found.
include!(concat!(env!("OUT_DIR"), "/viewer.rs"));

/// The page's own file.
const PAGE: &str = "index.html";

/// Whether this program was built with the page.
pub fn is_built_in() -> bool {
    find(PAGE).is_some()
}

/// `/view/`: the page.
pub async fn page() -> Response {
    respond(PAGE)
}

/// `/view/FILE`: what the page consists of.
pub async fn file(Path(name): Path<String>) -> Response {
    respond(&name)
}

fn find(name: &str) -> Option<&'static [u8]> {
    FILES.iter().find(|(path, _)| *path == name).map(|(_, bytes)| *bytes)
}

fn respond(name: &str) -> Response {
    let Some(bytes) = find(name) else { return StatusCode::NOT_FOUND.into_response() };
    let fields = [
        (header::CONTENT_TYPE, HeaderValue::from_static(media_type(name))),
        (header::CACHE_CONTROL, HeaderValue::from_static("no-cache")),
    ];
    (fields, bytes).into_response()
}

fn media_type(name: &str) -> &'static str {
    match name.rsplit_once('.').map_or("", |(_, suffix)| suffix) {
        "html" => "text/html; charset=utf-8",
        "js" | "mjs" => "text/javascript; charset=utf-8",
        "css" => "text/css; charset=utf-8",
        "json" => "application/json",
        "wasm" => "application/wasm",
        "svg" => "image/svg+xml",
        "png" => "image/png",
        "ico" => "image/x-icon",
        "woff2" => "font/woff2",
        "txt" => "text/plain; charset=utf-8",
        "tct" => super::file::MEDIA_TYPE,
        _ => "application/octet-stream",
    }
}
