//! Hands the linker the memory map of the workspace's top folder and what lies in the CCM SRAM, and the image its revision.

#[path = "../revision.rs"]
mod revision;

use std::path::PathBuf;
use std::{env, fs};

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let map = PathBuf::from(env::var("CARGO_MANIFEST_DIR")?).join("../../memory.x");
    let out = PathBuf::from(env::var("OUT_DIR")?);
    let copy = |from: &PathBuf, name: &str| {
        fs::copy(from, out.join(name)).map_err(|error| format!("{}: {error}", from.display()))
    };
    copy(&map, "memory.x")?;
    let ccm = PathBuf::from(env::var("CARGO_MANIFEST_DIR")?).join("ccm.x");
    copy(&ccm, "ccm.x")?;
    println!("cargo::rustc-link-search={}", out.display());
    println!("cargo::rerun-if-changed={}", map.display());
    println!("cargo::rerun-if-changed={}", ccm.display());
    revision::emit(&[
        "build.rs",
        "ccm.x",
        "../revision.rs",
        "src",
        "../control/src",
        "../link/src",
        "../../model/src",
    ]);
    Ok(())
}
