//! What the server shows of itself to clients.

use std::path::Path;
use std::sync::Arc;
use std::time::Duration;

use anyhow::{Context, Result};
use rustls::crypto::ring;
use rustls::pki_types::{CertificateDer, PrivateKeyDer};
use wtransport::Identity;

use crate::protocol::CertificateHash;

/// Names in a certificate that the server signs itself. Clients go by its digest.
const NAMES: [&str; 3] = ["localhost", "127.0.0.1", "::1"];
/// Days for which it is valid: browsers accept the digest of a certificate for at most 14 days.
const VALID_DAYS: u32 = 14;
/// How long it is in use: whoever has just asked for its digest has a week to come.
pub const RENEWAL: Duration = Duration::from_secs(7 * 86_400);

/// A new certificate for a new key on the curve P-256.
pub fn self_signed() -> Result<Identity> {
    let builder = Identity::self_signed_builder().subject_alt_names(NAMES);
    Ok(builder.from_now_utc().validity_days(VALID_DAYS).build()?)
}

/// What PEM files hold: a chain of certificates, the server's first, and its key.
///
/// # Errors
/// If they hold no such thing, or the key is another certificate's.
pub async fn load(chain: &Path, key: &Path) -> Result<Identity> {
    let identity = Identity::load_pemfiles(chain, key).await?;
    check(&identity).with_context(|| format!("{} and {}", chain.display(), key.display()))?;
    Ok(identity)
}

/// Whether a server can be built of it: `wtransport` takes that for granted, and panics if not.
fn check(identity: &Identity) -> Result<()> {
    let chain = identity.certificate_chain().as_slice().iter();
    let chain = chain.map(|certificate| CertificateDer::from(certificate.der().to_vec())).collect();
    let key = identity.private_key().secret_der().to_vec();
    let key = PrivateKeyDer::try_from(key).map_err(anyhow::Error::msg)?;
    let builder = rustls::ServerConfig::builder_with_provider(Arc::new(ring::default_provider()));
    builder.with_safe_default_protocol_versions()?.with_no_client_auth().with_single_cert(chain, key)?;
    Ok(())
}

/// The SHA-256 of the server's certificate.
pub fn hash(identity: &Identity) -> Option<CertificateHash> {
    identity.certificate_chain().as_slice().first().map(|first| *first.hash().as_ref())
}
