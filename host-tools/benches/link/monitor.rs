//! `bowden monitor` at full rate: what it costs, and that the samples arrived.

use std::io::{Read, Write};
use std::num::NonZeroU16;
use std::sync::{Arc, Mutex, PoisonError};
use std::time::{Duration, Instant};

use super::{Board, Outcome};

/// How long it is watched, s.
const SHORT_S: f64 = 10.0;

/// What watching a board costs.
pub struct Watching {
    /// Processor time over real time.
    pub share: f64,
    /// Lowest rate that stood on the screen.
    pub least_samples_per_s: f64,
}

/// Lowest rate at which 10 kHz are said to have arrived. A second of the screen may end in the middle of a batch.
const LEAST_SAMPLES_PER_S: f64 = 9_900.0;

/// Rate on the monitor's screen, if nothing was lost. The figure is none of 10 kHz if the samples do not arrive.
fn arrived(screen: &str) -> Outcome<f64> {
    let line =
        screen.lines().find_map(|line| line.split("link ").nth(1)).ok_or("the monitor shows no link")?;
    let rate = line.split(" samples/s").next().unwrap_or_default().parse()?;
    let says = |what: &str| line.contains(what);
    if rate < LEAST_SAMPLES_PER_S || !says("lost 0 (by the board 0)") || !says("not shown 0") {
        return Err(format!("10 kHz did not arrive at the monitor: link {line}").into());
    }
    Ok(rate)
}

/// The monitor with a board that is off.
///
/// # Errors
/// When it does not start, or 10 kHz do not arrive at it without a loss.
pub fn monitor() -> Outcome<Watching> {
    let board = Board::new()?;
    let (pty, pts) = pty_process::blocking::open()?;
    pty.resize(pty_process::Size::new(40, 140))?;
    let arguments = ["monitor", "--port", &board.port, "--timeout", "30", "--quiet"];
    let command = pty_process::blocking::Command::new(env!("CARGO_BIN_EXE_bowden"));
    let mut child = command.args(arguments).env("TERM", "xterm-256color").spawn(pts)?;
    let pty = Arc::new(pty);
    let size = |value| NonZeroU16::new(value).ok_or("an empty screen");
    let emulator = Arc::new(Mutex::new(vt100::Parser::new(size(40)?, size(140)?, 0)));
    let (drawn, shown) = (Arc::clone(&pty), Arc::clone(&emulator));
    let reader = std::thread::spawn(move || {
        let mut buffer = [0; 4096];
        while let Ok(length @ 1..) = (&*drawn).read(&mut buffer) {
            shown.lock().unwrap_or_else(PoisonError::into_inner).process(&buffer[..length]);
        }
    });
    // The first second that is shown holds the start.
    std::thread::sleep(Duration::from_secs(3));
    let ticks_per_s = rustix::param::clock_ticks_per_second() as f64;
    let used_s = |id: u32| -> Outcome<f64> {
        let text = std::fs::read_to_string(format!("/proc/{id}/stat"))?;
        let fields: Vec<&str> = text.rsplit(") ").next().unwrap_or_default().split(' ').collect();
        // utime and stime, counted behind the name.
        Ok((fields[11].parse::<f64>()? + fields[12].parse::<f64>()?) / ticks_per_s)
    };
    let (begun, before_s) = (Instant::now(), used_s(child.id())?);
    let mut rates = Vec::new();
    while begun.elapsed().as_secs_f64() < SHORT_S {
        std::thread::sleep(Duration::from_secs(1));
        let screen = emulator.lock().unwrap_or_else(PoisonError::into_inner).screen().contents();
        rates.push(arrived(&screen));
    }
    let share = (used_s(child.id())? - before_s) / begun.elapsed().as_secs_f64();
    (&*pty).write_all(b"q")?;
    child.wait()?;
    drop(pty);
    reader.join().map_err(|_| "the reading thread failed")?;
    let rates = rates.into_iter().collect::<Outcome<Vec<f64>>>()?;
    Ok(Watching { share, least_samples_per_s: rates.into_iter().fold(f64::INFINITY, f64::min) })
}
