//! Sessions on WebTransport: real sockets on loopback, and packets lost on purpose.

use std::sync::OnceLock;
use std::time::{Duration, Instant};

use crate::fetch::fetch;
use crate::plain::{Manner, Plain};
use crate::site::{Site, folder, patience, tct};
use serde_json::Value;
use tercet::shapes;
use tercet::transport::{FileId, MAX_DATAGRAM, Received, Receiver};
use tercet::{EncodeOptions, Limits, Scheme, encode, subdivide};
use tercet_cli::server::Patience;
use tercet_cli::server::webtransport::InjectedLoss;
use tokio::io::{AsyncReadExt, BufReader};
use tokio::time::timeout;
use wtransport::tls::Sha256Digest;
use wtransport::{ClientConfig, Connection, Endpoint, RecvStream, SendStream};

const LOSS: Option<InjectedLoss> = Some(InjectedLoss { rate: 0.1, seed: 1 });

/// A client that follows the document and nothing else.
struct Client {
    connection: Connection,
    out: SendStream,
    input: BufReader<RecvStream>,
}

impl Client {
    async fn new(site: &Site) -> Client {
        let connection = connect(site, None).await.unwrap();
        let (out, input) = connection.open_bi().await.unwrap().await.unwrap();
        Client { connection, out, input: BufReader::new(input) }
    }

    async fn say(&mut self, bytes: &[u8]) {
        // A server that has left does not listen.
        let _ = self.out.write_all(bytes).await;
    }

    async fn line(&mut self) -> String {
        let mut line = Vec::new();
        while line.last() != Some(&b'\n') {
            line.push(self.input.read_u8().await.expect("a line"));
        }
        String::from_utf8(line).unwrap().trim_end().into()
    }

    /// The code of the line that ends the session, and the session's end.
    async fn refused(&mut self) -> String {
        let line = timeout(Duration::from_secs(10), self.line()).await.expect("a reason");
        let code = line.strip_prefix("ERROR ").unwrap_or_else(|| panic!("{line}")).split(' ').next().unwrap();
        timeout(Duration::from_secs(10), self.connection.closed()).await.expect("the end");
        code.into()
    }

    /// Opens a file: its size, digest and identity, and its opening.
    async fn open(&mut self, path: &str) -> (u64, String, FileId, Vec<u8>) {
        self.say(format!("OPEN {path}\n").as_bytes()).await;
        let line = self.line().await;
        let words: Vec<&str> = line.split(' ').collect();
        assert_eq!((&words[..2], words.len()), (&["HELLO", "1"][..], 6), "{line}");
        let mut opening = vec![0; words[3].parse().unwrap()];
        self.input.read_exact(&mut opening).await.unwrap();
        (words[2].parse().unwrap(), words[4].into(), words[5].parse().unwrap(), opening)
    }
}

async fn offer(site: &Site) -> Value {
    serde_json::from_slice(&site.get("/webtransport.json").await.body).unwrap()
}

/// A connection; with `hash` only to a certificate of that digest.
async fn connect(site: &Site, hash: Option<[u8; 32]>) -> Result<Connection, String> {
    let offer = offer(site).await;
    let digits = offer["certificateHashes"][0].as_str().unwrap();
    let hash = hash.unwrap_or_else(|| digits.parse::<FileId>().unwrap().0);
    let config = ClientConfig::builder().with_bind_default();
    let config = config.with_server_certificate_hashes([Sha256Digest::new(hash)]).build();
    let url = format!("https://127.0.0.1:{}{}", offer["port"], offer["path"].as_str().unwrap());
    Endpoint::client(config).unwrap().connect(url).await.map_err(|error| error.to_string())
}

/// A file of several blocks of each code.
fn file() -> Vec<u8> {
    static FILE: OnceLock<Vec<u8>> = OnceLock::new();
    FILE.get_or_init(|| encode(&shapes::scan(60_000, 1), &Default::default()).unwrap().bytes).clone()
}

#[tokio::test]
async fn a_file_arrives_in_spite_of_losses() {
    let site = Site::lossy("wt-loss", patience(), LOSS).await;
    let file = file();
    site.write("a folder/scan.tct", &file);
    let folder = folder("wt-loss-out");
    let url = format!("http://{}/a%20folder/scan.tct", site.address);
    let run = fetch(&folder, &format!("{url} -o out.tct --protocol wt --json --retries 0")).await.good();
    assert!(std::fs::read(folder.join("out.tct")).unwrap() == file);
    let events = run.events();
    assert_eq!(events.last().unwrap()["complete"], true);
    assert!(events.len() > 5, "levels are announced as they come");
    // Only what is wanted is kept.
    let run = fetch(&folder, &format!("{url} -o coarse.ply --protocol wt --level 2 --json")).await.good();
    assert!(run.events().last().unwrap()["bytes"].as_u64().unwrap() < file.len() as u64 / 10);
}

