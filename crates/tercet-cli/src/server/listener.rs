//! Accepting connections, within limits.

use std::io;
use std::net::SocketAddr;
use std::pin::pin;
use std::sync::Arc;
use std::time::Duration;

use hyper::server::conn::http1;
use hyper_util::rt::{TokioIo, TokioTimer};
use hyper_util::service::TowerToHyperService;
use tokio::net::{TcpListener, TcpStream};
use tokio::sync::{OwnedSemaphorePermit, Semaphore};

use super::Service;
use super::connection::Connection;

/// Bytes of requests and answers that a connection may hold, headers included.
const BUFFER: usize = 64 << 10;
/// Fields that a request may have.
const MOST_FIELDS: usize = 64;
/// How long to wait when no connection can be accepted, as when no file descriptor is left.
const BREATH: Duration = Duration::from_millis(100);

/// How much is asked of clients and granted to them.
#[derive(Clone, Copy, Debug)]
pub struct Patience {
    /// Connections at a time; further ones wait in the system's queue.
    pub connections: u32,
    /// How long a client may take for a request's head, and stay silent between two requests.
    pub header: Duration,
    /// How long a client may take no byte of what is sent to it.
    pub stall: Duration,
    /// How long answers may go on after the server was told to stop.
    pub shutdown: Duration,
}

/// A socket that listens.
pub struct Listener {
    socket: TcpListener,
    patience: Patience,
    places: Arc<Semaphore>,
}

impl Listener {
    /// Binds to an address; port 0 is any free one.
    ///
    /// # Errors
    /// If that address cannot be had.
    pub async fn bind(address: SocketAddr, patience: Patience) -> io::Result<Self> {
        let socket = TcpListener::bind(address).await?;
        let places = Semaphore::new(patience.connections as usize);
        Ok(Listener { socket, patience, places: Arc::new(places) })
    }

    /// Where it listens.
    ///
    /// # Errors
    /// If the system does not tell.
    pub fn address(&self) -> io::Result<SocketAddr> {
        self.socket.local_addr()
    }

    /// Serves until `stop` is done; then answers what was asked, for no longer than agreed.
    pub async fn run(self, service: Service, stop: impl Future<Output = ()>) {
        tokio::select! {
            () = stop => {}
            () = self.accept_all(&service) => {}
        }
        tracing::info!("stopping");
        service.stop.cancel();
        // Every connection, and every session on one, holds a place.
        let all_gone = self.places.acquire_many(self.patience.connections);
        if tokio::time::timeout(self.patience.shutdown, all_gone).await.is_err() {
            tracing::warn!("connections were cut");
        }
    }

    async fn accept_all(&self, service: &Service) {
        while let Ok(place) = self.places.clone().acquire_owned().await {
            match self.socket.accept().await {
                Ok((stream, _)) => self.serve(stream, place, service),
                Err(error) => {
                    tracing::warn!(%error, "accepting");
                    tokio::time::sleep(BREATH).await;
                }
            }
        }
    }

    fn serve(&self, stream: TcpStream, place: OwnedSemaphorePermit, service: &Service) {
        // Levels are sent as a whole: nothing is gained by waiting for more. If it cannot be set,
        // things are only slower.
        let _ = stream.set_nodelay(true);
        let count = service.metrics.connection();
        let connection = Connection::new(stream, self.patience.stall, (place, count));
        let http = http1::Builder::new()
            .timer(TokioTimer::new())
            .header_read_timeout(self.patience.header)
            .max_buf_size(BUFFER)
            .max_headers(MOST_FIELDS)
            .serve_connection(TokioIo::new(connection), TowerToHyperService::new(service.router.clone()))
            .with_upgrades();
        let stop = service.stop.clone();
        tokio::spawn(async move {
            let mut http = pin!(http);
            let ended = tokio::select! {
                ended = http.as_mut() => ended,
                () = stop.cancelled() => {
                    http.as_mut().graceful_shutdown();
                    http.await
                }
            };
            if let Err(error) = ended {
                tracing::debug!(%error, "connection");
            }
        });
    }
}
