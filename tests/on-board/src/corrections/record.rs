//! Finished rows of the table as files, so that an interrupted measurement goes on where it was.
//!
//! A line each: `key = value`. Errors are written as they are in memory, so a row that is read again prints the same.

use std::fmt::Write as _;
use std::fs;
use std::path::Path;

use super::page::Row;
use super::{Errors, write};
use crate::{Failure, Outcome, fail};

/// Name of a row's file in the folder of its case.
pub const FILE: &str = "row.txt";

impl Row {
    /// The row as the text of its file.
    pub fn to_record(&self) -> String {
        let errors = |errors: &Errors| format!("{:?} {:?}", errors.on_image, errors.natively);
        let mut text = format!(
            "name = {}\nshown = {}\nprovenance = {}\nwithout = {:?}\nbefore = {}\nwith_truth = {}\n",
            self.name,
            self.shown,
            self.provenance,
            self.without,
            errors(&self.before),
            errors(&self.with_truth)
        );
        // Writing to a string does not fail.
        let _ = match &self.diagnosed {
            Ok((after, summary)) => writeln!(text, "after = {}\nsummary = {summary}", errors(after)),
            Err(reason) => writeln!(text, "failed = {}", reason.replace('\n', " ")),
        };
        text
    }

    /// The row of such a text.
    pub fn from_record(text: &str) -> Outcome<Self> {
        let found = |key: &str| {
            text.lines()
                .find_map(|line| line.split_once(" = ").filter(|(name, _)| *name == key))
                .map(|it| it.1)
        };
        let value = |key: &str| found(key).ok_or_else(|| Failure(format!("expected a line `{key} = ...`")));
        let numbers = |key: &str| -> Outcome<Vec<f64>> {
            let parsed: Result<_, _> = value(key)?.split(' ').map(str::parse).collect();
            parsed.map_err(|error| Failure(format!("{key}: expected numbers: {error}")))
        };
        let errors = |key: &str| match numbers(key)?.as_slice() {
            &[on_image, natively] => Ok(Errors { on_image, natively }),
            other => fail(format!("{key}: expected two numbers, got {}", other.len())),
        };
        let without = numbers("without")?;
        Ok(Self {
            name: value("name")?.to_owned(),
            shown: value("shown")?.to_owned(),
            provenance: value("provenance")?.to_owned(),
            without: *without.first().ok_or_else(|| Failure("without: expected a number".into()))?,
            before: errors("before")?,
            with_truth: errors("with_truth")?,
            diagnosed: match found("failed") {
                Some(reason) => Err(reason.to_owned()),
                None => Ok((errors("after")?, value("summary")?.to_owned())),
            },
        })
    }

    /// Writes the row's file to the folder of its case.
    pub fn keep(&self, folder: &Path) -> Outcome {
        write(&folder.join(FILE), &self.to_record())
    }

    /// The row in the folder of a case; `None` if there is none.
    pub fn kept(folder: &Path) -> Outcome<Option<Self>> {
        let path = folder.join(FILE);
        let named = |reason: &dyn std::fmt::Display| {
            Failure(format!("{}: {reason}; remove it to measure this row again", path.display()))
        };
        match fs::read_to_string(&path) {
            Ok(text) => Self::from_record(&text).map(Some).map_err(|failure| named(&failure)),
            Err(error) if error.kind() == std::io::ErrorKind::NotFound => Ok(None),
            Err(error) => Err(named(&error)),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn row(diagnosed: Result<(Errors, String), String>) -> Row {
        Row {
            name: "sensor_offset of f2".into(),
            shown: "mN·m".into(),
            provenance: "2026-01-02, commit 0123456789ab".into(),
            without: 0.1 + 0.2,
            before: Errors { on_image: 1.0 / 3.0, natively: 2.0 / 3.0 },
            with_truth: Errors { on_image: 1e-3, natively: 2e-3 },
            diagnosed,
        }
    }

    #[test]
    fn a_row_that_is_read_again_is_the_same() {
        let after = Errors { on_image: 0.1, natively: 0.7 };
        for diagnosed in [Ok((after, "adding x = 1 brings less".to_owned())), Err("no rig".to_owned())] {
            let row = row(diagnosed);
            let again = Row::from_record(&row.to_record()).unwrap();
            assert_eq!(again.to_record(), row.to_record());
            assert_eq!((again.line(), again.diagnosed), (row.line(), row.diagnosed));
        }
    }

    #[test]
    fn a_row_that_is_damaged_is_refused_with_its_file() {
        let folder = std::env::temp_dir().join(format!("bowden-row-{}", std::process::id()));
        let whole = row(Err("no rig".into())).to_record();
        write(&folder.join(FILE), &whole.replace("before = ", "before = x")).unwrap();
        let damaged = Row::kept(&folder);
        fs::remove_dir_all(&folder).unwrap();
        let Err(Failure(reason)) = damaged else { panic!("{damaged:?}") };
        assert!(reason.contains("row.txt: before: expected numbers"), "{reason}");
        assert!(matches!(Row::kept(&folder), Ok(None)));
    }
}
