//! Lints where the code is compiled: what is built for tests is compiled by clippy's compiler, which is the usual one with lints.
//!
//! `cargo clippy` checks all that ours depend on once more before it comes to ours, in a form that tests cannot use: on two cores that takes
//! longer than the lints of ours do here.

use std::process::Command;

use crate::process::find_program;

/// Clippy's compiler, as rustup installs it with the component `clippy`.
const COMPILER: &str = "clippy-driver";

/// `-D warnings` in the form in which `cargo clippy` hands it on.
const WARNINGS_ARE_ERRORS: &str = "-D__CLIPPY_HACKERY__warnings__CLIPPY_HACKERY__";

/// Has the members of the workspace linted that `command`, a cargo or what starts one, compiles; a warning is an error. Does nothing without
/// clippy.
pub fn linted(command: &mut Command) -> &mut Command {
    if find_program(COMPILER).is_some() {
        command.env("RUSTC_WORKSPACE_WRAPPER", COMPILER).env("CLIPPY_ARGS", WARNINGS_ARE_ERRORS);
    }
    command
}

/// Why [`linted`] does nothing, if so.
pub fn unlinted() -> Option<String> {
    find_program(COMPILER)
        .is_none()
        .then(|| format!("not linted: no {COMPILER}; `rustup component add clippy`"))
}

#[cfg(test)]
mod tests {
    use std::fs;
    use std::process::Output;

    use super::*;
    use crate::process::cargo;

    /// Compiles a package of one function.
    fn compiled(name: &str, function: &str) -> Output {
        let folder = std::env::temp_dir().join(format!("bowden-{name}-{}", std::process::id()));
        fs::create_dir_all(folder.join("src")).unwrap();
        let manifest = format!("[package]\nname = \"{name}\"\nedition = \"2024\"\n[workspace]\n");
        fs::write(folder.join("Cargo.toml"), manifest).unwrap();
        fs::write(folder.join("src/lib.rs"), function).unwrap();
        let mut build = cargo(&["build", "--quiet", "--offline"]);
        build.current_dir(&folder).env("CARGO_TARGET_DIR", folder.join("target"));
        let output = linted(&mut build).output().unwrap();
        fs::remove_dir_all(folder).unwrap();
        output
    }

    #[test]
    fn a_lint_of_clippy_fails_the_build_and_without_one_it_compiles() {
        if unlinted().is_some() {
            println!("skipped: no {COMPILER}");
            return;
        }
        let clean = compiled("clean", "pub fn same(x: f64) -> f64 { x }");
        assert!(clean.status.success(), "{}", String::from_utf8_lossy(&clean.stderr));
        let linted = compiled("untidy", "pub fn same(x: f64) -> f64 { return x; }");
        let said = String::from_utf8_lossy(&linted.stderr);
        assert!(!linted.status.success() && said.contains("clippy::needless_return"), "{said}");
    }
}
