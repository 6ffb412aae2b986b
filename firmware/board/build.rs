//! Hands the linker the memory map of the workspace's top folder, and the image its revision.

#[path = "../revision.rs"]
mod revision;

use std::path::PathBuf;
use std::{env, fs};

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let map = PathBuf::from(env::var("CARGO_MANIFEST_DIR")?).join("../../memory.x");
    let out = PathBuf::from(env::var("OUT_DIR")?);
    fs::copy(&map, out.join("memory.x")).map_err(|error| format!("{}: {error}", map.display()))?;
    println!("cargo::rustc-link-search={}", out.display());
    println!("cargo::rerun-if-changed={}", map.display());
    revision::emit(&[
        "build.rs",
        "../revision.rs",
        "src",
        "../control/src",
        "../link/src",
        "../../model/src",
    ]);
    Ok(())
}
