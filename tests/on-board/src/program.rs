//! What the programs of this crate have in common: options with a value each, help, and one line where something is wrong.

use std::process::ExitCode;

use crate::{Failure, Outcome, fail};

/// What a program understands.
#[derive(Debug, Clone, Copy)]
pub struct Program {
    /// Its name, in front of what went wrong.
    pub name: &'static str,
    /// What it says of itself.
    pub help: &'static str,
    /// Its options, each of which takes a value.
    pub options: &'static [&'static str],
}

impl Program {
    /// Runs it: `take` puts each option of the command line with its value into `options`, and `act` does what was asked for.
    pub fn run<T>(
        &self,
        mut options: T,
        take: impl FnMut(&mut T, &str, String) -> Outcome,
        act: impl FnOnce(&T) -> Outcome,
    ) -> ExitCode {
        let done = match self.read(std::env::args().skip(1), &mut options, take) {
            Ok(true) => act(&options),
            Ok(false) => {
                println!("{}", self.help);
                Ok(())
            }
            Err(failure) => Err(failure),
        };
        match done {
            Ok(()) => ExitCode::SUCCESS,
            Err(failure) => {
                eprintln!("{}: {failure}", self.name);
                ExitCode::FAILURE
            }
        }
    }

    /// Takes the command line; `false` where it asks for help.
    fn read<T>(
        &self,
        mut arguments: impl Iterator<Item = String>,
        options: &mut T,
        mut take: impl FnMut(&mut T, &str, String) -> Outcome,
    ) -> Outcome<bool> {
        while let Some(argument) = arguments.next() {
            if matches!(argument.as_str(), "--help" | "-h") {
                return Ok(false);
            }
            if !self.options.contains(&argument.as_str()) {
                return fail(format!("{argument}: not an option; --help lists them"));
            }
            let value = arguments.next().ok_or_else(|| Failure(format!("{argument}: expected a value")))?;
            take(options, &argument, value)?;
        }
        Ok(true)
    }
}

/// The value of an option where it is one that `is_allowed`; else a line with what was `expected`.
pub fn value<T: std::str::FromStr>(
    option: &str,
    value: &str,
    expected: &str,
    is_allowed: impl FnOnce(&T) -> bool,
) -> Outcome<T> {
    let parsed = value.parse().ok().filter(is_allowed);
    parsed.ok_or_else(|| Failure(format!("{option} {value}: expected {expected}")))
}

#[cfg(test)]
mod tests {
    use super::*;

    const PROGRAM: Program = Program { name: "test", help: "", options: &["--jobs", "--page"] };

    fn read(arguments: &[&str]) -> Outcome<(bool, Vec<(String, String)>)> {
        let mut taken = Vec::new();
        let arguments = arguments.iter().map(|argument| (*argument).to_owned());
        let goes_on = PROGRAM.read(arguments, &mut taken, |taken, option, value| {
            taken.push((option.to_owned(), value));
            Ok(())
        })?;
        Ok((goes_on, taken))
    }

    #[test]
    fn options_are_taken_with_their_values_and_others_refused() {
        let taken =
            [("--jobs", "2"), ("--page", "a.md")].map(|(option, value)| (option.into(), value.into()));
        assert_eq!(read(&["--jobs", "2", "--page", "a.md"]).unwrap(), (true, taken.to_vec()));
        assert!(!read(&["--help"]).unwrap().0);
        assert_eq!(read(&["--job", "2"]).unwrap_err().0, "--job: not an option; --help lists them");
        assert_eq!(read(&["--jobs"]).unwrap_err().0, "--jobs: expected a value");
        assert_eq!(value("--jobs", "3", "a few", |jobs: &usize| *jobs < 4).unwrap(), 3);
        for wrong in ["4", "x"] {
            let refused = value("--jobs", wrong, "a few", |jobs: &usize| *jobs < 4).unwrap_err();
            assert_eq!(refused.0, format!("--jobs {wrong}: expected a few"));
        }
    }
}
