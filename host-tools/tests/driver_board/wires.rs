//! The fake board in the same thread as its host, on the board's clock, and a lossy wire.

use std::cell::RefCell;
use std::io;
use std::rc::Rc;
use std::time::Duration;

use bowden_host_link::{Client, LinkError, Transport};

use crate::fake::{Fake, PERIOD_NS};

/// Longest wait for an answer, on the board's clock.
pub const TIMEOUT: Duration = Duration::from_millis(500);

/// The fake board in the same thread.
pub struct Direct {
    fake: Rc<RefCell<Fake>>,
    rest: Vec<u8>,
}

impl Transport for Direct {
    fn read(&mut self, buffer: &mut [u8], timeout: Duration) -> io::Result<usize> {
        let mut fake = self.fake.borrow_mut();
        let end = fake.now() + timeout;
        loop {
            self.rest.extend(fake.take());
            if !self.rest.is_empty() {
                let length = buffer.len().min(self.rest.len());
                buffer[..length].copy_from_slice(&self.rest[..length]);
                self.rest.drain(..length);
                return Ok(length);
            }
            if fake.now() >= end {
                return Ok(0);
            }
            let next = fake.now() + Duration::from_nanos(PERIOD_NS);
            fake.advance_to(next);
        }
    }

    fn write(&mut self, bytes: &[u8]) -> io::Result<()> {
        let mut fake = self.fake.borrow_mut();
        let next = fake.now() + Duration::from_nanos(PERIOD_NS);
        fake.advance_to(next);
        fake.receive(bytes);
        Ok(())
    }

    fn now(&self) -> Duration {
        self.fake.borrow().now()
    }
}

/// A wire that loses every n-th frame of the board.
pub struct Lossy<T> {
    inner: T,
    every: u64,
    frames: u64,
    frame: Vec<u8>,
}

impl<T: Transport> Lossy<T> {
    pub fn new(inner: T, every: u64) -> Self {
        Self { inner, every, frames: 0, frame: Vec::new() }
    }
}

impl<T: Transport> Transport for Lossy<T> {
    fn read(&mut self, buffer: &mut [u8], timeout: Duration) -> io::Result<usize> {
        let mut came = vec![0; buffer.len()];
        let length = self.inner.read(&mut came, timeout)?;
        let mut passed = Vec::new();
        for byte in &came[..length] {
            self.frame.push(*byte);
            if *byte == 0 {
                self.frames += 1;
                let frame = std::mem::take(&mut self.frame);
                if !self.frames.is_multiple_of(self.every) {
                    passed.extend(frame);
                }
            }
        }
        buffer[..passed.len()].copy_from_slice(&passed);
        Ok(passed.len())
    }

    fn write(&mut self, bytes: &[u8]) -> io::Result<()> {
        self.inner.write(bytes)
    }

    fn now(&self) -> Duration {
        self.inner.now()
    }
}

/// Greets a fake board in the same thread.
pub fn connect(fake: Fake) -> (Result<Client, LinkError>, Rc<RefCell<Fake>>) {
    let fake = Rc::new(RefCell::new(fake));
    (connect_again(&fake), fake)
}

/// Greets a fake board that another client has greeted before.
pub fn connect_again(fake: &Rc<RefCell<Fake>>) -> Result<Client, LinkError> {
    let wire = Direct { fake: Rc::clone(fake), rest: Vec::new() };
    Client::connect(Box::new(wire), "fake", TIMEOUT)
}
