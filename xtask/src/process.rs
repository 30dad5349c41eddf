//! Running other programs, and installing those that a check needs.

use anyhow::{Context, Result, bail};
use std::borrow::BorrowMut;
use std::panic::resume_unwind;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::sync::LazyLock;

/// The workspace's folder: where cargo runs this program for, not where it was once compiled, as clones
/// may share a target folder.
pub fn root() -> &'static Path {
    static ROOT: LazyLock<PathBuf> = LazyLock::new(|| {
        let own = std::env::var_os("CARGO_MANIFEST_DIR").unwrap_or(env!("CARGO_MANIFEST_DIR").into());
        PathBuf::from(own).parent().expect("xtask lies in the workspace").to_path_buf()
    });
    &ROOT
}

/// The target folder in use: this program lies in `TARGET/PROFILE/xtask`.
pub fn target_dir() -> Result<PathBuf> {
    let own = std::env::current_exe().context("finding the target folder")?;
    Ok(own.ancestors().nth(2).context("finding the target folder")?.to_path_buf())
}

/// The version in `rust-version`, as in "1.95".
pub fn promised_version() -> Result<String> {
    let metadata = capture(command("cargo", &["metadata", "--no-deps", "--format-version", "1"]))?;
    let metadata: serde_json::Value = serde_json::from_str(&metadata)?;
    let version = metadata["packages"][0]["rust_version"].as_str();
    version.map(str::to_owned).context("the workspace states no rust-version")
}

/// A command that starts in the repository's root, without what cargo told this program of its own package:
/// build scripts that look at variables of the same names, as that of `ring` does, would run anew in each
/// clone, and all that depends on them be compiled anew.
pub fn command(program: &str, arguments: &[&str]) -> Command {
    let mut command = Command::new(program);
    command.args(arguments).current_dir(root());
    for (name, _) in std::env::vars_os() {
        if ["CARGO_MANIFEST_", "CARGO_PKG_"].iter().any(|own| name.to_string_lossy().starts_with(own)) {
            command.env_remove(name);
        }
    }
    command
}

/// Shows the command, runs it with its output passed on, and fails unless it exits with 0.
pub fn run(mut command: impl BorrowMut<Command>) -> Result<()> {
    let command = command.borrow_mut();
    println!("$ {}", shown(command));
    let status = command.status().with_context(|| format!("starting {}", shown(command)))?;
    if !status.success() {
        bail!("`{}` failed: {status}", shown(command));
    }
    Ok(())
}

/// Runs the command and returns what it printed; fails, with its errors, unless it exits with 0.
pub fn capture(mut command: impl BorrowMut<Command>) -> Result<String> {
    let command = command.borrow_mut();
    let output = command.output().with_context(|| format!("starting {}", shown(command)))?;
    if !output.status.success() {
        let errors = String::from_utf8_lossy(&output.stderr);
        bail!("`{}` failed: {}\n{}", shown(command), output.status, errors.trim_end());
    }
    Ok(String::from_utf8_lossy(&output.stdout).into_owned())
}

/// Does all jobs at the same time, each in a thread, and returns what they return in their order.
pub fn at_once<T: Send>(jobs: impl IntoIterator<Item = impl FnOnce() -> T + Send>) -> Vec<T> {
    std::thread::scope(|scope| {
        let running: Vec<_> = jobs.into_iter().map(|job| scope.spawn(job)).collect();
        running.into_iter().map(|job| job.join().unwrap_or_else(|panic| resume_unwind(panic))).collect()
    })
}

/// Whether the command can be started and exits with 0. Prints nothing.
pub fn succeeds(mut command: Command) -> bool {
    command.stdin(Stdio::null()).stdout(Stdio::null()).stderr(Stdio::null());
    command.status().is_ok_and(|status| status.success())
}

/// Whether `program` is on the path.
pub fn available(program: &str) -> bool {
    let folders = std::env::var_os("PATH").unwrap_or_default();
    std::env::split_paths(&folders).any(|folder| folder.join(program).is_file())
}

/// Sees to it that Debian packages are installed: installs the missing ones when run as root.
///
/// # Errors
/// Says which packages to install where this program may not, or the system is not Debian's.
pub fn debian_packages(packages: &[&str]) -> Result<()> {
    let missing: Vec<&str> = packages.iter().copied().filter(|package| !installed(package)).collect();
    if missing.is_empty() {
        return Ok(());
    }
    let root_user = capture(command("id", &["-u"])).is_ok_and(|id| id.trim() == "0");
    if !available("apt-get") || !root_user {
        bail!("not installed: {0} (on Debian, as root: apt-get install {0})", missing.join(" "));
    }
    let apt = |arguments: &[&str]| {
        let mut apt = command("apt-get", &["-qq", "-o", "DPkg::Lock::Timeout=120"]);
        apt.args(arguments).env("DEBIAN_FRONTEND", "noninteractive");
        apt
    };
    println!("installing {}", missing.join(" "));
    capture(apt(&["update"]))?;
    let mut install = apt(&["install", "--yes", "--no-install-recommends"]);
    install.args(&missing);
    capture(install).map(|_| ())
}

fn installed(package: &str) -> bool {
    capture(command("dpkg-query", &["--show", "--showformat=${db:Status-Status}", package]))
        .is_ok_and(|status| status == "installed")
}

fn shown(command: &Command) -> String {
    let words = std::iter::once(command.get_program()).chain(command.get_args());
    words.map(|word| word.to_string_lossy()).collect::<Vec<_>>().join(" ")
}
