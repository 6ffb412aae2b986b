//! The board's USB port as a pseudo terminal, so that host tools cannot tell it from a board.

use std::fs::File;
use std::io::{ErrorKind, Read, Write};
use std::os::fd::OwnedFd;
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

use rustix::fs::{Mode, OFlags, open};
use rustix::pty::{OpenptFlags, grantpt, openpt, ptsname, unlockpt};
use rustix::termios::{OptionalActions, tcgetattr, tcsetattr};

use crate::board::Board;
use crate::error::BoardError;

/// Board time between two looks at the terminal \[s\].
const STEP_S: f64 = 0.25e-3;
/// Bytes that may wait for the board.
const WAITING: usize = 4096;

/// A pseudo terminal in raw mode.
#[derive(Debug)]
pub struct Terminal {
    controller: File,
    /// Held open: without it reads fail while no tool has the terminal open.
    _device: OwnedFd,
    path: PathBuf,
    link: Option<PathBuf>,
    to_tool: Vec<u8>,
}

fn failed(what: &str, error: impl std::fmt::Display) -> BoardError {
    BoardError::Terminal(format!("{what}: {error}"))
}

impl Terminal {
    /// Opens a pseudo terminal and, if asked, points the symbolic link `link` at it; an old link is replaced.
    ///
    /// # Errors
    /// [`BoardError::Terminal`] if the system has none left, or `link` exists and is no symbolic link.
    pub fn open(link: Option<&Path>) -> Result<Self, BoardError> {
        // Not inherited: a tool that held this end would never see the other one go.
        let flags = OpenptFlags::RDWR | OpenptFlags::NOCTTY | OpenptFlags::CLOEXEC;
        let controller = openpt(flags).map_err(|error| failed("openpt", error))?;
        grantpt(&controller).map_err(|error| failed("grantpt", error))?;
        unlockpt(&controller).map_err(|error| failed("unlockpt", error))?;
        let name = ptsname(&controller, Vec::new()).map_err(|error| failed("ptsname", error))?;
        let path = PathBuf::from(name.to_string_lossy().into_owned());
        let device = open(&path, OFlags::RDWR | OFlags::NOCTTY | OFlags::CLOEXEC, Mode::empty())
            .map_err(|error| failed(&path.display().to_string(), error))?;
        let mut settings = tcgetattr(&device).map_err(|error| failed("tcgetattr", error))?;
        settings.make_raw();
        tcsetattr(&device, OptionalActions::Now, &settings).map_err(|error| failed("tcsetattr", error))?;
        let flags = rustix::fs::fcntl_getfl(&controller).map_err(|error| failed("fcntl", error))?;
        rustix::fs::fcntl_setfl(&controller, flags | OFlags::NONBLOCK)
            .map_err(|error| failed("fcntl", error))?;
        if let Some(link) = link {
            if link.symlink_metadata().is_ok_and(|old| old.file_type().is_symlink()) {
                std::fs::remove_file(link).map_err(|error| failed(&link.display().to_string(), error))?;
            }
            std::os::unix::fs::symlink(&path, link)
                .map_err(|error| failed(&format!("link {}", link.display()), error))?;
        }
        Ok(Self {
            controller: File::from(controller),
            _device: device,
            path,
            link: link.map(Path::to_owned),
            to_tool: Vec::new(),
        })
    }

