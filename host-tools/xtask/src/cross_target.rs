//! The Rust target of the board's processor, on any machine: from rustup, or built from the sources of `core`.

use std::path::Path;
use std::process::Command;
use std::time::Duration;

use crate::core_from_source;
use crate::files::{make_folder, remove, write};
use crate::process::{output, run_within, rustc, target_folder, workspace};
use crate::toolchain::Toolchain;

/// Cortex-M4 with its floating-point unit.
pub const TARGET: &str = "thumbv7em-none-eabihf";

/// Links nothing, but needs `core` and `alloc` for the target.
const PROBE: &str = "#![no_std]\nextern crate alloc;\n";
/// Longest wait for rustup, which may look for a network that is not there.
const RUSTUP_LIMIT: Duration = Duration::from_mins(5);

/// Makes the active toolchain compile for the board.
///
/// # Errors
/// When rustup cannot add the target and its libraries cannot be built either.
pub fn ensure() -> Result<(), String> {
    let folder = target_folder()?.join("xtask-probe");
    if compiles(&folder)? {
        return Ok(());
    }
    add(&folder)?;
    // Cargo does not see that these are other libraries than those that former builds were made with.
    remove(&target_folder()?.join(TARGET))
}

/// Adds the target to the toolchain, by whichever way works.
fn add(folder: &Path) -> Result<(), String> {
    println!("rust target {TARGET}: missing, asking rustup to add it");
    let mut rustup = Command::new("rustup");
    // In the workspace's folder, so that it means the same toolchain as cargo.
    rustup.args(["target", "add", TARGET]).current_dir(workspace());
    let rustup = match run_within(&mut rustup, RUSTUP_LIMIT, &folder.join("rustup.log")) {
        Ok(()) if compiles(folder)? => return Ok(()),
        Ok(()) => "rustup says it is there, but rustc does not find it".to_owned(),
        Err(reason) => reason,
    };
    println!("rust target {TARGET}: not from rustup; building its libraries from source");
    let source = match core_from_source::install(&Toolchain::active()?, TARGET) {
        Ok(from) if compiles(folder)? => {
            println!("rust target {TARGET}: built from {from}");
            return Ok(());
        }
        Ok(from) => format!("what was built from {from} does not compile the probe"),
        Err(reason) => reason,
    };
    Err(missing(&rustup, &source))
}

/// One line that says what was tried and what to do.
fn missing(rustup: &str, source: &str) -> String {
    let one_line = |text: &str| text.split_whitespace().collect::<Vec<_>>().join(" ");
    format!(
        "the Rust target {TARGET} is missing: {}; from source: {}; with rustup and a network, run \
         `rustup target add {TARGET}`",
        one_line(rustup),
        one_line(source)
    )
}

/// Whether rustc has what a crate for the board needs.
fn compiles(folder: &Path) -> Result<bool, String> {
    let probe = folder.join("probe.rs");
    make_folder(folder)?;
    write(&probe, PROBE)?;
    let mut command = rustc(&["--target", TARGET, "--edition", "2024", "--crate-type", "rlib", "--out-dir"]);
    Ok(output(command.arg(folder).arg(&probe)).is_ok())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_missing_target_is_told_in_one_line_with_the_next_step() {
        let line = missing("rustup cannot be started: No such file", "no rust-src 1.95.0\nin Debian");
        assert_eq!(
            line,
            "the Rust target thumbv7em-none-eabihf is missing: rustup cannot be started: No such file; from source: \
             no rust-src 1.95.0 in Debian; with rustup and a network, run `rustup target add thumbv7em-none-eabihf`"
        );
    }
}
