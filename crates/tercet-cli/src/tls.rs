//! TLS for what this program asks others for.

/// Chooses the cryptography of the process; what was chosen before stays.
pub fn choose_provider() {
    // An error means that there is one already.
    let _ = rustls::crypto::ring::default_provider().install_default();
}
