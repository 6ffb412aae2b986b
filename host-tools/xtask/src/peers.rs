//! `cargo xtask bench --peers`: speed and error beside other software, in an environment of its own.

use std::fs;
use std::process::Command;

use crate::process::{self, Said, built, cargo, target_folder, workspace};
use crate::prove::provenance;
use crate::python;

/// Script, the packages it needs, and the page that it writes, below the workspace.
const SCRIPT: &str = "host-tools/python/benches/peers.py";
const PACKAGES: &str = "benches/requirements.txt";
const PAGE: &str = "host-tools/docs/peers.md";

/// Cases of the proof that the rivals run on: one of a kind.
const CASES: [&str; 3] = ["single/joint_coulomb_friction/clear/quiet", "pair/03", "nothing/00"];

/// Benchmarks that print lines of JSON: package and target.
const BENCHES: [(&str, &str); 2] = [("bowden-core", "mcap"), ("bowden-control", "cascade")];

/// Builds the package in release, times MCAP, the control tick and simulation, runs the rivals on a few cases, and writes the page.
///
/// # Errors
/// Without Python, or when a package cannot be installed or built, or a measurement fails.
pub fn run() -> Result<(), String> {
    let interpreter = python::interpreter()?;
    let folder = target_folder()?.join("python");
    fs::create_dir_all(&folder).map_err(|error| format!("{}: {error}", folder.display()))?;
    let environment = python::environment(&interpreter, &folder, ("peers", PACKAGES), Said::Here)?;
    let mut figures = String::new();
    for (package, target) in BENCHES {
        println!("\n== {target}");
        let said =
            process::output(&mut cargo(&["bench", "--quiet", "--package", package, "--bench", target]))?;
        print!("{said}");
        figures += &said;
    }
    let files = folder.join("figures.jsonl");
    fs::write(&files, figures).map_err(|error| format!("{}: {error}", files.display()))?;
    println!("\n== diagnosis, beside other tools");
    let rivals = folder.join("rivals.md");
    fs::write(&rivals, diagnoses()?).map_err(|error| format!("{}: {error}", rivals.display()))?;
    python::install_wheel(&environment, &folder, "release", Said::Here)?;
    println!("\n== simulation and replay, against MuJoCo, scipy and diffrax");
    let mut script = Command::new(python::program(&environment, "python"));
    script.arg(workspace().join(SCRIPT)).arg("--folder").arg(&folder).arg("--files").arg(&files);
    script.arg("--rivals").arg(&rivals);
    script.arg("--page").arg(workspace().join(PAGE)).arg("--provenance").arg(format!(", {},", provenance()));
    process::run(&mut script, &[0])
}

/// The part of the proof's page that has the rivals, of [`CASES`], below a sentence with the numbers of cases and runs.
fn diagnoses() -> Result<String, String> {
    let folder = target_folder()?;
    if !folder.join("rivals/installed").is_file() {
        process::run(&mut Command::new(workspace().join("tests/rivals/install")), &[0])?;
    }
    let programs = ["--package", "bowden", "--package", "bowden-tests", "--bin", "bowden", "--bin", "prove"];
    process::run(cargo(&["build", "--release"]).args(programs), &[0])?;
    let mut prove = Command::new(built("release", "prove")?);
    prove.arg("--rivals").arg("--bowden").arg(built("release", "bowden")?);
    prove.arg("--results").arg(folder.join("peers"));
    for case in CASES {
        prove.args(["--only", case]);
    }
    let said = process::output(&mut prove)?;
    section(&said, "Rivals")
        .map(of_single_runs)
        .ok_or_else(|| "prove has printed no table of the rivals".to_owned())
}

/// `table` below the numbers of cases and runs, because a reader of times expects a spread.
fn of_single_runs(table: &str) -> String {
    let cases = CASES.len();
    format!(
        "{cases} cases of the proof, one of a kind, each run once: the ratio and the times of a case are single values without a spread.\n\n{table}"
    )
}

/// What stands below a heading of the second rank, up to the next one.
fn section<'a>(page: &'a str, heading: &str) -> Option<&'a str> {
    let after = page.split_once(&format!("\n## {heading}\n"))?.1;
    Some(after.split_once("\n## ").map_or(after, |(part, _)| part).trim())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_section_ends_at_the_next_heading() {
        let page = "# A\n\n## Rivals\n\nfour\n\n### more\n\n## Numbers\n\nfive\n";
        assert_eq!(section(page, "Rivals"), Some("four\n\n### more"));
        assert_eq!(section(page, "Numbers"), Some("five"));
        assert_eq!(section(page, "Rival"), None);
    }

    #[test]
    fn the_diagnosis_says_first_that_its_figures_are_of_single_runs() {
        let page = of_single_runs("| a |");
        assert!(
            page.starts_with("3 cases ") && page.contains("each run once") && page.ends_with("\n\n| a |"),
            "{page}"
        );
    }
}
