//! Ctrl-C: before the program ends, a joint is switched off and what was found so far is written.

use std::sync::atomic::{AtomicBool, Ordering};

use bowden_core::outcome::Failure;

static REQUESTED: AtomicBool = AtomicBool::new(false);

/// From now on Ctrl-C and a request to terminate only set a flag, which [`requested`] tells.
///
/// # Errors
/// When the operating system refuses.
pub fn catch() -> Result<(), Failure> {
    match ctrlc::set_handler(|| REQUESTED.store(true, Ordering::Relaxed)) {
        Ok(()) | Err(ctrlc::Error::MultipleHandlers) => Ok(()),
        Err(error) => Err(Failure::failed(format!("Ctrl-C cannot be caught: {error}; run it elsewhere"))),
    }
}

/// Whether the user wants to stop.
pub fn requested() -> bool {
    REQUESTED.load(Ordering::Relaxed)
}
