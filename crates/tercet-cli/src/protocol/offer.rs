//! Where a server holds sessions on WebTransport: `/webtransport.json`.

use serde_json::{Value, json};

/// The version of the sessions that this program speaks.
const VERSION: u32 = 1;
/// Certificates that an offer may name: one, and one that is about to replace it, are enough.
#[cfg(all(feature = "fetch", feature = "webtransport"))]
const MOST_HASHES: usize = 8;

/// The path of a session's request.
pub const PATH: &str = "/wt";

/// The SHA-256 of a certificate.
pub type CertificateHash = [u8; 32];

/// What a client has to know before it asks for a session.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Offer {
    /// The UDP port, on the host that makes the offer.
    pub port: u16,
    /// The certificates to accept; none if they are to be verified as for HTTPS.
    pub hashes: Vec<CertificateHash>,
}

impl Offer {
    /// The members of the JSON object.
    pub fn json(&self) -> Value {
        let digits =
            |hash: &CertificateHash| hash.iter().map(|byte| format!("{byte:02x}")).collect::<String>();
        let hashes: Vec<String> = self.hashes.iter().map(digits).collect();
        json!({ "version": VERSION, "port": self.port, "path": PATH, "certificateHashes": hashes })
    }

    /// Reads what another server says. The path is in the result.
    ///
    /// # Errors
    /// What is wrong with it, in words.
    #[cfg(all(feature = "fetch", feature = "webtransport"))]
    pub fn read(value: &Value) -> Result<(Offer, String), String> {
        if value["version"] != VERSION {
            return Err(format!("the server's sessions have version {}, not {VERSION}", value["version"]));
        }
        let meaningless = || "the server's offer means nothing".to_string();
        let port =
            value["port"].as_u64().and_then(|port| u16::try_from(port).ok()).ok_or_else(meaningless)?;
        let path = value["path"].as_str().filter(|path| path.starts_with('/')).ok_or_else(meaningless)?;
        let hashes = value["certificateHashes"].as_array().filter(|list| list.len() <= MOST_HASHES);
        // A digest of 32 bytes, as an identity is.
        let hash = |text: &Value| text.as_str()?.parse::<tercet::transport::FileId>().ok().map(|id| id.0);
        let hashes = hashes.and_then(|list| list.iter().map(hash).collect::<Option<Vec<_>>>());
        Ok((Offer { port, hashes: hashes.ok_or_else(meaningless)? }, path.into()))
    }
}

#[cfg(all(test, feature = "fetch", feature = "webtransport"))]
mod tests {
    use super::*;

    #[test]
    fn an_offer_is_read_as_it_is_written() {
        for hashes in [vec![], vec![[0xAB; 32], [7; 32]]] {
            let offer = Offer { port: 4433, hashes };
            assert_eq!(Offer::read(&offer.json()), Ok((offer, PATH.to_string())));
        }
    }

    #[test]
    fn nothing_else_is_an_offer() {
        let good = Offer { port: 1, hashes: vec![[1; 32]] }.json();
        for (member, bad) in [
            ("version", json!(2)),
            ("port", json!(65_536)),
            ("port", json!("1")),
            ("path", json!("wt")),
            ("certificateHashes", json!(null)),
            ("certificateHashes", json!(["ab"])),
            ("certificateHashes", json!(vec!["00".repeat(32); 9])),
        ] {
            let mut offer = good.clone();
            offer[member] = bad;
            assert!(Offer::read(&offer).is_err(), "{offer}");
        }
        assert!(Offer::read(&Value::Null).is_err());
    }
}
