//! The fake board behind a pseudo terminal, for `bowden` as a process.
//!
//! Neither side depends on how fast this machine is. The board's clock is driven by its host: each request lets it go on by
//! [`TIME_PER_REQUEST`], and only while the terminal has room for what the board sends. A slow host is therefore never silent to
//! the board and loses no sample. The host, whose clock is real, gives up after [`ANSWER_LIMIT_S`] without an answer.

use std::fs::{File, remove_file};
use std::io::{Read, Write};
use std::os::unix::fs::symlink;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex, MutexGuard};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

use bowden_link::State;
use bowden_link::sample::BATCH_LENGTH;
use rustix::event::{PollFd, PollFlags, Timespec, poll};
use rustix::fs::{OFlags, fcntl_setfl};
use rustix::pty::{OpenptFlags, grantpt, openpt, ptsname, unlockpt};
use rustix::termios::{OptionalActions, tcgetattr, tcsetattr};

use crate::fake::{Fake, PERIOD_NS};

/// Time on the board's clock that a request allows: a fifth of the silence that the board allows its host, and the longest time
/// between two signs of life of a host.
const TIME_PER_REQUEST: Duration = Duration::from_millis(100);

/// Value of `--timeout`, s: the largest that `bowden` takes.
const ANSWER_LIMIT_S: &str = "600";

/// Real time without a request after which the clock of a board that is not off goes on by itself. The board then stops a host
/// that hangs with fault 31, and the test fails instead of waiting for ever.
const HANG_LIMIT: Duration = Duration::from_mins(10);

/// Longest wait for bytes or for room before the thread checks whether to stop.
const WAKE: Timespec = Timespec { tv_sec: 0, tv_nsec: 10_000_000 };

const TICK: Duration = Duration::from_nanos(PERIOD_NS);
const BATCH: Duration = Duration::from_nanos(PERIOD_NS * BATCH_LENGTH as u64);

/// A pseudo terminal with the fake board in a thread behind it.
pub struct Terminal {
    fake: Arc<Mutex<Fake>>,
    stop: Arc<AtomicBool>,
    /// Gives back the terminal's end and what is not sent.
    thread: Option<JoinHandle<(File, Vec<u8>)>>,
    port: String,
    /// Other name of the port, which stays when it is plugged in again.
    link: Option<PathBuf>,
    // Keeps the terminal alive between two programs that use it.
    _slave: File,
}

impl Terminal {
    pub fn new(fake: Fake) -> Self {
        Self::plugged(Arc::new(Mutex::new(fake)))
    }

    /// The same under a name of its own, by which it is found again after it was unplugged.
    pub fn linked(fake: Fake, link: PathBuf) -> Self {
        let mut terminal = Self::new(fake);
        symlink(&terminal.port, &link).unwrap();
        terminal.link = Some(link);
        terminal
    }

    fn plugged(fake: Arc<Mutex<Fake>>) -> Self {
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

        let stop = Arc::new(AtomicBool::new(false));
        let (shared, stopped) = (Arc::clone(&fake), Arc::clone(&stop));
        let thread = std::thread::spawn(move || serve(File::from(master), &shared, &stopped));
        Self { fake, stop, thread: Some(thread), port, link: None, _slave: slave }
    }

    pub fn port(&self) -> &str {
        self.link.as_ref().map_or(&self.port, |link| link.to_str().unwrap())
    }

