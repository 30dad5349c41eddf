//! A server of files that knows nothing of Tercet, and does as it is told.

use std::net::SocketAddr;
use std::sync::{Arc, Mutex};

use tokio::io::{AsyncReadExt, AsyncWriteExt};
use tokio::net::{TcpListener, TcpStream};

/// How an answer is given.
#[derive(Clone, Debug, Default)]
pub struct Manner {
    pub ranges: bool,
    pub tag: Option<&'static str>,
    /// Close the connection after this many bytes of the body.
    pub cut: Option<usize>,
    /// Change this byte of the file.
    pub damage: Option<usize>,
    /// Answer with this status and no file.
    pub status: Option<&'static str>,
}

/// A server of one file.
pub struct Plain {
    pub address: SocketAddr,
    /// The `Range` and `If-Range` fields of the requests so far.
    asked: Arc<Mutex<Vec<[Option<String>; 2]>>>,
}

impl Plain {
    /// Answers the first request in the first manner and so on; the last one stays.
    pub async fn new(file: Vec<u8>, manners: Vec<Manner>) -> Plain {
        let listener = TcpListener::bind("127.0.0.1:0").await.unwrap();
        let (address, asked) = (listener.local_addr().unwrap(), Arc::<Mutex<Vec<_>>>::default());
        let log = asked.clone();
        tokio::spawn(async move {
            while let Ok((stream, _)) = listener.accept().await {
                let turn = log.lock().unwrap().len().min(manners.len() - 1);
                answer(stream, &file, &manners[turn], &log).await;
            }
        });
        Plain { address, asked }
    }

    pub fn url(&self) -> String {
        format!("http://{}/some/scan.tct", self.address)
    }

    pub fn asked(&self) -> Vec<[Option<String>; 2]> {
        self.asked.lock().unwrap().clone()
    }
}

async fn answer(mut stream: TcpStream, file: &[u8], manner: &Manner, log: &Mutex<Vec<[Option<String>; 2]>>) {
    let mut head = Vec::new();
    while !head.ends_with(b"\r\n\r\n") {
        let Ok(byte) = stream.read_u8().await else { return };
        head.push(byte);
    }
    let head = String::from_utf8(head).unwrap();
    let field = |name: &str| {
        let mut fields = head.lines().filter_map(|line| line.split_once(": "));
        fields.find(|(it, _)| it.eq_ignore_ascii_case(name)).map(|(_, value)| value.to_string())
    };
    let (range, condition) = (field("range"), field("if-range"));
    log.lock().unwrap().push([range.clone(), condition.clone()]);
    let mut body = file.to_vec();
    if let Some(at) = manner.damage {
        body[at] ^= 1;
    }
    let same = condition.is_none_or(|tag| manner.tag == Some(&tag));
    let range = range.filter(|_| manner.ranges && same && manner.status.is_none());
    let mut fields = manner.tag.map(|tag| format!("ETag: {tag}\r\n")).unwrap_or_default();
    let mut status = manner.status.unwrap_or("200 OK");
    if let Some(range) = range {
        let (first, last) = range.strip_prefix("bytes=").unwrap().split_once('-').unwrap();
        let first: usize = first.parse().unwrap();
        let last = last.parse().unwrap_or(usize::MAX).min(body.len() - 1);
        fields += &format!("Content-Range: bytes {first}-{last}/{}\r\n", body.len());
        body = body[first..=last].to_vec();
        status = "206 Partial Content";
    }
    if manner.status.is_some() {
        body = b"no".to_vec();
    }
    let head =
        format!("HTTP/1.1 {status}\r\nContent-Length: {}\r\nConnection: close\r\n{fields}\r\n", body.len());
    body.truncate(manner.cut.unwrap_or(usize::MAX));
    let _ = stream.write_all(&[head.into_bytes(), body].concat()).await;
}
