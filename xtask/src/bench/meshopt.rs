//! meshoptimizer's vertex and index codecs and its glTF packer, each followed by `zstd -19`, and its simplification;
//! run by node.

use crate::process::{available, capture, command, debian_packages, root, target_dir};
use anyhow::{Result, bail};
use std::fs;
use std::path::{Path, PathBuf};

/// The folder that holds the script and its package.
pub struct Program(PathBuf);

impl Program {
    /// Installs what is needed; says what is missing where it cannot.
    pub fn set_up() -> Result<Self> {
        if !available("node") || !available("npm") {
            bail!("node and npm are not installed");
        }
        if !available("zstd") {
            debian_packages(&["zstd"])?;
        }
        let folder = target_dir()?.join("peers");
        fs::create_dir_all(&folder)?;
        for name in ["meshopt.mjs", "ply.mjs", "simplify.mjs", "package.json"] {
            fs::copy(root().join("xtask/peers").join(name), folder.join(name))?;
        }
        let mut install = command("npm", &["install", "--no-audit", "--no-fund", "--silent"]);
        install.current_dir(&folder);
        capture(install)?;
        Ok(Program(folder))
    }

    /// The bytes of a mesh with unrounded positions.
    pub fn encode(&self, ply: &Path, scratch: &Path) -> Result<u64> {
        let plain = scratch.join("meshopt");
        let mut node = command("node", &[]);
        node.arg(self.0.join("meshopt.mjs")).arg(ply).arg(&plain);
        capture(node)?;
        zstd_bytes(&plain)
    }

    /// The bytes of a glTF file of a mesh with positions on a lattice of `bits` bits, compressed for size.
    pub fn pack(&self, obj: &Path, bits: u8, scratch: &Path) -> Result<u64> {
        let packed = scratch.join("packed.glb");
        let mut gltfpack = command("node", &[]);
        gltfpack.arg(self.0.join("node_modules/gltfpack/cli.js")).args(["-cz", "-vp", &bits.to_string()]);
        gltfpack.arg("-i").arg(obj).arg("-o").arg(&packed);
        capture(gltfpack)?;
        zstd_bytes(&packed)
    }

    /// Simplifies a mesh to about so many faces each: by their number, the meshes of kept and of moved vertices.
    pub fn simplify(&self, ply: &Path, faces: &[u64], scratch: &Path) -> Result<Vec<(u64, [PathBuf; 2])>> {
        let stem = scratch.join("simplified");
        let mut node = command("node", &[]);
        node.arg(self.0.join("simplify.mjs")).arg(ply).arg(&stem).args(faces.iter().map(u64::to_string));
        capture(node)?;
        let name = |faces: u64, kind: &str| PathBuf::from(format!("{}-{faces}-{kind}.ply", stem.display()));
        Ok(faces.iter().map(|&faces| (faces, [name(faces, "kept"), name(faces, "moved")])).collect())
    }
}

/// The bytes of a file after `zstd -19`.
fn zstd_bytes(file: &Path) -> Result<u64> {
    let packed = file.with_extension("zst");
    let mut zstd = command("zstd", &["-19", "--quiet", "--force", "-o"]);
    zstd.arg(&packed).arg(file);
    capture(zstd)?;
    Ok(fs::metadata(packed)?.len())
}
