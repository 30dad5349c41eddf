//! Which way to a file is taken.

use std::collections::VecDeque;
use std::time::Duration;

use anyhow::{Context, Result, bail};
use clap::ValueEnum;
use reqwest::Url;
use tercet::Limits;

use super::Opened;
use super::fault::Fault;
use super::http::Http;
use super::wanted::Wanted;
use super::ws::Ws;
#[cfg(feature = "webtransport")]
use super::wt::Wt;

/// How to ask for a file.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum Protocol {
    /// The first of wt, ws and http that the server offers.
    Auto,
    /// Ranges of a file.
    Http,
    /// Commands on a WebSocket.
    Ws,
    /// Datagrams on WebTransport, for links that lose packets.
    #[cfg(feature = "webtransport")]
    Wt,
}

/// How long a way may take to begin while there are others.
const BRIEFLY: Duration = Duration::from_secs(3);

/// Where a file comes from: ways to it, the best first. One that does not begin is not tried again,
/// unless it is the last.
pub struct Source {
    ways: VecDeque<Way>,
}

enum Way {
    /// By HTTP, from any server.
    Http(Http),
    /// By the command protocol, from `tercet serve`.
    Ws(Ws),
    /// By datagrams, from `tercet serve --webtransport`.
    #[cfg(feature = "webtransport")]
    Wt(Wt),
}

impl Source {
    /// The source at an address; nothing is asked of it yet. `timeout` bounds the server's silence,
    /// `limits` what may be held until it can be decoded.
    ///
    /// # Errors
    /// If that is no address, or not of that protocol.
    #[cfg_attr(not(feature = "webtransport"), expect(unused_variables))]
    pub fn new(url: &str, protocol: Protocol, timeout: Duration, limits: &Limits) -> Result<Source> {
        let url = Url::parse(url).with_context(|| format!("{url}: not an address"))?;
        let by_http = matches!(url.scheme(), "http" | "https");
        let ways = match protocol {
            _ if matches!(url.scheme(), "ws" | "wss") => vec![Way::Ws(Ws::new(url, timeout))],
            _ if !by_http => {
                let scheme = url.scheme();
                bail!("{url}: addresses begin with http, https, ws or wss, not {scheme}")
            }
            Protocol::Http => vec![Way::Http(Http::new(url, timeout)?)],
            Protocol::Ws => vec![Way::Ws(Ws::of_file(url, timeout)?)],
            #[cfg(feature = "webtransport")]
            Protocol::Wt => vec![Way::Wt(Wt::new(url, timeout, *limits)?)],
            Protocol::Auto => vec![
                #[cfg(feature = "webtransport")]
                Way::Wt(Wt::new(url.clone(), timeout, *limits)?),
                Way::Ws(Ws::of_file(url.clone(), timeout)?),
                Way::Http(Http::new(url, timeout)?),
            ],
        };
        Ok(Source { ways: ways.into() })
    }

    /// Asks for the bytes from `from` on, by the best way that there is: to `end`, if that is known,
    /// of the version that `tag` names.
    pub async fn open(
        &mut self,
        from: u64,
        tag: Option<&str>,
        wanted: &Wanted,
        end: Option<u64>,
    ) -> Result<Opened, Fault> {
        while self.ways.len() > 1 {
            let begun = tokio::time::timeout(BRIEFLY, self.ways[0].open(from, tag, wanted, end)).await;
            if let Ok(begun @ (Ok(_) | Err(Fault::Replaced))) = begun {
                return begun;
            }
            self.ways.pop_front();
        }
        self.ways[0].open(from, tag, wanted, end).await
    }
}

impl Way {
    async fn open(
        &self,
        from: u64,
        tag: Option<&str>,
        wanted: &Wanted,
        end: Option<u64>,
    ) -> Result<Opened, Fault> {
        match self {
            Way::Http(http) => http.open(from, tag, wanted, end).await,
            Way::Ws(ws) => ws.open(from, tag, wanted).await,
            #[cfg(feature = "webtransport")]
            Way::Wt(wt) => wt.open(from, tag).await,
        }
    }
}
