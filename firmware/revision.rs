//! Revision of the sources that a program is built from, for build scripts.

use std::path::Path;
use std::process::Command;

/// Sets the environment variable `BOWDEN_REVISION` of the crate to the commit, with `+` behind it if files differ from it;
/// `unknown` outside a repository. `sources` are the folders that the program is built from, relative to the crate.
pub fn emit(sources: &[&str]) {
    let commit = git(&["rev-parse", "--short=12", "HEAD"]);
    let changed =
        git(&["status", "--porcelain", "--untracked-files=no"]).is_some_and(|files| !files.is_empty());
    let revision = commit.map_or("unknown".to_owned(), |commit| if changed { commit + "+" } else { commit });
    println!("cargo::rustc-env=BOWDEN_REVISION={revision}");
    let log = git(&["rev-parse", "--git-path", "logs/HEAD"]);
    for path in sources.iter().copied().chain(log.as_deref()).filter(|path| Path::new(path).exists()) {
        println!("cargo::rerun-if-changed={path}");
    }
}

fn git(arguments: &[&str]) -> Option<String> {
    let output =
        Command::new("git").args(arguments).output().ok().filter(|output| output.status.success())?;
    Some(String::from_utf8(output.stdout).ok()?.trim().to_owned())
}
