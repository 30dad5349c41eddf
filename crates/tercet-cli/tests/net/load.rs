//! Very many clients at once: `cargo xtask load`.

use std::io::{BufRead, BufReader};
use std::net::SocketAddr;
use std::process::{Child, Command, Stdio};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering::Relaxed};
use std::time::{Duration, Instant};

use crate::site::{folder, tct};
use futures_util::{SinkExt, StreamExt};
use tercet::{Decoder, Limits, shapes};
use tokio::io::{AsyncReadExt, AsyncWriteExt};
use tokio::net::{TcpSocket, TcpStream};
use tokio_tungstenite::client_async;
use tokio_tungstenite::tungstenite::Message;

/// Clients that take some kilobytes a second; half of them by each protocol.
const SLOW: usize = 1000;
/// Levels that fast clients ask for, one after another.
const FAST: usize = 400;
/// What a slow client takes at a time, and how often.
const SIP: (usize, Duration) = (1 << 10, Duration::from_millis(200));

/// The server as a process of its own, so that its memory is its own.
struct Server(Child);

impl Drop for Server {
    fn drop(&mut self) {
        let _ = self.0.kill();
        let _ = self.0.wait();
    }
}

impl Server {
    fn start(folder: &std::path::Path) -> (Server, SocketAddr) {
        let mut command = Command::new(env!("CARGO_BIN_EXE_tercet"));
        command.args(["serve", "site", "--addr", "127.0.0.1:0", "--cache", "cache", "--quiet"]);
        command.args(["--max-connections", "2000"]).current_dir(folder).stdout(Stdio::piped());
        let mut child = command.spawn().unwrap();
        let mut line = String::new();
        BufReader::new(child.stdout.take().unwrap()).read_line(&mut line).unwrap();
        let address = line.trim().trim_start_matches("http://").trim_end_matches('/').parse().unwrap();
        (Server(child), address)
    }

    /// The most memory that the process has held, in megabytes; `None` where the system does not tell.
    fn memory(&self) -> Option<u64> {
        let status = std::fs::read_to_string(format!("/proc/{}/status", self.0.id())).ok()?;
        let line = status.lines().find_map(|line| line.strip_prefix("VmHWM:"))?;
        Some(line.trim().trim_end_matches(" kB").parse::<u64>().ok()? / 1024)
    }
}

/// A connection with a small window, so that a slow reader is felt by the server.
async fn connect(address: SocketAddr) -> std::io::Result<TcpStream> {
    let socket = TcpSocket::new_v4()?;
    socket.set_recv_buffer_size(8 << 10)?;
    socket.connect(address).await
}

/// Takes a large file by sips until it is told to stop; false if the server let it down.
async fn sip_http(
    address: SocketAddr,
    stop: Arc<AtomicBool>,
    ready: Arc<AtomicUsize>,
) -> std::io::Result<()> {
    let mut stream = connect(address).await?;
    stream.write_all(b"GET /large.tct HTTP/1.1\r\nHost: a\r\n\r\n").await?;
    let mut sip = vec![0; SIP.0];
    stream.read_exact(&mut sip).await?;
    assert!(sip.starts_with(b"HTTP/1.1 200 OK\r\n"));
    ready.fetch_add(1, Relaxed);
    while !stop.load(Relaxed) {
        tokio::time::sleep(SIP.1).await;
        stream.read_exact(&mut sip).await?;
    }
    Ok(())
}

async fn sip_ws(address: SocketAddr, stop: Arc<AtomicBool>, ready: Arc<AtomicUsize>) -> std::io::Result<()> {
    let stream = connect(address).await?;
    let target = format!("ws://{address}/ws/large.tct?command=UNTIL%200");
    let (mut socket, _) = client_async(target, stream).await.map_err(std::io::Error::other)?;
    ready.fetch_add(1, Relaxed);
    while !stop.load(Relaxed) {
        tokio::time::sleep(16 * SIP.1).await;
        match socket.next().await {
            Some(Ok(Message::Binary(_) | Message::Text(_))) => {}
            other => return Err(std::io::Error::other(format!("{other:?}"))),
        }
    }
    Ok(())
}

/// How long a level takes from the command to its last byte, in an open session.
async fn fast_levels(address: SocketAddr, rounds: usize) -> Vec<Duration> {
    let stream = TcpStream::connect(address).await.unwrap();
    stream.set_nodelay(true).unwrap();
    let (mut socket, _) = client_async(format!("ws://{address}/ws/scan.tct"), stream).await.unwrap();
    let mut times = Vec::new();
    for _ in 0..rounds {
        let start = Instant::now();
        for command in ["FROM 0", "LEVEL 5"] {
            socket.send(Message::text(command)).await.unwrap();
        }
        loop {
            match socket.next().await.unwrap().unwrap() {
                Message::Text(text) if text.starts_with("DONE") => break,
                _ => {}
            }
        }
        times.push(start.elapsed());
        tokio::time::sleep(Duration::from_millis(5)).await;
    }
    times
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
#[ignore = "takes a minute: cargo xtask load"]
async fn load_of_a_thousand_slow_clients() {
    let folder = folder("load");
    let file = tct(&shapes::scan(20_000, 1));
    let mut decoder = Decoder::new(Limits::default());
    decoder.push(&file);
    let level = decoder.info().unwrap().levels[5].bytes;
    std::fs::write(folder.join("site/scan.tct"), &file).unwrap();
    let mut large = file;
    large.resize(64 << 20, 1);
    std::fs::write(folder.join("site/large.tct"), large).unwrap();
    let (server, address) = Server::start(&folder);

    let (stop, ready) = (Arc::new(AtomicBool::new(false)), Arc::new(AtomicUsize::new(0)));
    let start = Instant::now();
    let slow: Vec<_> = (0..SLOW)
        .map(|i| {
            let (stop, ready) = (stop.clone(), ready.clone());
            tokio::spawn(async move {
                match i % 2 {
                    0 => sip_http(address, stop, ready).await,
                    _ => sip_ws(address, stop, ready).await,
                }
            })
        })
        .collect();
    while ready.load(Relaxed) < SLOW && start.elapsed() < Duration::from_secs(60) {
        tokio::time::sleep(Duration::from_millis(50)).await;
    }
    println!("{} of {SLOW} slow clients connected after {:?}", ready.load(Relaxed), start.elapsed());
    // Four fast clients side by side.
    let (a, b, c, d) = tokio::join!(
        fast_levels(address, FAST / 4),
        fast_levels(address, FAST / 4),
        fast_levels(address, FAST / 4),
        fast_levels(address, FAST / 4)
    );
    let mut times = [a, b, c, d].concat();
    times.sort();
    stop.store(true, Relaxed);
    let mut errors = Vec::new();
    for client in slow {
        errors.extend(client.await.unwrap().err());
    }
    let at = |percent: usize| times[(times.len() - 1) * percent / 100];
    println!(
        "a fast client's level of {level} bytes: median {:?}, 99 % {:?}, most {:?}",
        at(50),
        at(99),
        at(100)
    );
    println!("memory of the server at most: {:?} MB; errors: {}", server.memory(), errors.len());
    assert!(errors.is_empty(), "{:?}", errors.first());
    assert!(at(50) < Duration::from_millis(50));
    assert!(server.memory().is_none_or(|megabytes| megabytes < 500));
}
