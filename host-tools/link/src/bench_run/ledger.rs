//! What of a plan is done.

use std::fs;
use std::path::{Path, PathBuf};

use bowden_core::outcome::Failure;
use bowden_core::output;
use serde::{Deserialize, Serialize};

/// Value of `schema`.
const SCHEMA: &str = "bowden-run/1";

/// Name of the file.
pub const LEDGER: &str = "run.json";

/// A step that is done.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Done {
    /// Its name.
    pub name: String,
    /// How long it took on the board, s; 0 where the board decides.
    pub seconds: f64,
    /// Its recording in the folder.
    pub file: Option<String>,
    /// Rows of it.
    pub rows: u64,
    /// What was lost of it.
    pub loss: Option<String>,
}

#[derive(Debug, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct Text {
    schema: String,
    /// Text of the plan: another one is another run.
    plan: String,
    board: String,
    done: Vec<Done>,
}

/// The file, and what stands in it.
#[derive(Debug)]
pub struct Ledger {
    path: PathBuf,
    text: Text,
}

impl Ledger {
    /// Opens the ledger of `folder`, or begins one. `board` is name and serial number of the board.
    ///
    /// # Errors
    /// Exit status 2: the folder has the run of another plan or board, or something that is no ledger.
    pub fn open(folder: &Path, plan: &str, board: &str) -> Result<Self, Failure> {
        let path = folder.join(LEDGER);
        let refuse = |what: String| Failure::bad_input(format!("{}: {what}", path.display()));
        if !path.exists() {
            let text = Text {
                schema: SCHEMA.to_owned(),
                plan: plan.to_owned(),
                board: board.to_owned(),
                done: Vec::new(),
            };
            return Ok(Self { path, text });
        }
        let read = fs::read_to_string(&path).map_err(|error| refuse(output::describe(&error)))?;
        let text: Text = serde_json::from_str(&read)
            .map_err(|error| refuse(format!("no ledger of a run: {error}; choose another folder")))?;
        if text.schema != SCHEMA {
            return Err(refuse(format!(
                "got schema `{}`, expected `{SCHEMA}`; choose another folder",
                text.schema
            )));
        }
        if text.plan != plan {
            return Err(refuse("the run of another plan; choose another folder with --out".to_owned()));
        }
        if text.board != board {
            return Err(refuse(format!(
                "begun with {}, this is {board}; choose another folder with --out",
                text.board
            )));
        }
        Ok(Self { path, text })
    }

    /// Steps that are done, in their order.
    pub fn done(&self) -> &[Done] {
        &self.text.done
    }

    /// Adds a step, and puts the ledger on the medium: whole, or as it was.
    ///
    /// # Errors
    /// Exit status 1, when the medium refuses.
    pub fn add(&mut self, done: Done) -> Result<(), Failure> {
        self.text.done.push(done);
        let refuse = |reason: String| {
            Failure::failed(format!("{}: cannot be written: {reason}; make room", self.path.display()))
        };
        let text = serde_json::to_string_pretty(&self.text).map_err(|error| refuse(error.to_string()))?;
        output::write_text(&self.path, &(text + "\n")).map_err(|error| refuse(output::describe(&error)))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_ledger_goes_on_for_the_same_plan_and_board_only() {
        let folder = tempfile::tempdir().unwrap();
        let mut ledger = Ledger::open(folder.path(), "plan", "board 7").unwrap();
        ledger.add(Done { name: "01-home".to_owned(), ..Done::default() }).unwrap();
        assert_eq!(Ledger::open(folder.path(), "plan", "board 7").unwrap().done(), ledger.done());
        for (plan, board, expected) in [
            ("other", "board 7", "the run of another plan; choose another folder with --out"),
            ("plan", "board 8", "begun with board 7, this is board 8; choose another folder with --out"),
        ] {
            let refused = Ledger::open(folder.path(), plan, board).unwrap_err();
            assert!(refused.message().ends_with(expected), "{refused}");
        }
        fs::write(folder.path().join(LEDGER), "{").unwrap();
        assert!(
            Ledger::open(folder.path(), "plan", "board 7")
                .unwrap_err()
                .message()
                .contains("no ledger of a run")
        );
    }
}
