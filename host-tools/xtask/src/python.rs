//! The Python package: an environment of its own below the target folder, its wheel, its tests.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

use crate::linted::linted;
use crate::process::{self, Said, built, cargo, find_program, target_folder, workspace};

/// Package and crate, below the workspace.
const PACKAGE: &str = "host-tools/python";

/// Folder of environments and wheels, below cargo's target folder.
const FOLDER: &str = "python";

/// Name of the environment of the tests, and the file of its packages.
const OF_TESTS: (&str, &str) = ("environment", "requirements.txt");

/// The crate: only Python loads it, so it is no default member of the workspace.
pub const CRATE: &str = "bowden-python";

/// The interpreter: `PYTHON`, or `python3`. `Err` says why there is none that would do.
///
/// # Errors
/// None is there, or it is older than 3.11.
pub fn interpreter() -> Result<PathBuf, String> {
    let named = std::env::var_os("PYTHON").map(PathBuf::from);
    let path = named.or_else(|| find_program("python3")).ok_or("no python3; install Python 3.11 or newer")?;
    let version = "import sys, venv, ensurepip; sys.exit(sys.version_info < (3, 11))";
    process::output(Command::new(&path).args(["-c", version]))
        .map(|_| path.clone())
        .map_err(|_| format!("{} is older than 3.11 or has no venv; name another in PYTHON", path.display()))
}

/// Makes the environment of the tests if there is an interpreter; [`tests`] says why it could not be made.
pub fn prepare(said: Said) {
    if let (Ok(interpreter), Ok(target)) = (interpreter(), target_folder()) {
        let _ = environment(&interpreter, &target.join(FOLDER), OF_TESTS, said);
    }
}

/// Builds the wheel, installs it and runs pytest, which say what they say to `said`; `programs_are_built` says whether the tests of the host
/// have built what these tests run.
///
/// # Errors
/// When a package cannot be installed, the wheel does not build, or a test fails.
pub fn tests(programs_are_built: bool, said: Said) -> Result<String, String> {
    let interpreter = match interpreter() {
        Ok(interpreter) => interpreter,
        Err(reason) => return Ok(format!("skipped: {reason}")),
    };
    let folder = target_folder()?.join(FOLDER);
    let environment = environment(&interpreter, &folder, OF_TESTS, said)?;
    if !programs_are_built {
        said.run(linted(&mut cargo(&["build", "--package", "bowden", "--package", "virtual-bench"])))?;
    }
    install_wheel(&environment, &folder, "dev", said)?;

    let counts = folder.join("tests.xml");
    let notebooks = folder.join("notebooks");
    fs::create_dir_all(&notebooks).map_err(|error| format!("{}: {error}", notebooks.display()))?;
    let mut pytest = Command::new(program(&environment, "python"));
    pytest.current_dir(workspace().join(PACKAGE)).args(["-m", "pytest", "-rs", "--junit-xml"]).arg(&counts);
    pytest
        .env("BOWDEN_BIN", built("debug", "bowden")?)
        .env("VIRTUAL_BENCH", built("debug", "virtual-bench")?);
    pytest.env("BOWDEN_NOTEBOOKS", &notebooks).env("MPLBACKEND", "agg").env("PYTHONDONTWRITEBYTECODE", "1");
    let ended = said.run(&mut pytest);
    let report = fs::read_to_string(&counts).map_err(|error| format!("{}: {error}", counts.display()))?;
    let counts = Counts::read(&report).ok_or_else(|| format!("{}: no counts of tests", counts.display()))?;
    match ended {
        Ok(()) if counts.passed() == 0 => Err("no test has run".to_owned()),
        Ok(()) => Ok(counts.to_string()),
        Err(_) => Err(counts.to_string()),
    }
}

/// The environment of a name, below `folder`, with the pinned packages of a file of the package, made anew when these have changed.
///
/// # Errors
/// When it cannot be made, or a package cannot be installed.
pub fn environment(
    interpreter: &Path,
    folder: &Path,
    (name, packages): (&str, &str),
    said: Said,
) -> Result<PathBuf, String> {
    let requirements = workspace().join(PACKAGE).join(packages);
    let wanted = fs::read(&requirements).map_err(|error| format!("{}: {error}", requirements.display()))?;
    let environment = folder.join(name);
    let installed = environment.join("requirements.txt");
    if fs::read(&installed).is_ok_and(|there| there == wanted) {
        return Ok(environment);
    }
    println!("Python environment: installing the packages of {}", requirements.display());
    said.run(Command::new(interpreter).args(["-m", "venv", "--clear"]).arg(&environment))?;
    let mut pip = pip(&environment);
    pip.args(["install", "--quiet", "--only-binary", ":all:", "--requirement"]).arg(&requirements);
    said.run(&mut pip)?;
    fs::write(&installed, wanted).map_err(|error| format!("{}: {error}", installed.display()))?;
    Ok(environment)
}

/// The one wheel among the files of a folder.
///
/// # Errors
/// There is none or more than one, or it is not of the stable ABI and so fits the Python alone that built it.
fn wheel_for_every_python(files: &[PathBuf]) -> Result<&Path, String> {
    let wheels: Vec<&PathBuf> =
        files.iter().filter(|path| path.extension().is_some_and(|e| e == "whl")).collect();
    let [wheel] = wheels[..] else {
        return Err(format!("{} wheels after the build, expected one", wheels.len()));
    };
    // NAME-VERSION-PYTHON-ABI-PLATFORM.whl
    let name = wheel.file_name().unwrap_or_default().to_string_lossy();
    if name.rsplit('-').nth(1) == Some("abi3") {
        Ok(wheel)
    } else {
        Err(format!(
            "{name}: not built for the stable ABI (abi3); correct the features of {PACKAGE}/Cargo.toml"
        ))
    }
}

