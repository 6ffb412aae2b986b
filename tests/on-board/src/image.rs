//! Where the images are.

use std::env;
use std::path::PathBuf;

use crate::{Failure, Outcome};

/// Target of the images.
const TARGET: &str = "thumbv7em-none-eabihf";

/// The firmware of the joint driver board: the file that `BOWDEN_FIRMWARE_ELF` names, or the release build.
pub fn firmware() -> Outcome<Vec<u8>> {
    read("BOWDEN_FIRMWARE_ELF", "bowden-firmware")
}

/// The image that runs the control code alone: the file that `BOWDEN_MEASURE_ELF` names, or the release build.
pub fn measure() -> Outcome<Vec<u8>> {
    read("BOWDEN_MEASURE_ELF", "bowden-measure")
}

/// Folder that cargo builds into: the one this program runs from.
pub fn target_folder() -> Outcome<PathBuf> {
    let program = env::current_exe().map_err(|error| Failure(format!("own path: {error}")))?;
    // target/<profile>/deps/<test>, or target/<profile>/<binary>
    let folder = program.ancestors().skip(1).find(|folder| !folder.ends_with("deps"));
    let target = folder.and_then(|profile| profile.parent());
    target
        .map(PathBuf::from)
        .ok_or_else(|| Failure(format!("{}: no target folder above it", program.display())))
}

fn read(variable: &str, name: &str) -> Outcome<Vec<u8>> {
    let path = match env::var_os(variable) {
        Some(path) => PathBuf::from(path),
        None => target_folder()?.join(TARGET).join("release").join(name),
    };
    std::fs::read(&path)
        .map_err(|error| Failure(format!("{}: {error}; build it: cargo xtask firmware", path.display())))
}
