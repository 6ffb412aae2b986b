//! Two ways to the fake board: in the same thread with a clock of its own, and over a pseudo terminal in real time.

use std::cell::RefCell;
use std::fs::File;
use std::io::{self, Read, Write};
use std::rc::Rc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex, MutexGuard};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

use bowden::link::{Client, LinkError, Transport};
use rustix::fs::{OFlags, fcntl_setfl};
use rustix::pty::{OpenptFlags, grantpt, openpt, ptsname, unlockpt};
use rustix::termios::{OptionalActions, tcgetattr, tcsetattr};

use crate::fake::{Fake, PERIOD_NS};

/// Longest wait for an answer in tests without a real clock.
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
    let wire = Direct { fake: Rc::clone(&fake), rest: Vec::new() };
    (Client::connect(Box::new(wire), "fake", TIMEOUT), fake)
}

/// The fake board behind a pseudo terminal, in a thread.
pub struct Terminal {
    fake: Arc<Mutex<Fake>>,
    stop: Arc<AtomicBool>,
    thread: Option<JoinHandle<()>>,
    port: String,
    // Keeps the terminal alive between two programs that use it.
    _slave: File,
}

impl Terminal {
    pub fn new(fake: Fake) -> Self {
        let flags = OpenptFlags::RDWR | OpenptFlags::NOCTTY | OpenptFlags::CLOEXEC;
        let master = openpt(flags).unwrap();
        grantpt(&master).unwrap();
        unlockpt(&master).unwrap();
        let port = ptsname(&master, Vec::new()).unwrap().into_string().unwrap();
        let slave = File::options().read(true).write(true).open(&port).unwrap();
        let mut settings = tcgetattr(&slave).unwrap();
        settings.make_raw();
        tcsetattr(&slave, OptionalActions::Now, &settings).unwrap();
        fcntl_setfl(&master, OFlags::NONBLOCK).unwrap();

        let fake = Arc::new(Mutex::new(fake));
        let stop = Arc::new(AtomicBool::new(false));
        let (shared, stopped) = (Arc::clone(&fake), Arc::clone(&stop));
        let thread = std::thread::spawn(move || {
            let mut master = File::from(master);
            let begun = Instant::now();
            let mut buffer = [0; 4096];
            while !stopped.load(Ordering::Relaxed) {
                let read = master.read(&mut buffer).unwrap_or(0);
                let bytes = {
                    let mut fake = shared.lock().unwrap();
                    fake.receive(&buffer[..read]);
                    fake.advance_to(begun.elapsed());
                    fake.take()
                };
                write(&mut master, &bytes, &stopped);
                if read == 0 {
                    std::thread::sleep(Duration::from_micros(300));
                }
            }
        });
        Self { fake, stop, thread: Some(thread), port, _slave: slave }
    }

    pub fn port(&self) -> &str {
        &self.port
    }

    pub fn fake(&self) -> MutexGuard<'_, Fake> {
        self.fake.lock().unwrap()
    }

    /// Pulls the plug.
    pub fn unplug(&mut self) {
        self.stop.store(true, Ordering::Relaxed);
        self.thread.take().unwrap().join().unwrap();
    }
}

/// Writes what the terminal takes; nobody may be listening any more, and then the rest is lost, as on a real port.
fn write(master: &mut File, mut bytes: &[u8], stop: &AtomicBool) {
    let patience = Instant::now() + Duration::from_millis(500);
    while !bytes.is_empty() && !stop.load(Ordering::Relaxed) && Instant::now() < patience {
        match master.write(bytes) {
            Ok(written) => bytes = &bytes[written..],
            Err(_) => std::thread::sleep(Duration::from_micros(300)),
        }
    }
}

impl Drop for Terminal {
    fn drop(&mut self) {
        self.stop.store(true, Ordering::Relaxed);
        if let Some(thread) = self.thread.take() {
            let _ = thread.join();
        }
    }
}
