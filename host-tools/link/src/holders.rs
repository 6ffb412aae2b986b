//! Who has a port open, as the process table of Linux says.

use std::fs;
use std::path::Path;

/// Length of a command line in a message, characters.
const COMMAND_LENGTH: usize = 60;

/// A process that has a file open.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Holder {
    /// Number of the process.
    pub pid: u32,
    /// Its command line, cut where it is long.
    pub command: String,
}

/// Processes other than this one that have a file open, as far as this user may see them; none where there is no `/proc`.
pub fn holders(path: &Path) -> Vec<Holder> {
    let Ok(target) = path.canonicalize() else { return Vec::new() };
    let processes = fs::read_dir("/proc").into_iter().flatten().flatten();
    processes
        .filter_map(|process| {
            let pid: u32 = process.file_name().to_str()?.parse().ok()?;
            let holds = pid != std::process::id() && has_open(&process.path(), &target);
            holds.then(|| Holder { pid, command: command(&process.path()) })
        })
        .collect()
}

fn has_open(process: &Path, target: &Path) -> bool {
    let files = fs::read_dir(process.join("fd")).into_iter().flatten().flatten();
    files.into_iter().any(|file| fs::read_link(file.path()).is_ok_and(|file| file == target))
}

/// Command line of a process, the program without its folder.
fn command(process: &Path) -> String {
    let line = fs::read(process.join("cmdline")).unwrap_or_default();
    let line = String::from_utf8_lossy(&line);
    let words: Vec<&str> = line.split('\0').filter(|word| !word.is_empty()).collect();
    let Some((program, arguments)) = words.split_first() else {
        return "a program without a name".to_owned();
    };
    let program = program.rsplit('/').next().unwrap_or(program);
    let whole = [&[program], arguments].concat().join(" ");
    if whole.chars().count() <= COMMAND_LENGTH {
        return whole;
    }
    format!("{}...", whole.chars().take(COMMAND_LENGTH).collect::<String>())
}

#[cfg(test)]
mod tests {
    use std::fs::File;
    use std::process::Command;

    use super::*;

    #[test]
    fn a_process_that_has_a_file_open_is_named_with_its_command() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("port");
        fs::write(&path, "").unwrap();
        assert_eq!(holders(&path), []);
        let link = folder.path().join("link");
        std::os::unix::fs::symlink(&path, &link).unwrap();
        let mut child = Command::new("sleep").arg("600").stdin(File::open(&path).unwrap()).spawn().unwrap();
        let expected = [Holder { pid: child.id(), command: "sleep 600".to_owned() }];
        // The child has its command line from the moment on at which it is another program.
        while holders(&link) != expected {
            assert_eq!(child.try_wait().unwrap(), None);
        }
        child.kill().unwrap();
        child.wait().unwrap();
        assert_eq!(holders(&path), []);
    }
}
