//! `tercet serve`.

use std::net::SocketAddr;
use std::path::PathBuf;
use std::time::Duration;

use anyhow::{Context, Result};
use object_store::ObjectStore;
use std::sync::Arc;
use tercet::{EncodeOptions, Limits};
use tokio::signal;

use crate::console::Console;
#[cfg(feature = "webtransport")]
use crate::server::webtransport::{self, Certificate, InjectedLoss, WebTransport};
use crate::server::{self, Effort, Listener, LogFormat, Options, Patience, Service, Sessions};
use crate::{Outcome, args};

/// Serve a folder or a bucket of meshes over HTTP and WebSocket.
///
/// NAME.tct is sent as it lies there; a mesh of another format, NAME.obj, is encoded when
/// NAME.obj.tct is first asked for. / is a page of what there is, /index.json the same for
/// programs, /healthz and /metrics are for those who watch over it.
#[derive(Debug, clap::Args)]
pub struct ServeArgs {
    /// The folder to serve.
    #[arg(required_unless_present = "store", conflicts_with = "store")]
    pub dir: Option<PathBuf>,
    /// A store instead of a folder: s3://BUCKET/PREFIX, with the usual AWS_… variables.
    #[arg(long, value_name = "URL")]
    pub store: Option<String>,
    /// Where to listen; port 0 is any free one.
    #[arg(long, value_name = "HOST:PORT", default_value = "127.0.0.1:8080")]
    pub addr: String,
    #[cfg(feature = "webtransport")]
    #[command(flatten)]
    pub datagrams: Datagrams,
    #[command(flatten)]
    pub serving: Serving,
}

/// Sessions on WebTransport.
#[cfg(feature = "webtransport")]
#[derive(Debug, clap::Args)]
pub struct Datagrams {
    /// Hold sessions on WebTransport too, which send files by datagrams over links that lose packets:
    /// on this UDP address [default: the one of --addr].
    #[arg(long, value_name = "HOST:PORT", num_args = 0..=1)]
    pub webtransport: Option<Option<String>>,
    /// The certificate of these sessions, a PEM file with those that vouch for it [default: one signed
    /// by the server itself, which /webtransport.json tells].
    #[arg(long, value_name = "FILE.pem", requires_all = ["key", "webtransport"])]
    pub certificate: Option<PathBuf>,
    /// The certificate's key, a PEM file.
    #[arg(long, value_name = "FILE.pem", requires = "certificate")]
    pub key: Option<PathBuf>,
    /// Lose this part of packets on purpose: for tests.
    #[arg(long, value_name = "P", hide = true, requires = "webtransport", value_parser = loss)]
    pub inject_loss: Option<f64>,
    /// Which packets are lost on purpose.
    #[arg(long, value_name = "SEED", hide = true, requires = "inject_loss", default_value_t = 1)]
    pub inject_seed: u64,
}

#[cfg(feature = "webtransport")]
impl Datagrams {
    /// Binds the endpoint, if it is wanted; `beside` is where HTTP is.
    async fn bind(
        &self,
        service: &Service,
        beside: SocketAddr,
        patience: Patience,
    ) -> Result<Option<WebTransport>> {
        let Some(wanted) = &self.webtransport else { return Ok(None) };
        let address = match wanted {
            Some(address) => resolve(address).await?,
            None => beside,
        };
        let certificate = match self.certificate.clone().zip(self.key.clone()) {
            Some((chain, key)) => Certificate::Files { chain, key },
            None => Certificate::SelfSigned { renewal: webtransport::RENEWAL },
        };
        let setting = webtransport::Setting {
            address,
            certificate,
            patience,
            loss: self.inject_loss.map(|rate| InjectedLoss { rate, seed: self.inject_seed }),
        };
        Ok(Some(WebTransport::bind(service, setting).await?))
    }
}

/// What `serve` and `view` share.
#[derive(Debug, clap::Args)]
pub struct Serving {
    /// Encode meshes on a lattice of 2^N points along the longest side [default: exactly].
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u8).range(4..=24))]
    pub bits: Option<u8>,
    /// Where encoded meshes are kept [default: the user's folder for caches].
    #[arg(long, value_name = "DIR")]
    pub cache: Option<PathBuf>,
    /// Bytes that encoded meshes may take up there; beyond, the oldest are removed.
    #[arg(long, value_name = "SIZE", default_value = "2G", value_parser = args::size)]
    pub cache_size: u64,
    /// Encodings at a time; they share --max-memory.
    #[arg(long, value_name = "N", default_value_t = 2, value_parser = at_least_one)]
    pub encode_jobs: usize,
    /// Seconds that a request waits for an encoding before it is told to come back.
    #[arg(long, value_name = "SECONDS", default_value = "60", value_parser = args::seconds)]
    pub encode_timeout: Duration,
    /// Connections at a time; further ones wait.
    #[arg(long, value_name = "N", default_value_t = 1000, value_parser = clap::value_parser!(u32).range(1..))]
    pub max_connections: u32,
    /// Seconds that a client may take for a request, and stay silent between requests.
    #[arg(long, value_name = "SECONDS", default_value = "30", value_parser = args::seconds)]
    pub header_timeout: Duration,
    /// Seconds that a client may take nothing of what is sent to it.
    #[arg(long, value_name = "SECONDS", default_value = "60", value_parser = args::seconds)]
    pub stall_timeout: Duration,
    /// Seconds that a WebSocket session may ask for nothing.
    #[arg(long, value_name = "SECONDS", default_value = "300", value_parser = args::seconds)]
    pub idle_timeout: Duration,
    /// Bytes of the largest WebSocket message that a client may send.
    #[arg(long, value_name = "SIZE", default_value = "4K", value_parser = args::size)]
    pub max_message: u64,
    /// Seconds that answers may go on after a signal to stop.
    #[arg(long, value_name = "SECONDS", default_value = "10", value_parser = args::seconds)]
    pub shutdown_timeout: Duration,
    /// How the log on standard error is written; --quiet keeps its errors only.
    #[arg(long, value_name = "FORMAT", default_value = "text")]
    pub log: LogFormat,
}

