//! Serving `.tct` files: a [`router`] that can be mounted anywhere, and a [`Listener`] that carries it.
//!
//! A file is served under its plain name, to be revalidated, and under an address with its digest,
//! which never changes. Meshes of other formats are encoded when they are first asked for. A plain
//! file server serves the same files as well; what this one adds is described in `spec/transport.md`.

mod address;
mod catalogue;
mod connection;
mod encode_cache;
mod etag;
mod failure;
mod file;
mod index;
mod levels;
mod listener;
mod log;
mod metrics;
mod once;
mod outbox;
mod range;
#[cfg(feature = "fetch")]
mod relay;
mod rendition;
mod session;
mod store;
mod thumbnail;
mod trim;
mod viewer;
#[cfg(feature = "webtransport")]
pub mod webtransport;

use std::io;
use std::path::PathBuf;
use std::sync::{Arc, PoisonError, RwLock};
use std::time::{Duration, Instant};

use axum::Router;
use axum::extract::{MatchedPath, Path, Request, State};
use axum::http::{HeaderMap, HeaderValue, Method, StatusCode, header};
use axum::middleware::{Next, from_fn_with_state};
use axum::response::{IntoResponse, Redirect, Response};
use axum::routing::get;
use object_store::ObjectStore;
use tokio_util::sync::CancellationToken;
use tower_http::catch_panic::CatchPanicLayer;
use tower_http::cors::{Any, CorsLayer};

pub use encode_cache::Effort;
pub use file::MEDIA_TYPE;
pub use listener::{Listener, Patience};
pub use log::{LogFormat, start as start_log};
#[cfg(feature = "fetch")]
pub(crate) use relay::add as relay;
pub use store::open as open_store;
pub use viewer::is_built_in as has_viewer;

use address::Addresses;
use catalogue::Catalogue;
use encode_cache::EncodeCache;
use failure::Failure;
use metrics::Metrics;
use thumbnail::Thumbnails;

use crate::protocol::Offer;

/// How a server works.
#[derive(Clone, Debug)]
pub struct Options {
    /// The path at which the router is mounted, as in "/meshes"; empty at the root.
    pub base: String,
    /// The folder that keeps encoded meshes.
    pub cache: PathBuf,
    /// Bytes that they may take up there; beyond, the oldest are removed.
    pub cache_size: u64,
    /// How meshes of other formats are encoded.
    pub encode: tercet::EncodeOptions,
    /// How much encoding may go on at a time.
    pub effort: Effort,
    /// What WebSocket sessions may do.
    pub sessions: Sessions,
}

/// Limits of WebSocket sessions.
#[derive(Clone, Copy, Debug)]
pub struct Sessions {
    /// Bytes of a client's largest message.
    pub max_message: usize,
    /// How long a client may ask for nothing when there is nothing to send.
    pub idle: Duration,
}

/// What all requests share.
struct Shared {
    addresses: Addresses,
    catalogue: Catalogue,
    thumbnails: Thumbnails,
    metrics: Arc<Metrics>,
    sessions: Sessions,
    /// Where sessions on WebTransport are held, if they are.
    offer: RwLock<Option<Offer>>,
    /// Bytes that the files of these sessions may take together.
    #[cfg(feature = "webtransport")]
    max_memory: u64,
    stop: CancellationToken,
}

impl Shared {
    fn offer(&self) -> Option<Offer> {
        self.offer.read().unwrap_or_else(PoisonError::into_inner).clone()
    }

    #[cfg(feature = "webtransport")]
    fn set_offer(&self, offer: Offer) {
        *self.offer.write().unwrap_or_else(PoisonError::into_inner) = Some(offer);
    }
}

/// A server's routes, and what the one who carries them needs to know.
#[derive(Clone)]
pub struct Service {
    /// The routes.
    pub router: Router,
    metrics: Arc<Metrics>,
    /// Ends the sessions.
    stop: CancellationToken,
    #[cfg(feature = "webtransport")]
    shared: Arc<Shared>,
}

/// Without a client there is nothing to pass on: the page asks the other server itself.
#[cfg(not(feature = "fetch"))]
pub(crate) fn relay(_: &mut Service, url: &str) -> anyhow::Result<String> {
    Ok(url.into())
}

/// The address of a file of that name on a server at the root.
pub(crate) fn plain_url(name: &str) -> String {
    Addresses::default().plain(name)
}

/// The address of the viewer, showing the file at `url`, on a server at the root.
pub(crate) fn viewer_url(url: &str) -> String {
    Addresses::default().viewer(url)
}

/// The routes that serve the meshes of a store.
///
/// # Errors
/// If the cache's folder cannot be used.
pub fn router(store: Arc<dyn ObjectStore>, options: Options) -> io::Result<Router> {
    Ok(service(store, options)?.router)
}

