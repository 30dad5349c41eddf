//! A WebSocket session: commands in, levels out. `spec/transport.md` says what each message means.

use std::sync::Arc;
use std::time::Duration;

use axum::extract::ws::{CloseFrame, Message, WebSocket, WebSocketUpgrade};
use axum::extract::{Path, Query, State};
use axum::response::Response;
use futures_util::stream::{SplitSink, SplitStream};
use futures_util::{SinkExt, StreamExt};
use tokio::sync::mpsc;
use tokio::time::timeout;

use super::Shared;
use super::failure::Failure;
use super::levels::Levels;
use super::outbox::{Outbox, Refusal};
use crate::protocol::{Command, Hello, SUBPROTOCOL};

/// Commands of one client that may wait to be carried out.
const WAITING: usize = 16;
/// Bytes for what arrives; commands are short.
const READ_BUFFER: usize = 4 << 10;
/// How long to wait for a client to hear why the session ends.
const FAREWELL: Duration = Duration::from_secs(1);

type Received = Result<Command, Refusal>;

/// `/ws/NAME.tct`.
pub async fn open(
    State(shared): State<Arc<Shared>>,
    Path(name): Path<String>,
    Query(query): Query<Vec<(String, String)>>,
    upgrade: WebSocketUpgrade,
) -> Result<Response, Failure> {
    let rendition = shared.catalogue.find(&name).await?;
    let levels = Levels::read(&rendition).await?;
    let first = query.into_iter().filter(|(key, _)| key == "command");
    let first: Vec<Received> = first.map(|(_, text)| text.parse().map_err(|_| Refusal::Usage)).collect();
    let largest = shared.sessions.max_message;
    let upgrade = upgrade.protocols([SUBPROTOCOL]).max_message_size(largest).max_frame_size(largest);
    // What is written goes out at once: the outbox decides how much there is of it.
    let upgrade = upgrade.read_buffer_size(READ_BUFFER).write_buffer_size(0);
    Ok(upgrade.on_upgrade(async move |socket| {
        let _open = shared.metrics.session();
        let hello = Hello {
            bytes: levels.bytes,
            header: levels.header.len() as u64,
            digest: rendition.digest.as_str().into(),
        };
        let outbox = Outbox::new(rendition, levels, shared.metrics.clone());
        Session { shared, hello, outbox }.hold(socket, first).await;
    }))
}

struct Session {
    shared: Arc<Shared>,
    hello: Hello,
    outbox: Outbox,
}

impl Session {
    async fn hold(mut self, socket: WebSocket, first: Vec<Received>) {
        let (mut sink, mut stream) = socket.split();
        let (commands, mut inbox) = mpsc::channel(WAITING);
        let ended = tokio::select! {
            // The client is gone: there is nobody to tell anything.
            () = listen(&mut stream, commands) => return,
            ended = self.talk(&mut sink, first, &mut inbox) => ended,
        };
        if let Err(End::Refused(refusal)) = ended {
            tracing::info!(code = refusal.code(), "session refused");
            let reason = Message::text(format!("ERROR {} {refusal}", refusal.code()));
            let close = CloseFrame { code: refusal.status(), reason: refusal.code().into() };
            let farewell = async {
                if sink.send(reason).await.is_ok() && sink.send(Message::Close(Some(close))).await.is_ok() {
                    while stream.next().await.is_some_and(|message| message.is_ok()) {}
                }
            };
            // Closing with unread messages could take the reason away from the client.
            let _ = timeout(FAREWELL, farewell).await;
        }
    }

    /// Sends what is asked for until there is a reason not to.
    async fn talk(
        &mut self,
        sink: &mut SplitSink<WebSocket, Message>,
        first: Vec<Received>,
        inbox: &mut mpsc::Receiver<Received>,
    ) -> Result<(), End> {
        sink.send(Message::text(self.hello.to_string())).await?;
        for data in self.outbox.header() {
            sink.send(Message::Binary(data.message())).await?;
        }
        for command in first {
            self.outbox.obey(command?)?;
        }
        loop {
            if self.shared.stop.is_cancelled() {
                return Err(Refusal::Stopping.into());
            }
            if let Ok(command) = inbox.try_recv() {
                self.outbox.obey(command?)?;
            } else if self.outbox.is_busy() {
                let data = self.outbox.next().await?;
                sink.send(Message::Binary(data.message())).await?;
            } else if let Some(position) = self.outbox.reached() {
                sink.send(Message::text(format!("DONE {position}"))).await?;
            } else {
                let command = tokio::select! {
                    command = timeout(self.shared.sessions.idle, inbox.recv()) => command,
                    () = self.shared.stop.cancelled() => return Err(Refusal::Stopping.into()),
                };
                match command.map_err(|_| Refusal::Idle)? {
                    Some(command) => self.outbox.obey(command?)?,
                    None => return Ok(()),
                }
            }
        }
    }
}

/// Passes commands on until the client leaves, no faster than they are carried out.
async fn listen(stream: &mut SplitStream<WebSocket>, commands: mpsc::Sender<Received>) {
    while let Some(message) = stream.next().await {
        let received = match message {
            Ok(Message::Text(text)) => text.parse().map_err(|_| Refusal::Usage),
            // An error is a broken rule of WebSocket, as a message that is too large, or a broken connection.
            Ok(Message::Binary(_)) | Err(_) => Err(Refusal::Usage),
            Ok(Message::Ping(_) | Message::Pong(_)) => continue,
            Ok(Message::Close(_)) => return,
        };
        let is_last = received.is_err();
        if commands.send(received).await.is_err() {
            return;
        }
        if is_last {
            // The session ends when it comes to this one.
            return commands.closed().await;
        }
    }
}

/// Why a session ends before the client ends it.
enum End {
    Refused(Refusal),
    /// Nothing can be sent any more.
    Broken,
}

impl From<Refusal> for End {
    fn from(refusal: Refusal) -> Self {
        End::Refused(refusal)
    }
}

impl From<axum::Error> for End {
    fn from(_: axum::Error) -> Self {
        End::Broken
    }
}
