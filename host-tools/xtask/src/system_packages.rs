//! Programs and libraries that the emulator is built with, from the system's packages.
//!
//! Unicorn is C, configured by `CMake` and a script that wants pkg-config, and its bindings are made by libclang. A C
//! compiler is there: it has linked this program. The serial port of the host tools is built without libudev.

use std::fs;
use std::path::{Path, PathBuf};

use crate::debian;
use crate::process::find_program;

/// A package of Debian, and whether what it brings is there, from wherever.
struct Need {
    package: &'static str,
    is_there: fn() -> bool,
}

const NEEDED: [Need; 4] = [
    Need { package: "cmake", is_there: || find_program("cmake").is_some() },
    Need {
        package: "ninja-build",
        is_there: || ["ninja", "make"].map(find_program).iter().any(Option::is_some),
    },
    Need { package: "libclang-dev", is_there: has_libclang },
    Need { package: "pkg-config", is_there: || find_program("pkg-config").is_some() },
];

/// Makes sure that the emulator can be built.
///
/// # Errors
/// When something is missing and may not or cannot be installed.
pub fn ensure() -> Result<(), String> {
    let missing = missing();
    if missing.is_empty() {
        return Ok(());
    }
    let names = missing.join(" ");
    if !debian::has_apt() {
        return Err(format!(
            "the emulator needs packages that are missing; install what Debian calls {names}"
        ));
    }
    if !debian::is_root() {
        return Err(format!("the emulator needs packages that are missing: sudo apt-get install {names}"));
    }
    println!("packages {names}: missing, installing them");
    debian::install(&missing)?;
    match self::missing().as_slice() {
        [] => Ok(()),
        [still, ..] => Err(format!("{still} is installed, but what the emulator needs of it is not found")),
    }
}

fn missing() -> Vec<&'static str> {
    NEEDED.iter().filter(|need| !(need.is_there)()).map(|need| need.package).collect()
}

/// Whether libclang and the compiler's own headers are where the bindings' generator finds them.
fn has_libclang() -> bool {
    if let Some(named) = std::env::var_os("LIBCLANG_PATH") {
        // Named by hand, and maybe a place that only its owner understands.
        return Path::new(&named).exists();
    }
    let mut folders: Vec<PathBuf> = ["/usr/lib", "/usr/lib64", "/usr/local/lib"].map(PathBuf::from).into();
    folders.extend(entries(Path::new("/usr/lib")).filter(|path| is_llvm(path)).map(|path| path.join("lib")));
    folders.iter().any(|folder| is_complete(folder))
}

fn entries(folder: &Path) -> impl Iterator<Item = PathBuf> + use<> {
    fs::read_dir(folder).into_iter().flatten().filter_map(Result::ok).map(|entry| entry.path())
}

fn is_llvm(path: &Path) -> bool {
    path.file_name().is_some_and(|name| name.to_string_lossy().starts_with("llvm-"))
}

fn is_libclang(path: &Path) -> bool {
    let name = path.file_name().unwrap_or_default().to_string_lossy();
    let rest = name.strip_prefix("libclang");
    // libclang-cpp.so is another library.
    let rest = rest.map(|rest| rest.trim_start_matches(|c: char| c == '-' || c == '.' || c.is_ascii_digit()));
    rest.is_some_and(|rest| rest == "so" || rest.starts_with("so."))
}

/// Whether a folder holds libclang and, in `clang/<version>/include`, headers such as `stddef.h`, without which nothing
/// is parsed. Debian has a package with the library alone.
fn is_complete(folder: &Path) -> bool {
    // Where there is a /usr/lib64, the headers may still stand in /usr/lib.
    let headers = ["clang", "../lib/clang"].map(|place| folder.join(place));
    let has_headers =
        |versions: &PathBuf| entries(versions).any(|version| version.join("include/stddef.h").is_file());
    entries(folder).any(|file| is_libclang(&file)) && headers.iter().any(has_headers)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn libclang_is_told_from_its_neighbours() {
        for name in
            ["libclang.so", "libclang-14.so", "libclang.so.1", "libclang-14.so.14.0.6", "libclang-14.0.6.so"]
        {
            assert!(is_libclang(&Path::new("/usr/lib").join(name)), "{name}");
        }
        for name in
            ["libclang-cpp.so.14", "libclang-cpp14.so", "libclangAST.a", "libclang.a", "libLLVM-14.so"]
        {
            assert!(!is_libclang(&Path::new("/usr/lib").join(name)), "{name}");
        }
    }

    #[test]
    fn a_libclang_without_its_headers_does_not_count() {
        let folder = std::env::temp_dir().join(format!("xtask-libclang-{}", std::process::id()));
        let headers = folder.join("clang/14.0.6/include");
        fs::create_dir_all(&headers).unwrap();
        let nothing = is_complete(&folder);
        fs::write(folder.join("libclang-14.so.1"), "").unwrap();
        let library = is_complete(&folder);
        fs::write(headers.join("stddef.h"), "").unwrap();
        let both = is_complete(&folder);
        fs::remove_dir_all(&folder).unwrap();
        assert_eq!([nothing, library, both], [false, false, true]);
    }
}
