//! `cargo xtask clippy`: lints of the whole workspace, warnings as errors.

use crate::process::{self, EMULATED_BOARD, cargo};
use crate::{cross_target, firmware, python, system_packages};

/// Checks what runs on a host, then the images for the board.
///
/// # Errors
/// When there is a warning, or something that is needed for building is missing.
pub fn run() -> Result<(), String> {
    system_packages::ensure()?;
    cross_target::ensure()?;
    // The same selections as for the tests: with another one cargo would choose other features of the dependencies, and
    // compile the emulator once more.
    let python = match python::interpreter() {
        Ok(_) => Some(&python::CRATE as &[&str]),
        Err(reason) => {
            println!("the Python module is not checked: {reason}");
            None
        }
    };
    for selected in [&[] as &[&str], &EMULATED_BOARD].into_iter().chain(python) {
        let mut clippy = cargo(&["clippy", "--all-targets"]);
        clippy.args(selected).args(["--", "-D", "warnings"]);
        process::run(&mut clippy, &[0])?;
    }
    firmware::clippy()
}
