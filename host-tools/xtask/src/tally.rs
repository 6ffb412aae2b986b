//! Counts of tests, from what `cargo test` prints.

use std::fmt;
use std::io::{BufRead, BufReader, Write};
use std::process::{Command, Stdio};

use crate::process::{failed, unstarted};

/// What became of the tests of several programs.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct Tally {
    programs: u32,
    passed: u32,
    failed: u32,
    ignored: u32,
    /// Passed without having done anything, for want of recordings or a browser.
    skipped: u32,
    failures: Vec<String>,
}

impl Tally {
    /// Runs `cargo test` and shows what it prints.
    ///
    /// # Errors
    /// When a test fails, when nothing is tested, or when the tests do not build.
    pub fn of(command: &mut Command) -> Result<Self, String> {
        Self::shown(command, &mut std::io::stdout())
    }

    fn shown(command: &mut Command, onlooker: &mut dyn Write) -> Result<Self, String> {
        let mut child = command.stdout(Stdio::piped()).spawn().map_err(|error| unstarted(command, &error))?;
        let mut tally = Self::default();
        let mut pipe = BufReader::new(child.stdout.take().ok_or("cargo's output is not connected")?);
        let mut line = Vec::new();
        let unread = |error: std::io::Error| format!("cargo's output: {error}");
        while pipe.read_until(b'\n', &mut line).map_err(unread)? > 0 {
            tally.read(&String::from_utf8_lossy(&line));
            // Who looks on may have left; the tests go on.
            let _ = onlooker.write_all(&line).and_then(|()| onlooker.flush());
            line.clear();
        }
        let status = child.wait().map_err(unread)?;
        tally.outcome(status.success()).map_err(|reason| reason.unwrap_or_else(|| failed(command, status)))
    }

    fn read(&mut self, line: &str) {
        if line.starts_with("skipped:") {
            self.skipped += 1;
        }
        if let Some(name) =
            line.strip_prefix("test ").and_then(|rest| rest.trim_end().strip_suffix(" ... FAILED"))
        {
            self.failures.push(name.to_owned());
        }
        let Some(result) = line.strip_prefix("test result: ") else { return };
        self.programs += 1;
        let counts = result.split_once(". ").map_or("", |(_, counts)| counts);
        for count in counts.split(';') {
            let mut words = count.split_whitespace();
            let number = words.next().and_then(|number| number.parse().ok()).unwrap_or(0);
            match words.next() {
                Some("passed") => self.passed += number,
                Some("failed") => self.failed += number,
                Some("ignored") => self.ignored += number,
                _ => {}
            }
        }
    }

    /// The tally of a run that went well, or the reason why it did not where the counts tell one.
    fn outcome(self, success: bool) -> Result<Self, Option<String>> {
        match (success, self.failed, self.passed) {
            (_, 1.., _) => Err(Some(self.to_string())),
            (false, ..) => Err(None),
            (true, _, 0) => Err(Some("no test has run".to_owned())),
            (true, ..) => Ok(self),
        }
    }
}

impl fmt::Display for Tally {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        if self.failed > 0 {
            write!(f, "{} tests failed ({}), ", self.failed, self.failures.join(", "))?;
        }
        write!(f, "{} tests passed in {} programs", self.passed, self.programs)?;
        if self.ignored > 0 {
            write!(f, ", {} ignored", self.ignored)?;
        }
        if self.skipped > 0 {
            write!(f, ", of which {} lacked recordings or a browser and did nothing", self.skipped)?;
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn tally(lines: &str) -> Tally {
        let mut tally = Tally::default();
        lines.lines().for_each(|line| tally.read(line));
        tally
    }

    #[test]
    fn results_of_several_programs_add_up() {
        let lines = "running 3 tests\ntest a ... ok\nskipped: no such folder\n\
            test result: ok. 3 passed; 0 failed; 1 ignored; 0 measured; 2 filtered out; finished in 0.00s\n\
            test result: ok. 12 passed; 0 failed; 0 ignored; 0 measured; 0 filtered out; finished in 1.25s\n";
        let tally = tally(lines);
        assert_eq!(
            tally.to_string(),
            "15 tests passed in 2 programs, 1 ignored, of which 1 lacked recordings or a browser and did nothing"
        );
        assert_eq!(tally.clone().outcome(true), Ok(tally));
    }

    #[test]
    fn failures_are_counted_and_no_tests_are_a_failure() {
        let lines = "test a::one ... FAILED\ntest a::two ... ok\ntest b ... FAILED\n\
            test result: FAILED. 3 passed; 2 failed; 0 ignored; 0 measured; 0 filtered out; finished in 0.01s";
        let reason = tally(lines).outcome(false).unwrap_err();
        assert_eq!(reason.as_deref(), Some("2 tests failed (a::one, b), 3 tests passed in 1 programs"));
        let line =
            "test result: ok. 0 passed; 0 failed; 0 ignored; 0 measured; 9 filtered out; finished in 0.00s";
        assert_eq!(tally(line).outcome(true).unwrap_err().as_deref(), Some("no test has run"));
        assert_eq!(tally("").outcome(false), Err(None));
    }

    #[cfg(unix)]
    #[test]
    fn a_program_is_read_to_its_end() {
        // What this run shows must not be counted by the one that it is part of.
        let mut shown = Vec::new();
        let mut run = |script: &str| Tally::shown(Command::new("sh").args(["-c", script]), &mut shown);
        let passed = "echo 'test result: ok. 2 passed; 0 failed; 0 ignored;'";
        assert_eq!(run(passed).unwrap(), Tally { programs: 1, passed: 2, ..Tally::default() });
        assert!(run(&format!("{passed}; exit 101")).unwrap_err().contains("exit status: 101"));
        assert_eq!(shown, b"test result: ok. 2 passed; 0 failed; 0 ignored;\n".repeat(2));
    }
}
