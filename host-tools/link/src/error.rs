//! What can go wrong between host and board. Refusals are answers of a board that works; everything else is the way to it.

use std::borrow::Cow;
use std::time::Duration;

use bowden_core::outcome::Failure;
use bowden_link::message::Refusal;
use bowden_link::{FaultRecord, State};

/// Why there is no talking to the board.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum CommsError {
    /// The port cannot be opened.
    #[error("{port}: {reason}; {next}")]
    Open {
        /// Name of the port.
        port: String,
        /// What is wrong.
        reason: String,
        /// What to do.
        next: Cow<'static, str>,
    },
    /// Nobody greets.
    #[error(
        "{port}: no greeting within {:.1} s, expected a bowden driver board{}; check the port and the board's supply, or \
         reset the board", waited.as_secs_f64(), heard_instead(*heard)
    )]
    NoGreeting {
        /// Name of the port.
        port: String,
        /// How long it was tried.
        waited: Duration,
        /// Bytes that came instead.
        heard: u64,
    },
    /// The board speaks another version of the protocol.
    #[error(
        "{port}: firmware {firmware} speaks protocol version {got}, expected {expected}; {}",
        if got < expected { "flash the firmware that belongs to this bowden" }
        else { "use the bowden that belongs to this firmware" }
    )]
    OtherVersion {
        /// Name of the port.
        port: String,
        /// Version of the firmware.
        firmware: String,
        /// Version of the board's protocol.
        got: u16,
        /// Version of the host's protocol.
        expected: u16,
    },
    /// The board's messages have another shape.
    #[error(
        "{port}: firmware {firmware} has message schema {:016x}, expected {:016x}; flash the firmware that belongs to this bowden",
        u64::from_be_bytes(*got), u64::from_be_bytes(*expected)
    )]
    OtherSchema {
        /// Name of the port.
        port: String,
        /// Version of the firmware.
        firmware: String,
        /// Schema of the board.
        got: [u8; 8],
        /// Schema of the host.
        expected: [u8; 8],
    },
    /// The port failed after the greeting.
    #[error("{port}: {reason}; check cable and supply, then connect again")]
    Broken {
        /// Name of the port.
        port: String,
        /// What the operating system says.
        reason: String,
    },
    /// A request stayed without answer.
    #[error(
        "{port}: no answer to {request} within {:.1} s ({attempts} attempts); check cable and supply, or reset the board",
        waited.as_secs_f64()
    )]
    NoAnswer {
        /// Name of the port.
        port: String,
        /// The request.
        request: &'static str,
        /// How often it was sent.
        attempts: u32,
        /// How long it was waited for.
        waited: Duration,
    },
    /// An answer of another kind.
    #[error(
        "{port}: the answer to {request} is no {expected}; firmware and bowden do not belong together, flash it again"
    )]
    OtherAnswer {
        /// Name of the port.
        port: String,
        /// The request.
        request: &'static str,
        /// What was expected.
        expected: &'static str,
    },
    /// The board answers, but control does not go on.
    #[error("{port}: control ticks stand still at tick {tick}; reset the board")]
    TicksStandStill {
        /// Name of the port.
        port: String,
        /// The tick.
        tick: u32,
    },
    /// The count of ticks began again.
    #[error(
        "{port}: the board started again (tick {tick} after tick {before}); see `bowden faults` for why, and run again"
    )]
    Restarted {
        /// Name of the port.
        port: String,
        /// Tick now.
        tick: u32,
        /// Tick before.
        before: u32,
    },
}

fn heard_instead(heard: u64) -> String {
    match heard {
        0 => String::new(),
        bytes => format!(" ({bytes} bytes of something else came)"),
    }
}

/// Why a request or a run did not succeed.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum LinkError {
    /// The way to the board.
    #[error(transparent)]
    Comms(#[from] CommsError),
    /// The board's answer.
    #[error("the board refused {request}: {refusal}{}", advice(refusal))]
    Refused {
        /// What was asked.
        request: &'static str,
        /// Why not.
        refusal: Refusal,
    },
    /// A fault stopped the board, or waits to be cleared.
    #[error("{0}")]
    Fault(FaultRecord),
    /// The board went somewhere else than it was sent.
    #[error("the board is in state {got}, expected {expected}; see `bowden faults`")]
    Strayed {
        /// Where it is.
        got: State,
        /// Where it should be.
        expected: State,
    },
    /// Ctrl-C.
    #[error("stopped by the user")]
    Interrupted,
    /// The board that came back is another one, or has other parameters.
    #[error(
        "the board came back changed: {0}; keep parameters with `bowden params store` before a run, and record again"
    )]
    Changed(String),
    /// A parameter that this program needs is not there.
    #[error("the board has no parameter `{0}`; flash the firmware that belongs to this bowden")]
    NoParameter(String),
}

/// What to do about a refusal that does not say it itself.
fn advice(refusal: &Refusal) -> &'static str {
    match refusal {
        Refusal::WrongState(State::Fault) => "; see `bowden faults`, then clear it with --clear",
        Refusal::WrongState(State::Off) => "; `bowden send ready` comes first",
        Refusal::WrongState(_) => "; `bowden send off` comes first",
        Refusal::OutOfRange { .. } => "; choose a value within it",
        Refusal::NoSuchIndex => "; list what there is",
        Refusal::Conflict(_) => "; change that one first",
        Refusal::Forbidden(_) => "; see `bowden params list`",
        Refusal::Storage => "; try again, then replace the board",
        Refusal::Moving
        | Refusal::StreamFull
        | Refusal::Busy
        | Refusal::TableDiffers
        | Refusal::TableUnreadable
        | Refusal::SafeMode => "",
    }
}

impl From<LinkError> for Failure {
    fn from(error: LinkError) -> Self {
        match &error {
            // What was named on the command line is not usable.
            LinkError::Comms(
                CommsError::Open { .. }
                | CommsError::NoGreeting { .. }
                | CommsError::OtherVersion { .. }
                | CommsError::OtherSchema { .. },
            )
            | LinkError::Refused { refusal: Refusal::OutOfRange { .. }, .. } => Self::bad_input(error),
            _ => Self::failed(error),
        }
    }
}

impl From<CommsError> for Failure {
    fn from(error: CommsError) -> Self {
        LinkError::from(error).into()
    }
}
