//! Inputs that found something, kept in the repository.

use std::fs;
use std::path::{Path, PathBuf};

/// Folder of a target's inputs.
pub fn folder(target: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("corpus").join(target)
}

/// Name and bytes of every input of a target, sorted by name.
///
/// # Panics
/// When a file that is listed cannot be read.
pub fn inputs(target: &str) -> Vec<(String, Vec<u8>)> {
    let Ok(entries) = fs::read_dir(folder(target)) else { return Vec::new() };
    let mut inputs: Vec<(String, Vec<u8>)> = entries
        .map(|entry| entry.expect("a listed folder can be read").path())
        .map(|path| (path.display().to_string(), fs::read(&path).expect("a listed file can be read")))
        .collect();
    inputs.sort();
    inputs
}
