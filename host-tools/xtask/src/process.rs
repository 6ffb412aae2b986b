//! Other programs: cargo, and what the workspace builds.

use std::path::{Path, PathBuf};
use std::process::Command;

/// Folder of the workspace.
pub fn workspace() -> PathBuf {
    let here = Path::new(env!("CARGO_MANIFEST_DIR"));
    here.ancestors().nth(2).unwrap_or(here).to_owned()
}

/// Folder of recordings that are not part of the workspace; tests on real data read them where it is there.
pub fn shared() -> PathBuf {
    workspace().join("..").join("shared")
}

/// The cargo that started this program, in the workspace's folder.
pub fn cargo(arguments: &[&str]) -> Command {
    let mut command = Command::new(std::env::var_os("CARGO").unwrap_or_else(|| "cargo".into()));
    command.current_dir(workspace()).args(arguments);
    command
}

/// Runs a program to its end.
///
/// # Errors
/// When it cannot be started or does not end with one of the accepted exit statuses.
pub fn run(command: &mut Command, accepted: &[i32]) -> Result<(), String> {
    let name = command.get_program().to_string_lossy().into_owned();
    let status = command.status().map_err(|error| format!("{name} cannot be started: {error}"))?;
    match status.code() {
        Some(code) if accepted.contains(&code) => Ok(()),
        _ => {
            let arguments: Vec<_> = command.get_args().map(|a| a.to_string_lossy()).collect();
            Err(format!("`{name} {}` failed ({status}); what it says above tells why", arguments.join(" ")))
        }
    }
}

/// A program that `cargo build --release` made, beside the folder that this program was built into.
///
/// # Errors
/// When it is not there.
pub fn built(name: &str) -> Result<PathBuf, String> {
    let here = std::env::current_exe().map_err(|error| format!("this program's own path: {error}"))?;
    let path = here
        .parent()
        .and_then(Path::parent)
        .unwrap_or(&here)
        .join("release")
        .join(format!("{name}{}", std::env::consts::EXE_SUFFIX));
    if path.exists() { Ok(path) } else { Err(format!("{} is not there after the build", path.display())) }
}
