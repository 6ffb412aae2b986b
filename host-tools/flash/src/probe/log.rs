//! What the firmware logs: from its start on, or from the moment on at which somebody begins to read.

use std::thread::sleep;
use std::time::{Duration, Instant};

use bowden_core::outcome::Failure;
use probe_rs::Core;
use probe_rs::rtt::{Error, Rtt};

use super::target::Target;
use super::words;
use crate::error::FlashError;

/// How long a firmware that starts may be without a log.
const PATIENCE: Duration = Duration::from_secs(3);

/// Time between two looks when nothing is there.
const LOOK: Duration = Duration::from_millis(10);

/// Bytes that are read at once.
const READ_BYTES: usize = 4096;

impl Target {
    /// Hands the bytes of the first RTT channel on, whose control block is at `rtt`, until `stop` says so. A board that starts
    /// again goes on. The processor is not halted, at the end neither.
    ///
    /// # Errors
    /// [`FlashError::NoLog`], [`FlashError::Unread`]; what `take` says.
    pub fn follow_log(
        mut self,
        rtt: u32,
        stop: &dyn Fn() -> bool,
        take: &mut dyn FnMut(&[u8]) -> Result<(), Failure>,
    ) -> Result<(), Failure> {
        let result = self.read_log(rtt, stop, take);
        self.let_go();
        result
    }

    fn read_log(
        &mut self,
        rtt: u32,
        stop: &dyn Fn() -> bool,
        take: &mut dyn FnMut(&[u8]) -> Result<(), Failure>,
    ) -> Result<(), Failure> {
        let mut core = self.core(true)?;
        let mut buffer = vec![0; READ_BYTES];
        while let Some(mut channels) = attach(&mut core, rtt, stop)? {
            let Some(channel) = channels.up_channel(0) else { return Err(no_log().into()) };
            while !stop() {
                match channel.read(&mut core, &mut buffer) {
                    Ok(0) => sleep(LOOK),
                    Ok(length) => take(&buffer[..length])?,
                    Err(Error::Probe(error)) => return Err(unread(&error).into()),
                    // The board started again.
                    Err(_) => break,
                }
            }
        }
        Ok(())
    }
}

/// Waits for the control block; none if it is to end.
fn attach(core: &mut Core<'_>, rtt: u32, stop: &dyn Fn() -> bool) -> Result<Option<Rtt>, FlashError> {
    let begun = Instant::now();
    while !stop() {
        match Rtt::attach_at(core, rtt.into()) {
            Ok(mut channels) => {
                if channels.up_channel(0).is_some() {
                    return Ok(Some(channels));
                }
            }
            Err(Error::Probe(error)) => return Err(unread(&error)),
            // The firmware has not written it yet.
            Err(_) => {}
        }
        if begun.elapsed() > PATIENCE {
            return Err(no_log());
        }
        sleep(LOOK);
    }
    Ok(None)
}

fn unread(error: &dyn std::error::Error) -> FlashError {
    FlashError::Unread { during: "reading the log".to_owned(), reason: words(error) }
}

fn no_log() -> FlashError {
    FlashError::NoLog { seconds: PATIENCE.as_secs() }
}
