//! Where the served files lie.

use std::path::Path;
use std::sync::Arc;

use anyhow::{Context, Result, bail};
use object_store::ObjectStore;
use object_store::local::LocalFileSystem;

/// Opens a folder, or what `s3://BUCKET/PREFIX` names.
///
/// A bucket's region, credentials and endpoint come from the environment variables that the
/// other S3 programs use: `AWS_REGION`, `AWS_ACCESS_KEY_ID`, `AWS_SECRET_ACCESS_KEY`,
/// `AWS_ENDPOINT_URL` …
///
/// # Errors
/// If there is no such folder, or the variables do not suffice.
pub fn open(place: &str) -> Result<Arc<dyn ObjectStore>> {
    match place.split_once("://") {
        None => folder(Path::new(place)),
        Some(("s3", rest)) => bucket(place, rest),
        Some((scheme, _)) => bail!("{place}: a store is a folder or begins with s3://, not {scheme}://"),
    }
}

fn folder(path: &Path) -> Result<Arc<dyn ObjectStore>> {
    let name = || path.display().to_string();
    if !path.metadata().with_context(name)?.is_dir() {
        bail!("{}: not a folder", name());
    }
    Ok(Arc::new(LocalFileSystem::new_with_prefix(path).with_context(name)?))
}

#[cfg(feature = "s3")]
fn bucket(place: &str, rest: &str) -> Result<Arc<dyn ObjectStore>> {
    use object_store::aws::AmazonS3Builder;
    use object_store::path::Path;
    use object_store::prefix::PrefixStore;

    crate::tls::choose_provider();
    let (bucket, prefix) = rest.split_once('/').unwrap_or((rest, ""));
    let mut builder = AmazonS3Builder::from_env().with_bucket_name(bucket);
    // An endpoint of one's own is often without TLS, and naming it is consent enough.
    let endpoint = ["AWS_ENDPOINT_URL_S3", "AWS_ENDPOINT_URL", "AWS_ENDPOINT"];
    if endpoint.iter().any(|name| std::env::var(name).is_ok_and(|url| url.starts_with("http://"))) {
        builder = builder.with_allow_http(true);
    }
    let store = builder.build().with_context(|| place.to_string())?;
    let prefix = Path::parse(prefix).with_context(|| place.to_string())?;
    Ok(Arc::new(PrefixStore::new(store, prefix)))
}

#[cfg(not(feature = "s3"))]
fn bucket(place: &str, _: &str) -> Result<Arc<dyn ObjectStore>> {
    bail!("{place}: this program was built without the feature s3")
}
