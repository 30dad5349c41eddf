//! A file by datagrams on WebTransport, from `tercet serve --webtransport`.

use std::pin::Pin;
use std::sync::{Arc, Mutex, PoisonError};
use std::time::Duration;

use anyhow::{Context, Result, anyhow};
use futures_util::{Stream, StreamExt, stream};
use reqwest::{StatusCode, Url};
use tercet::Limits;
use tercet::transport::{FileId, Received, Receiver};
use tokio::io::{AsyncReadExt, BufReader};
use tokio::time::{Instant, Interval, MissedTickBehavior, interval, sleep_until, timeout};
use wtransport::config::IpBindConfig;
use wtransport::error::ConnectingError;
use wtransport::tls::Sha256Digest;
use wtransport::{ClientConfig, Connection, Endpoint, RecvStream, SendStream};

use super::fault::Fault;
use super::refusal::refusal;
use super::{Arrived, Opened};
use crate::protocol::{Greeting, MOST_LINE, Offer, Open};
use crate::quic::{self, REPORT_INTERVAL};

/// Bytes of an answer that says where sessions are.
const MOST_OFFER: usize = 16 << 10;
/// Bytes of an opening: no block is larger.
const MOST_OPENING: u32 = 1150 << 10;

/// A file on a server that holds sessions.
pub struct Wt {
    client: reqwest::Client,
    /// The file's address by HTTP.
    url: Url,
    timeout: Duration,
    limits: Limits,
    gathered: Arc<Mutex<Option<Gathered>>>,
}

/// What has arrived of a file. It outlives a broken session.
struct Gathered {
    id: FileId,
    receiver: Receiver,
    /// Bytes of the file that were handed on.
    position: u64,
}

impl Wt {
    /// The sessions of the server at an address that begins with http:// or https://.
    ///
    /// # Errors
    /// If no HTTP client can be started.
    pub fn new(url: Url, timeout: Duration, limits: Limits) -> Result<Self> {
        crate::tls::choose_provider();
        let client =
            reqwest::Client::builder().timeout(timeout).build().context("starting an HTTP client")?;
        Ok(Wt { client, url, timeout, limits, gathered: Arc::default() })
    }

    /// Begins a session, of the version that `tag` names. Bytes come from `from` on, if those before
    /// it came from here, and otherwise from the beginning.
    pub async fn open(&self, from: u64, tag: Option<&str>) -> Result<Opened, Fault> {
        let digest = tag.map(|tag| tag.trim_matches('"').to_owned());
        let open = Open { path: self.url.path().trim_start_matches('/').into(), digest };
        let begun = timeout(self.timeout, async { self.greet(self.connect().await?, &open).await });
        let (session, greeting, opening) = begun.await.map_err(|_| late())??;
        let start = self.prepare(from, &greeting, &opening);
        let tag = Some(format!("\"{}\"", greeting.digest));
        Ok(Opened { start, tag, bytes: session.pieces().boxed() })
    }

    /// Where the sessions are. The answer changes when the server renews its certificate.
    async fn offer(&self) -> Result<(Offer, String), Fault> {
        let mut url = self.url.clone();
        url.set_path("/webtransport.json");
        url.set_query(None);
        let mut answer = self.client.get(url).send().await?;
        if answer.status() == StatusCode::NOT_FOUND {
            return Err(Fault::Fatal(anyhow!("the server offers no WebTransport")));
        }
        if answer.status() != StatusCode::OK {
            return Err(Fault::of_status(answer.status(), "", None));
        }
        let mut bytes = Vec::new();
        while let Some(chunk) = answer.chunk().await? {
            bytes.extend_from_slice(&chunk);
            if bytes.len() > MOST_OFFER {
                return Err(Fault::Fatal(anyhow!("the server's offer is too long")));
            }
        }
        let value = serde_json::from_slice(&bytes).map_err(|error| Fault::Fatal(error.into()))?;
        Offer::read(&value).map_err(|why| Fault::Fatal(anyhow!(why)))
    }

    async fn connect(&self) -> Result<Connection, Fault> {
        let (offer, path) = self.offer().await?;
        let host = self.url.host_str().unwrap_or_default();
        let config = ClientConfig::builder().with_bind_config(IpBindConfig::InAddrAnyDual);
        let mut config = if offer.hashes.is_empty() {
            config.with_native_certs().build()
        } else {
            config.with_server_certificate_hashes(offer.hashes.into_iter().map(Sha256Digest::new)).build()
        };
        config.quic_config_mut().transport_config(Arc::new(quic::settings(self.timeout)));
        let endpoint = Endpoint::client(config).map_err(Fault::from)?;
        endpoint.connect(format!("https://{host}:{}{path}", offer.port)).await.map_err(|error| match error {
            ConnectingError::InvalidUrl(_) => Fault::Fatal(error.into()),
            _ => Fault::transient(error),
        })
    }

