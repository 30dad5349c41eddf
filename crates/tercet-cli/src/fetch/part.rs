//! What has arrived of a file, on disk, so that it need not come again.

use std::ffi::OsString;
use std::fs::{self, File, OpenOptions};
use std::io::{self, Read, Seek, SeekFrom, Write};
use std::path::{Path, PathBuf};

use bytes::Bytes;
use serde_json::{Value, json};

/// Bytes that are read back at a time.
const PORTION: u64 = 1 << 16;

/// The first bytes of a file, in a file beside the output: `OUTPUT.part`; and in `OUTPUT.part.json`
/// where they came from, so that only the same file's rest is put behind them.
pub struct Part {
    file: File,
    bytes: u64,
    tag: Option<String>,
    url: String,
    /// `None` if the output is standard output: then nothing is left behind.
    places: Option<Places>,
}

struct Places {
    part: PathBuf,
    note: PathBuf,
}

impl Part {
    /// What is there of the file at `url` for an output, or nothing if what is there is of another
    /// file or has no entity tag to tell.
    ///
    /// # Errors
    /// If the file cannot be made.
    pub fn open(output: Option<&Path>, url: &str) -> io::Result<Part> {
        let Some(output) = output else {
            let file = tempfile::tempfile()?;
            return Ok(Part { file, bytes: 0, tag: None, url: url.into(), places: None });
        };
        let beside = |suffix: &str| {
            let mut name = OsString::from(output);
            name.push(suffix);
            PathBuf::from(name)
        };
        let places = Places { part: beside(".part"), note: beside(".part.json") };
        let file =
            OpenOptions::new().read(true).write(true).create(true).truncate(false).open(&places.part)?;
        let tag = noted_tag(&places.note, url);
        let bytes = if tag.is_some() { file.metadata()?.len() } else { 0 };
        let mut part = Part { file, bytes, tag, url: url.into(), places: Some(places) };
        part.truncate(bytes)?;
        Ok(part)
    }

    /// How many bytes are there.
    pub fn bytes(&self) -> u64 {
        self.bytes
    }

    /// The entity tag of the file they are of.
    pub fn tag(&self) -> Option<&str> {
        self.tag.as_deref()
    }

    pub fn set_tag(&mut self, tag: Option<String>) -> io::Result<()> {
        if tag != self.tag {
            self.tag = tag;
            if let Some(places) = &self.places {
                fs::write(&places.note, format!("{}\n", json!({ "url": self.url, "etag": self.tag })))?;
            }
        }
        Ok(())
    }

    pub fn append(&mut self, bytes: &[u8]) -> io::Result<()> {
        self.file.seek(SeekFrom::Start(self.bytes))?;
        self.file.write_all(bytes)?;
        self.bytes += bytes.len() as u64;
        Ok(())
    }

    /// Forgets what follows the first `bytes`.
    pub fn truncate(&mut self, bytes: u64) -> io::Result<()> {
        self.bytes = self.bytes.min(bytes);
        self.file.set_len(self.bytes)
    }

    /// Some bytes from `offset` on; `None` at the end.
    pub fn read(&mut self, offset: u64) -> io::Result<Option<Bytes>> {
        let mut bytes = vec![0; self.bytes.saturating_sub(offset).min(PORTION) as usize];
        self.file.seek(SeekFrom::Start(offset))?;
        self.file.read_exact(&mut bytes)?;
        Ok((!bytes.is_empty()).then(|| bytes.into()))
    }

    /// Copies everything to `out`.
    pub fn copy(&mut self, out: &mut dyn Write) -> io::Result<()> {
        self.file.seek(SeekFrom::Start(0))?;
        io::copy(&mut (&self.file).take(self.bytes), out).map(|_| ())
    }

    /// Removes it: it is no longer needed.
    pub fn remove(self) -> io::Result<()> {
        let Some(places) = self.places else { return Ok(()) };
        drop(self.file);
        fs::remove_file(places.part)?;
        match fs::remove_file(places.note) {
            Err(error) if error.kind() != io::ErrorKind::NotFound => Err(error),
            _ => Ok(()),
        }
    }
}

/// The tag in a note about that address. A note that is not as it should be is none.
fn noted_tag(note: &Path, url: &str) -> Option<String> {
    let note: Value = serde_json::from_str(&fs::read_to_string(note).ok()?).ok()?;
    (note["url"] == url).then(|| note["etag"].as_str().map(str::to_owned))?
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_part_of_the_same_file_is_there_again_and_of_another_is_not() {
        let folder = tempfile::tempdir().unwrap();
        let output = folder.path().join("mesh.ply");
        let open = |url| Part::open(Some(&output), url).unwrap();
        let mut part = open("http://a/1.tct");
        part.append(b"12345").unwrap();
        drop(part);
        assert_eq!(open("http://a/1.tct").bytes(), 0, "without a tag");

        let mut part = open("http://a/1.tct");
        part.append(b"12345").unwrap();
        part.set_tag(Some("\"t\"".into())).unwrap();
        part.truncate(4).unwrap();
        part.append(b"x").unwrap();
        drop(part);
        let mut part = open("http://a/1.tct");
        assert_eq!((part.tag(), part.bytes()), (Some("\"t\""), 5));
        assert_eq!(part.read(2).unwrap().unwrap(), "34x");
        assert!(part.read(5).unwrap().is_none() && part.read(50).unwrap().is_none());
        drop(part);
        assert_eq!(open("http://a/2.tct").bytes(), 0, "another address");
        open("http://a/2.tct").remove().unwrap();
        assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 0);
    }
}
