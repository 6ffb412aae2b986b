//! Gives the library a digest of the sources that its results depend on.

#[path = "build/sources.rs"]
mod sources;

use std::path::Path;

/// Below the workspace: the library, the physics, and the versions of their dependencies. What is beside them (command, Python package,
/// documents) changes no result.
const SOURCES: [&str; 5] =
    ["Cargo.lock", "host-tools/core/Cargo.toml", "host-tools/core/src", "model/Cargo.toml", "model/src"];

fn main() {
    let root = Path::new("../..");
    let digest = sources::digest(root, &SOURCES).expect("sources that are compiled can be read");
    println!("cargo::rustc-env=BOWDEN_SOURCES={digest}");
    println!("cargo::rerun-if-changed=build.rs");
    println!("cargo::rerun-if-changed=build");
    for path in SOURCES.map(|path| root.join(path)).iter().filter(|path| path.exists()) {
        println!("cargo::rerun-if-changed={}", path.display());
    }
}