#[tokio::test]
async fn levels_in_groups_are_shown_before_their_block_is_complete() {
    let site = Site::lossy("wt-groups", patience(), LOSS).await;
    let mesh = subdivide(&shapes::scan(200, 1), Scheme::Sqrt3, 5, &Limits::default()).unwrap();
    let options = EncodeOptions { bits: Some(14), groups: true, ..EncodeOptions::default() };
    let encoded = encode(&shapes::noisy(&mesh, 0.002, 1), &options).unwrap();
    site.write("rough.tct", &encoded.bytes);
    let folder = folder("wt-groups-out");
    let url = format!("http://{}/rough.tct", site.address);
    let run = fetch(&folder, &format!("{url} -o out.tct --protocol wt --json --retries 0")).await.good();
    assert!(std::fs::read(folder.join("out.tct")).unwrap() == encoded.bytes);
    let events = run.events();
    let previews: Vec<&Value> = events.iter().filter(|event| event["event"] == "preview").collect();
    assert!(!previews.is_empty());
    for preview in previews {
        let level = &encoded.info.levels[preview["level"].as_u64().unwrap() as usize];
        assert!(level.grouped);
        assert_eq!(preview["vertices"], level.vertices);
        assert!(preview["pending"].as_u64().unwrap() < u64::from(level.vertices));
    }
    // What is not wanted is not shown.
    let grouped = encoded.info.levels.iter().position(|level| level.grouped).unwrap();
    let goal = format!("--level {}", grouped - 1);
    let run = fetch(&folder, &format!("{url} -o coarse.ply --protocol wt {goal} --json")).await.good();
    assert!(run.events().iter().all(|event| event["event"] != "preview"));
}

#[tokio::test]
async fn a_client_that_follows_the_document_gets_the_file() {
    let site = Site::lossy("wt-document", patience(), LOSS).await;
    let file = file();
    site.write("scan.tct", &file);
    let mut client = Client::new(&site).await;
    let (bytes, digest, id, opening) = client.open("scan.tct").await;
    assert_eq!(bytes, file.len() as u64);
    let etag = site.get("/scan.tct").await.field("etag").to_string();
    assert_eq!(etag, format!("\"{digest}\""));
    let mut receiver = Receiver::new(id, Limits::default());
    assert_eq!(receiver.open(&opening), Received::Completed);
    let mut reports = tokio::time::interval(Duration::from_millis(20));
    while !receiver.is_complete() {
        tokio::select! {
            datagram = client.connection.receive_datagram() => {
                let datagram = datagram.unwrap().payload();
                assert!(datagram.len() <= MAX_DATAGRAM);
                receiver.push(&datagram);
            }
            _ = reports.tick() => drop(client.connection.send_datagram(receiver.report().write())),
        }
    }
    let received: Vec<u8> = std::iter::from_fn(|| receiver.take()).flatten().collect();
    assert!(received == file);
    // The last report ends the session; one that follows another at once may be passed over.
    let end = async {
        loop {
            tokio::select! {
                _ = client.connection.closed() => break,
                _ = reports.tick() => drop(client.connection.send_datagram(receiver.report().write())),
            }
        }
    };
    timeout(Duration::from_secs(5), end).await.expect("the end");
}

#[tokio::test]
async fn the_offer_names_the_certificate_and_no_other_is_accepted() {
    let site = Site::lossy("wt-offer", patience(), None).await;
    let offer = offer(&site).await;
    assert_eq!((&offer["version"], &offer["path"]), (&1.into(), &"/wt".into()));
    let list: Value = serde_json::from_slice(&site.get("/index.json").await.body).unwrap();
    assert_eq!(list["webtransport"], offer);
    assert!(connect(&site, Some([7; 32])).await.is_err());
    assert!(connect(&site, None).await.is_ok());

    let without = Site::new("wt-none").await;
    assert_eq!(without.get("/webtransport.json").await.status, 404);
    let list: Value = serde_json::from_slice(&without.get("/index.json").await.body).unwrap();
    assert_eq!(list.get("webtransport"), None);
}

#[tokio::test]
async fn what_cannot_be_sent_is_refused_with_a_reason() {
    let site = Site::lossy("wt-refused", patience(), None).await;
    site.write("scan.tct", tct(&shapes::torus(8, 6)));
    site.write("bad.obj", "f 1 2 3\n");
    site.write("cut.tct", &tct(&shapes::torus(8, 6))[..40]);
    let other = "0".repeat(64);
    for (words, code) in [
        ("OPEN none.tct", "missing"),
        ("OPEN ../secret.tct", "missing"),
        ("OPEN %2e%2e/secret.tct", "missing"),
        ("OPEN bad.obj.tct", "mesh"),
        ("OPEN cut.tct", "mesh"),
        (&format!("OPEN scan.tct {other}"), "replaced"),
        ("NEXT", "usage"),
        ("OPEN a b c", "usage"),
        ("", "usage"),
    ] {
        let mut client = Client::new(&site).await;
        client.say(format!("{words}\n").as_bytes()).await;
        assert_eq!(client.refused().await, code, "{words}");
    }
    let mut client = Client::new(&site).await;
    client.say(&[b'a'; 100_000]).await;
    assert_eq!(client.refused().await, "usage", "a line without end");
}

