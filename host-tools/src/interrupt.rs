//! Ctrl-C: before the program ends, a joint is switched off and what was found so far is written.

use std::io::{self, BufRead};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc;
use std::time::Duration;

use bowden_core::outcome::Failure;
use bowden_core::output;

/// Time between two looks whether the user pressed Ctrl-C instead of answering.
const LOOK_INTERVAL: Duration = Duration::from_millis(50);

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

/// Reads a line of standard input, none at its end; Ctrl-C ends the wait.
///
/// # Errors
/// Exit status 1: Ctrl-C, or standard input cannot be read.
pub fn read_line() -> Result<Option<String>, Failure> {
    // Reading a line cannot be interrupted, so another thread does it and this one looks for Ctrl-C.
    let (sender, answer) = mpsc::channel();
    std::thread::spawn(move || {
        let mut line = String::new();
        let read = io::stdin().lock().read_line(&mut line).map(|count| (count > 0).then_some(line));
        let _ = sender.send(read);
    });
    loop {
        if requested() {
            crate::commands::print("\n")?;
            return Err(Failure::failed("stopped by the user"));
        }
        match answer.recv_timeout(LOOK_INTERVAL) {
            Ok(Ok(line)) => return Ok(line),
            Ok(Err(error)) => {
                let reason = output::describe(&error);
                return Err(Failure::failed(format!(
                    "standard input: cannot be read: {reason}; use another terminal"
                )));
            }
            Err(mpsc::RecvTimeoutError::Timeout) => {}
            Err(mpsc::RecvTimeoutError::Disconnected) => return Ok(None),
        }
    }
}
