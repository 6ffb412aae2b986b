//! `cargo xtask clippy`: lints of the whole workspace, warnings as errors.

use crate::parts::Parts;
use crate::process::{self, cargo};
use crate::{cross_target, firmware, python, selection, system_packages};

/// Checks what runs on a host, then the images for the board.
///
/// # Errors
/// When there is a warning, or something that is needed for building is missing.
pub fn run(parts: Parts) -> Result<(), String> {
    if parts.host() {
        host()?;
    }
    if parts.board() {
        cross_target::ensure()?;
        firmware::clippy()?;
    }
    Ok(())
}

fn host() -> Result<(), String> {
    system_packages::ensure()?;
    let python = python::interpreter();
    if let Err(reason) = &python {
        println!("the Python module is not checked: {reason}");
    }
    let mut clippy = cargo(&["clippy", "--all-targets"]);
    clippy.args(selection::for_the_host(python.is_ok())).args(["--", "-D", "warnings"]);
    process::run(&mut clippy, &[0])
}
