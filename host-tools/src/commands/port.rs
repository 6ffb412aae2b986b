//! Arguments that say which board.

use std::time::Duration;

use bowden_host_link::calibrate::hand::Hand;
use bowden_host_link::replug::Replug;
use bowden_host_link::{Client, LinkError};

/// Arguments that say which board.
#[derive(Clone, Debug, clap::Args)]
pub struct PortArguments {
    /// Serial port of the board, `auto` for the one on USB, `serial:NUMBER` for the one with this serial number, or `sim` for a simulated board with a simulated joint,
    /// switched on anew each time; `sim:joint_backlash:0.8,seed=7` for one that conceals something
    #[arg(long, value_name = "PATH|auto|serial:NUMBER|sim")]
    port: String,
    /// How long an answer of the board is waited for, s
    #[arg(long, value_name = "SECONDS", default_value = "1.5", value_parser = timeout)]
    timeout: Duration,
}

/// Arguments that say how long a board is waited for that was unplugged.
#[derive(Clone, Copy, Debug, clap::Args)]
pub struct ReplugArguments {
    /// How long a board that was unplugged is waited for, s; it goes on with the joint stopped. 0: not at all
    #[arg(long, value_name = "SECONDS", default_value = "30", value_parser = patience)]
    replug: Duration,
}

impl PortArguments {
    /// How the board is found again after it was unplugged; to be asked for while it is there.
    pub fn replug(&self, arguments: ReplugArguments) -> Replug {
        Replug::new(&self.port, self.timeout, arguments.replug)
    }

    /// Opens the port and greets the board.
    ///
    /// # Errors
    /// See [`bowden_host_link::connect`].
    pub fn connect(&self) -> Result<Client, LinkError> {
        bowden_host_link::connect(&self.port, self.timeout)
    }

    /// The same, with who acts at the bench.
    ///
    /// # Errors
    /// See [`bowden_host_link::connect_with_hand`].
    pub fn connect_with_hand(&self) -> Result<(Client, Box<dyn Hand>), LinkError> {
        bowden_host_link::connect_with_hand(&self.port, self.timeout)
    }

    /// The same; a simulated board then runs in real time.
    ///
    /// # Errors
    /// See [`bowden_host_link::connect_live`].
    pub fn connect_live(&self) -> Result<Client, LinkError> {
        bowden_host_link::connect_live(&self.port, self.timeout)
    }
}

/// Reads how long an answer is waited for, s, from an argument.
///
/// # Errors
/// Says what is allowed.
pub fn timeout(text: &str) -> Result<Duration, String> {
    match text.parse::<f64>() {
        Ok(seconds) if (0.05..=600.0).contains(&seconds) => Ok(Duration::from_secs_f64(seconds)),
        _ => Err("allowed 0.05 to 600 s".to_owned()),
    }
}

fn patience(text: &str) -> Result<Duration, String> {
    match text.parse::<f64>() {
        Ok(seconds) if (0.0..=86_400.0).contains(&seconds) => Ok(Duration::from_secs_f64(seconds)),
        _ => Err("allowed 0 to 86400 s".to_owned()),
    }
}
