//! `cargo xtask fuzz`: the fuzz targets under libFuzzer, guided by the coverage that the compiler counts.
//!
//! The flags are those of cargo-fuzz 0.13 without a sanitizer, which needs no nightly compiler and finds nothing in code without `unsafe`; the
//! engine's sources come with the crate `libfuzzer-sys`. So nothing has to be installed but a C++ compiler.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

use clap::Args;

use crate::process::{self, cargo, target_folder, workspace};
use crate::toolchain::Toolchain;

/// What is fuzzed, and for how long.
#[derive(Debug, Args)]
pub struct Options {
    /// Only this target; else all, one after the other
    #[arg(long, value_name = "NAME")]
    target: Option<String>,
    /// Time of each target, s
    #[arg(long, value_name = "N", default_value_t = 60)]
    seconds: u32,
}

/// Package of the targets, and its folder.
const PACKAGE: &str = "bowden-fuzz";
const FOLDER: &str = "tests/fuzz";

/// Counters at every edge, their places, and the operands of comparisons.
const COVERAGE: &str = "-Cpasses=sancov-module -Cllvm-args=-sanitizer-coverage-level=4 \
                        -Cllvm-args=-sanitizer-coverage-inline-8bit-counters -Cllvm-args=-sanitizer-coverage-pc-table \
                        -Cllvm-args=-sanitizer-coverage-trace-compares -Ccodegen-units=1";

/// Longest input, bytes; longest time of one, s; most memory, MB: a page of Parquet may ask for 4 GiB, which the tests say.
const LIMITS: [&str; 4] = ["-max_len=6000", "-timeout=20", "-rss_limit_mb=6000", "-print_final_stats=1"];

/// Fuzzes; every target has its turn also where one before it has found something.
///
/// # Errors
/// When the targets cannot be built, or one has found something: the input lies where the line says.
pub fn run(options: &Options) -> Result<(), String> {
    let triple = Toolchain::active()?.host;
    let mut build = cargo(&[
        "build",
        "--package",
        PACKAGE,
        "--features",
        "coverage",
        "--bin",
        "coverage",
        "--target",
        &triple,
    ]);
    // The triple is named so that build scripts and macros are compiled without counters.
    process::run(build.env("CARGO_ENCODED_RUSTFLAGS", encoded(COVERAGE)), &[0])?;
    let program = target_folder()?.join(&triple).join("debug").join("coverage");
    let names = match &options.target {
        Some(name) => vec![name.clone()],
        None => process::output(Command::new(&program).env("BOWDEN_FUZZ_TARGET", "names"))?
            .lines()
            .map(str::to_owned)
            .collect(),
    };
    let mut found = Vec::new();
    for name in names {
        println!("\n== fuzz: {name}, {} s", options.seconds);
        if let Err(reason) = fuzz(&program, &name, options.seconds) {
            println!("{reason}");
            found.push(name);
        }
    }
    if found.is_empty() { Ok(()) } else { Err(format!("found something: {}", found.join(", "))) }
}

/// One target: what was found before and the seeds are read, what adds coverage is kept in the target folder for the next time.
fn fuzz(program: &Path, name: &str, seconds: u32) -> Result<(), String> {
    let folder = target_folder()?.join("fuzz").join(name);
    let (grown, seeds, found) = (folder.join("corpus"), folder.join("seeds"), folder.join("found"));
    let kept: PathBuf = workspace().join(FOLDER).join("corpus").join(name);
    for folder in [&grown, &seeds, &found] {
        fs::create_dir_all(folder).map_err(|error| format!("{}: {error}", folder.display()))?;
    }
    let mut command = Command::new(program);
    command.env("BOWDEN_FUZZ_TARGET", name).env("BOWDEN_FUZZ_SEEDS", &seeds).arg(grown).arg(seeds);
    if kept.is_dir() {
        command.arg(kept);
    }
    command.arg(format!("-max_total_time={seconds}")).args(LIMITS);
    command.arg(format!("-artifact_prefix={}/", found.display()));
    process::run(&mut command, &[0])
        .map_err(|reason| format!("{reason}; the input lies in {}", found.display()))
}

/// Arguments as cargo takes them from the environment.
fn encoded(arguments: &str) -> String {
    arguments.split_whitespace().collect::<Vec<_>>().join("\u{1f}")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn arguments_are_told_apart_by_the_separator_that_cargo_reads() {
        assert_eq!(encoded("-Ca=b  -Cc"), "-Ca=b\u{1f}-Cc");
        assert!(encoded(COVERAGE).split('\u{1f}').all(|argument| argument.starts_with("-C")));
    }
}
