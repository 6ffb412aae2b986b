//! The way to a driver board, and what is done with it.
//!
//! | module | what |
//! |---|---|
//! | [`transport`] | bytes and a clock: [`serial`] port or [`sim`]ulated board |
//! | [`client`] | one method a request, over any transport |
//! | [`error`], [`losses`] | what goes wrong, and what gets lost |
//! | [`parameters`] | the board's parameters by name, to and from a file |
//! | [`from_rig`] | the board's parameters from what a fit or a diagnosis found |
//! | [`ripple_table`] | the board's ripple table, to and from a file |
//! | [`session`] | from off to a running reference and back to off |
//! | [`course`] | what the joint is to follow |
//! | [`investigate`] | excites, diagnoses, corrects and verifies a joint |
//! | [`conversion`], [`recorder`], [`capture`], [`rig_file`] | raw samples to a recording and the rig that goes with it |

#![forbid(unsafe_code)]

pub mod capture;
pub mod client;
pub mod conversion;
pub mod course;
pub mod error;
pub mod from_rig;
pub mod investigate;
pub mod losses;
pub mod parameters;
pub mod recorder;
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

pub use client::{Client, Telemetry};
pub use error::{CommsError, LinkError};
pub use losses::Losses;
pub use parameters::ParameterSet;
pub use session::{RunEnd, RunTick, Session};
pub use transport::Transport;

/// Name of the simulated board.
pub const SIM: &str = "sim";

/// Beginning of the name of a simulated board whose joint conceals something.
const SIM_CONCEALS: &str = "sim:";

/// Name that stands for the one board on USB.
pub const AUTO: &str = "auto";

/// Arguments that say which board.
#[derive(Clone, Debug, clap::Args)]
pub struct PortArguments {
    /// Serial port of the board, `auto` for the one on USB, or `sim` for a simulated board with a simulated joint,
    /// switched on anew each time; `sim:joint_backlash:0.8,seed=7` for one that conceals something
    #[arg(long, value_name = "PATH|auto|sim")]
    port: String,
    /// How long an answer of the board is waited for, s
    #[arg(long, value_name = "SECONDS", default_value = "1.5", value_parser = timeout)]
    timeout: Duration,
}

impl PortArguments {
    /// Opens the port and greets the board.
    ///
    /// # Errors
    /// See [`serial::SerialTransport::open`], [`serial::find`] and [`Client::connect`].
    pub fn connect(&self) -> Result<Client, LinkError> {
        if let Some(list) = self.port.strip_prefix(SIM_CONCEALS) {
            let transport = sim::SimTransport::with(&sim::Concealed::parse(list)?)?;
            return Client::connect(Box::new(transport), SIM, self.timeout);
        }
        let (transport, name): (Box<dyn Transport>, String) = match self.port.as_str() {
            SIM => (Box::new(sim::SimTransport::new()), SIM.to_owned()),
            AUTO => {
                let path = serial::find()?;
                (Box::new(serial::SerialTransport::open(&path)?), path)
            }
            path => (Box::new(serial::SerialTransport::open(path)?), path.to_owned()),
        };
        Client::connect(transport, name, self.timeout)
    }
}

fn timeout(text: &str) -> Result<Duration, String> {
    match text.parse::<f64>() {
        Ok(seconds) if (0.05..=600.0).contains(&seconds) => Ok(Duration::from_secs_f64(seconds)),
        _ => Err("allowed 0.05 to 600 s".to_owned()),
    }
}
