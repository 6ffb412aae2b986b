//! `core`, `alloc` and `compiler_builtins` for a target, compiled from the standard library's sources and put where
//! rustup would have put them.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

use crate::debian;
use crate::files::{make_folder, remove, write};
use crate::process::output;
use crate::toolchain::Toolchain;

/// Libraries that a crate for the board links.
const LIBRARIES: [&str; 3] = ["core", "alloc", "compiler_builtins"];
/// Debian's suites that may carry the sources of a recent compiler.
const SUITES: [&str; 3] = ["trixie-backports", "forky", "sid"];

/// Builds and installs the libraries; returns what they were built from.
///
/// # Errors
/// When there are no sources of the compiler's own version, they do not compile, or the toolchain's folder cannot be
/// written.
pub fn install(toolchain: &Toolchain, target: &str) -> Result<String, String> {
    let libraries = toolchain.libraries(target);
    // In the toolchain's own folder, because cargo hashes paths into the names of crates: built again, the libraries
    // have the same names, and what was compiled against them stays valid.
    let work = libraries.with_file_name("build");
    remove(&work)?;
    make_folder(&work)?;
    let done = sources(toolchain, &work).and_then(|sources| {
        let compiled = compile(toolchain, target, &sources.folder, &work)?;
        put(&compiled, &libraries)?;
        Ok(sources.origin)
    });
    remove(&work)?;
    if done.is_err()
        && let Some(folder) = work.parent()
    {
        // An empty folder would look like an installed target; one that is not empty stays.
        let _ = fs::remove_dir(folder);
    }
    done
}

/// Sources of the standard library.
struct Sources {
    /// Folder that holds `library`.
    folder: PathBuf,
    /// Where they come from.
    origin: String,
}

impl Sources {
    fn at(folder: PathBuf, origin: &str) -> Option<Self> {
        let complete = folder.join("library/core/src/lib.rs").is_file();
        complete.then(|| Self { folder, origin: origin.to_owned() })
    }
}

/// Sources of exactly the compiler's version, from where they can be had.
fn sources(toolchain: &Toolchain, work: &Path) -> Result<Sources, String> {
    let version = &toolchain.version;
    let folder_name = format!("usr/src/rustc-{version}");
    let here = || {
        let component = toolchain.sysroot.join("lib/rustlib/src/rust");
        Sources::at(component, "the toolchain's component rust-src")
            .or_else(|| Sources::at(Path::new("/").join(&folder_name), "the installed package rust-src"))
    };
    if let Some(sources) = here() {
        return Ok(sources);
    }
    let unpacked = debian::unpack("rust-src", version, &SUITES, work)?;
    Sources::at(unpacked.join(&folder_name), "Debian's package rust-src")
        .ok_or_else(|| format!("Debian's package rust-src holds no {folder_name}/library"))
}

/// Compiles the libraries by way of an empty crate; returns the folder that holds them.
fn compile(toolchain: &Toolchain, target: &str, sources: &Path, work: &Path) -> Result<PathBuf, String> {
    let package = work.join("crate");
    make_folder(&package.join("src"))?;
    write(
        &package.join("Cargo.toml"),
        "[package]\nname = \"libraries\"\nedition = \"2024\"\n[profile.release]\ndebug = false\n[workspace]\n",
    )?;
    write(&package.join("src/lib.rs"), "#![no_std]\nextern crate alloc;\n")?;

    let flags = [
        // Link-time optimisation reads bitcode.
        "-Cembed-bitcode=yes".to_owned(),
        format!("--remap-path-prefix={}=/rustc/{}", sources.display(), toolchain.commit),
    ];
    let mut cargo = Command::new(std::env::var_os("CARGO").unwrap_or_else(|| "cargo".into()));
    cargo
        .args(["build", "--quiet", "--release", "-Zbuild-std=core,alloc"])
        .args(["-Zbuild-std-features=compiler-builtins-mem", "--target", target, "--target-dir"])
        .arg(work.join("target"))
        .current_dir(&package)
        .env_remove("RUSTFLAGS")
        .env_remove("CARGO_BUILD_TARGET")
        .env("CARGO_ENCODED_RUSTFLAGS", flags.join("\u{1f}"))
        // Building the standard library is reserved to nightly compilers; the sources are this compiler's own.
        .env("RUSTC_BOOTSTRAP", "1")
        .env("__CARGO_TESTS_ONLY_SRC_ROOT", sources.join("library"));
    output(&mut cargo)?;
    Ok(work.join("target").join(target).join("release/deps"))
}

/// Replaces the libraries in `to` by those in `from`.
fn put(from: &Path, to: &Path) -> Result<(), String> {
    make_folder(to)?;
    for library in LIBRARIES {
        let compiled = named(from, library)?;
        let [compiled] = compiled.as_slice() else {
            let count = compiled.len();
            return Err(format!("{}: {count} files lib{library}-*.rlib, expected 1", from.display()));
        };
        for old in named(to, library)? {
            fs::remove_file(&old).map_err(|error| format!("{}: {error}", old.display()))?;
        }
        let place = to.join(compiled.file_name().unwrap_or_default());
        fs::copy(compiled, &place).map_err(|error| format!("{}: {error}", place.display()))?;
    }
    Ok(())
}

/// Files `lib<library>-*.rlib` of a folder.
fn named(folder: &Path, library: &str) -> Result<Vec<PathBuf>, String> {
    let entries = fs::read_dir(folder).map_err(|error| format!("{}: {error}", folder.display()))?;
    let paths = entries.filter_map(Result::ok).map(|entry| entry.path());
    let prefix = format!("lib{library}-");
    let fits = |path: &PathBuf| {
        let name = path.file_name().unwrap_or_default().to_string_lossy();
        name.starts_with(&prefix) && path.extension().is_some_and(|end| end == "rlib")
    };
    Ok(paths.filter(fits).collect())
}