    /// Asks for the file, and takes the server's first words.
    async fn greet(
        &self,
        connection: Connection,
        open: &Open,
    ) -> Result<(Session, Greeting, Vec<u8>), Fault> {
        let stream = connection.open_bi().await.map_err(Fault::transient)?.await;
        let (mut out, input) = stream.map_err(Fault::transient)?;
        out.write_all(format!("{open}\n").as_bytes()).await.map_err(Fault::transient)?;
        let mut input = BufReader::new(input);
        let line = line(&mut input).await?;
        let greeting: Greeting =
            line.parse().map_err(|why: String| refusal(&line).unwrap_or(Fault::Fatal(anyhow!(why))))?;
        if greeting.opening > MOST_OPENING {
            return Err(Fault::Fatal(anyhow!("the server announces too long an opening")));
        }
        let mut opening = vec![0; greeting.opening as usize];
        input.read_exact(&mut opening).await.map_err(Fault::transient)?;
        let (gathered, patience) = (self.gathered.clone(), self.timeout);
        let last_words = Box::pin(async move { self::line(&mut input).await });
        let session = Session { connection, last_words, _out: out, gathered, patience, reports: None };
        Ok((session, greeting, opening))
    }

    /// Makes ready to gather; the result is where the bytes begin that will be handed on.
    fn prepare(&self, from: u64, greeting: &Greeting, opening: &[u8]) -> u64 {
        let mut gathered = self.gathered.lock().unwrap_or_else(PoisonError::into_inner);
        let goes_on = gathered.as_ref().is_some_and(|old| old.id == greeting.id && old.position == from);
        if !goes_on {
            *gathered = None;
        }
        let gathered = gathered.get_or_insert_with(|| Gathered {
            id: greeting.id,
            receiver: Receiver::new(greeting.id, self.limits),
            position: 0,
        });
        // A damaged opening comes again as packets.
        gathered.receiver.open(opening);
        gathered.position
    }
}

/// A session that the server sends packets in.
struct Session {
    connection: Connection,
    /// The line that ends the session, if one comes: read by one future, because it may come in parts.
    last_words: Pin<Box<dyn Future<Output = Result<String, Fault>> + Send>>,
    /// Kept: its end would be the end of the session.
    _out: SendStream,
    gathered: Arc<Mutex<Option<Gathered>>>,
    patience: Duration,
    /// When to report, if that goes on as it was.
    reports: Option<Interval>,
}

impl Session {
    /// The next bytes of the file, whenever a block is complete, and before what of the next one has arrived; `None` at
    /// the file's end.
    async fn piece(&mut self) -> Result<Option<Arrived>, Fault> {
        let mut reports = self.reports.take().unwrap_or_else(|| {
            let mut reports = interval(REPORT_INTERVAL.max(self.connection.rtt() / 4));
            reports.set_missed_tick_behavior(MissedTickBehavior::Delay);
            reports
        });
        let mut deadline = Instant::now() + self.patience;
        loop {
            if let Some(piece) = self.take()? {
                // Only a block that is complete is worth a report at once.
                self.reports = matches!(piece, Some(Arrived::Ahead(..))).then_some(reports);
                return Ok(piece);
            }
            tokio::select! {
                datagram = self.connection.receive_datagram() => {
                    let datagram = datagram.map_err(Fault::transient)?;
                    let gathered = &mut *self.gathered.lock().unwrap_or_else(PoisonError::into_inner);
                    let received = gathered.as_mut().map(|it| it.receiver.push(&datagram.payload()));
                    match received {
                        Some(Received::Kept | Received::Completed) => deadline = Instant::now() + self.patience,
                        Some(Received::Refused) => {
                            return Err(Fault::Fatal(anyhow!("the file needs more memory than --max-memory grants")));
                        }
                        _ => {}
                    }
                }
                _ = reports.tick() => {
                    // One that finds no room is followed by another.
                    let _ = self.connection.send_datagram(self.report());
                }
                line = &mut self.last_words => {
                    let line = line?;
                    let meaningless = || Fault::Fatal(anyhow!("the server says what means nothing"));
                    return Err(refusal(&line).unwrap_or_else(meaningless));
                }
                () = sleep_until(deadline) => return Err(late()),
            }
        }
    }

    /// What can be handed on now: some bytes, or that the end is there.
    fn take(&self) -> Result<Option<Option<Arrived>>, Fault> {
        let gathered = &mut *self.gathered.lock().unwrap_or_else(PoisonError::into_inner);
        let gone = || Fault::transient(anyhow!("another session has begun"));
        let gathered = gathered.as_mut().ok_or_else(gone)?;
        if let Some(piece) = gathered.receiver.take() {
            gathered.position += piece.len() as u64;
            return Ok(Some(Some(Arrived::Next(piece.into()))));
        }
        if let Some((place, bytes)) = gathered.receiver.glimpse() {
            return Ok(Some(Some(Arrived::Ahead(place, bytes.into()))));
        }
        Ok(gathered.receiver.is_complete().then_some(None))
    }

    fn report(&self) -> Vec<u8> {
        let gathered = self.gathered.lock().unwrap_or_else(PoisonError::into_inner);
        gathered.as_ref().map(|gathered| gathered.receiver.report().write()).unwrap_or_default()
    }

    fn pieces(self) -> impl Stream<Item = Result<Arrived, Fault>> + Send {
        stream::try_unfold(self, |mut session| async move {
            Ok(session.piece().await?.map(|piece| (piece, session)))
        })
    }
}

/// A line of the server's. When none can come any more, the connection's end says why.
async fn line(input: &mut BufReader<RecvStream>) -> Result<String, Fault> {
    let line = quic::read_line(input, MOST_LINE).await.map_err(Fault::transient)?;
    line.ok_or_else(|| Fault::transient(anyhow!("the server ended the session")))
}

fn late() -> Fault {
    Fault::transient(anyhow!("the server says nothing"))
}
