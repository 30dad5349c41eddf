//! A file that is ready to be sent: where its bytes lie and what they are.

use std::ops::Range;
use std::sync::Arc;

use axum::http::HeaderValue;
use bytes::Bytes;
use futures_util::stream::{BoxStream, Stream, StreamExt, TryStreamExt};
use object_store::path::Path;
use object_store::{GetOptions, ObjectMeta, ObjectStore};
use sha2::{Digest as _, Sha256};

use super::failure::Failure;

/// The SHA-256 of some bytes, in lower-case hexadecimal digits.
#[derive(Clone, Debug, PartialEq, Eq, Hash)]
pub struct Digest(Arc<str>);

impl Digest {
    pub fn as_str(&self) -> &str {
        &self.0
    }

    /// The strong entity tag of the bytes.
    pub fn etag(&self) -> HeaderValue {
        let quoted = format!("\"{}\"", self.0);
        HeaderValue::from_str(&quoted).expect("hexadecimal digits in quotes are a header's value")
    }

    /// The digest of a stream's bytes, in the order in which they arrive; holds one chunk.
    pub async fn of<E>(bytes: impl Stream<Item = Result<Bytes, E>>) -> Result<Self, E> {
        let hash = bytes.try_fold(Sha256::new(), async |mut hash, chunk| {
            hash.update(&chunk);
            Ok(hash)
        });
        let hash = hash.await?.finalize();
        Ok(Digest(hash.iter().map(|byte| format!("{byte:02x}")).collect::<String>().into()))
    }
}

/// An object in a store, in the version in which it was found.
#[derive(Clone, Debug)]
pub struct Object {
    pub store: Arc<dyn ObjectStore>,
    pub meta: ObjectMeta,
}

/// What tells one version of an object from another, without reading it.
#[derive(Clone, Debug, PartialEq, Eq, Hash)]
pub struct Version {
    location: Path,
    bytes: u64,
    modified: i64,
    tag: Option<String>,
}

impl Object {
    /// Looks an object up.
    pub async fn find(store: &Arc<dyn ObjectStore>, location: &Path) -> Result<Object, Failure> {
        let head = GetOptions { head: true, ..GetOptions::default() };
        let meta = store.get_opts(location, head).await?.meta;
        Ok(Object { store: store.clone(), meta })
    }

    pub fn version(&self) -> Version {
        Version {
            location: self.meta.location.clone(),
            bytes: self.meta.size,
            modified: self.meta.last_modified.timestamp_micros(),
            tag: self.meta.e_tag.clone(),
        }
    }

    /// Reads a part of the object, chunk by chunk as the stream is asked for them.
    ///
    /// # Errors
    /// [`Failure::Replaced`] if it is no longer the version that was found.
    pub async fn read(
        &self,
        range: Range<u64>,
    ) -> Result<BoxStream<'static, Result<Bytes, Failure>>, Failure> {
        if range.is_empty() {
            // Stores refuse such a range.
            return Ok(futures_util::stream::empty().boxed());
        }
        let whole = range == (0..self.meta.size);
        let options = GetOptions {
            if_match: self.meta.e_tag.clone(),
            range: (!whole).then(|| range.clone().into()),
            ..GetOptions::default()
        };
        let found = self.store.get_opts(&self.meta.location, options).await?;
        if found.range != range {
            return Err(Failure::Replaced);
        }
        let chunks = found.into_stream().map(|chunk| match chunk {
            // A local file that was shortened in its place gives empty chunks without end.
            Ok(chunk) if chunk.is_empty() => Err(Failure::Replaced),
            chunk => Ok(chunk?),
        });
        Ok(chunks.boxed())
    }

    /// The digest of the whole object, which is read once.
    pub async fn digest(&self) -> Result<Digest, Failure> {
        Digest::of(self.read(0..self.meta.size).await?).await
    }
}

/// A `.tct` file that can be sent.
#[derive(Clone, Debug)]
pub struct Rendition {
    pub object: Object,
    pub digest: Digest,
}

impl Rendition {
    /// Size of the file.
    pub fn bytes(&self) -> u64 {
        self.object.meta.size
    }
}
