//! The command protocol.

use std::time::Duration;

use crate::site::{Answer, Site, patience, ply, tct};
use futures_util::{SinkExt, StreamExt};
use serde_json::Value;
use tercet::{Decoder, Info, Limits, shapes};
use tokio::io::AsyncWriteExt;
use tokio::net::TcpStream;
use tokio_tungstenite::tungstenite::Message;
use tokio_tungstenite::{MaybeTlsStream, WebSocketStream, connect_async};

/// A client that follows the document and nothing else.
struct Client {
    socket: WebSocketStream<MaybeTlsStream<TcpStream>>,
    digest: String,
    total: u64,
    /// The file from `start` on.
    bytes: Vec<u8>,
    start: usize,
}

impl Client {
    async fn new(site: &Site, target: &str) -> Client {
        let (socket, _) = connect_async(format!("ws://{}{target}", site.address)).await.unwrap();
        let mut client = Client { socket, digest: String::new(), total: 0, bytes: Vec::new(), start: 0 };
        let hello = client.text().await;
        let words: Vec<&str> = hello.split(' ').collect();
        assert_eq!(words[..2], ["HELLO", "1"]);
        client.total = words[2].parse().unwrap();
        client.digest = words[4].to_string();
        let header: usize = words[3].parse().unwrap();
        while client.bytes.len() < header {
            client.data().await;
        }
        client
    }

    async fn say(&mut self, command: &str) {
        self.socket.send(Message::text(command)).await.unwrap();
    }

    async fn message(&mut self) -> Message {
        let next = tokio::time::timeout(Duration::from_secs(10), self.socket.next());
        next.await.expect("a message").expect("an open session").unwrap()
    }

    async fn text(&mut self) -> String {
        self.message().await.into_text().unwrap().to_string()
    }

    async fn data(&mut self) {
        let message = self.message().await;
        self.take(&message.into_data());
    }

    fn take(&mut self, message: &[u8]) {
        let (head, bytes) = message.split_at(12);
        let offset = u64::from_le_bytes(head[..8].try_into().unwrap());
        assert_eq!(offset as usize, self.start + self.bytes.len());
        assert_eq!(u32::from_le_bytes(head[8..].try_into().unwrap()), crc32fast::hash(bytes));
        assert!((1..=16_384).contains(&bytes.len()));
        self.bytes.extend_from_slice(bytes);
    }

    /// Takes data until the goal is reached, which is there.
    async fn until_done(&mut self) -> u64 {
        loop {
            match self.message().await {
                Message::Binary(data) => self.take(&data),
                Message::Text(text) => return text.strip_prefix("DONE ").expect(&text).parse().unwrap(),
                other => panic!("{other:?}"),
            }
        }
    }

    /// The last words, and the status of the close behind them.
    async fn refused(&mut self) -> (String, u16) {
        loop {
            match self.message().await {
                Message::Text(text) => {
                    let words: Vec<&str> = text.splitn(3, ' ').collect();
                    assert_eq!(words[0], "ERROR");
                    let code = words[1].to_string();
                    let Message::Close(Some(close)) = self.message().await else { panic!("no close") };
                    return (code, close.code.into());
                }
                Message::Binary(_) => {}
                other => panic!("{other:?}"),
            }
        }
    }
}

async fn site(test: &str) -> (Site, Vec<u8>, Info) {
    let site = Site::new(test).await;
    let file = tct(&shapes::scan(5000, 1));
    site.write("scan.tct", &file);
    let mut decoder = Decoder::new(Limits::default());
    decoder.push(&file);
    (site, file, decoder.info().unwrap())
}

