//! Chromium, which the tests of how the report looks render it in.

use crate::debian;
use crate::process::find_program;

/// Where the tests look, but for the program that `CHROMIUM` names.
const NAMES: [&str; 4] = ["chromium", "chromium-browser", "google-chrome", "google-chrome-stable"];

/// Makes sure that the report can be rendered.
///
/// # Errors
/// When there is no browser and none may or can be installed.
pub fn ensure() -> Result<(), String> {
    if is_there() {
        return Ok(());
    }
    if !debian::has_apt() {
        return Err("it is missing; install it, or name one in CHROMIUM".to_owned());
    }
    if !debian::is_root() {
        return Err("it is missing: sudo apt-get install chromium".to_owned());
    }
    println!("package chromium: missing, installing it");
    debian::install(&["chromium"])?;
    if is_there() { Ok(()) } else { Err("the package chromium is installed without its program".to_owned()) }
}

fn is_there() -> bool {
    std::env::var_os("CHROMIUM").is_some() || NAMES.iter().any(|name| find_program(name).is_some())
}
