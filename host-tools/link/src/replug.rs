//! A board that was unplugged and comes back: its port is opened anew, the joint is stopped, and counts of ticks go on.

use std::time::{Duration, Instant};

use super::client::Client;
use super::error::LinkError;
use super::session::{Session, Stop};
use super::{AUTO, SERIAL, SIM, connect, serial};

/// Time between two attempts.
const RETRY: Duration = Duration::from_millis(100);

/// How a board is found again.
#[derive(Clone, Debug)]
pub struct Replug {
    port: String,
    timeout: Duration,
    patience: Duration,
}

/// An absence of the board.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Absence {
    /// How long it was away.
    pub away: Duration,
    /// It was without supply or reset meanwhile.
    pub restarted: bool,
}

impl Replug {
    /// How the board that is at `port` now is found again, under any name of its port if it has a serial number. It is waited
    /// for as long as `patience`, and each answer of it as long as `timeout`.
    pub fn new(port: &str, timeout: Duration, patience: Duration) -> Self {
        let path = match port {
            AUTO => serial::find(None).ok(),
            path => Some(path.to_owned()),
        };
        let number = path.as_deref().and_then(serial::number_of);
        let port = number.map_or_else(|| port.to_owned(), |number| format!("{SERIAL}{number}"));
        Self { port, timeout, patience }
    }

    /// Whether the board is waited for at all. A simulated one cannot be unplugged.
    pub fn is_on(&self) -> bool {
        !self.patience.is_zero() && !self.port.starts_with(SIM)
    }

    /// Waits for the board and goes on with it, bridge off.
    ///
    /// # Errors
    /// [`LinkError::Interrupted`], why the port cannot be opened at the end of the patience, or as [`Session::adopt`].
    pub fn bring_back(&self, session: &mut Session, stop: Stop) -> Result<Absence, LinkError> {
        let begun = Instant::now();
        session.hang_up();
        let client = self.connect(begun, stop)?;
        let away = begun.elapsed();
        let restarted = session.adopt(client, away)?;
        Ok(Absence { away, restarted })
    }

    fn connect(&self, begun: Instant, stop: Stop) -> Result<Client, LinkError> {
        loop {
            if stop() {
                return Err(LinkError::Interrupted);
            }
            match connect(&self.port, self.timeout) {
                Ok(client) => return Ok(client),
                Err(error) if begun.elapsed() >= self.patience => return Err(error),
                Err(_) => std::thread::sleep(RETRY),
            }
        }
    }
}
