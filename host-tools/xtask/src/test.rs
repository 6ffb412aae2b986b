//! `cargo xtask test`: all tests that need no hardware, those of the board's release images among them.

use std::fmt;
use std::time::{Duration, Instant};

use crate::parts::Parts;
use crate::process::{self, EMULATED_BOARD, built, cargo, shared};
use crate::tally::Tally;
use crate::{browser, cross_target, firmware, python, system_packages};

/// Which tests are run; all when no part is named.
#[derive(Debug, Clone, Copy, clap::Args)]
pub struct Options {
    #[command(flatten)]
    parts: Parts,
    /// Only the Python package: its wheel is built, installed in an environment of its own and tested
    #[arg(long)]
    python: bool,
}

impl Options {
    fn host(self) -> bool {
        self.parts.host() && (self.parts.is_named() || !self.python)
    }

    fn python(self) -> bool {
        self.python || !self.parts.is_named()
    }

    fn board(self) -> bool {
        self.parts.board() && (self.parts.is_named() || !self.python)
    }
}

/// Runs the tests; the closing lines say what has run and how it went. A part that fails does not stop the others.
///
/// # Errors
/// When a test fails, or a part cannot be run.
pub fn run(options: Options) -> Result<(), String> {
    let mut outcomes = Vec::new();
    let mut command_is_built = false;
    if options.host() {
        let outcome = timed("host", host);
        // Its own tests build it, with other features of its dependencies: to build it alone takes a minute more.
        command_is_built = outcome.result.is_ok();
        outcomes.push(outcome);
    }
    if options.python() {
        outcomes.push(timed("python", || python::tests(command_is_built)));
    }
    if options.board() {
        outcomes.push(timed("board", || board(command_is_built)));
    }
    println!();
    for outcome in &outcomes {
        println!("{outcome}");
    }
    let failed: Vec<_> =
        outcomes.iter().filter(|outcome| outcome.result.is_err()).map(|outcome| outcome.part).collect();
    if failed.is_empty() { Ok(()) } else { Err(format!("tests failed: {}", failed.join(", "))) }
}

/// How a part went.
struct Outcome {
    part: &'static str,
    result: Result<String, String>,
    took: Duration,
}

impl fmt::Display for Outcome {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let seconds = self.took.as_secs();
        let (what, text) = match &self.result {
            Ok(done) => ("", done),
            Err(reason) => ("FAILED: ", reason),
        };
        write!(f, "{:<6} {what}{text} ({} min {:02} s)", self.part, seconds / 60, seconds % 60)
    }
}

fn timed(part: &'static str, run: impl FnOnce() -> Result<String, String>) -> Outcome {
    println!("\n== tests: {part}");
    let started = Instant::now();
    let result = run();
    Outcome { part, result, took: started.elapsed() }
}

/// Tests of everything that is built for the host, but for the emulated board.
fn host() -> Result<String, String> {
    let data = shared().join("data");
    let recordings = if data.is_dir() { Ok(()) } else { Err(format!("{} is not there", data.display())) };
    let mut tests = cargo(&["test", "--no-fail-fast"]);
    let mut lacking = false;
    for (what, found) in [("real recordings", recordings), ("Chromium", browser::ensure())] {
        if let Err(reason) = found {
            println!("{what}: none, {reason}; each test that misses it prints a line `skipped: ...`");
            lacking = true;
        }
    }
    if lacking {
        // Passed tests are silent otherwise, and a skipped one passes.
        tests.args(["--", "--show-output"]);
    }
    Tally::of(&mut tests).map(|tally| tally.to_string())
}

/// Tests of the release images, which are built first, as is the command that talks to the board.
fn board(command_is_built: bool) -> Result<String, String> {
    system_packages::ensure()?;
    cross_target::ensure()?;
    let images = firmware::build()?;
    if !command_is_built {
        process::run(&mut cargo(&["build", "--package", "bowden"]), &[0])?;
    }
    let mut tests = cargo(&["test", "--no-fail-fast"]);
    tests.args(EMULATED_BOARD);
    firmware::announce(&images, &mut tests);
    tests.env("BOWDEN_BIN", built("debug", "bowden")?);
    Tally::of(&mut tests).map(|tally| tally.to_string())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_part_that_is_named_leaves_out_the_others() {
        use clap::Parser;
        #[derive(clap::Parser)]
        struct Line {
            #[command(flatten)]
            options: Options,
        }
        let run = |flags: &[&str]| {
            let options = Line::parse_from(["test"].iter().chain(flags)).options;
            [options.host(), options.python(), options.board()]
        };
        assert_eq!(run(&[]), [true; 3]);
        assert_eq!(run(&["--host"]), [true, false, false]);
        assert_eq!(run(&["--python"]), [false, true, false]);
        assert_eq!(run(&["--board", "--python"]), [false, true, true]);
    }

    #[test]
    fn a_closing_line_tells_part_outcome_and_time() {
        let result = Ok("3 tests passed".to_owned());
        let outcome = Outcome { part: "host", result, took: Duration::from_secs(125) };
        assert_eq!(outcome.to_string(), "host   3 tests passed (2 min 05 s)");
        let result = Err("no image".to_owned());
        let outcome = Outcome { part: "board", result, took: Duration::from_millis(900) };
        assert_eq!(outcome.to_string(), "board  FAILED: no image (0 min 00 s)");
    }
}
