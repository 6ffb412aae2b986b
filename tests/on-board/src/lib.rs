//! What the tests of the images share: where the images are, a host on the emulated board's port, figures.
//!
//! Everything here fails with a [`Failure`] that says in words what was met; a test passes it on and adds what it expected.
#![forbid(unsafe_code)]
#![allow(
    clippy::missing_errors_doc,
    reason = "all of it fails with the board, its link or the image, in words"
)]

pub mod campaign;
pub mod corrections;
pub mod cost;
pub mod course;
pub mod endurance;
pub mod host;
pub mod image;
pub mod load;
pub mod paper;
pub mod parallel;
pub mod program;
pub mod telemetry;
pub mod ticks;
pub mod tool;
pub mod trial;

use std::fmt;

use bowden_board::BoardError;

/// Why a step of a test or a measurement did not work, in words.
pub struct Failure(pub String);

/// Result of such a step.
pub type Outcome<T = ()> = Result<T, Failure>;

impl fmt::Display for Failure {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.0)
    }
}

// What a failed test prints.
impl fmt::Debug for Failure {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.0)
    }
}

impl std::error::Error for Failure {}

impl From<BoardError> for Failure {
    fn from(error: BoardError) -> Self {
        Self(error.to_string())
    }
}

/// The [`Failure`] with this text, as a result.
pub fn fail<T>(text: impl Into<String>) -> Outcome<T> {
    Err(Failure(text.into()))
}
