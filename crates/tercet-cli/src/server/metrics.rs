//! What the server counts, in the text form of Prometheus.

use std::time::Duration;

use prometheus_client::encoding::EncodeLabelSet;
use prometheus_client::encoding::text::encode;
use prometheus_client::metrics::counter::Counter;
use prometheus_client::metrics::family::Family;
use prometheus_client::metrics::gauge::Gauge;
use prometheus_client::metrics::histogram::Histogram;
use prometheus_client::registry::Registry;

/// Upper bounds of the encoding times' classes, in seconds.
const ENCODING_SECONDS: [f64; 8] = [0.01, 0.03, 0.1, 0.3, 1.0, 3.0, 10.0, 30.0];

/// The media type of [`Metrics::text`].
pub const MEDIA_TYPE: &str = "application/openmetrics-text; version=1.0.0; charset=utf-8";

/// Which requests are counted together. Routes, not paths: their number is bounded.
#[derive(Clone, Debug, Hash, PartialEq, Eq, EncodeLabelSet)]
struct Request {
    method: &'static str,
    route: String,
    status: u16,
}

#[derive(Clone, Debug, Hash, PartialEq, Eq, EncodeLabelSet)]
struct Encoding {
    result: &'static str,
}

/// Counters of one server.
pub struct Metrics {
    registry: Registry,
    requests: Family<Request, Counter>,
    bytes: Counter,
    connections: Gauge,
    sessions: Gauge,
    encodings: Family<Encoding, Counter>,
    encoding_seconds: Histogram,
}

impl Default for Metrics {
    fn default() -> Self {
        let mut registry = Registry::with_prefix("tercet");
        let (requests, bytes) = (Family::default(), Counter::default());
        let (connections, sessions) = (Gauge::default(), Gauge::default());
        let (encodings, encoding_seconds) = (Family::default(), Histogram::new(ENCODING_SECONDS));
        registry.register("requests", "Requests answered", requests.clone());
        registry.register("sent_bytes", "Bytes of files sent", bytes.clone());
        registry.register("connections", "Connections that are open", connections.clone());
        registry.register("sessions", "WebSocket sessions that are open", sessions.clone());
        registry.register("encodings", "Meshes encoded", encodings.clone());
        registry.register("encoding_seconds", "Time an encoding took", encoding_seconds.clone());
        Metrics { registry, requests, bytes, connections, sessions, encodings, encoding_seconds }
    }
}

impl Metrics {
    /// Counts a request to a route, by what it was answered with.
    pub fn answered(&self, method: &axum::http::Method, route: String, status: u16) {
        let method = match *method {
            axum::http::Method::GET => "GET",
            axum::http::Method::HEAD => "HEAD",
            axum::http::Method::OPTIONS => "OPTIONS",
            _ => "other",
        };
        self.requests.get_or_create(&Request { method, route, status }).inc();
    }

    /// Counts bytes of a file that were handed to a connection.
    pub fn sent(&self, bytes: usize) {
        self.bytes.inc_by(bytes as u64);
    }

    /// Counts an encoding.
    pub fn encoded(&self, time: Duration, good: bool) {
        let result = if good { "good" } else { "failed" };
        self.encodings.get_or_create(&Encoding { result }).inc();
        self.encoding_seconds.observe(time.as_secs_f64());
    }

    /// Counts a connection until the result is dropped.
    pub fn connection(&self) -> Open {
        Open::new(&self.connections)
    }

    /// Counts a session until the result is dropped.
    pub fn session(&self) -> Open {
        Open::new(&self.sessions)
    }

    /// Everything as text.
    pub fn text(&self) -> String {
        let mut text = String::new();
        // Only a writer can fail, and a string does not.
        let _ = encode(&mut text, &self.registry);
        text
    }
}

/// Something that is counted as long as this value lives.
pub struct Open(Gauge);

impl Open {
    fn new(gauge: &Gauge) -> Self {
        gauge.inc();
        Open(gauge.clone())
    }
}

impl Drop for Open {
    fn drop(&mut self) {
        self.0.dec();
    }
}
