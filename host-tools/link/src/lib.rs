//! The way to a driver board, and what is done with it.
//!
//! | module | what |
//! |---|---|
//! | [`transport`] | bytes and a clock: [`serial`] port or [`sim`]ulated board, [`paced`] for those who watch it |
//! | [`native_board`] | the board's control and services where there is no board |
//! | [`client`] | one method a request, over any transport |
//! | [`error`], [`losses`] | what goes wrong, and what gets lost |
//! | [`parameters`] | the board's parameters by name, to and from a file |
//! | [`from_rig`] | the board's parameters from what a fit or a diagnosis found |
//! | [`ripple_table`] | the board's ripple table, to and from a file |
//! | [`holders`] | who has a port open |
//! | [`hub`] | live samples for several readers |
//! | [`session`] | from off to a running reference and back to off |
//! | [`operator`] | a joint with somebody at the keys |
//! | [`replug`] | a board that was unplugged and comes back |
//! | [`course`] | what the joint is to follow |
//! | [`bench_run`] | a bench run as a file |
//! | [`calibrate`] | zeros, gains, wiring, encoders, motor and pretension, one question at a time |
//! | [`investigate`] | excites, diagnoses, corrects and verifies a joint |
//! | [`conversion`], [`recorder`], [`capture`], [`rig_file`] | raw samples to a recording and the rig that goes with it |
//! | [`evidence`] | what a recording says of itself |
//! | [`raw`], [`raw_capture`], [`replay_control`] | all that goes into a tick, and the tick computed again |
//! | [`firmware_log`] | the firmware's own log, and a recording made of it |

#![forbid(unsafe_code)]

pub mod bench_run;
pub mod calibrate;
pub mod capture;
pub mod client;
pub mod conversion;
pub mod course;
pub mod error;
pub mod evidence;
pub mod firmware_log;
pub mod from_rig;
pub mod holders;
pub mod hub;
pub mod investigate;
pub mod losses;
pub mod native_board;
pub mod operator;
pub mod paced;
pub mod parameters;
pub mod raw;
pub mod raw_capture;
pub mod recorder;
pub mod replay_control;
pub mod replug;
pub mod rig_file;
pub mod ripple_table;
pub mod serial;
pub mod session;
pub mod sim;
pub mod transport;

#[cfg(test)]
#[path = "../../core/src/report/example.rs"]
#[expect(dead_code, reason = "another part of it is for the tests of the report")]
mod example;

// The example of the report's own tests speaks of `crate::diagnose`.
#[cfg(test)]
use bowden_core::diagnose;

use std::time::Duration;

use calibrate::hand::{Hand, Person};
pub use client::{Client, Telemetry};
pub use error::{CommsError, LinkError};
pub use losses::Losses;
pub use parameters::{ParameterSet, Unnoticed};
pub use session::{RunEnd, RunTick, Session};
pub use transport::Transport;

/// Name of the simulated board.
pub const SIM: &str = "sim";

/// Beginning of the name of a simulated board whose joint conceals something.
const SIM_CONCEALS: &str = "sim:";

/// Beginning of a name that chooses a board by its serial number.
pub const SERIAL: &str = "serial:";

/// Name that stands for the one board on USB.
pub const AUTO: &str = "auto";

/// Opens a port and greets the board: a serial port, [`AUTO`], a serial number behind [`SERIAL`], or [`SIM`] with what the simulated joint conceals behind a colon.
/// An answer of the board is waited for as long as `timeout`. A simulated board runs as fast as it can.
///
/// # Errors
/// See [`serial::SerialTransport::open`], [`serial::find`], [`sim::Concealed::parse`] and [`Client::connect`].
pub fn connect(port: &str, timeout: Duration) -> Result<Client, LinkError> {
    match simulated(port)? {
        Some(board) => Client::connect(Box::new(board), SIM, timeout),
        None => connect_serial(port, timeout),
    }
}

/// As [`connect`], with who acts at the bench: a person, or a hand at the bench of a simulated board.
///
/// # Errors
/// As [`connect`].
pub fn connect_with_hand(port: &str, timeout: Duration) -> Result<(Client, Box<dyn Hand>), LinkError> {
    match simulated(port)? {
        Some(board) => {
            let hand = board.hand();
            Ok((Client::connect(Box::new(board), SIM, timeout)?, Box::new(hand)))
        }
        None => Ok((connect_serial(port, timeout)?, Box::new(Person))),
    }
}

/// As [`connect`], but a simulated board runs in real time.
///
/// # Errors
/// As [`connect`].
pub fn connect_live(port: &str, timeout: Duration) -> Result<Client, LinkError> {
    match simulated(port)? {
        Some(board) => Client::connect(Box::new(paced::Paced::new(board)), SIM, timeout),
        None => connect_serial(port, timeout),
    }
}

/// The simulated board that `port` names, if it names one.
fn simulated(port: &str) -> Result<Option<sim::SimTransport>, LinkError> {
    if port == SIM {
        return Ok(Some(sim::SimTransport::new()));
    }
    let Some(list) = port.strip_prefix(SIM_CONCEALS) else { return Ok(None) };
    Ok(Some(sim::SimTransport::with(&sim::Concealed::parse(list)?)?))
}

fn connect_serial(port: &str, timeout: Duration) -> Result<Client, LinkError> {
    let path = match (port, port.strip_prefix(SERIAL)) {
        (AUTO, _) => serial::find(None)?,
        (_, Some(number)) => serial::find(Some(number))?,
        (path, None) => path.to_owned(),
    };
    Client::connect(Box::new(serial::SerialTransport::open(&path)?), path, timeout)
}
