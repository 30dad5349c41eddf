//! A file by the command protocol, from `tercet serve`.

use std::time::Duration;

use anyhow::{Result, anyhow, bail};
use bytes::Bytes;
use futures_util::{Stream, StreamExt, stream};
use reqwest::{StatusCode, Url};
use tokio::net::TcpStream;
use tokio::time::timeout;
use tokio_tungstenite::tungstenite::client::IntoClientRequest;
use tokio_tungstenite::tungstenite::http::{HeaderValue, header};
use tokio_tungstenite::tungstenite::protocol::WebSocketConfig;
use tokio_tungstenite::tungstenite::{Error, Message};
use tokio_tungstenite::{MaybeTlsStream, WebSocketStream, connect_async_with_config};

use super::fault::Fault;
use super::refusal::refusal;
use super::wanted::Wanted;
use super::{Arrived, Opened};
use crate::protocol::{Command, Data, Hello, MOST_BYTES, SUBPROTOCOL};

type Socket = WebSocketStream<MaybeTlsStream<TcpStream>>;

/// Bytes of a message that a server may send: some more than data ever are.
const MOST_MESSAGE: usize = 2 * MOST_BYTES;

/// A file in a server's care.
pub struct Ws {
    url: Url,
    timeout: Duration,
}

impl Ws {
    /// The session at an address that begins with ws:// or wss://.
    pub fn new(url: Url, timeout: Duration) -> Self {
        Ws { url, timeout }
    }

    /// The session of the file at an address that begins with http:// or https://.
    pub fn of_file(mut url: Url, timeout: Duration) -> Result<Self> {
        let scheme = if url.scheme() == "https" { "wss" } else { "ws" };
        let path = format!("/ws{}", url.path());
        url.set_path(&path);
        if url.set_scheme(scheme).is_err() {
            bail!("{url}: there is no WebSocket of it");
        }
        Ok(Ws::new(url, timeout))
    }

    /// Asks for what is wanted from byte `from` on, of the version that `tag` names.
    pub async fn open(&self, from: u64, tag: Option<&str>, wanted: &Wanted) -> Result<Opened, Fault> {
        let digest = tag.map(|tag| tag.trim_matches('"').to_owned());
        let mut url = self.url.clone();
        let mut query = url.query_pairs_mut();
        if from > 0 {
            query.append_pair("command", &Command::From(from, digest).to_string());
        }
        query.append_pair("command", &goal(wanted).to_string());
        drop(query);
        let mut socket = self.connect(&url).await?;
        let hello = match next(&mut socket, self.timeout).await? {
            Message::Text(text) => {
                text.parse::<Hello>().map_err(|why| refusal(&text).unwrap_or(Fault::Fatal(anyhow!(why))))?
            }
            _ => return Err(Fault::Fatal(anyhow!("the server begins without a word"))),
        };
        let tag = Some(format!("\"{}\"", hello.digest));
        let session = Session { socket, timeout: self.timeout, position: from, total: hello.bytes };
        Ok(Opened { start: from, tag, bytes: session.pieces().boxed() })
    }

    async fn connect(&self, url: &Url) -> Result<Socket, Fault> {
        crate::tls::choose_provider();
        let mut request = url.as_str().into_client_request().map_err(fault)?;
        request.headers_mut().insert(header::SEC_WEBSOCKET_PROTOCOL, HeaderValue::from_static(SUBPROTOCOL));
        let config = WebSocketConfig::default()
            .max_message_size(Some(MOST_MESSAGE))
            .max_frame_size(Some(MOST_MESSAGE));
        let connecting = connect_async_with_config(request, Some(config), true);
        let connected = timeout(self.timeout, connecting).await.map_err(|_| late())?;
        connected.map(|(socket, _)| socket).map_err(fault)
    }
}

/// The command that asks for at least what is wanted. The header is not known when it is given:
/// of a number of bytes everything is asked for, and the client leaves when it has enough.
fn goal(wanted: &Wanted) -> Command {
    match *wanted {
        Wanted::Level(level) => Command::Level(level),
        Wanted::Error(error) => Command::Until(error),
        Wanted::Everything | Wanted::Bytes(_) => Command::Until(0.0),
    }
}

/// A session that sends what was asked for.
struct Session {
    socket: Socket,
    timeout: Duration,
    /// The next byte that is missing.
    position: u64,
    /// The file's size.
    total: u64,
}

impl Session {
    /// The bytes of the next data message that are new; `None` when the goal is reached.
    async fn piece(&mut self) -> Result<Option<Bytes>, Fault> {
        while self.position < self.total {
            let data = match next(&mut self.socket, self.timeout).await? {
                Message::Binary(message) => Data::read(message),
                Message::Text(text) if text.starts_with("DONE ") => return Ok(None),
                Message::Text(text) => {
                    let meaningless = || Fault::Fatal(anyhow!("the server says what means nothing"));
                    return Err(refusal(&text).unwrap_or_else(meaningless));
                }
                Message::Close(_) => return Err(Fault::transient(anyhow!("the server closed the session"))),
                _ => continue,
            };
            let data = data.ok_or_else(|| Fault::transient(anyhow!("damaged data")))?;
            let known = self.position.checked_sub(data.offset);
            let known = known.ok_or_else(|| Fault::Fatal(anyhow!("the server leaves out bytes")))?;
            // The header comes again in every session.
            if known < data.bytes.len() as u64 {
                let piece = data.bytes.slice(known as usize..);
                self.position += piece.len() as u64;
                return Ok(Some(piece));
            }
        }
        Ok(None)
    }

    fn pieces(self) -> impl Stream<Item = Result<Arrived, Fault>> + Send {
        stream::try_unfold(self, |mut session| async move {
            Ok(session.piece().await?.map(|piece| (Arrived::Next(piece), session)))
        })
    }
}

async fn next(socket: &mut Socket, patience: Duration) -> Result<Message, Fault> {
    match timeout(patience, socket.next()).await {
        Ok(Some(message)) => message.map_err(fault),
        Ok(None) => Err(Fault::transient(anyhow!("the connection ended"))),
        Err(_) => Err(late()),
    }
}

fn late() -> Fault {
    Fault::transient(anyhow!("the server says nothing"))
}

fn fault(error: Error) -> Fault {
    match error {
        Error::Http(answer) => {
            let status = StatusCode::from_u16(answer.status().as_u16()).unwrap_or(StatusCode::BAD_GATEWAY);
            let wait = answer.headers().get(header::RETRY_AFTER).and_then(|wait| wait.to_str().ok());
            let words = answer.body().as_deref().unwrap_or_default();
            Fault::of_status(status, &String::from_utf8_lossy(words), wait)
        }
        Error::Url(_) | Error::HttpFormat(_) | Error::Tls(_) => Fault::Fatal(error.into()),
        Error::Capacity(_) => Fault::Fatal(error.into()),
        _ => Fault::transient(error),
    }
}
