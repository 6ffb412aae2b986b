//! How a command ends: exit status and the one line that explains it.

use std::fmt::{self, Display};

/// Class of a failure; it decides the exit status.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum FailureClass {
    /// The work itself did not succeed: exit status 1.
    Failed,
    /// Bad usage or unusable input: exit status 2.
    BadInput,
}

/// Why a command could not do its work: one line that says what, where and what to do.
///
/// Line breaks and other control characters, which may come from a file or its name, are shown escaped, so that
/// the message stays one line.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("{message}")]
pub struct Failure {
    class: FailureClass,
    message: String,
}

impl Failure {
    /// The work did not succeed although the input was usable.
    pub fn failed(message: impl Display) -> Self {
        Self { class: FailureClass::Failed, message: one_line(&message) }
    }

    /// Bad usage or unusable input.
    pub fn bad_input(message: impl Display) -> Self {
        Self { class: FailureClass::BadInput, message: one_line(&message) }
    }

    /// The same failure with another clause behind its message.
    #[must_use]
    pub fn with_note(self, note: &impl Display) -> Self {
        Self { class: self.class, message: format!("{}; {}", self.message, one_line(note)) }
    }

    /// Class, and with it the exit status.
    pub fn class(&self) -> FailureClass {
        self.class
    }

    /// What is wrong, one line.
    pub fn message(&self) -> &str {
        &self.message
    }

    /// The message taken apart.
    pub fn parts(&self) -> FailureParts<'_> {
        FailureParts::of(&self.message)
    }
}

/// What a message says: `FILE:LINE:COLUMN: what is wrong; what to do`, each part but the second where it is there.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct FailureParts<'m> {
    /// File, or what else the message is about.
    pub source: Option<&'m str>,
    /// Line, from 1.
    pub line: Option<u64>,
    /// Column, from 1.
    pub column: Option<u64>,
    /// What is wrong.
    pub what: &'m str,
    /// What to do.
    pub hint: Option<&'m str>,
}

impl<'m> FailureParts<'m> {
    fn of(message: &'m str) -> Self {
        let (place, rest) = match message.split_once(": ") {
            Some((place, rest)) => (Some(place), rest),
            None => (None, message),
        };
        let (what, hint) = match rest.rsplit_once("; ") {
            Some((what, hint)) => (what, Some(hint)),
            None => (rest, None),
        };
        let mut source = place;
        let mut numbers = Vec::new();
        while let Some((before, number)) = source.and_then(|place| place.rsplit_once(':'))
            && numbers.len() < 2
            && let Ok(number) = number.parse()
        {
            numbers.push(number);
            source = Some(before);
        }
        let mut numbers = numbers.into_iter().rev();
        Self { source, line: numbers.next(), column: numbers.next(), what, hint }
    }
}

/// How a command ended that did its work.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Outcome {
    notes: Vec<String>,
}

impl Outcome {
    /// Done, with nothing to add.
    pub fn done() -> Self {
        Self::default()
    }

    /// Adds what was lost or repaired on the way, one line each.
    pub fn extend<S: Display>(&mut self, notes: impl IntoIterator<Item = S>) {
        self.notes.extend(notes.into_iter().map(|note| one_line(&note)));
    }

    /// What was lost or repaired.
    pub fn notes(&self) -> &[String] {
        &self.notes
    }
}

/// Exit status of a process; the only place that knows the numbers.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ExitStatus {
    /// Done.
    Done = 0,
    /// Failed.
    Failed = 1,
    /// Bad usage or unusable input.
    BadInput = 2,
    /// Done, but something was lost or repaired.
    DoneWithNotes = 3,
}

impl From<&Result<Outcome, Failure>> for ExitStatus {
    fn from(result: &Result<Outcome, Failure>) -> Self {
        match result {
            Ok(outcome) if outcome.notes.is_empty() => Self::Done,
            Ok(_) => Self::DoneWithNotes,
            Err(failure) => match failure.class {
                FailureClass::Failed => Self::Failed,
                FailureClass::BadInput => Self::BadInput,
            },
        }
    }
}

impl From<ExitStatus> for std::process::ExitCode {
    fn from(status: ExitStatus) -> Self {
        Self::from(status as u8)
    }
}

/// The text with line breaks and control characters escaped.
pub fn one_line(text: &impl fmt::Display) -> String {
    let text = text.to_string();
    if !text.contains(char::is_control) {
        return text;
    }
    text.chars()
        .map(|c| if c.is_control() { c.escape_default().to_string() } else { c.to_string() })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn messages_stay_one_line_whatever_a_file_is_called() {
        let failure = Failure::bad_input("a\nb\u{1b}[31m.csv: empty");
        assert_eq!(failure.message(), "a\\nb\\u{1b}[31m.csv: empty");
    }

    #[test]
    fn a_message_is_taken_apart_into_place_reason_and_advice() {
        let parts = |message: &str| Failure::bad_input(message).parts().shown();
        for (message, expected) in [
            (
                "a.toml:3:7: unknown key `x`; did you mean `y`?",
                "a.toml|3|7|unknown key `x`|did you mean `y`?",
            ),
            (
                "a.csv:12: column `t_s`: got 1 s; sort the rows",
                "a.csv|12|-|column `t_s`: got 1 s|sort the rows",
            ),
            ("a.mcap: byte 8: damaged; b; copy it again", "a.mcap|-|-|byte 8: damaged; b|copy it again"),
            ("no rig; name it", "-|-|-|no rig|name it"),
            ("nothing", "-|-|-|nothing|-"),
        ] {
            assert_eq!(parts(message), expected);
        }
    }

    impl FailureParts<'_> {
        fn shown(self) -> String {
            let or_dash = |part: Option<String>| part.unwrap_or_else(|| "-".to_owned());
            let text = |part: Option<&str>| or_dash(part.map(str::to_owned));
            let number = |part: Option<u64>| or_dash(part.map(|number| number.to_string()));
            [text(self.source), number(self.line), number(self.column), self.what.to_owned(), text(self.hint)]
                .join("|")
        }
    }

    #[test]
    fn exit_status_follows_class_and_notes() {
        let mut noted = Outcome::done();
        noted.extend(["the last line was dropped"]);
        let cases = [
            (Ok(Outcome::done()), 0),
            (Err(Failure::failed("x")), 1),
            (Err(Failure::bad_input("x")), 2),
            (Ok(noted), 3),
        ];
        for (result, expected) in cases {
            assert_eq!(ExitStatus::from(&result) as u8, expected, "{result:?}");
        }
    }
}
