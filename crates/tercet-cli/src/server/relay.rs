//! A file of another server, passed on: a page may read it although that server does not say so.

use std::sync::Arc;

use axum::body::Body;
use axum::extract::State;
use axum::http::{HeaderMap, Method, StatusCode, header};
use axum::response::{IntoResponse, Response};
use axum::routing::get;
use reqwest::{Client, Url};

use super::Service;
use super::address::Addresses;

/// What of a request is passed on.
const ASKED: [header::HeaderName; 4] =
    [header::RANGE, header::IF_RANGE, header::IF_MATCH, header::IF_NONE_MATCH];
/// What of an answer is passed on.
const ANSWERED: [header::HeaderName; 6] = [
    header::CONTENT_TYPE,
    header::CONTENT_LENGTH,
    header::CONTENT_RANGE,
    header::ACCEPT_RANGES,
    header::ETAG,
    header::CACHE_CONTROL,
];

struct Relay {
    client: Client,
    url: Url,
}

/// Adds a route for the file at `url`, and no other; the result is its address here.
///
/// # Errors
/// If that is no address.
pub fn add(service: &mut Service, url: &str) -> anyhow::Result<String> {
    crate::tls::choose_provider();
    let url = Url::parse(url)?;
    let name = url.path().rsplit('/').next().unwrap_or_default();
    let name = percent_encoding::percent_decode_str(name).decode_utf8_lossy().into_owned();
    let relay = Arc::new(Relay { client: Client::new(), url });
    let routes = axum::Router::new().route("/relay/{name}", get(pass_on)).with_state(relay);
    service.router = std::mem::take(&mut service.router).merge(routes);
    Ok(Addresses::default().plain(&format!("relay/{name}")))
}

async fn pass_on(State(relay): State<Arc<Relay>>, method: Method, asked: HeaderMap) -> Response {
    let mut request = relay.client.request(method, relay.url.clone());
    for name in ASKED {
        if let Some(value) = asked.get(&name) {
            request = request.header(name, value);
        }
    }
    match request.send().await {
        Ok(answer) => {
            let mut fields = HeaderMap::new();
            for name in ANSWERED {
                if let Some(value) = answer.headers().get(&name) {
                    fields.insert(name, value.clone());
                }
            }
            (answer.status(), fields, Body::from_stream(answer.bytes_stream())).into_response()
        }
        Err(error) => (StatusCode::BAD_GATEWAY, format!("{}\n", error.without_url())).into_response(),
    }
}
