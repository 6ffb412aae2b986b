//! Where results go: checked before the work, written so that no half file is ever left.

use std::fs::{self, File};
use std::io::{self, BufWriter, Write};
use std::path::{Path, PathBuf};

use crate::outcome::Failure;

/// Checks before any long work that `path` can become an output file and is none of the inputs.
///
/// # Errors
/// Names the folder that is missing, the folder that stands in the way, or the input that would be overwritten.
pub fn check_file(path: &Path, inputs: &[&Path]) -> Result<(), Failure> {
    let shown = path.display();
    if path.is_dir() {
        return Err(Failure::bad_input(format!("{shown}: is a folder, expected a file name; add one")));
    }
    let folder = folder_of(path);
    if !folder.is_dir() {
        let folder = folder.display();
        return Err(Failure::bad_input(format!("{shown}: folder {folder} does not exist; create it first")));
    }
    refuse_inputs(path, inputs)
}

/// Checks before any long work that an output folder is there or can be made: its path crosses no file.
///
/// # Errors
/// Names the file that stands where a folder should be.
pub fn check_folder(folder: &Path) -> Result<(), Failure> {
    match folder.ancestors().find(|ancestor| ancestor.exists()) {
        Some(there) if !there.is_dir() => Err(Failure::bad_input(format!(
            "{}: {} is a file, expected a folder; name another folder",
            folder.display(),
            there.display()
        ))),
        _ => Ok(()),
    }
}

/// Creates the output folder with its parents and checks that none of `files` in it is an input.
///
/// # Errors
/// Names the folder that cannot be made, or the input that would be overwritten.
pub fn prepare_folder(folder: &Path, files: &[&str], inputs: &[&Path]) -> Result<(), Failure> {
    check_folder(folder)?;
    fs::create_dir_all(folder).map_err(|error| {
        let reason = describe(&error);
        Failure::bad_input(format!("{}: cannot be made: {reason}; name another folder", folder.display()))
    })?;
    files.iter().try_for_each(|file| refuse_inputs(&folder.join(file), inputs))
}

fn refuse_inputs(path: &Path, inputs: &[&Path]) -> Result<(), Failure> {
    let Ok(target) = path.canonicalize() else { return Ok(()) };
    for input in inputs {
        if input.canonicalize().is_ok_and(|input| input == target) {
            let (path, input) = (path.display(), input.display());
            return Err(Failure::bad_input(format!(
                "{path}: would overwrite the input {input}; name another output"
            )));
        }
    }
    Ok(())
}

/// Removes a file that an earlier run wrote.
///
/// # Errors
/// Exit status 1 with the reason, if the medium refuses.
pub fn remove_file(path: &Path) -> Result<(), Failure> {
    fs::remove_file(path).map_err(|error| {
        Failure::failed(format!(
            "{}: cannot be removed: {}; remove it yourself",
            path.display(),
            describe(&error)
        ))
    })
}

/// Writes a file; it appears under its name only when it is complete.
///
/// # Errors
/// Exit status 1 with the reason, if the medium refuses.
pub fn write_file(
    path: &Path,
    write: impl FnOnce(&mut BufWriter<&File>) -> io::Result<()>,
) -> Result<(), Failure> {
    write_through(path, write).map_err(|error| {
        Failure::failed(format!("{}: cannot be written: {}", path.display(), describe(&error)))
    })
}

/// Writes a text file; it appears under its name only when it is complete.
///
/// # Errors
/// The reason why the medium refuses.
pub fn write_text(path: &Path, text: &str) -> io::Result<()> {
    write_through(path, |file| file.write_all(text.as_bytes()))
}

fn write_through(path: &Path, write: impl FnOnce(&mut BufWriter<&File>) -> io::Result<()>) -> io::Result<()> {
    // A link is followed, so that it goes on pointing where it did.
    let path = path.canonicalize().unwrap_or_else(|_| path.to_owned());
    if path.exists() && !path.is_file() {
        // A device or pipe cannot be replaced by a finished file.
        return fill(&File::options().write(true).open(&path)?, write);
    }
    let mut builder = tempfile::Builder::new();
    builder.prefix(".bowden-").suffix(".partial");
    #[cfg(unix)]
    builder.permissions(std::os::unix::fs::PermissionsExt::from_mode(0o666));
    let partial = builder.tempfile_in(folder_of(&path))?;
    fill(partial.as_file(), write)?;
    partial.persist(&path)?;
    Ok(())
}

fn fill(file: &File, write: impl FnOnce(&mut BufWriter<&File>) -> io::Result<()>) -> io::Result<()> {
    let mut buffered = BufWriter::with_capacity(1 << 18, file);
    write(&mut buffered)?;
    buffered.flush()
}

/// Folder of a file.
pub(crate) fn folder_of(path: &Path) -> PathBuf {
    match path.parent() {
        Some(folder) if folder != Path::new("") => folder.to_owned(),
        _ => PathBuf::from("."),
    }
}

/// What an I/O error says, without the number of the operating system.
pub fn describe(error: &io::Error) -> String {
    let text = error.to_string();
    match text.split_once(" (os error") {
        Some((reason, _)) => reason.to_lowercase(),
        None => text,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_failed_write_leaves_the_old_file_and_no_partial_one() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.csv");
        fs::write(&path, "old").unwrap();
        let failure = write_file(&path, |file| {
            file.write_all(b"half")?;
            Err(io::Error::other("the disk left"))
        })
        .unwrap_err();
        assert!(failure.message().ends_with("cannot be written: the disk left"), "{failure}");
        assert_eq!(fs::read_to_string(&path).unwrap(), "old");
        assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 1);
    }

    #[test]
    fn an_output_that_is_an_input_is_refused_under_any_name() {
        let folder = tempfile::tempdir().unwrap();
        let input = folder.path().join("in.csv");
        fs::write(&input, "t_s").unwrap();
        let other_name = folder.path().join(".").join("in.csv");
        let failure = check_file(&other_name, &[&input]).unwrap_err();
        assert!(failure.message().contains("would overwrite the input"), "{failure}");
        check_file(&folder.path().join("out.csv"), &[&input]).unwrap();
    }
}
