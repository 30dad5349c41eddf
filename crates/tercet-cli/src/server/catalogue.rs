//! Which file a name stands for.

use std::sync::Arc;

use object_store::ObjectStore;
use object_store::path::Path;
use tercet::io::Format;

use super::encode_cache::EncodeCache;
use super::failure::Failure;
use super::once::Once;
use super::rendition::{Digest, Object, Rendition, Version};

/// The suffix of the files that are served, with its dot.
pub const SUFFIX: &str = ".tct";
/// Objects whose digests are remembered; beyond, they are read again.
const REMEMBERED: usize = 65_536;

/// The files of a store, the encoded ones and those that are encoded when they are asked for.
///
/// `NAME.tct` is the object of that name, or else the mesh `NAME` (as in `bunny.obj.tct`) encoded.
pub struct Catalogue {
    store: Arc<dyn ObjectStore>,
    cache: EncodeCache,
    digests: Once<Version, Digest>,
}

impl Catalogue {
    pub fn new(store: Arc<dyn ObjectStore>, cache: EncodeCache) -> Self {
        Catalogue { store, cache, digests: Once::new(REMEMBERED) }
    }

    pub fn store(&self) -> &Arc<dyn ObjectStore> {
        &self.store
    }

    /// The file of that name. Takes time linear in the file when it is first asked for, and again
    /// after it has been replaced; otherwise one look-up in the store.
    pub async fn find(&self, name: &str) -> Result<Rendition, Failure> {
        let otherwise = if mesh_format(name).is_some() { Failure::NotEncoded } else { Failure::NotFound };
        let mesh_name = name.strip_suffix(SUFFIX).ok_or(otherwise)?;
        let object = match Object::find(&self.store, &location(name)?).await {
            Ok(object) => object,
            Err(Failure::NotFound) => self.encoded(mesh_name).await?,
            Err(failure) => return Err(failure),
        };
        let digest = self.digest(&object).await?;
        Ok(Rendition { object, digest })
    }

    async fn encoded(&self, mesh_name: &str) -> Result<Object, Failure> {
        let format = mesh_format(mesh_name).ok_or(Failure::NotFound)?;
        let mesh = Object::find(&self.store, &location(mesh_name)?).await?;
        let digest = self.digest(&mesh).await?;
        self.cache.encoded(&mesh, format, &digest).await
    }

    async fn digest(&self, object: &Object) -> Result<Digest, Failure> {
        let work = || {
            let object = object.clone();
            async move { object.digest().await }
        };
        self.digests.get(object.version(), work).await
    }
}

/// The format of a mesh file of another kind, by its suffix.
pub fn mesh_format(name: &str) -> Option<Format> {
    Format::from_path(std::path::Path::new(name))
}

/// Where a name of a request leads: into the store, and never out of it. `.` and `..`, empty
/// segments, backslashes and control characters name nothing.
pub fn location(name: &str) -> Result<Path, Failure> {
    if name.contains(|c: char| c == '\\' || c.is_control()) {
        return Err(Failure::NotFound);
    }
    Path::parse(name).map_err(|_| Failure::NotFound)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn no_name_leads_out_of_the_store() {
        for bad in
            ["..", "../a.tct", "a/../../b.tct", "./a.tct", "a//b.tct", "//a.tct", "a\\..\\b", "a\0.tct"]
        {
            assert_eq!(location(bad), Err(Failure::NotFound), "{bad:?}");
        }
        for good in ["a.tct", "a/b.tct", "a b.tct", "ü~#%2e%2e.tct", "..a.tct"] {
            assert_eq!(location(good).unwrap().as_ref(), good);
        }
    }
}
