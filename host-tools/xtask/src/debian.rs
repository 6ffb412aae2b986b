//! Debian's packages: installing them, and sources of a release that this machine does not run.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

use crate::files::{make_folder, write};
use crate::process::{find_program, output, run};

/// Used where apt names no mirror of its own.
const DEFAULT_MIRROR: &str = "http://deb.debian.org/debian";
const KEYRING: &str = "/usr/share/keyrings/debian-archive-keyring.gpg";

/// Whether packages come by apt here.
pub fn has_apt() -> bool {
    find_program("apt-get").is_some()
}

/// Whether this program may install packages.
pub fn is_root() -> bool {
    output(Command::new("id").arg("-u")).is_ok_and(|user| user.trim() == "0")
}

/// Installs packages; their lists are brought up to date only when they do not suffice as they are.
///
/// # Errors
/// When apt-get cannot.
pub fn install(packages: &[&str]) -> Result<(), String> {
    let attempt = || {
        let mut install = Command::new("apt-get");
        install.args(["-qq", "-y", "--no-install-recommends", "install"]).args(packages);
        output(install.env("DEBIAN_FRONTEND", "noninteractive"))
    };
    if attempt().is_ok() {
        return Ok(());
    }
    run(Command::new("apt-get").args(["-qq", "update"]), &[0])?;
    attempt().map(drop)
}

/// Downloads a package of one upstream version from a list of suites, without a trace in the machine's own apt, and
/// unpacks it.
///
/// # Errors
/// When no suite has that version, or apt or dpkg fail.
pub fn unpack(package: &str, version: &str, suites: &[&str], folder: &Path) -> Result<PathBuf, String> {
    if !has_apt() || find_program("dpkg-deb").is_none() {
        return Err("this is no Debian with apt-get and dpkg-deb".to_owned());
    }
    if !Path::new(KEYRING).exists() {
        return Err(format!("{KEYRING} is missing (package debian-archive-keyring)"));
    }
    let mut tried = Vec::new();
    for suite in suites {
        let apt = PrivateApt::new(&folder.join(suite), suite)?;
        if let Err(reason) = output(apt.command("apt-get").args(["-qq", "update"])) {
            tried.push(format!("{suite}: {reason}"));
            continue;
        }
        let listed = output(apt.command("apt-cache").args(["madison", package]))?;
        let Some(full) = full_version(&listed, version) else {
            tried.push(format!("{suite}: another version"));
            continue;
        };
        let mut download = apt.command("apt-get");
        output(download.args(["-qq", "download", &format!("{package}={full}")]).current_dir(&apt.folder))?;
        let unpacked = folder.join("unpacked");
        output(Command::new("dpkg-deb").arg("-x").arg(apt.downloaded(package)?).arg(&unpacked))?;
        return Ok(unpacked);
    }
    Err(format!("no {package} {version} in Debian ({})", tried.join("; ")))
}

/// Lists and cache of apt in a folder of their own.
struct PrivateApt {
    folder: PathBuf,
}

impl PrivateApt {
    fn new(folder: &Path, suite: &str) -> Result<Self, String> {
        for part in ["lists/partial", "cache/archives/partial"] {
            make_folder(&folder.join(part))?;
        }
        let known = output(Command::new("apt-get").args([
            "indextargets",
            "--format",
            "$(REPO_URI)",
            "Created-By: Packages",
        ]))
        .unwrap_or_default();
        let list = folder.join("sources.list");
        let source = format!("deb [signed-by={KEYRING}] {} {suite} main\n", mirror(&known));
        write(&list, &source)?;
        let options = [
            format!("Dir::Etc::SourceList \"{}\";", list.display()),
            "Dir::Etc::SourceParts \"/dev/null\";".to_owned(),
            format!("Dir::State::Lists \"{}\";", folder.join("lists").display()),
            format!("Dir::Cache \"{}\";", folder.join("cache").display()),
            // Its own user could not enter a folder of ours.
            "APT::Sandbox::User \"root\";".to_owned(),
            "Acquire::Languages \"none\";".to_owned(),
            // Otherwise lists that cannot be had are a warning.
            "APT::Update::Error-Mode \"any\";\n".to_owned(),
        ];
        write(&folder.join("apt.conf"), &options.join("\n"))?;
        Ok(Self { folder: folder.to_owned() })
    }

    fn command(&self, program: &str) -> Command {
        let mut command = Command::new(program);
        command.env("APT_CONFIG", self.folder.join("apt.conf"));
        command
    }

    fn downloaded(&self, package: &str) -> Result<PathBuf, String> {
        let named = |path: &PathBuf| {
            let name = path.file_name().unwrap_or_default().to_string_lossy();
            name.starts_with(&format!("{package}_")) && name.ends_with(".deb")
        };
        let entries =
            fs::read_dir(&self.folder).map_err(|error| format!("{}: {error}", self.folder.display()))?;
        let found = entries.filter_map(Result::ok).map(|entry| entry.path()).find(named);
        found.ok_or_else(|| format!("apt-get has left no {package} in {}", self.folder.display()))
    }
}

/// The mirror of Debian's main archive among the addresses that apt uses.
fn mirror(repositories: &str) -> &str {
    let is_debian = |line: &&str| line.trim_end_matches('/').ends_with("/debian");
    repositories.lines().map(str::trim).find(is_debian).unwrap_or(DEFAULT_MIRROR)
}

/// Debian's version of a package by its upstream version, from `apt-cache madison`.
fn full_version<'a>(listed: &'a str, upstream: &str) -> Option<&'a str> {
    let versions = listed.lines().filter_map(|line| line.split('|').nth(1)).map(str::trim);
    let mut matching = versions.filter(|version| {
        let rest = version.strip_prefix(upstream);
        rest.is_some_and(|rest| rest.starts_with(['+', '-', '~']))
    });
    matching.next()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_mirror_is_the_one_of_debians_main_archive() {
        let repositories = "https://deb.nodesource.com/node_20.x/\nhttp://deb.debian.org/debian-security/\n\
                            http://ftp.example.org/debian/\n";
        assert_eq!(mirror(repositories), "http://ftp.example.org/debian/");
        assert_eq!(mirror("http://archive.ubuntu.com/ubuntu/\n"), "http://deb.debian.org/debian");
    }

    #[test]
    fn only_the_same_upstream_version_is_taken() {
        let listed = "  rust-src | 1.95.10+dfsg-1 | http://d.example/debian sid/main amd64 Packages\n  \
                      rust-src | 1.95.0+dfsg1-2 | http://d.example/debian sid/main amd64 Packages\n";
        assert_eq!(full_version(listed, "1.95.0"), Some("1.95.0+dfsg1-2"));
        assert_eq!(full_version(listed, "1.95.1"), None);
        assert_eq!(full_version("", "1.95.0"), None);
    }
}
