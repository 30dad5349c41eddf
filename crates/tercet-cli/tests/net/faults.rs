//! Clients that mean harm or vanish, and files that change.

use std::time::{Duration, Instant};

use crate::site::{Site, patience, tct};
use tercet::shapes;
use tercet_cli::server::Patience;
use tokio::io::{AsyncReadExt, AsyncWriteExt};
use tokio::net::TcpStream;

#[tokio::test]
async fn no_path_leads_out_of_the_folder() {
    let site = Site::new("traversal").await;
    let secret = tct(&shapes::torus(8, 6));
    std::fs::write(site.path("../secret.tct"), &secret).unwrap();
    site.write("inner/open.tct", &secret);
    for target in [
        "/../secret.tct",
        "/inner/../../secret.tct",
        "/%2e%2e/secret.tct",
        "/%2e%2e%2fsecret.tct",
        "/..%2fsecret.tct",
        "/inner/..%5c..%5csecret.tct",
        "/inner%2f..%2f..%2fsecret.tct",
        "/%252e%252e/secret.tct",
        "//secret.tct",
        "/inner//open.tct",
        "/./inner/open.tct",
        "/inner/open.tct%00",
        "/%00",
        "/..",
        "/../",
        "/..%2f",
        "/..%2findex.json",
        "/thumbnail/..%2fsecret.tct",
        "/thumbnail/../../secret.tct",
        "/d/0000/..%2fsecret.tct",
    ] {
        let answer = site.get(target).await;
        assert!(matches!(answer.status, 400 | 404), "{target}: {}", answer.status);
        assert!(!answer.body.windows(8).any(|bytes| bytes == &secret[..8]), "{target}");
    }
    assert_eq!(site.get("/%ff%fe.tct").await.status, 400);
    assert_eq!(site.get("/inner%2fopen.tct").await.status, 200);
}

#[tokio::test]
async fn what_is_not_http_is_refused() {
    let site = Site::new("garbage").await;
    for request in [
        b"\x16\x03\x01\x02\x00\x01\x00".to_vec(),
        b"GET /\r\n\r\n".to_vec(),
        [b"GET /".to_vec(), vec![b'a'; 200_000], b" HTTP/1.1\r\nHost: a\r\n\r\n".to_vec()].concat(),
        format!("GET / HTTP/1.1\r\n{}\r\n", "A: b\r\n".repeat(1000)).into_bytes(),
    ] {
        let mut stream = TcpStream::connect(site.address).await.unwrap();
        // The server may close before it has read everything.
        let _ = stream.write_all(&request).await;
        let mut answer = Vec::new();
        let _ = stream.read_to_end(&mut answer).await;
        assert!(
            answer.is_empty() || answer.starts_with(b"HTTP/1.1 4"),
            "{:?}",
            String::from_utf8_lossy(&answer)
        );
    }
    assert_eq!(site.get("/healthz").await.status, 200);
}

#[tokio::test]
async fn a_client_that_is_silent_or_takes_nothing_loses_its_place() {
    let short = Duration::from_millis(300);
    let site =
        Site::patient("silent", Patience { connections: 2, header: short, stall: short, ..patience() }).await;
    site.write("large.tct", vec![0; 30 << 20]);
    let mut silent = TcpStream::connect(site.address).await.unwrap();
    let mut stalled = TcpStream::connect(site.address).await.unwrap();
    stalled.write_all(b"GET /large.tct HTTP/1.1\r\nHost: a\r\n\r\n").await.unwrap();
    // Both places are taken: this one waits for one of them.
    let start = Instant::now();
    assert_eq!(site.get("/healthz").await.status, 200);
    assert!(start.elapsed() > short / 2, "{:?}", start.elapsed());
    assert_eq!(silent.read(&mut [0; 100]).await.unwrap(), 0);
    tokio::time::sleep(3 * short).await;
    let mut bytes = Vec::new();
    let _ = stalled.read_to_end(&mut bytes).await;
    assert!(bytes.len() < 30 << 20);
}

#[tokio::test]
async fn a_file_that_is_replaced_is_sent_as_one_or_the_other() {
    let site = Site::new("replaced").await;
    let files = [tct(&shapes::scan(3000, 1)), tct(&shapes::scan(3000, 2))];
    site.write("scan.tct", &files[0]);
    for round in 0..20 {
        let next = site.path("next");
        std::fs::write(&next, &files[round % 2]).unwrap();
        let replace = async {
            tokio::task::yield_now().await;
            std::fs::rename(&next, site.path("scan.tct")).unwrap();
        };
        let (answer, ()) = tokio::join!(site.get("/scan.tct"), replace);
        assert!(answer.status == 200 && files.contains(&answer.body), "round {round}: {}", answer.status);
    }
    // Shortened in its place while it is sent: the answer ends early, and says how long it should be.
    site.write("large.tct", vec![1; 30 << 20]);
    let mut stream = TcpStream::connect(site.address).await.unwrap();
    stream.write_all(b"GET /large.tct HTTP/1.1\r\nHost: a\r\nConnection: close\r\n\r\n").await.unwrap();
    stream.read_exact(&mut [0; 1000]).await.unwrap();
    site.write("large.tct", "short");
    let mut rest = Vec::new();
    let _ = stream.read_to_end(&mut rest).await;
    assert!(rest.len() < 30 << 20);
}

#[tokio::test]
async fn clients_that_vanish_leave_nothing_behind() {
    let site = Site::new("vanish").await;
    site.write("large.tct", vec![0; 30 << 20]);
    for _ in 0..50 {
        let mut stream = TcpStream::connect(site.address).await.unwrap();
        stream.write_all(b"GET /large.tct HTTP/1.1\r\nHost: a\r\n\r\n").await.unwrap();
        stream.read_exact(&mut [0; 1000]).await.unwrap();
    }
    let gone = async {
        while !site.get("/metrics").await.text().contains("tercet_connections 1\n") {
            tokio::time::sleep(Duration::from_millis(20)).await;
        }
    };
    tokio::time::timeout(Duration::from_secs(5), gone).await.expect("all connections are closed");
}
