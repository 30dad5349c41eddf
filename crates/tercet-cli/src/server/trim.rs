//! A limit on what the encoded meshes on a disk take up.

use std::fs;
use std::io;
use std::path::{Path, PathBuf};
use std::time::SystemTime;

use super::catalogue::SUFFIX;

/// Digits of a SHA-256, with which the names of encoded meshes begin.
const DIGEST_DIGITS: usize = 64;

/// Removes encoded meshes, the oldest first, until those in `folder` take up at most `limit` bytes or
/// `newest` is the only one left. Files of other names are neither counted nor touched. O(n log n) in
/// the folder's files.
///
/// # Errors
/// If the folder cannot be read, or a file cannot be removed.
pub fn trim(folder: &Path, limit: u64, newest: Option<&str>) -> io::Result<()> {
    let mut files = encoded_meshes(folder)?;
    let mut bytes: u64 = files.iter().map(|file| file.bytes).sum();
    files.sort_by_key(|file| file.written);
    for file in files.iter().filter(|file| newest.is_none_or(|newest| !file.path.ends_with(newest))) {
        if bytes <= limit {
            break;
        }
        match fs::remove_file(&file.path) {
            // Another server that uses the same folder was faster.
            Err(error) if error.kind() == io::ErrorKind::NotFound => {}
            done => done?,
        }
        bytes -= file.bytes;
    }
    Ok(())
}

struct File {
    path: PathBuf,
    bytes: u64,
    written: SystemTime,
}

fn encoded_meshes(folder: &Path) -> io::Result<Vec<File>> {
    let mut found = Vec::new();
    for entry in fs::read_dir(folder)? {
        let entry = entry?;
        // One that vanishes meanwhile takes up nothing.
        let Ok(meta) = entry.metadata() else { continue };
        if meta.is_file() && entry.file_name().to_str().is_some_and(is_encoded_mesh) {
            found.push(File { path: entry.path(), bytes: meta.len(), written: meta.modified()? });
        }
    }
    Ok(found)
}

/// Whether a file's name is one that the cache gives: nothing else in the folder is the server's own.
fn is_encoded_mesh(name: &str) -> bool {
    let digest = name.split('-').next().unwrap_or_default();
    let is_digest = digest.len() == DIGEST_DIGITS && digest.bytes().all(|digit| digit.is_ascii_hexdigit());
    is_digest && name.len() > DIGEST_DIGITS && name.ends_with(SUFFIX)
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::time::Duration;

    /// A file of ten bytes, the older the smaller its number.
    fn write(folder: &Path, number: u64, suffix: &str) -> String {
        let name = format!("{number:064x}-{suffix}");
        fs::write(folder.join(&name), [0; 10]).unwrap();
        let file = fs::File::options().write(true).open(folder.join(&name)).unwrap();
        file.set_modified(SystemTime::UNIX_EPOCH + Duration::from_secs(number)).unwrap();
        name
    }

    fn names(folder: &Path) -> Vec<String> {
        let mut names: Vec<_> = fs::read_dir(folder).unwrap().map(|file| file.unwrap().file_name()).collect();
        names.sort();
        names.into_iter().map(|name| name.into_string().unwrap()).collect()
    }

    #[test]
    fn the_oldest_go_first_and_only_as_many_as_have_to() {
        let folder = tempfile::tempdir().unwrap();
        let written = [3, 1, 2, 4].map(|number| write(folder.path(), number, "obj-exact.tct"));
        trim(folder.path(), 40, None).unwrap();
        assert_eq!(names(folder.path()).len(), 4);
        trim(folder.path(), 29, None).unwrap();
        assert_eq!(names(folder.path()), [&written[0], &written[3]].map(String::from));
        trim(folder.path(), 0, None).unwrap();
        assert!(names(folder.path()).is_empty());
    }

    #[test]
    fn the_newest_stays_however_small_the_limit() {
        let folder = tempfile::tempdir().unwrap();
        let first = write(folder.path(), 1, "obj-exact.tct");
        write(folder.path(), 2, "obj-exact.tct");
        trim(folder.path(), 5, Some(&first)).unwrap();
        assert_eq!(names(folder.path()), [first]);
    }

    #[test]
    fn files_of_other_people_are_not_touched() {
        let folder = tempfile::tempdir().unwrap();
        write(folder.path(), 1, "notes.txt");
        for name in ["mesh.tct", "0123-obj-exact.tct"] {
            fs::write(folder.path().join(name), [0; 10]).unwrap();
        }
        fs::create_dir(folder.path().join(format!("{:064x}-obj.tct", 0))).unwrap();
        trim(folder.path(), 0, None).unwrap();
        assert_eq!(names(folder.path()).len(), 4);
    }
}
