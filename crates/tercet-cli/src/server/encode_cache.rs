//! Meshes of other formats, encoded when they are first asked for and kept on disk.

use std::io::{self, Write};
use std::path::PathBuf;
use std::sync::Arc;
use std::time::{Duration, Instant};

use futures_util::TryStreamExt;
use object_store::ObjectStore;
use object_store::local::LocalFileSystem;
use object_store::path::Path;
use tercet::io::Format;
use tercet::{EncodeOptions, Limits};
use tokio::sync::Semaphore;

use super::failure::Failure;
use super::metrics::Metrics;
use super::once::Once;
use super::rendition::{Digest, Object};
use super::trim::trim;

/// Encodings that are remembered as done or as impossible; beyond, the disk is asked again.
const REMEMBERED: usize = 4096;
/// Encodings that may wait for each one that runs; beyond, clients are told that the server is busy.
const WAITING_PER_JOB: usize = 32;

/// Encoded meshes in a folder, named by the digest of the mesh file and what was asked for.
pub struct EncodeCache {
    folder: PathBuf,
    /// What they may take up together, in bytes.
    size: u64,
    store: Arc<dyn ObjectStore>,
    options: EncodeOptions,
    /// What one job may hold.
    limits: Limits,
    running: Arc<Semaphore>,
    admitted: Arc<Semaphore>,
    patience: Duration,
    jobs: Once<Path, ()>,
    metrics: Arc<Metrics>,
}

/// How much encoding may go on at a time.
#[derive(Clone, Copy, Debug)]
pub struct Effort {
    /// Encodings at a time.
    pub jobs: usize,
    /// What all of them together may hold.
    pub limits: Limits,
    /// How long a client is kept waiting for one.
    pub patience: Duration,
}

impl EncodeCache {
    /// Opens the folder, and makes it if it is not there. Whenever the files in it take up more than
    /// `size` bytes, the oldest are removed; a file that is larger than that stays until the next one
    /// is written.
    ///
    /// # Errors
    /// If that cannot be.
    pub fn open(
        folder: PathBuf,
        size: u64,
        options: EncodeOptions,
        effort: Effort,
        metrics: Arc<Metrics>,
    ) -> io::Result<Self> {
        let named =
            |error: &dyn std::fmt::Display| io::Error::other(format!("{}: {error}", folder.display()));
        std::fs::create_dir_all(&folder).map_err(|error| named(&error))?;
        trim(&folder, size, None).map_err(|error| named(&error))?;
        let store = LocalFileSystem::new_with_prefix(&folder).map_err(|error| named(&error))?;
        let jobs = effort.jobs.max(1);
        Ok(EncodeCache {
            folder,
            size,
            store: Arc::new(store),
            options,
            limits: Limits { max_memory: effort.limits.max_memory / jobs as u64 },
            running: Arc::new(Semaphore::new(jobs)),
            admitted: Arc::new(Semaphore::new(jobs * (1 + WAITING_PER_JOB))),
            patience: effort.patience,
            jobs: Once::new(REMEMBERED),
            metrics,
        })
    }

    /// The file that a mesh of that digest is encoded as. The encoding goes on if the caller
    /// leaves or is turned away, so that it is there when the mesh is asked for again.
    ///
    /// # Errors
    /// [`Failure::Mesh`] if it cannot be encoded, [`Failure::Busy`] if that takes too long or too
    /// many others wait.
    pub async fn encoded(&self, mesh: &Object, format: Format, digest: &Digest) -> Result<Object, Failure> {
        let location = self.location(digest, format);
        match Object::find(&self.store, &location).await {
            Err(Failure::NotFound) => {}
            found => return found,
        }
        // What was encoded before may have been removed since.
        self.jobs.forget(&location);
        let job = self.jobs.get(location.clone(), || self.job(mesh.clone(), format, location.clone()));
        tokio::time::timeout(self.patience, job).await.unwrap_or(Err(Failure::Busy))?;
        Object::find(&self.store, &location).await
    }