/// Builds the wheel and installs it. Tests take the profile of the other tests, `dev`: what `pip install` builds for users, `release`, is the
/// same, optimised further.
///
/// # Errors
/// When it does not build, is not of the stable ABI, or cannot be installed.
pub fn install_wheel(environment: &Path, folder: &Path, profile: &str, said: Said) -> Result<(), String> {
    let wheels = folder.join("wheels");
    // Of an earlier version nothing may be left that could be installed instead.
    let _ = fs::remove_dir_all(&wheels);
    let mut maturin = Command::new(program(environment, "maturin"));
    maturin.current_dir(workspace()).args(["build", "--profile", profile, "--locked", "--manifest-path"]);
    maturin.arg(format!("{PACKAGE}/Cargo.toml")).arg("--out").arg(&wheels);
    maturin.arg("--interpreter").arg(program(environment, "python"));
    // The same packages as for the tests of the host, compiled for both.
    said.run(if profile == "dev" { linted(&mut maturin) } else { &mut maturin })?;
    let entries = fs::read_dir(&wheels).map_err(|error| format!("{}: {error}", wheels.display()))?;
    let files: Vec<PathBuf> = entries.flatten().map(|entry| entry.path()).collect();
    let wheel = wheel_for_every_python(&files).map_err(|error| format!("{}: {error}", wheels.display()))?;
    println!("wheel: {}", wheel.display());
    let mut pip = pip(environment);
    pip.args(["install", "--quiet", "--no-deps", "--force-reinstall"]).arg(wheel);
    said.run(&mut pip)
}

fn pip(environment: &Path) -> Command {
    let mut pip = Command::new(program(environment, "python"));
    pip.args(["-m", "pip", "--disable-pip-version-check"]);
    pip
}

/// A program of an environment.
pub fn program(environment: &Path, name: &str) -> PathBuf {
    let folder = if cfg!(windows) { "Scripts" } else { "bin" };
    environment.join(folder).join(format!("{name}{}", std::env::consts::EXE_SUFFIX))
}

/// What became of the tests, from the file that pytest writes.
#[derive(Debug, PartialEq, Eq)]
struct Counts {
    run: u32,
    failed: u32,
    skipped: u32,
}

impl Counts {
    fn read(xml: &str) -> Option<Self> {
        let suite = xml.split_once("<testsuite ")?.1;
        let suite = suite.split_once('>')?.0;
        let count = |name: &str| -> Option<u32> {
            let value = suite.split_once(&format!("{name}=\""))?.1;
            value.split_once('"')?.0.parse().ok()
        };
        Some(Self {
            run: count(" tests")?,
            failed: count(" failures")? + count(" errors").or_else(|| count("errors"))?,
            skipped: count(" skipped")?,
        })
    }

    const fn passed(&self) -> u32 {
        self.run.saturating_sub(self.failed).saturating_sub(self.skipped)
    }
}

impl std::fmt::Display for Counts {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        if self.failed > 0 {
            write!(f, "{} tests failed, ", self.failed)?;
        }
        write!(f, "{} tests passed", self.passed())?;
        if self.skipped > 0 {
            write!(f, ", {} skipped", self.skipped)?;
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_wheel_of_one_python_alone_is_refused() {
        let files = |names: &[&str]| -> Vec<PathBuf> {
            names.iter().map(|name| Path::new("wheels").join(name)).collect()
        };
        let stable = files(&["bowden-0.1.0-cp311-abi3-manylinux_2_34_x86_64.whl", "notes.txt"]);
        assert_eq!(wheel_for_every_python(&stable).unwrap(), stable[0]);
        for (refused, why) in [
            (&["bowden-0.1.0-cp311-cp311-manylinux_2_34_x86_64.whl"][..], "stable ABI"),
            (&["abi3-0.1.0-cp311-cp311-linux_x86_64.whl"], "stable ABI"),
            (&["notes.txt"], "0 wheels"),
            (&["a-1-cp311-abi3-linux_x86_64.whl", "a-2-cp311-abi3-linux_x86_64.whl"], "2 wheels"),
        ] {
            let error = wheel_for_every_python(&files(refused)).unwrap_err();
            assert!(error.contains(why), "{error}");
        }
    }

    #[test]
    fn counts_are_those_of_the_suite() {
        let xml = "<?xml version=\"1.0\"?><testsuites name=\"pytest tests\"><testsuite name=\"pytest\" errors=\"1\" failures=\"2\" \
                   skipped=\"3\" tests=\"40\" time=\"1.5\"><testcase name=\"a\" tests=\"9\" /></testsuite></testsuites>";
        let counts = Counts::read(xml).unwrap();
        assert_eq!(counts, Counts { run: 40, failed: 3, skipped: 3 });
        assert_eq!(counts.to_string(), "3 tests failed, 34 tests passed, 3 skipped");
        assert_eq!(Counts { run: 5, failed: 0, skipped: 0 }.to_string(), "5 tests passed");
        assert_eq!(Counts::read("<nothing/>"), None);
    }
}
