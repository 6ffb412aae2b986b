//! The compiler that the workspace uses, as it describes itself.

use std::path::PathBuf;

use crate::process::{output, rustc};

/// The compiler that the workspace uses.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Toolchain {
    /// Folder that holds its libraries under `lib/rustlib`.
    pub sysroot: PathBuf,
    /// Version, without `rustc` before it.
    pub version: String,
    /// Commit that it was built from.
    pub commit: String,
    /// Target that it compiles for by itself.
    pub host: String,
}

impl Toolchain {
    /// Asks rustc.
    pub fn active() -> Result<Self, String> {
        let sysroot = output(&mut rustc(&["--print", "sysroot"]))?;
        Self::parse(sysroot.trim(), &output(&mut rustc(&["--version", "--verbose"]))?)
    }

    fn parse(sysroot: &str, verbose_version: &str) -> Result<Self, String> {
        let value = |key: &str| {
            let found = verbose_version.lines().find_map(|line| line.strip_prefix(key)?.strip_prefix(": "));
            found.map(str::to_owned).ok_or_else(|| format!("`rustc --version --verbose` tells no {key}"))
        };
        let (version, commit, host) = (value("release")?, value("commit-hash")?, value("host")?);
        Ok(Self { sysroot: sysroot.into(), version, commit, host })
    }

    /// Folder of the compiled libraries of a target.
    pub fn libraries(&self, target: &str) -> PathBuf {
        self.sysroot.join("lib/rustlib").join(target).join("lib")
    }
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use super::*;

    const VERBOSE: &str = "rustc 1.95.0 (59807616e 2026-04-14)\nbinary: rustc\n\
                           commit-hash: 59807616e1fa2540724bfbac14d7976d7e4a3860\ncommit-date: 2026-04-14\n\
                           host: x86_64-unknown-linux-gnu\nrelease: 1.95.0\nLLVM version: 22.1.2\n";

    #[test]
    fn a_toolchain_is_read_from_what_rustc_says() {
        let toolchain = Toolchain::parse("/opt/rust", VERBOSE).unwrap();
        assert_eq!(toolchain.version, "1.95.0");
        assert_eq!(toolchain.commit, "59807616e1fa2540724bfbac14d7976d7e4a3860");
        assert_eq!(toolchain.host, "x86_64-unknown-linux-gnu");
        assert_eq!(
            toolchain.libraries("thumbv7em-none-eabihf"),
            Path::new("/opt/rust/lib/rustlib/thumbv7em-none-eabihf/lib")
        );
        let reason = Toolchain::parse("/opt/rust", "rustc 1.95.0\n").unwrap_err();
        assert_eq!(reason, "`rustc --version --verbose` tells no release");
    }
}
