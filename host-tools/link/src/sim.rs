//! A board without hardware: the board's own control and services, natively, with the virtual bench behind the sensors.
//!
//! Bytes go in and out as on the wire; everything between the wire and the converters is the code that runs on the board.
//! What is missing is the hardware: no flash (parameters are stored until the program ends), no USB, and time that
//! passes only while somebody waits for it. Equal requests give equal answers, bit for bit.

mod board;
mod concealed;
mod hand;
mod joint;
mod wiring;

use std::cell::RefCell;
use std::io;
use std::rc::Rc;
use std::time::Duration;

use bowden_control::parameters::Parameters;

use super::error::CommsError;
use super::transport::Transport;
use joint::SimJoint;

pub use board::{Joint, SimBoard};
pub use concealed::Concealed;
pub use hand::SimHand;

/// A simulated board at the other end.
pub struct SimTransport {
    board: Rc<RefCell<SimBoard<SimJoint>>>,
}

impl SimTransport {
    /// A board that has just been switched on, with a joint at rest.
    ///
    /// # Panics
    /// Never: a bench that conceals nothing can be simulated, which every test of this board relies on.
    #[must_use]
    pub fn new() -> Self {
        Self::with(&Concealed::default()).expect("the bench of the data sheet can be simulated")
    }

    /// A board that has just been switched on, with a joint at rest that conceals something.
    ///
    /// # Errors
    /// [`CommsError::Open`], when such a bench cannot be simulated.
    pub fn with(concealed: &Concealed) -> Result<Self, CommsError> {
        let joint = SimJoint::new(&Parameters::default(), concealed).map_err(|error| CommsError::Open {
            port: super::SIM.to_owned(),
            reason: error.to_string(),
            next: "conceal something else".into(),
        })?;
        Ok(Self { board: Rc::new(RefCell::new(SimBoard::new(joint))) })
    }

    /// A hand at its bench.
    #[must_use]
    pub fn hand(&self) -> SimHand {
        SimHand::new(Rc::clone(&self.board))
    }
}

impl Default for SimTransport {
    fn default() -> Self {
        Self::new()
    }
}

impl Transport for SimTransport {
    fn read(&mut self, buffer: &mut [u8], timeout: Duration) -> io::Result<usize> {
        let mut board = self.board.borrow_mut();
        let end = board.now() + timeout;
        while board.is_silent() && board.now() < end {
            board.tick();
        }
        Ok(board.send_into(buffer))
    }

    fn write(&mut self, bytes: &[u8]) -> io::Result<()> {
        let mut board = self.board.borrow_mut();
        // A tick passes while they are on the way.
        board.tick();
        board.receive(bytes);
        Ok(())
    }

    fn now(&self) -> Duration {
        self.board.borrow().now()
    }
}