#[tokio::test]
async fn levels_come_as_they_are_asked_for() {
    let (site, file, info) = site("ws-levels").await;
    let ends: Vec<u64> = info.levels.iter().map(|level| level.bytes).collect();
    let mut client = Client::new(&site, "/ws/scan.tct").await;
    assert_eq!((client.total, client.bytes.len() as u64), (file.len() as u64, info.header_bytes));
    client.say("NEXT").await;
    assert_eq!(client.until_done().await, ends[0]);
    client.say("NEXT").await;
    assert_eq!(client.until_done().await, ends[1]);
    client.say("LEVEL 3").await;
    assert_eq!(client.until_done().await, ends[3]);
    // What is there is not sent again.
    client.say("LEVEL 2").await;
    assert_eq!(client.until_done().await, ends[3]);
    client.say(&format!("UNTIL {}", info.levels[4].error)).await;
    assert_eq!(client.until_done().await, ends[4]);
    client.say("UNTIL 0").await;
    assert_eq!(client.until_done().await, client.total);
    assert!(client.bytes == file);
    client.say("NEXT").await;
    assert_eq!(client.until_done().await, client.total);
}

#[tokio::test]
async fn commands_in_the_address_save_a_round_trip() {
    let (site, file, info) = site("ws-address").await;
    let mut client = Client::new(&site, "/ws/scan.tct?command=NEXT&command=NEXT&other=1&command=NEXT").await;
    assert_eq!(client.until_done().await, info.levels[2].bytes);
    let (digest, from) = (client.digest, client.bytes.len());
    // The connection breaks, the client goes on.
    let target = format!("/ws/scan.tct?command=FROM%20{from}%20{digest}&command=UNTIL%200");
    let mut client = Client::new(&site, &target).await;
    (client.start, client.bytes) = (from, Vec::new());
    assert_eq!(client.until_done().await, file.len() as u64);
    assert!(client.bytes == file[from..]);
    // With another digest, or when the file has changed, it may not.
    let target = format!("/ws/scan.tct?command=FROM%20{from}%20{}", "0".repeat(64));
    assert_eq!(Client::new(&site, &target).await.refused().await, ("replaced".into(), 1008));
}

#[tokio::test]
async fn a_mesh_of_another_format_is_encoded_for_the_session() {
    let site = Site::new("ws-encode").await;
    site.write("ico.ply", ply(&shapes::icosahedron()));
    let mut client = Client::new(&site, "/ws/ico.ply.tct?command=UNTIL%200").await;
    client.until_done().await;
    assert_eq!(tercet::decode(&client.bytes, &Limits::default()).unwrap().faces.len(), 20);
    assert!(connect_async(format!("ws://{}/ws/none.tct", site.address)).await.is_err());
}

#[tokio::test]
async fn a_pause_holds_back_a_large_file_and_cancel_drops_the_rest() {
    let (site, file, _) = site("ws-pause").await;
    let large = large_file(&file);
    site.write("large.tct", &large);
    let mut client = Client::new(&site, "/ws/large.tct?command=UNTIL%200").await;
    client.data().await;
    client.say("PAUSE").await;
    // What was under way comes, and then nothing.
    while let Ok(Some(Ok(Message::Binary(data)))) =
        tokio::time::timeout(Duration::from_millis(300), client.socket.next()).await
    {
        client.take(&data);
    }
    assert!(client.bytes.len() < 25 << 20, "{}", client.bytes.len());
    client.say("RESUME").await;
    client.data().await;
    client.say("CANCEL").await;
    let reached = client.until_done().await;
    assert!(reached < client.total && reached == client.bytes.len() as u64);
    client.say(&format!("FROM {}", client.total - 3)).await;
    client.say("UNTIL 0").await;
    client.start = client.total as usize - 3;
    client.bytes.clear();
    assert_eq!(client.until_done().await, client.total);
    assert!(client.bytes == large[large.len() - 3..]);
}

/// The file with many more bytes behind it; a session sends what is there.
fn large_file(file: &[u8]) -> Vec<u8> {
    let mut large = file.to_vec();
    large.resize(30 << 20, 7);
    large
}

