//! A file by HTTP, from any server.

use std::time::Duration;

use anyhow::{Context, Result, anyhow};
use futures_util::{StreamExt, TryStreamExt};
use reqwest::header::{self, HeaderMap};
use reqwest::{Client, Response, StatusCode, Url};

use super::fault::Fault;
use super::wanted::Wanted;
use super::{Arrived, Opened};

/// Bytes that are asked for when only a part is wanted and the header is not known yet: the header
/// and, of most files, some levels.
const PROBE: u64 = 1 << 14;

/// A file at an address.
pub struct Http {
    client: Client,
    url: Url,
}

impl Http {
    pub fn new(url: Url, timeout: Duration) -> Result<Self> {
        crate::tls::choose_provider();
        let client = Client::builder()
            .user_agent(concat!("tercet/", env!("CARGO_PKG_VERSION")))
            .connect_timeout(timeout)
            .read_timeout(timeout)
            .build()
            .context("starting an HTTP client")?;
        Ok(Http { client, url })
    }

    /// Asks for the bytes from `from` to `end`, if that is known, of the version that `tag` names.
    pub async fn open(
        &self,
        from: u64,
        tag: Option<&str>,
        wanted: &Wanted,
        end: Option<u64>,
    ) -> Result<Opened, Fault> {
        let end = match (wanted, end) {
            (Wanted::Everything, _) => None,
            (Wanted::Bytes(most), None) => Some(*most),
            (_, None) => Some(from + PROBE),
            (_, end) => end,
        };
        let mut request = self.client.get(self.url.clone());
        if from > 0 || end.is_some() {
            let last = end.map_or(String::new(), |end| end.saturating_sub(1).max(from).to_string());
            request = request.header(header::RANGE, format!("bytes={from}-{last}"));
        }
        if let Some(tag) = tag.filter(|_| from > 0) {
            request = request.header(header::IF_RANGE, tag);
        }
        let answer = request.send().await?;
        let start = match answer.status() {
            StatusCode::OK => 0,
            StatusCode::PARTIAL_CONTENT => first_byte(answer.headers())
                .filter(|&first| first == from)
                .ok_or_else(|| Fault::Fatal(anyhow!("the server sends another part than was asked for")))?,
            _ => return Err(refused(answer).await),
        };
        let tag =
            field(answer.headers(), header::ETAG).filter(|tag| !tag.starts_with("W/")).map(str::to_owned);
        let bytes = answer.bytes_stream().map_ok(Arrived::Next).map_err(Fault::from).boxed();
        Ok(Opened { start, tag, bytes })
    }
}

async fn refused(answer: Response) -> Fault {
    let status = answer.status();
    let wait = field(answer.headers(), header::RETRY_AFTER).map(str::to_owned);
    // Only a server's plain words are for a terminal, and only a few of them.
    let plain = field(answer.headers(), header::CONTENT_TYPE).is_some_and(|it| it.starts_with("text/plain"));
    let mut words = String::new();
    if plain && let Some(Ok(bytes)) = answer.bytes_stream().next().await {
        let text = String::from_utf8_lossy(&bytes);
        words = text.chars().take(200).filter(|c| *c == '\n' || !c.is_control()).collect();
    }
    Fault::of_status(status, &words, wait.as_deref())
}

fn field(fields: &HeaderMap, name: header::HeaderName) -> Option<&str> {
    fields.get(name)?.to_str().ok()
}

/// The *a* of `Content-Range: bytes a-b/c`.
fn first_byte(fields: &HeaderMap) -> Option<u64> {
    let range = field(fields, header::CONTENT_RANGE)?.strip_prefix("bytes ")?;
    range.split_once('-')?.0.trim().parse().ok()
}
