//! Digest of sources, for the build script and its test.

use std::fmt::Write as _;
use std::fs;
use std::io;
use std::path::{Path, PathBuf};

use sha2::{Digest, Sha256};

/// SHA-256 of files and of all files in folders, in hexadecimal: paths relative to `root` and contents. A path that is not there counts as
/// empty.
///
/// # Errors
/// A file or folder that cannot be read.
pub fn digest(root: &Path, paths: &[&str]) -> io::Result<String> {
    let mut files = Vec::new();
    for path in paths {
        collect(&root.join(path), &mut files)?;
    }
    let name = |file: &Path| {
        let parts = file.strip_prefix(root).unwrap_or(file).iter();
        parts.map(|part| part.to_string_lossy().into_owned()).collect::<Vec<_>>().join("/")
    };
    // The order of a folder's listing is that of the file system.
    let mut named: Vec<(String, PathBuf)> = files.into_iter().map(|file| (name(&file), file)).collect();
    named.sort();
    let mut digest = Sha256::new();
    for (name, file) in named {
        let contents = fs::read(file)?;
        for part in [name.as_bytes(), &contents] {
            // The length keeps bytes from moving between names and contents unseen.
            digest.update((part.len() as u64).to_le_bytes());
            digest.update(part);
        }
    }
    Ok(digest.finalize().iter().fold(String::new(), |mut text, byte| {
        // Writing to a String cannot fail.
        let _ = write!(text, "{byte:02x}");
        text
    }))
}

fn collect(path: &Path, files: &mut Vec<PathBuf>) -> io::Result<()> {
    if path.is_dir() {
        for entry in fs::read_dir(path)? {
            collect(&entry?.path(), files)?;
        }
    } else if path.is_file() {
        files.push(path.to_owned());
    }
    Ok(())
}
