//! The certificates of sessions on WebTransport: files, and those that a server signs and replaces itself.

use std::path::PathBuf;
use std::time::{Duration, Instant};

use crate::site::{Site, folder, patience};
use serde_json::{Value, json};
use tercet_cli::server::webtransport::Certificate;
use tokio::time::{sleep, timeout};
use wtransport::tls::Sha256Digest;
use wtransport::{ClientConfig, Connection, Endpoint, Identity};

type Hash = [u8; 32];

async fn offer(site: &Site) -> Value {
    serde_json::from_slice(&site.get("/webtransport.json").await.body).unwrap()
}

/// The digest of the certificate that a site offers.
async fn offered(site: &Site) -> Hash {
    let offer = offer(site).await;
    offer["certificateHashes"][0].as_str().unwrap().parse::<tercet::transport::FileId>().unwrap().0
}

/// A connection to whoever has the certificate of this digest.
async fn connect(site: &Site, hash: Hash) -> Result<Connection, String> {
    let config = ClientConfig::builder().with_bind_default();
    let config = config.with_server_certificate_hashes([Sha256Digest::new(hash)]).build();
    let url = format!("https://127.0.0.1:{}/wt", offer(site).await["port"]);
    Endpoint::client(config).unwrap().connect(url).await.map_err(|error| error.to_string())
}

/// PEM files of a certificate and its key, and its digest.
async fn files(test: &str) -> (PathBuf, PathBuf, Hash) {
    let folder = folder(test);
    let identity = Identity::self_signed(["127.0.0.1"]).unwrap();
    let (chain, key) = (folder.join("chain.pem"), folder.join("key.pem"));
    identity.certificate_chain().store_pemfile(&chain).await.unwrap();
    identity.private_key().store_secret_pemfile(&key).await.unwrap();
    (chain, key, *identity.certificate_chain().as_slice()[0].hash().as_ref())
}

#[tokio::test]
async fn a_certificate_from_files_is_shown_and_no_digest_offered() {
    let (chain, key, hash) = files("certificate-files").await;
    let certificate = Certificate::Files { chain, key };
    let site = Site::certified("certificate-site", certificate, patience(), None).await.unwrap();
    // It is an authority's business to vouch for it.
    assert_eq!(offer(&site).await["certificateHashes"], json!([]));
    assert!(connect(&site, hash).await.is_ok());
    assert!(connect(&site, [7; 32]).await.is_err());
}

#[tokio::test]
async fn files_that_are_no_certificate_are_refused() {
    let (chain, key, _) = files("certificate-none").await;
    let (_, others, _) = files("certificate-others").await;
    let missing = chain.with_file_name("none.pem");
    let empty = chain.with_file_name("empty.pem");
    std::fs::write(&empty, "nothing").unwrap();
    let wrong = [
        (&missing, &key),
        (&empty, &key),
        (&chain, &missing),
        (&chain, &empty),
        (&chain, &chain),
        (&chain, &others),
    ];
    for (chain, key) in wrong {
        let certificate = Certificate::Files { chain: chain.clone(), key: key.clone() };
        let site = Site::certified("certificate-refused", certificate, patience(), None).await;
        assert!(site.is_err(), "{chain:?} {key:?}");
    }
}

#[tokio::test]
async fn a_certificate_is_replaced_while_sessions_go_on() {
    let certificate = Certificate::SelfSigned { renewal: Duration::from_secs(2) };
    let site = Site::certified("certificate-renewal", certificate, patience(), None).await.unwrap();
    let first = offered(&site).await;
    let before = connect(&site, first).await.unwrap();
    let start = Instant::now();
    while offered(&site).await == first {
        assert!(start.elapsed() < Duration::from_secs(20), "no renewal");
        sleep(Duration::from_millis(50)).await;
    }
    assert!(connect(&site, first).await.is_err(), "the first one is not shown any more");
    // Unless it was replaced once more in between, the one offered is the one shown.
    let mut after = connect(&site, offered(&site).await).await;
    if after.is_err() {
        after = connect(&site, offered(&site).await).await;
    }
    after.unwrap();
    let ended = timeout(Duration::from_millis(200), before.closed()).await;
    assert!(ended.is_err(), "the session from before goes on");
}
