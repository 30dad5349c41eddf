//! A server of a test's own, and requests to it byte by byte.

use std::collections::HashMap;
use std::net::SocketAddr;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::time::Duration;

use object_store::ObjectStore;
use tercet::{EncodeOptions, Limits, Mesh};
use tercet_cli::server::webtransport::{Certificate, InjectedLoss, RENEWAL, Setting, WebTransport};
use tercet_cli::server::{self, Effort, Listener, Options, Patience, Service, Sessions};
use tokio::io::{AsyncReadExt, AsyncWriteExt};
use tokio::net::TcpStream;
use tokio::sync::oneshot;

/// A server on a free port, and the folder that it serves. It stops when this is dropped.
pub struct Site {
    pub address: SocketAddr,
    folder: PathBuf,
    stop: oneshot::Sender<()>,
}

/// What an answer consists of.
#[derive(Debug)]
pub struct Answer {
    pub status: u16,
    /// By their names in lower case.
    pub fields: HashMap<String, String>,
    pub body: Vec<u8>,
}

/// Bytes that encoded meshes may take up.
pub const CACHE_SIZE: u64 = 40_000;

pub fn patience() -> Patience {
    Patience {
        connections: 200,
        header: Duration::from_secs(5),
        stall: Duration::from_secs(5),
        shutdown: Duration::from_secs(5),
    }
}

/// A new, empty folder.
pub fn folder(test: &str) -> PathBuf {
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join("net").join(test);
    let _ = std::fs::remove_dir_all(&folder);
    std::fs::create_dir_all(folder.join("site")).unwrap();
    folder
}

fn service(folder: &Path, store: Arc<dyn ObjectStore>) -> Service {
    let effort = Effort { jobs: 2, limits: Limits::default(), patience: Duration::from_secs(60) };
    let sessions = Sessions { max_message: 1024, idle: Duration::from_secs(2) };
    let cache = folder.join("cache");
    let options = Options {
        base: String::new(),
        cache,
        cache_size: CACHE_SIZE,
        encode: EncodeOptions::default(),
        effort,
        sessions,
    };
    server::service(store, options).unwrap()
}

impl Site {
    pub async fn new(test: &str) -> Site {
        Site::patient(test, patience()).await
    }

    pub async fn patient(test: &str, patience: Patience) -> Site {
        let folder = folder(test);
        let store = server::open_store(folder.join("site").to_str().unwrap()).unwrap();
        Site::with_store(folder, store, patience).await
    }

    /// A site that also holds sessions on WebTransport, over a link that loses packets.
    pub async fn lossy(test: &str, patience: Patience, loss: Option<InjectedLoss>) -> Site {
        Site::certified(test, Certificate::SelfSigned { renewal: RENEWAL }, patience, loss).await.unwrap()
    }

    /// The same, under a certificate; an error if that is none.
    pub async fn certified(
        test: &str,
        certificate: Certificate,
        patience: Patience,
        loss: Option<InjectedLoss>,
    ) -> Result<Site, String> {
        let folder = folder(test);
        let store = server::open_store(folder.join("site").to_str().unwrap()).unwrap();
        let service = service(&folder, store);
        let address = "127.0.0.1:0".parse().unwrap();
        let setting = Setting { address, certificate, patience, loss };
        let endpoint = WebTransport::bind(&service, setting).await.map_err(|error| format!("{error:#}"))?;
        tokio::spawn(endpoint.run());
        Ok(Site::of_service(folder, service, patience).await)
    }

    pub async fn with_store(folder: PathBuf, store: Arc<dyn ObjectStore>, patience: Patience) -> Site {
        let service = service(&folder, store);
        Site::of_service(folder, service, patience).await
    }

    async fn of_service(folder: PathBuf, service: Service, patience: Patience) -> Site {
        let listener = Listener::bind("127.0.0.1:0".parse().unwrap(), patience).await.unwrap();
        let address = listener.address().unwrap();
        let (stop, stopped) = oneshot::channel();
        tokio::spawn(listener.run(service, async {
            let _ = stopped.await;
        }));
        Site { address, folder, stop }
    }

    /// A file in the folder that is served.
    pub fn path(&self, name: &str) -> PathBuf {
        self.folder.join("site").join(name)
    }

    pub fn write(&self, name: &str, bytes: impl AsRef<[u8]>) {
        let path = self.path(name);
        std::fs::create_dir_all(path.parent().unwrap()).unwrap();
        std::fs::write(path, bytes).unwrap();
    }

    /// The files that the cache holds.
    pub fn cached(&self) -> Vec<PathBuf> {
        let files = std::fs::read_dir(self.folder.join("cache")).unwrap();
        files.map(|file| file.unwrap().path()).collect()
    }

    pub async fn get(&self, target: &str) -> Answer {
        self.request("GET", target, &[]).await
    }

    pub async fn request(&self, method: &str, target: &str, fields: &[(&str, &str)]) -> Answer {
        request(self.address, method, target, fields).await
    }

    /// As [`raw`], to this server.
    pub async fn raw(&self, request: &[u8]) -> Answer {
        raw(self.address, request).await
    }

    /// Tells the server to stop.
    pub fn stop(self) {
        let _ = self.stop.send(());
    }
}

/// Asks a server.
pub async fn request(address: SocketAddr, method: &str, target: &str, fields: &[(&str, &str)]) -> Answer {
    let fields: String = fields.iter().map(|(name, value)| format!("{name}: {value}\r\n")).collect();
    let head = format!("{method} {target} HTTP/1.1\r\nHost: test\r\nConnection: close\r\n{fields}\r\n");
    raw(address, head.as_bytes()).await
}

/// Sends bytes to a server, and reads until it closes the connection.
async fn raw(address: SocketAddr, request: &[u8]) -> Answer {
    let mut stream = TcpStream::connect(address).await.unwrap();
    // The server may close before it has read everything, which resets the connection.
    let _ = stream.write_all(request).await;
    let mut bytes = Vec::new();
    let _ = stream.read_to_end(&mut bytes).await;
    Answer::parse(&bytes)
}

impl Answer {
    fn parse(bytes: &[u8]) -> Answer {
        let end = bytes.windows(4).position(|window| window == b"\r\n\r\n").expect("a head");
        let head = std::str::from_utf8(&bytes[..end]).unwrap();
        let mut lines = head.split("\r\n");
        let status = lines.next().unwrap().split(' ').nth(1).unwrap().parse().unwrap();
        let fields = lines.map(|line| line.split_once(": ").unwrap());
        let fields = fields.map(|(name, value)| (name.to_ascii_lowercase(), value.to_string())).collect();
        Answer { status, fields, body: bytes[end + 4..].to_vec() }
    }

    #[track_caller]
    pub fn field(&self, name: &str) -> &str {
        self.fields.get(name).unwrap_or_else(|| panic!("no {name} in {:?}", self.fields))
    }

    pub fn text(&self) -> &str {
        std::str::from_utf8(&self.body).unwrap()
    }
}

/// A mesh as a PLY file.
pub fn ply(mesh: &Mesh) -> Vec<u8> {
    let mut bytes = Vec::new();
    tercet::io::write(mesh, tercet::io::Format::Ply, &mut bytes).unwrap();
    bytes
}

/// A mesh as a `.tct` file.
pub fn tct(mesh: &Mesh) -> Vec<u8> {
    tercet::encode(mesh, &EncodeOptions::default()).unwrap().bytes
}