    /// Path of the terminal, for tools to open.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// Moves waiting bytes between the terminal and `board`, and returns how many the tool has sent. Bytes for which the
    /// terminal has no room wait, and the host stops reading the device once 4096 of them do.
    ///
    /// # Errors
    /// [`BoardError::Terminal`] if the terminal fails.
    pub fn exchange(&mut self, board: &mut Board) -> Result<usize, BoardError> {
        let mut buffer = [0; 1024];
        let mut received = 0;
        while board.usb_ready() && board.usb_unsent() < WAITING {
            match self.controller.read(&mut buffer) {
                Ok(0) => break,
                Ok(count) => {
                    received += count;
                    board.usb_write(&buffer[..count]);
                }
                Err(error) if error.kind() == ErrorKind::WouldBlock => break,
                Err(error) => return Err(failed("read", error)),
            }
        }
        if self.to_tool.len() < WAITING {
            self.to_tool.extend(board.usb_read());
        }
        board.set_usb_reading(self.to_tool.len() < WAITING);
        while !self.to_tool.is_empty() {
            match self.controller.write(&self.to_tool) {
                Ok(count) => {
                    self.to_tool.drain(..count);
                }
                Err(error) if error.kind() == ErrorKind::WouldBlock => break,
                Err(error) => return Err(failed("write", error)),
            }
        }
        Ok(received)
    }

    /// Whether bytes of the board wait for room in the terminal.
    pub fn is_full(&self) -> bool {
        !self.to_tool.is_empty()
    }

    /// Runs `board` for `seconds` of board time with its port on the terminal. `realtime` keeps board time from running
    /// ahead of real time. `each` is called every quarter of a millisecond of board time.
    ///
    /// # Errors
    /// As [`Self::exchange`] and [`Board::run_for`].
    pub fn serve(
        &mut self,
        board: &mut Board,
        seconds: f64,
        realtime: bool,
        mut each: impl FnMut(&mut Board),
    ) -> Result<(), BoardError> {
        let (start, start_s) = (Instant::now(), board.time_s());
        while board.time_s() - start_s < seconds {
            self.exchange(board)?;
            board.run_for(STEP_S)?;
            each(board);
            let ahead_s = board.time_s() - start_s - start.elapsed().as_secs_f64();
            if realtime && ahead_s > STEP_S {
                std::thread::sleep(Duration::from_secs_f64(ahead_s - 0.5 * STEP_S));
            }
        }
        Ok(())
    }
}

impl Drop for Terminal {
    fn drop(&mut self) {
        if let Some(link) = &self.link {
            // Nothing is left to tell about a link that cannot be removed.
            let _ = std::fs::remove_file(link);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn scratch(name: &str) -> PathBuf {
        std::env::temp_dir().join(format!("bowden-board-{}-{name}", std::process::id()))
    }

    #[test]
    fn the_link_leads_to_the_terminal_and_goes_with_it() {
        let link = scratch("link");
        let first = Terminal::open(Some(&link)).expect("a terminal");
        assert_eq!(std::fs::read_link(&link).expect("a link"), first.path());
        // A link that a killed process left behind is replaced.
        let second = Terminal::open(Some(&link)).expect("a terminal");
        assert_eq!(std::fs::read_link(&link).expect("a link"), second.path());
        assert_ne!(first.path(), second.path());
        drop(second);
        assert!(std::fs::symlink_metadata(&link).is_err());
    }

    #[test]
    fn a_file_in_the_way_is_kept_and_reported() {
        let path = scratch("file");
        std::fs::write(&path, "precious").expect("written");
        let error = Terminal::open(Some(&path)).expect_err("in the way").to_string();
        assert!(error.contains("link"), "{error}");
        assert_eq!(std::fs::read_to_string(&path).expect("still there"), "precious");
        std::fs::remove_file(&path).expect("removed");
    }

    #[test]
    fn bytes_pass_unchanged() {
        let mut terminal = Terminal::open(None).expect("a terminal");
        let mut tool =
            std::fs::OpenOptions::new().read(true).write(true).open(terminal.path()).expect("opens");
        let all: Vec<u8> = (0..=255).collect();
        terminal.controller.write_all(&all).expect("written");
        let mut seen = vec![0; 256];
        tool.read_exact(&mut seen).expect("read");
        assert_eq!(seen, all, "no echo, no translation of line ends");
        tool.write_all(&all).expect("written");
        let mut back = vec![0; 256];
        terminal.controller.read_exact(&mut back).expect("read");
        assert_eq!(back, all);
    }
}
