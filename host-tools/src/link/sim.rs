//! A board without hardware: the board's own control and services, natively, with a simulated joint behind the sensors.
//!
//! Bytes go in and out as on the wire; everything between the wire and the converters is the code that runs on the board.
//! What is missing is the hardware: no flash (parameters are stored until the program ends), no USB, and time that
//! passes only while somebody waits for it. Equal requests give equal answers, bit for bit.

mod board;
mod joint;

use std::io;
use std::time::Duration;

use super::transport::Transport;
use board::SimBoard;

/// A simulated board at the other end.
pub struct SimTransport {
    board: SimBoard,
}

impl SimTransport {
    /// A board that has just been switched on, with a joint at rest.
    #[must_use]
    pub fn new() -> Self {
        Self { board: SimBoard::new() }
    }
}

impl Default for SimTransport {
    fn default() -> Self {
        Self::new()
    }
}

impl Transport for SimTransport {
    fn read(&mut self, buffer: &mut [u8], timeout: Duration) -> io::Result<usize> {
        let end = self.board.now() + timeout;
        while self.board.is_silent() && self.board.now() < end {
            self.board.tick();
        }
        Ok(self.board.send_into(buffer))
    }

    fn write(&mut self, bytes: &[u8]) -> io::Result<()> {
        // A tick passes while they are on the way.
        self.board.tick();
        self.board.receive(bytes);
        Ok(())
    }

    fn now(&self) -> Duration {
        self.board.now()
    }
}
