//! What a lossy file says of the mesh that it stands for.

use super::fields::Fields;
use super::section::{error_code, read_count, read_error};
use super::varint;
use crate::Result;

/// What a lossy file says of its *source*: the mesh that the one in the file stands for.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Approximation {
    /// Vertices of the source.
    pub vertices: u32,
    /// Faces of the source.
    pub faces: u32,
    /// [`Mesh::digest`](crate::Mesh::digest) of the source.
    pub digest: u64,
    /// Root mean square distance of the file's mesh and the source, the larger of both directions,
    /// as a part of the diagonal of the source's bounding box; measured by samples, and rounded up.
    pub rms: f32,
    /// Their Hausdorff distance is at most this, as a part of the same diagonal.
    pub greatest: f32,
}

impl Approximation {
    /// Bytes that it takes in a header, at most.
    #[cfg(feature = "remesh")]
    pub(crate) const MOST_BYTES: u64 = 5 + 5 + 8 + 2 + 2;

    /// Appends the fields. Errors are rounded up to 8 significant bits.
    pub(super) fn write(&self, out: &mut Vec<u8>) {
        varint::write(out, self.vertices.into());
        varint::write(out, self.faces.into());
        out.extend(self.digest.to_le_bytes());
        out.extend(error_code(self.rms).to_le_bytes());
        out.extend(error_code(self.greatest).to_le_bytes());
    }

    pub(super) fn read(fields: &mut Fields) -> Result<Self> {
        Ok(Approximation {
            vertices: read_count(fields, "vertices of the source")?,
            faces: read_count(fields, "faces of the source")?,
            digest: u64::from_le_bytes(fields.array("digest of the source")?),
            rms: read_error(fields, "error against the source")?,
            greatest: read_error(fields, "greatest error against the source")?,
        })
    }
}