    pub fn fake(&self) -> MutexGuard<'_, Fake> {
        self.fake.lock().unwrap()
    }

    /// Command line of `bowden` for this board.
    pub fn command(&self, folder: &Path, name: &str, arguments: &[&str]) -> Command {
        let board = [name, "--port", self.port(), "--timeout", ANSWER_LIMIT_S];
        crate::command(folder, &[&board, arguments].concat())
    }

    /// Runs `bowden` with this board: exit status, standard output, standard error.
    pub fn bowden(&self, folder: &Path, name: &str, arguments: &[&str]) -> (i32, String, String) {
        crate::result_of(&self.command(folder, name, arguments).output().unwrap())
    }

    /// Starts `bowden record` with this board, without an end to the run.
    pub fn start_recording(&self, folder: &Path, out: &str) -> Child {
        let mut command = self.command(folder, "record", &["--out", out]);
        command.stdout(Stdio::piped()).stderr(Stdio::piped()).spawn().unwrap()
    }

    /// Pulls the plug while a frame is on its way: its last bytes do not arrive.
    pub fn unplug_within_a_frame(&mut self) {
        let (mut master, unsent) = self.silence();
        send_without_its_end(&mut master, &self.fake, unsent);
    }

    /// Pulls the plug.
    pub fn unplug(&mut self) {
        self.silence();
    }

    /// Stops the thread; the terminal ends with what is returned.
    fn silence(&mut self) -> (File, Vec<u8>) {
        self.stop.store(true, Ordering::Relaxed);
        let rest = self.thread.take().unwrap().join().unwrap();
        if let Some(link) = &self.link {
            remove_file(link).unwrap();
        }
        rest
    }

    /// Plugs the board in again, as another device.
    pub fn replug(&mut self) {
        let link = self.link.take();
        *self = Self::plugged(Arc::clone(&self.fake));
        if let Some(link) = &link {
            symlink(&self.port, link).unwrap();
        }
        self.link = link;
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

/// Moves bytes between terminal and board, and the board's clock as far as its host allows, until told to stop; returns the terminal and what is not sent.
fn serve(mut master: File, fake: &Mutex<Fake>, stop: &AtomicBool) -> (File, Vec<u8>) {
    let mut buffer = [0; 4096];
    let mut unsent = Vec::new();
    let mut allowed_until = Duration::ZERO;
    let mut heard = Instant::now();
    while !stop.load(Ordering::Relaxed) {
        let received = master.read(&mut buffer).unwrap_or(0);
        let goes_on = {
            let mut fake = fake.lock().unwrap();
            let now = fake.now();
            let hangs = fake.state != State::Off && heard.elapsed() > HANG_LIMIT;
            let goes_on = unsent.is_empty() && (now < allowed_until || hangs);
            if received > 0 {
                heard = Instant::now();
                // A tick passes while they are on the way, so that ticks never stand still to a host that asks.
                fake.advance_to(now + TICK);
                fake.receive(&buffer[..received]);
                allowed_until = fake.now() + TIME_PER_REQUEST;
            } else if goes_on {
                fake.advance_to(now + BATCH);
            }
            unsent.extend(fake.take());
            goes_on
        };
        let sent = if unsent.is_empty() { 0 } else { master.write(&unsent).unwrap_or(0) };
        unsent.drain(..sent);
        if received == 0 && sent == 0 && !goes_on {
            let room = if unsent.is_empty() { PollFlags::empty() } else { PollFlags::OUT };
            // Without an event, or with an interrupted wait, the loop looks again.
            let _ = poll(&mut [PollFd::new(&master, PollFlags::IN | room)], Some(&WAKE));
        }
    }
    (master, unsent)
}

/// Sends what is unsent and a batch of samples, but for the last bytes.
fn send_without_its_end(master: &mut File, fake: &Mutex<Fake>, mut unsent: Vec<u8>) {
    /// The end of a frame, and two bytes of what it holds.
    const MISSING: usize = 3;
    {
        let mut fake = fake.lock().unwrap();
        let now = fake.now();
        fake.advance_to(now + BATCH);
        unsent.extend(fake.take());
    }
    assert_eq!(unsent.last(), Some(&0), "no frame to cut");
    unsent.truncate(unsent.len() - MISSING);
    assert_ne!(unsent.last(), Some(&0), "the cut is within no frame");
    while !unsent.is_empty() {
        let sent = master.write(&unsent).unwrap_or(0);
        unsent.drain(..sent);
        if sent == 0 {
            let _ = poll(&mut [PollFd::new(master, PollFlags::OUT)], Some(&WAKE));
        }
    }
}
