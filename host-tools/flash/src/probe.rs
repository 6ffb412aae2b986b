//! The way through a debug probe, with probe-rs: find, write, verify, reset, log.
//!
//! | module | what |
//! |---|---|
//! | [`find`](mod@find) | which of the probes that are plugged in |
//! | [`target`] | the board behind it: whether it is the right one, and an image into it |
//! | [`log`] | what its firmware logs |

pub mod find;
pub mod log;
pub mod target;

pub use find::find;
pub use probe_rs::probe::DebugProbeSelector;
pub use probe_rs::probe::list::Lister;
pub use target::Target;

use std::error::Error;
use std::fmt::Write;

/// An error with all that it came from, in one line.
fn words(error: &dyn Error) -> String {
    let mut words = error.to_string().trim_end_matches('.').to_owned();
    let mut source = error.source();
    while let Some(deeper) = source {
        let _ = write!(words, ": {}", deeper.to_string().trim_end_matches('.'));
        source = deeper.source();
    }
    words
}
