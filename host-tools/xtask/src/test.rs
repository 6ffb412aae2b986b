//! `cargo xtask test`: all tests that need neither hardware nor another toolchain.

use crate::process::{self, cargo, shared};

/// Runs the unit tests of the firmware's library and the tests of all other members, whose closing lines come last.
///
/// # Errors
/// When a test fails.
pub fn run() -> Result<(), String> {
    let data = shared().join("data");
    let mut rest = cargo(&["test"]);
    if data.is_dir() {
        println!("real recordings: {}", data.display());
    } else {
        // Passed tests are silent otherwise, and a skipped one passes.
        rest.args(["--", "--show-output"]);
        println!(
            "real recordings: none, {} is not there; each test that misses one prints a line `skipped: ...`",
            data.display()
        );
    }
    process::run(&mut cargo(&["test", "--package", "bowden-firmware", "--lib"]), &[0])?;
    process::run(&mut rest, &[0])
}
