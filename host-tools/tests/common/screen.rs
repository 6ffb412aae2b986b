//! A program in a terminal: its screen, as a terminal emulator shows it, and its keys.

use std::io::{Read, Write};
use std::num::NonZeroU16;
use std::process::{Child, Command, Stdio};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

use pty_process::Size;
use pty_process::blocking::{Pty, open};
use vt100::{Color, Parser};

/// Real time in which something has to appear on a screen; a hung program ends a test instead of holding it up for ever.
const HANG_LIMIT: Duration = Duration::from_mins(10);

/// Time between two looks.
const LOOK: Duration = Duration::from_millis(5);

/// A program in a terminal.
pub struct Screen {
    pty: Arc<Pty>,
    emulator: Arc<Mutex<Parser>>,
    held: Arc<AtomicBool>,
    reader: Option<JoinHandle<()>>,
    child: Option<Child>,
}

fn emulator(columns: u16, rows: u16) -> Parser {
    let size = |value| NonZeroU16::new(value).unwrap();
    Parser::new(size(rows), size(columns), 0)
}

impl Screen {
    /// Starts a command in a terminal of this size; standard error stays apart.
    pub fn start(command: &Command, columns: u16, rows: u16) -> Self {
        let (pty, pts) = open().unwrap();
        pty.resize(Size::new(rows, columns)).unwrap();
        let mut started = pty_process::blocking::Command::new(command.get_program());
        started = started.args(command.get_args()).stderr(Stdio::piped());
        started = started.env("TERM", "xterm-256color").env_remove("NO_COLOR");
        for (name, value) in command.get_envs() {
            started = match value {
                Some(value) => started.env(name, value),
                None => started.env_remove(name),
            };
        }
        if let Some(folder) = command.get_current_dir() {
            started = started.current_dir(folder);
        }
        let child = started.spawn(pts).unwrap();
        let pty = Arc::new(pty);
        let emulator = Arc::new(Mutex::new(emulator(columns, rows)));
        let held = Arc::new(AtomicBool::new(false));
        let (read_from, shown_on, is_held) = (Arc::clone(&pty), Arc::clone(&emulator), Arc::clone(&held));
        let reader = std::thread::spawn(move || {
            let mut buffer = [0; 4096];
            // An error is the end: nobody has the terminal open any more.
            while let Ok(read @ 1..) = (&*read_from).read(&mut buffer) {
                shown_on.lock().unwrap().process(&buffer[..read]);
                while is_held.load(Ordering::Relaxed) {
                    std::thread::sleep(LOOK);
                }
            }
        });
        Self { pty, emulator, held, reader: Some(reader), child: Some(child) }
    }

    /// What stands on the screen.
    pub fn text(&self) -> String {
        self.emulator.lock().unwrap().screen().contents()
    }

    /// Colours of all characters on the screen, each once.
    pub fn colours(&self) -> Vec<Color> {
        let emulator = self.emulator.lock().unwrap();
        let screen = emulator.screen();
        let (rows, columns) = screen.size();
        let mut colours = Vec::new();
        for row in 0..rows.get() {
            for cell in (0..columns.get()).filter_map(|column| screen.cell(row, column)) {
                for colour in [cell.fgcolor(), cell.bgcolor()] {
                    if !colours.contains(&colour) {
                        colours.push(colour);
                    }
                }
            }
        }
        colours
    }

    /// Presses keys.
    pub fn press(&self, keys: &str) {
        (&*self.pty).write_all(keys.as_bytes()).unwrap();
    }

    /// Another size of the terminal.
    pub fn resize(&self, columns: u16, rows: u16) {
        *self.emulator.lock().unwrap() = emulator(columns, rows);
        self.pty.resize(Size::new(rows, columns)).unwrap();
    }

    /// Nobody reads what the program draws, as on a line that is stuck, until released.
    pub fn hold(&self, held: bool) {
        self.held.store(held, Ordering::Relaxed);
    }

    /// Waits until something stands on the screen.
    pub fn wait_for(&mut self, text: &str) {
        self.wait_until(text, |screen| screen.contains(text));
    }

    /// Waits until the screen is as wanted.
    pub fn wait_until(&mut self, what: &str, wanted: impl Fn(&str) -> bool) {
        let begun = Instant::now();
        while !wanted(&self.text()) {
            let ended = self.child.as_mut().unwrap().try_wait().unwrap();
            let hangs = begun.elapsed() > HANG_LIMIT;
            if ended.is_some() || hangs {
                let screen = self.text();
                let (_, stderr) = self.end();
                panic!("`{what}` never came, ended: {ended:?}, stderr: {stderr}\n{screen}");
            }
            std::thread::sleep(LOOK);
        }
    }

    /// Whether the program has ended.
    pub fn has_ended(&mut self) -> bool {
        self.child.as_mut().unwrap().try_wait().unwrap().is_some()
    }

    /// Waits for the end: exit status and standard error.
    pub fn end(&mut self) -> (i32, String) {
        let output = self.child.take().unwrap().wait_with_output().unwrap();
        self.reader.take().unwrap().join().unwrap();
        (output.status.code().expect("no signal"), String::from_utf8(output.stderr).unwrap())
    }
}

impl Drop for Screen {
    fn drop(&mut self) {
        self.hold(false);
        if let Some(mut child) = self.child.take() {
            // After a failed test.
            let _ = child.kill();
            let _ = child.wait();
        }
    }
}