    /// Two formats read the same bytes differently, and two versions of the program may write
    /// different files, or files that this one cannot read.
    fn location(&self, digest: &Digest, format: Format) -> Path {
        let bits = self.options.bits.map_or("exact".into(), |bits| format!("{bits}bits"));
        let order = if self.options.keep_order { "-order" } else { "" };
        let version = format!("{}-v{}", env!("CARGO_PKG_VERSION"), tercet::FORMAT_VERSION);
        Path::from(format!("{}-{}-{bits}{order}-{version}.tct", digest.as_str(), format.name()))
    }

    fn job(
        &self,
        mesh: Object,
        format: Format,
        location: Path,
    ) -> impl Future<Output = Result<(), Failure>> + Send + 'static {
        let (running, admitted, metrics) =
            (self.running.clone(), self.admitted.clone(), self.metrics.clone());
        let (limits, options, folder) = (self.limits, self.options, self.folder.clone());
        let (size, store) = (self.size, self.store.clone());
        async move {
            // Another request's job may have ended since the file was looked for.
            if Object::find(&store, &location).await.is_ok() {
                return Ok(());
            }
            let _admission = admitted.try_acquire_owned().map_err(|_| Failure::Busy)?;
            let _turn = running.acquire_owned().await.map_err(|_| Failure::Busy)?;
            let bytes = read_whole(&mesh, &limits).await?;
            let start = Instant::now();
            let done = tokio::task::spawn_blocking(move || {
                let encoded = encode(&bytes, format, &options, &limits)?;
                keep(&encoded, &folder, &location)?;
                trim(&folder, size, Some(location.as_ref())).map_err(|error| cache_failure(&error))
            });
            let done = done.await.unwrap_or_else(|error| Err(Failure::Mesh(format!("encoding: {error}"))));
            metrics.encoded(start.elapsed(), done.is_ok());
            let (name, ms) = (mesh.meta.location.as_ref(), start.elapsed().as_millis() as u64);
            match &done {
                Ok(()) => tracing::info!(name, ms, "encoded"),
                Err(failure) => tracing::warn!(name, ms, %failure, "not encoded"),
            }
            done
        }
    }
}

async fn read_whole(mesh: &Object, limits: &Limits) -> Result<Vec<u8>, Failure> {
    let size = mesh.meta.size;
    if size > limits.max_memory {
        return Err(Failure::Mesh(format!("{size} bytes are more than may be read to encode it")));
    }
    let chunks = mesh.read(0..size).await?;
    let append = async |mut bytes: Vec<u8>, chunk: bytes::Bytes| {
        bytes.extend_from_slice(&chunk);
        Ok(bytes)
    };
    chunks.try_fold(Vec::with_capacity(size as usize), append).await
}

fn encode(
    bytes: &[u8],
    format: Format,
    options: &EncodeOptions,
    limits: &Limits,
) -> Result<Vec<u8>, Failure> {
    let failure = |error: tercet::Error| Failure::Mesh(error.to_string());
    let mesh = tercet::io::read(bytes, format, limits).map_err(failure)?.mesh;
    let needed = ENCODING_BYTES_PER_VERTEX * mesh.positions.len() as u64;
    if needed > limits.max_memory {
        return Err(Failure::Mesh(format!(
            "encoding it takes some {needed} bytes of memory, more than allowed"
        )));
    }
    Ok(tercet::encode(&mesh, options).map_err(failure)?.bytes)
}

/// What [`tercet::encode`] takes, rounded up.
const ENCODING_BYTES_PER_VERTEX: u64 = 300;

/// Writes a file under a name of its own first: whoever finds it finds it whole.
fn keep(bytes: &[u8], folder: &std::path::Path, location: &Path) -> Result<(), Failure> {
    let write = || -> io::Result<()> {
        let mut file = tempfile::NamedTempFile::new_in(folder)?;
        file.write_all(bytes)?;
        file.persist(folder.join(location.as_ref()))?;
        Ok(())
    };
    write().map_err(|error| cache_failure(&error))
}

fn cache_failure(error: &io::Error) -> Failure {
    Failure::Store(format!("cache: {error}"))
}