impl Serving {
    /// Starts the log and builds the service.
    pub fn service(
        &self,
        store: Arc<dyn ObjectStore>,
        limits: &Limits,
        console: &Console,
    ) -> Result<Service> {
        let most = if console.is_quiet() { tracing::Level::ERROR } else { tracing::Level::INFO };
        server::start_log(self.log, most);
        let options = Options {
            base: String::new(),
            cache: self.cache.clone().unwrap_or_else(default_cache),
            cache_size: self.cache_size,
            encode: EncodeOptions { bits: self.bits, ..EncodeOptions::default() },
            effort: Effort { jobs: self.encode_jobs, limits: *limits, patience: self.encode_timeout },
            sessions: Sessions { max_message: self.max_message as usize, idle: self.idle_timeout },
        };
        Ok(server::service(store, options)?)
    }

    pub fn patience(&self) -> Patience {
        Patience {
            connections: self.max_connections,
            header: self.header_timeout,
            stall: self.stall_timeout,
            shutdown: self.shutdown_timeout,
        }
    }
}

pub fn serve(args: &ServeArgs, limits: &Limits, console: &Console) -> Result<Outcome> {
    let runtime = tokio::runtime::Runtime::new()?;
    runtime.block_on(async {
        let place = match (&args.dir, &args.store) {
            (_, Some(store)) => store.clone(),
            (dir, None) => dir.as_deref().unwrap_or(".".as_ref()).display().to_string(),
        };
        let store = server::open_store(&place)?;
        let service = args.serving.service(store, limits, console)?;
        let address = resolve(&args.addr).await?;
        let listener = Listener::bind(address, args.serving.patience()).await;
        let listener = listener.with_context(|| args.addr.clone())?;
        let address = listener.address()?;
        #[cfg(feature = "webtransport")]
        let sessions = {
            let sessions = args.datagrams.bind(&service, address, args.serving.patience()).await?;
            sessions.map(|sessions| tokio::spawn(sessions.run()))
        };
        console.answer(&format!("http://{address}/"))?;
        listener.run(service, stopped()).await;
        #[cfg(feature = "webtransport")]
        if let Some(sessions) = sessions {
            sessions.await?;
        }
        Ok(Outcome::Good)
    })
}

pub async fn resolve(address: &str) -> Result<SocketAddr> {
    let mut found = tokio::net::lookup_host(address).await.with_context(|| address.to_string())?;
    found.next().with_context(|| format!("{address}: no such host"))
}

/// Done when the process is told to stop.
pub async fn stopped() {
    #[cfg(unix)]
    if let Ok(mut terminate) = signal::unix::signal(signal::unix::SignalKind::terminate()) {
        tokio::select! {
            _ = terminate.recv() => {}
            _ = signal::ctrl_c() => {}
        }
        return;
    }
    // If signals cannot be heard, the process ends at once by their default action.
    if signal::ctrl_c().await.is_err() {
        std::future::pending::<()>().await;
    }
}

/// The folder in which programs of this user keep what they can make again.
fn default_cache() -> PathBuf {
    let variable = |name| std::env::var_os(name).filter(|value| !value.is_empty()).map(PathBuf::from);
    let caches = variable("XDG_CACHE_HOME")
        .or_else(|| variable("HOME").map(|home| home.join(".cache")))
        .or_else(|| variable("LOCALAPPDATA"));
    caches.unwrap_or_else(std::env::temp_dir).join("tercet")
}

/// A probability that leaves something to arrive.
#[cfg(feature = "webtransport")]
fn loss(text: &str) -> Result<f64, String> {
    match text.parse() {
        Ok(loss) if (0.0..=0.9).contains(&loss) => Ok(loss),
        _ => Err("a part of packets between 0 and 0.9".into()),
    }
}

fn at_least_one(text: &str) -> Result<usize, String> {
    match text.parse() {
        Ok(0) => Err("at least 1".into()),
        Ok(number) => Ok(number),
        Err(error) => Err(format!("{error}")),
    }
}