/// As [`router`], for a [`Listener`].
///
/// # Errors
/// As [`router`].
pub fn service(store: Arc<dyn ObjectStore>, options: Options) -> io::Result<Service> {
    let metrics = Arc::new(Metrics::default());
    let stop = CancellationToken::new();
    let cache = EncodeCache::open(
        options.cache,
        options.cache_size,
        options.encode,
        options.effort,
        metrics.clone(),
    )?;
    let shared = Arc::new(Shared {
        addresses: Addresses::new(&options.base),
        catalogue: Catalogue::new(store, cache),
        thumbnails: Thumbnails::new(),
        metrics: metrics.clone(),
        sessions: options.sessions,
        offer: RwLock::new(None),
        #[cfg(feature = "webtransport")]
        max_memory: options.effort.limits.max_memory,
        stop: stop.clone(),
    });
    let mut router = Router::new()
        .route("/", get(root))
        .route("/{*name}", get(named))
        .route("/d/{digest}/{*name}", get(fixed))
        .route("/thumbnail/{*name}", get(thumbnail))
        .route("/ws/{*name}", get(session::open))
        .route("/webtransport.json", get(offer))
        .route("/healthz", get(async || "good\n"))
        .route("/metrics", get(counters));
    if viewer::is_built_in() {
        router = router
            .route("/view", get(async || Redirect::permanent("view/")))
            .route("/view/", get(viewer::page))
            .route("/view/{*file}", get(viewer::file));
    }
    let router = router
        .layer(cross_origin())
        .layer(CatchPanicLayer::new())
        .layer(from_fn_with_state(shared.clone(), observe))
        .with_state(shared.clone());
    Ok(Service {
        router,
        metrics,
        stop,
        #[cfg(feature = "webtransport")]
        shared,
    })
}

/// Pages of other origins may read everything, in parts too.
fn cross_origin() -> CorsLayer {
    CorsLayer::new()
        .allow_origin(Any)
        .allow_methods([Method::GET, Method::HEAD])
        .allow_headers([header::RANGE, header::IF_RANGE, header::IF_MATCH, header::IF_NONE_MATCH])
        .expose_headers([
            header::ACCEPT_RANGES,
            header::CONTENT_LENGTH,
            header::CONTENT_LOCATION,
            header::CONTENT_RANGE,
            header::ETAG,
            header::RETRY_AFTER,
        ])
        .max_age(Duration::from_secs(86_400))
}

async fn root(State(shared): State<Arc<Shared>>) -> Result<Response, Failure> {
    index::page(&shared, "").await
}

/// A folder, its list, or a file.
async fn named(
    State(shared): State<Arc<Shared>>,
    Path(name): Path<String>,
    method: Method,
    headers: HeaderMap,
) -> Result<Response, Failure> {
    if name.ends_with('/') {
        return index::page(&shared, &name).await;
    }
    match name.rsplit_once('/').unwrap_or(("", &name)) {
        (folder, index::LIST) => index::list(&shared, folder).await,
        _ => match file::send(&shared, &name, None, &method, &headers).await {
            // Relative addresses on a folder's page need the slash.
            Err(Failure::NotFound) if index::exists(&shared, &name).await => {
                Ok(Redirect::temporary(&shared.addresses.plain(&format!("{name}/"))).into_response())
            }
            sent => sent,
        },
    }
}

async fn fixed(
    State(shared): State<Arc<Shared>>,
    Path((digest, name)): Path<(String, String)>,
    method: Method,
    headers: HeaderMap,
) -> Result<Response, Failure> {
    file::send(&shared, &name, Some(&digest), &method, &headers).await
}

/// A picture of a file; where there is none, a picture that says so with the failure's status.
async fn thumbnail(State(shared): State<Arc<Shared>>, Path(name): Path<String>) -> Response {
    let found = shared.catalogue.find(&name).await;
    let picture = match found {
        Ok(rendition) => shared.thumbnails.picture(rendition).await,
        Err(failure) => Err(failure),
    };
    let caching = (header::CACHE_CONTROL, HeaderValue::from_static("no-cache"));
    let media = |name| (header::CONTENT_TYPE, HeaderValue::from_static(name));
    match picture {
        Ok(picture) => ([media("image/png"), caching], picture).into_response(),
        Err(failure) => {
            let placeholder = thumbnail::placeholder(&failure);
            let status = failure.into_response().status();
            (status, [media("image/svg+xml"), caching], placeholder).into_response()
        }
    }
}

/// Where sessions on WebTransport are held. It changes with the certificate.
async fn offer(State(shared): State<Arc<Shared>>) -> Result<Response, Failure> {
    let offer = shared.offer().ok_or(Failure::NotFound)?;
    let fields = [
        (header::CONTENT_TYPE, HeaderValue::from_static("application/json")),
        (header::CACHE_CONTROL, HeaderValue::from_static("no-store")),
    ];
    Ok((fields, format!("{:#}\n", offer.json())).into_response())
}

async fn counters(State(shared): State<Arc<Shared>>) -> Response {
    let media = [(header::CONTENT_TYPE, HeaderValue::from_static(metrics::MEDIA_TYPE))];
    (media, shared.metrics.text()).into_response()
}

/// Counts and logs each request when its answer begins.
async fn observe(State(shared): State<Arc<Shared>>, request: Request, next: Next) -> Response {
    let start = Instant::now();
    let (method, path) = (request.method().clone(), request.uri().path().to_owned());
    let route = request.extensions().get::<MatchedPath>().map(|route| route.as_str().to_owned());
    let mut response = next.run(request).await;
    response.headers_mut().insert(header::X_CONTENT_TYPE_OPTIONS, HeaderValue::from_static("nosniff"));
    let status = response.status().as_u16();
    shared.metrics.answered(&method, route.unwrap_or_default(), status);
    let micros = start.elapsed().as_micros() as u64;
    if response.status() == StatusCode::INTERNAL_SERVER_ERROR {
        tracing::error!(%method, path, status, micros, "request");
    } else {
        tracing::info!(%method, path, status, micros, "request");
    }
    response
}