#[tokio::test]
async fn what_is_no_command_ends_the_session_with_a_reason() {
    let (site, _, _) = site("ws-usage").await;
    for (message, code) in [
        (Message::text("QUIT"), "usage"),
        (Message::text(""), "usage"),
        (Message::text("NEXT ".repeat(500)), "usage"),
        (Message::binary(vec![1, 2, 3]), "usage"),
        (Message::text("LEVEL 99"), "range"),
        (Message::text("FROM 99999999"), "range"),
        (Message::text(format!("FROM 0 {}", "f".repeat(64))), "replaced"),
    ] {
        let mut client = Client::new(&site, "/ws/scan.tct").await;
        client.socket.send(message.clone()).await.unwrap();
        assert_eq!(client.refused().await, (code.into(), 1008), "{message:?}");
    }
    let mut client = Client::new(&site, "/ws/scan.tct?command=NONSENSE").await;
    assert_eq!(client.refused().await.0, "usage");
}

#[tokio::test]
async fn oversized_and_broken_frames_close_the_connection() {
    let (site, _, _) = site("ws-frames").await;
    let handshake = "GET /ws/scan.tct HTTP/1.1\r\nHost: a\r\nConnection: Upgrade\r\nUpgrade: websocket\r\n\
                     Sec-WebSocket-Version: 13\r\nSec-WebSocket-Key: AAAAAAAAAAAAAAAAAAAAAA==\r\n\r\n";
    let huge = [&[0x81, 0xFF][..], &u64::MAX.to_be_bytes(), &[0; 4]].concat();
    let large = [&[0x81, 0xFE, 0xFF, 0xFF, 0, 0, 0, 0][..], &[b'A'; 0xFFFF]].concat();
    let unmasked = b"\x81\x04NEXT".to_vec();
    let reserved = b"\xF1\x84\0\0\0\0NEXT".to_vec();
    let not_text = b"\x81\x82\0\0\0\0\xFF\xFE".to_vec();
    let noise: Vec<u8> = (0..4096u32).map(|i| (i.wrapping_mul(2_654_435_761) >> 24) as u8).collect();
    for frame in [huge, large, unmasked, reserved, not_text, noise] {
        let request = [handshake.as_bytes(), &frame].concat();
        let answer = tokio::time::timeout(Duration::from_secs(10), site.raw(&request));
        let answer: Answer = answer.await.expect("the server closes");
        assert_eq!(answer.status, 101);
    }
    assert_eq!(site.get("/healthz").await.status, 200);
}

#[tokio::test]
async fn a_file_that_is_replaced_during_a_session_is_noticed() {
    let (site, file, info) = site("ws-replaced").await;
    let mut client = Client::new(&site, "/ws/scan.tct?command=NEXT").await;
    client.until_done().await;
    site.write("next", tct(&shapes::scan(3000, 9)));
    std::fs::rename(site.path("next"), site.path("scan.tct")).unwrap();
    client.say("UNTIL 0").await;
    assert_eq!(client.refused().await, ("replaced".into(), 1008));
    assert!(client.bytes == file[..info.levels[0].bytes as usize]);
}

#[tokio::test]
async fn sessions_end_when_idle_and_when_the_server_stops() {
    let (site, _, _) = site("ws-end").await;
    let mut idle = Client::new(&site, "/ws/scan.tct").await;
    assert_eq!(idle.refused().await, ("idle".into(), 1001));
    let mut client = Client::new(&site, "/ws/scan.tct").await;
    site.stop();
    assert_eq!(client.refused().await, ("stopping".into(), 1001));
}

#[tokio::test]
async fn clients_that_vanish_within_a_level_leave_nothing_behind() {
    let (site, file, _) = site("ws-vanish").await;
    site.write("large.tct", large_file(&file));
    for i in 0..30 {
        let mut client = Client::new(&site, "/ws/large.tct?command=UNTIL%200").await;
        client.data().await;
        if i % 2 == 0 {
            client.socket.get_mut().shutdown().await.unwrap();
        }
    }
    let gone = async {
        while !site.get("/metrics").await.text().contains("tercet_sessions 0\n") {
            tokio::time::sleep(Duration::from_millis(20)).await;
        }
    };
    tokio::time::timeout(patience().stall, gone).await.expect("all sessions have ended");
    let list: Value = serde_json::from_str(site.get("/index.json").await.text()).unwrap();
    assert_eq!(list["files"].as_array().unwrap().len(), 2);
}
