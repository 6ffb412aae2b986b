//! Bytes to and from a board.

use std::io;
use std::time::Duration;

/// In place of a port that was given back.
pub(super) struct Gone(pub(super) Duration);

impl Transport for Gone {
    fn read(&mut self, _: &mut [u8], _: Duration) -> io::Result<usize> {
        Err(io::ErrorKind::BrokenPipe.into())
    }

    fn write(&mut self, _: &[u8]) -> io::Result<()> {
        Err(io::ErrorKind::BrokenPipe.into())
    }

    fn now(&self) -> Duration {
        self.0
    }
}

/// A way to a board: bytes out, bytes in, and a clock that goes with them.
///
/// # Contract
/// `read` gives back bytes as soon as there are any, and 0 only when `timeout` has passed on [`Transport::now`]'s clock
/// without one. A simulated board moves that clock; with hardware it is the machine's.
pub trait Transport {
    /// Reads what is there into `buffer`, waiting up to `timeout` for the first byte; 0 if none came.
    ///
    /// # Errors
    /// When the way is broken for good.
    fn read(&mut self, buffer: &mut [u8], timeout: Duration) -> io::Result<usize>;

    /// Writes all bytes.
    ///
    /// # Errors
    /// When the way is broken for good, or the board takes nothing for a second.
    fn write(&mut self, bytes: &[u8]) -> io::Result<()>;

    /// Time since an arbitrary zero.
    fn now(&self) -> Duration;
}