#[tokio::test]
async fn silent_clients_are_let_go() {
    let short = Duration::from_millis(500);
    let patience = Patience { connections: 2, header: short, stall: short, ..patience() };
    let site = Site::lossy("wt-silent", patience, None).await;
    site.write("scan.tct", file());
    // One names no file, one never reports.
    let mut nameless = Client::new(&site).await;
    nameless.say(b"OP").await;
    let mut mute = Client::new(&site).await;
    mute.open("scan.tct").await;
    assert!(connect(&site, None).await.is_err(), "there are two places");
    assert_eq!(nameless.refused().await, "usage");
    assert_eq!(mute.refused().await, "idle");
    // Their places are free again, also that of one that vanishes without a word.
    let start = Instant::now();
    while connect(&site, None).await.is_err() {
        assert!(start.elapsed() < Duration::from_secs(10));
        tokio::time::sleep(short / 5).await;
    }
}

#[tokio::test]
async fn a_client_that_denies_everything_is_given_up() {
    let site = Site::lossy("wt-futile", patience(), None).await;
    site.write("scan.tct", file());
    let mut client = Client::new(&site).await;
    let (_, _, id, _) = client.open("scan.tct").await;
    let nothing = Receiver::new(id, Limits::default()).report().write();
    let connection = client.connection.clone();
    tokio::spawn(async move {
        while connection.send_datagram(&nothing).is_ok() {
            tokio::time::sleep(Duration::from_millis(20)).await;
        }
    });
    assert_eq!(client.refused().await, "futile");
}

#[tokio::test]
async fn garbage_in_datagrams_is_harmless() {
    let site = Site::lossy("wt-garbage", patience(), LOSS).await;
    let file = file();
    site.write("scan.tct", &file);
    let mut client = Client::new(&site).await;
    let (_, _, id, opening) = client.open("scan.tct").await;
    let mut receiver = Receiver::new(id, Limits::default());
    receiver.open(&opening);
    let mut turn = 0u8;
    while !receiver.is_complete() {
        let datagram = client.connection.receive_datagram().await.unwrap().payload();
        receiver.push(&datagram);
        turn = turn.wrapping_add(1);
        let mut report = receiver.report().write();
        match turn % 8 {
            0 => {}
            1 => report.truncate(usize::from(turn) / 4),
            2 => report = datagram.to_vec(),
            _ => report[usize::from(turn) % 17] ^= turn,
        }
        // What finds no room is not missed.
        let _ = client.connection.send_datagram(report);
    }
    let received: Vec<u8> = std::iter::from_fn(|| receiver.take()).flatten().collect();
    assert!(received == file);
}

#[tokio::test]
async fn sessions_end_with_the_server() {
    let site = Site::lossy("wt-stop", patience(), None).await;
    site.write("scan.tct", file());
    let mut client = Client::new(&site).await;
    client.open("scan.tct").await;
    site.stop();
    assert_eq!(client.refused().await, "stopping");
}

/// `auto` takes what there is: the way that was taken shows in what the server counts.
#[tokio::test]
async fn auto_takes_the_best_that_is_offered() {
    let file = file();
    let folder = folder("wt-auto-out");
    let (lossy, ws) = (Site::lossy("wt-auto", patience(), LOSS).await, Site::new("wt-auto-ws").await);
    for (site, ws_sessions) in [(&lossy, 0), (&ws, 1)] {
        site.write("scan.tct", &file);
        let url = format!("http://{}/scan.tct", site.address);
        fetch(&folder, &format!("{url} -o out.tct --protocol auto")).await.good();
        assert!(std::fs::read(folder.join("out.tct")).unwrap() == file);
        let metrics = site.get("/metrics").await;
        let upgraded = metrics.text().lines().filter(|line| line.contains("/ws/") && line.contains("101"));
        assert_eq!(upgraded.count(), ws_sessions);
        assert!(!metrics.text().lines().any(|line| line.contains("route=\"/{*name}\"")));
    }
    let plain = Plain::new(file.clone(), vec![Manner { ranges: true, ..Manner::default() }]).await;
    fetch(&folder, &format!("{} -o out.tct --protocol auto", plain.url())).await.good();
    assert!(std::fs::read(folder.join("out.tct")).unwrap() == file);
    // Asked for by name, it is that or nothing.
    let run = fetch(&folder, &format!("http://{}/scan.tct -o x.tct --protocol wt", ws.address)).await;
    assert_eq!(run.status, 1);
    assert!(run.err.contains("offers no WebTransport"), "{}", run.err);
}
