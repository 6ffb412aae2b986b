//! A simulated board in real time: for somebody who watches it.

use std::io;
use std::time::{Duration, Instant};

use super::transport::Transport;

/// Time that the simulated board may be behind before it is let off: after a pause of this program it does not hurry.
const BEHIND: Duration = Duration::from_millis(200);

/// A transport whose clock does not run ahead of real time.
pub struct Paced<T> {
    inner: T,
    begun: Instant,
}

impl<T: Transport> Paced<T> {
    /// Holds the clock of `inner` back, beginning now at its zero.
    pub fn new(inner: T) -> Self {
        Self { inner, begun: Instant::now() }
    }
}

impl<T: Transport> Transport for Paced<T> {
    fn read(&mut self, buffer: &mut [u8], timeout: Duration) -> io::Result<usize> {
        let read = self.inner.read(buffer, timeout)?;
        let (simulated, real) = (self.inner.now(), self.begun.elapsed());
        std::thread::sleep(simulated.saturating_sub(real));
        let behind = real.saturating_sub(simulated);
        if behind > BEHIND {
            self.begun += behind;
        }
        Ok(read)
    }

    fn write(&mut self, bytes: &[u8]) -> io::Result<()> {
        self.inner.write(bytes)
    }

    fn now(&self) -> Duration {
        self.inner.now()
    }
}
