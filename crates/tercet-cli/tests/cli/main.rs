//! The command as a person runs it: arguments in; files, lines and exit statuses out.

mod decode;
mod demo;
mod encode;
mod info;
mod metrics;
mod subdivide;
mod verify;

use std::io::Write;
use std::path::{Path, PathBuf};
use std::process::{Command, Output, Stdio};

use tercet::io::Format;
use tercet::{Limits, Mesh};

/// A folder of its own for a test, in which its commands run.
struct Folder(PathBuf);

/// What a command left behind.
struct Run {
    status: i32,
    out: Vec<u8>,
    err: String,
}

impl Folder {
    fn new(test: &str) -> Self {
        let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join(test);
        let _ = std::fs::remove_dir_all(&folder);
        std::fs::create_dir_all(&folder).unwrap();
        Folder(folder)
    }

    fn path(&self, name: &str) -> PathBuf {
        self.0.join(name)
    }

    fn read(&self, name: &str) -> Vec<u8> {
        std::fs::read(self.path(name)).unwrap()
    }

    fn write(&self, name: &str, bytes: impl AsRef<[u8]>) {
        std::fs::write(self.path(name), bytes).unwrap();
    }

    fn exists(&self, name: &str) -> bool {
        self.path(name).exists()
    }

    fn mesh(&self, name: &str) -> Mesh {
        let format = Format::from_path(Path::new(name)).unwrap();
        tercet::io::read(&self.read(name), format, &Limits::default()).unwrap().mesh
    }

    fn write_mesh(&self, name: &str, mesh: &Mesh) {
        let format = Format::from_path(Path::new(name)).unwrap();
        let mut bytes = Vec::new();
        tercet::io::write(mesh, format, &mut bytes).unwrap();
        self.write(name, bytes);
    }

    fn command(&self, arguments: &str) -> Command {
        let mut command = Command::new(env!("CARGO_BIN_EXE_tercet"));
        command.args(arguments.split_whitespace()).current_dir(&self.0);
        command
    }

    /// Runs `tercet` with arguments that contain no spaces.
    fn run(&self, arguments: &str) -> Run {
        Run::new(self.command(arguments).stdin(Stdio::null()).output().unwrap())
    }

    /// As [`Folder::run`], with `input` on standard input.
    fn run_with(&self, arguments: &str, input: Vec<u8>) -> Run {
        let mut command = self.command(arguments);
        command.stdin(Stdio::piped()).stdout(Stdio::piped()).stderr(Stdio::piped());
        let mut child = command.spawn().unwrap();
        let mut stdin = child.stdin.take().unwrap();
        // From a thread of its own: the child may write before it has read everything. It may
        // also have seen enough and close its end.
        let feeder = std::thread::spawn(move || stdin.write_all(&input));
        let run = Run::new(child.wait_with_output().unwrap());
        let _ = feeder.join().unwrap();
        run
    }

    /// Runs a command that must succeed, and returns its standard output.
    fn good(&self, arguments: &str) -> String {
        let run = self.run(arguments);
        assert_eq!((run.status, run.err.as_str()), (0, ""), "tercet {arguments}");
        run.text()
    }

    /// Runs a command that must fail, and returns its message: one line.
    fn failed(&self, arguments: &str) -> String {
        let run = self.run(arguments);
        assert_eq!(run.status, 1, "tercet {arguments}: {}", run.err);
        assert_eq!(run.err.lines().count(), 1, "{}", run.err);
        run.err.trim_end().to_string()
    }
}

impl Run {
    fn new(output: Output) -> Self {
        Run {
            status: output.status.code().expect("an exit status, not a signal"),
            out: output.stdout,
            err: String::from_utf8(output.stderr).unwrap(),
        }
    }

    fn text(&self) -> String {
        String::from_utf8(self.out.clone()).unwrap()
    }
}

#[test]
fn wrong_usage_exits_with_2() {
    let folder = Folder::new("usage");
    for arguments in
        ["", "bake", "encode", "encode a.obj --bits 3", "encode a.obj --bits 25", "decode a.tct --level"]
    {
        assert_eq!(folder.run(arguments).status, 2, "tercet {arguments}");
    }
    for arguments in [
        "encode a.obj --update half",
        "encode a.obj --format glb",
        "decode a.tct --level 1 --bytes 100",
        "decode a.tct --max-error -1",
        "info a.tct --max-memory much",
        "subdivide a.obj -o b.obj --scheme loop --steps 1",
        "serve",
        "serve . --store s3://bucket",
        "serve . --max-connections 0",
        "serve . --stall-timeout -1",
        "serve . --log xml",
        "fetch http://a/b.tct --protocol ftp",
        "fetch http://a/b.tct --level 1 --max-error 0.1",
    ] {
        assert_eq!(folder.run(arguments).status, 2, "tercet {arguments}");
    }
}

#[test]
fn help_and_version_are_answers() {
    let folder = Folder::new("help");
    assert!(folder.good("--version").starts_with("tercet "));
    let help = folder.good("--help");
    for command in
        ["encode", "decode", "info", "verify", "metrics", "subdivide", "demo", "fetch", "serve", "view"]
    {
        assert!(help.contains(command), "{command} is not in:\n{help}");
        assert!(folder.good(&format!("{command} --help")).contains("Usage: tercet"));
    }
}
