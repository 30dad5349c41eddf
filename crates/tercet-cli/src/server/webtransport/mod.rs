//! WebTransport beside the listener: files over QUIC's datagrams, for links that lose packets.
//! `spec/transport.md`, chapter 3, says what a session is.

mod certificate;
mod channel;
mod refusal;
mod session;

use std::net::SocketAddr;
use std::path::PathBuf;
use std::sync::Arc;
use std::time::Duration;

use anyhow::{Context, Result};
use tokio::sync::{OwnedSemaphorePermit, Semaphore};
use tokio::time::{Instant, sleep_until, timeout};
use wtransport::endpoint::IncomingSession;
use wtransport::endpoint::endpoint_side::Server;
use wtransport::{Connection, Endpoint, Identity, ServerConfig};

use super::listener::Patience;
use super::{Service, Shared};
use crate::protocol::{Offer, PATH};
use crate::quic;

pub use certificate::RENEWAL;
pub use channel::InjectedLoss;

/// What an endpoint is to be like.
#[derive(Clone, Debug)]
pub struct Setting {
    /// Where it listens; port 0 is any free one.
    pub address: SocketAddr,
    /// What it shows of itself.
    pub certificate: Certificate,
    /// How much is asked of clients and granted to them.
    pub patience: Patience,
    /// Packets to be lost on purpose, for tests.
    pub loss: Option<InjectedLoss>,
}

/// Where a server's certificate comes from.
#[derive(Clone, Debug)]
pub enum Certificate {
    /// The server signs it itself, and replaces it after this time, at most [`RENEWAL`] to be of use.
    SelfSigned {
        /// How long each is in use.
        renewal: Duration,
    },
    /// PEM files, which are read once.
    Files {
        /// The certificate, and those that vouch for it.
        chain: PathBuf,
        /// Its key.
        key: PathBuf,
    },
}

/// What all sessions share.
struct Host {
    shared: Arc<Shared>,
    patience: Patience,
    loss: Option<InjectedLoss>,
    /// Memory for files that are being sent, in units of [`session::ROOM`].
    room: Arc<Semaphore>,
}

/// An endpoint of QUIC.
pub struct WebTransport {
    endpoint: Endpoint<Server>,
    host: Arc<Host>,
    places: Arc<Semaphore>,
    /// How often the certificate is replaced and when next, if it is the server's own.
    renewal: Option<(Duration, Instant)>,
}

impl WebTransport {
    /// Binds to an address, and lets the service offer what is there.
    ///
    /// # Errors
    /// If the address cannot be had, or the certificate's files are none.
    pub async fn bind(service: &Service, options: Setting) -> Result<Self> {
        let Setting { address, certificate, patience, loss } = options;
        let (identity, renewal) = match certificate {
            Certificate::SelfSigned { renewal } => (certificate::self_signed()?, Some(renewal)),
            Certificate::Files { chain, key } => (certificate::load(&chain, &key).await?, None),
        };
        let hash = certificate::hash(&identity);
        let endpoint = Endpoint::server(config(address, identity, &patience))
            .with_context(|| format!("UDP {address}"))?;
        let shared = service.shared.clone();
        let room = Arc::new(Semaphore::new(session::rooms(shared.max_memory) as usize));
        let host = Host { shared, patience, loss, room };
        let address = endpoint.local_addr()?;
        let port = address.port();
        tracing::info!(%address, "sessions on WebTransport");
        host.shared
            .set_offer(Offer { port, hashes: hash.filter(|_| renewal.is_some()).into_iter().collect() });
        Ok(WebTransport {
            endpoint,
            host: Arc::new(host),
            places: Arc::new(Semaphore::new(patience.connections as usize)),
            renewal: renewal.map(|time| (time, Instant::now() + time)),
        })
    }

    /// Holds sessions until the service stops.
    pub async fn run(mut self) {
        let stop = self.host.shared.stop.clone();
        loop {
            let renewal = self.renewal.map_or_else(Instant::now, |(_, next)| next);
            tokio::select! {
                () = stop.cancelled() => break,
                () = sleep_until(renewal), if self.renewal.is_some() => self.renew(),
                incoming = self.endpoint.accept() => self.admit(incoming),
            }
        }
        let patience = &self.host.patience;
        // Every connection holds a place.
        let all_gone = self.places.acquire_many(patience.connections);
        if timeout(patience.shutdown, all_gone).await.is_err() {
            tracing::warn!("sessions were cut");
        }
    }

    /// Replaces the certificate; sessions that are open go on.
    fn renew(&mut self) {
        self.renewal = self.renewal.map(|(time, _)| (time, Instant::now() + time));
        let renewed = certificate::self_signed().and_then(|identity| {
            let (hash, address) = (certificate::hash(&identity), self.endpoint.local_addr()?);
            self.endpoint.reload_config(config(address, identity, &self.host.patience), false)?;
            Ok(Offer { port: address.port(), hashes: hash.into_iter().collect() })
        });
        match renewed {
            Ok(offer) => self.host.shared.set_offer(offer),
            Err(error) => tracing::error!(%error, "renewing the certificate"),
        }
    }

    fn admit(&self, incoming: IncomingSession) {
        let Ok(place) = self.places.clone().try_acquire_owned() else { return incoming.refuse() };
        let scarce = 2 * self.places.available_permits() < self.host.patience.connections as usize;
        if scarce && !incoming.remote_address_validated() {
            // Addresses that are made up must not take the places that are left.
            return incoming.retry();
        }
        tokio::spawn(attend(self.host.clone(), incoming, place));
    }
}

fn config(address: SocketAddr, identity: Identity, patience: &Patience) -> ServerConfig {
    // Longer than a session waits for a report: who is let go shall hear why.
    let settings = quic::settings(2 * patience.stall);
    ServerConfig::builder().with_bind_address(address).with_custom_transport(identity, settings).build()
}

/// A connection from its first packet to its last.
async fn attend(host: Arc<Host>, incoming: IncomingSession, _place: OwnedSemaphorePermit) {
    let _count = host.shared.metrics.connection();
    let stop = host.shared.stop.clone();
    let shaken = tokio::select! {
        shaken = timeout(host.patience.header, handshake(incoming)) => shaken,
        () = stop.cancelled() => return,
    };
    match shaken {
        Ok(Ok(Some(connection))) => session::hold(&host, &connection).await,
        Ok(Ok(None)) => tracing::info!("not a session's path"),
        Ok(Err(error)) => tracing::debug!(%error, "handshake"),
        Err(_) => tracing::debug!("a handshake that takes too long"),
    }
}

/// The connection, if the client asks for what is offered.
async fn handshake(incoming: IncomingSession) -> Result<Option<Connection>> {
    let request = incoming.await?;
    if request.path() != PATH {
        request.not_found().await;
        return Ok(None);
    }
    Ok(Some(request.accept().await?))
}
