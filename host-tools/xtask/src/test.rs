//! `cargo xtask test`: all tests that need no hardware, those of the board's release images among them.

use std::fmt;
use std::fs::File;
use std::thread;
use std::time::{Duration, Instant};

use crate::firmware::Image;
use crate::linted::{linted, unlinted};
use crate::parts::Parts;
use crate::process::{self, Said, built, cargo, shared, target_folder};
use crate::tally::Tally;
use crate::{browser, cross_target, firmware, python, selection, system_packages};

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
    let programs = match options.board().then(|| timed("images", images)) {
        Some((Ok(images), _)) if options.host() => Some(Programs::of_all(images)),
        Some((Ok(images), _)) => Some(Programs::of_the_board(images)),
        Some((Err(reason), took)) => {
            outcomes.push(Outcome { part: "board", result: Err(reason), took });
            options.host().then(Programs::of_the_host)
        }
        None => options.host().then(Programs::of_the_host),
    };
    match (programs, options.python()) {
        (Some(programs), false) => {
            outcomes.push(programs.built().map_or_else(|failed| failed, |()| programs.outcome()));
        }
        (Some(programs), true) => outcomes.extend(beside_python(&programs)?),
        (None, true) => outcomes.push(Outcome::of("python", || python::tests(false, Said::Here))),
        (None, false) => {}
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

impl Outcome {
    fn of(part: &'static str, run: impl FnOnce() -> Result<String, String>) -> Self {
        let (result, took) = timed(part, run);
        Self { part, result, took }
    }
}

/// Runs the test programs and, when they are built, the Python tests beside them: single tests of either leave a processor idle. What the
/// latter say goes to a file, and is shown at the end.
///
/// # Errors
/// When there is no place for that file.
fn beside_python(programs: &Programs) -> Result<[Outcome; 2], String> {
    let path = target_folder()?.join("python-tests.log");
    let shown = |error: std::io::Error| format!("{}: {error}", path.display());
    let log = File::create(&path).map_err(shown)?;
    let said = Said::Into(&log);
    let outcomes = thread::scope(|scope| {
        // From a network, while processors build.
        let prepared = scope.spawn(|| python::prepare(said));
        let built = programs.built();
        // It says why it failed when it is made again.
        let _ = prepared.join();
        let are_built = built.is_ok();
        let python = scope.spawn(move || Outcome::of("python", || python::tests(are_built, said)));
        let programs = match built {
            Ok(()) => programs.outcome(),
            Err(failed) => failed,
        };
        let panicked =
            |_| Outcome { part: "python", result: Err("panicked".to_owned()), took: Duration::ZERO };
        [programs, python.join().unwrap_or_else(panicked)]
    });
    println!("\n== tests: what those of Python said");
    std::io::copy(&mut File::open(&path).map_err(shown)?, &mut std::io::stdout()).map_err(shown)?;
    Ok(outcomes)
}

impl fmt::Display for Outcome {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let seconds = self.took.as_secs();
        let (what, text) = match &self.result {
            Ok(done) => ("", done),
            Err(reason) => ("FAILED: ", reason),
        };
        write!(f, "{:<14} {what}{text} ({} min {:02} s)", self.part, seconds / 60, seconds % 60)
    }
}

/// What `run` returns, and the time it took.
fn timed<T>(step: &str, run: impl FnOnce() -> T) -> (T, Duration) {
    println!("\n== tests: {step}");
    let started = Instant::now();
    let result = run();
    (result, started.elapsed())
}

/// The release images, and what the emulator is built with.
fn images() -> Result<Vec<Image>, String> {
    system_packages::ensure()?;
    cross_target::ensure()?;
    firmware::build()
}

/// Test programs that cargo builds and runs together.
#[derive(Debug)]
struct Programs {
    part: &'static str,
    selected: Vec<&'static str>,
    images: Vec<Image>,
    /// Whether those of the host are among them, some of which want recordings and a browser.
    host: bool,
}

impl Programs {
    fn of_all(images: Vec<Image>) -> Self {
        let selected = selection::for_the_host(python::interpreter().is_ok());
        Self { part: "host and board", selected, images, host: true }
    }

    fn of_the_host() -> Self {
        Self { part: "host", selected: Vec::new(), images: Vec::new(), host: true }
    }

    fn of_the_board(images: Vec<Image>) -> Self {
        Self { part: "board", selected: selection::emulated_board().collect(), images, host: false }
    }

    /// Builds them; what became of them when they do not build.
    fn built(&self) -> Result<(), Outcome> {
        let (result, took) = timed("build", || self.build());
        result.map_err(|reason| Outcome { part: self.part, result: Err(reason), took })
    }

    /// Runs what is built.
    fn outcome(&self) -> Outcome {
        Outcome::of(self.part, || self.run())
    }

    /// Builds them, and the command that they start.
    fn build(&self) -> Result<(), String> {
        if let Some(reason) = unlinted() {
            println!("{reason}");
        }
        if !self.host {
            process::run(linted(&mut cargo(&["build", "--package", "bowden"])), &[0])?;
        }
        // Benchmarks among them, which are not run here.
        process::run(linted(&mut cargo(&["test", "--no-run", "--all-targets"])).args(&self.selected), &[0])
    }

    fn run(&self) -> Result<String, String> {
        let mut tests = cargo(&["test", "--no-fail-fast"]);
        linted(&mut tests).args(&self.selected);
        firmware::announce(&self.images, &mut tests);
        tests.env("BOWDEN_BIN", built("debug", "bowden")?);
        if self.host && lacks_recordings_or_browser() {
            // Passed tests are silent otherwise, and a skipped one passes.
            tests.args(["--", "--show-output"]);
        }
        Tally::of(&mut tests).map(|tally| tally.to_string())
    }
}

/// Whether tests will have nothing to work on; says what is missing.
fn lacks_recordings_or_browser() -> bool {
    let data = shared().join("data");
    let recordings = if data.is_dir() { Ok(()) } else { Err(format!("{} is not there", data.display())) };
    let mut lacking = false;
    for (what, found) in [("real recordings", recordings), ("Chromium", browser::ensure())] {
        if let Err(reason) = found {
            println!("{what}: none, {reason}; each test that misses it prints a line `skipped: ...`");
            lacking = true;
        }
    }
    lacking
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
        assert_eq!(outcome.to_string(), "host           3 tests passed (2 min 05 s)");
        let result = Err("no image".to_owned());
        let outcome = Outcome { part: "board", result, took: Duration::from_millis(900) };
        assert_eq!(outcome.to_string(), "board          FAILED: no image (0 min 00 s)");
    }
}
