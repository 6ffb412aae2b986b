//! The link at full rate: `cargo bench -p bowden --bench link`.
//!
//! | figure | goal |
//! |---|---|
//! | 10 kHz, all that goes into a tick, over a pseudo terminal for 60 s (`BOWDEN_LINK_SECONDS`) | no sample lost |
//! | the same at 20 kHz | no sample lost, 500 kB/s or more |
//! | ready-made frames of the same, as fast as they go | 500 kB/s or more |
//! | decoding on one core, without and with all that goes into a tick | 2 million samples a second or more |
//! | writing MCAP, beside the plain `mcap` crate with JSON messages of similar size | a ratio |
//! | `bowden monitor` at 10 kHz, if that rate stands on its screen without a loss | below 30 % of a core |
//!
//! Figures, not tests: they depend on the machine and on what else runs there. A sample that is lost or a goal that is missed is said at the end,
//! and the exit status is 1.

#[path = "link/monitor.rs"]
mod monitor;

use std::fs::File;
use std::io::{Cursor, Read, Write};
use std::process::ExitCode;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

use bowden_core::recording::{Format, Metadata, RowWriter};
use bowden_host_link::conversion::{Conversion, columns};
use bowden_host_link::paced::Paced;
use bowden_host_link::raw::OrderBook;
use bowden_host_link::serial::SerialTransport;
use bowden_host_link::sim::SimTransport;
use bowden_host_link::{Client, ParameterSet, Session, Transport};
use bowden_link::message::Mode;
use bowden_link::sample::{BATCH_LENGTH, RAW_BATCH_LENGTH};
use bowden_link::{Accumulator, Answer, Batch, FromBoard, RawBatch, RawTick, Sample, encode};
use monitor::monitor;
use rustix::fs::{OFlags, fcntl_setfl};
use rustix::pty::{OpenptFlags, grantpt, openpt, ptsname, unlockpt};
use rustix::termios::{OptionalActions, tcgetattr, tcsetattr};

type Outcome<T> = Result<T, Box<dyn std::error::Error>>;

/// Length of the link's figure, s, if `BOWDEN_LINK_SECONDS` does not say another one.
const LINK_S: f64 = 60.0;

/// Samples that are decoded and written.
const SAMPLES: usize = 2_000_000;

/// Goals of the table.
const GOAL_KB_PER_S: f64 = 500.0;
const GOAL_SAMPLES_PER_S: f64 = 2e6;
const GOAL_MONITOR_SHARE: f64 = 0.3;

/// Control rate at which all signals make the goal of the link, kHz.
const FASTEST_KHZ: u32 = 20;

fn main() -> ExitCode {
    match figures() {
        Ok(missed) if missed.is_empty() => ExitCode::SUCCESS,
        Ok(missed) => {
            eprintln!("missed: {}", missed.join("; "));
            ExitCode::FAILURE
        }
        Err(error) => {
            eprintln!("{error}");
            ExitCode::FAILURE
        }
    }
}

/// Prints all figures; returns the goals that are missed.
fn figures() -> Outcome<Vec<String>> {
    let mut missed = Vec::new();
    let mut goal = |is_reached: bool, what: String| missed.extend((!is_reached).then_some(what));
    let seconds =
        std::env::var("BOWDEN_LINK_SECONDS").ok().and_then(|text| text.parse().ok()).unwrap_or(LINK_S);
    for (kilohertz, divider) in [(10, 2.0), (FASTEST_KHZ, 1.0)] {
        let (received, lost, kilobytes_per_s) = at_rate(seconds, divider)?;
        println!(
            "{kilohertz} kHz, all that goes into a tick, {seconds} s over a pseudo terminal: {received} samples, {lost} lost, {kilobytes_per_s:.0} kB/s, {:.1} bytes a sample",
            kilobytes_per_s * 1e3 * seconds / received as f64
        );
        goal(lost == 0, format!("{lost} samples lost at {kilohertz} kHz"));
        if kilohertz == FASTEST_KHZ {
            goal(
                kilobytes_per_s >= GOAL_KB_PER_S,
                format!("{kilobytes_per_s:.0} of {GOAL_KB_PER_S} kB/s at {kilohertz} kHz"),
            );
        }
    }
    let (samples_per_s, kilobytes_per_s) = flat_out()?;
    println!(
        "ready-made frames of the same as fast as they go: {samples_per_s:.0} samples/s, {kilobytes_per_s:.0} kB/s (goal {GOAL_KB_PER_S} kB/s)"
    );
    goal(
        kilobytes_per_s >= GOAL_KB_PER_S,
        format!("{kilobytes_per_s:.0} of {GOAL_KB_PER_S} kB/s of ready-made frames"),
    );
    let samples = samples();
    for (what, samples_per_s) in [
        ("decoding on one core", decoding(&samples)?),
        ("decoding with all that goes into a tick", decoding_raw(&samples)?),
    ] {
        println!(
            "{what}: {:.2} million samples/s (goal {})",
            samples_per_s * 1e-6,
            GOAL_SAMPLES_PER_S * 1e-6
        );
        goal(
            samples_per_s >= GOAL_SAMPLES_PER_S,
            format!("{what}: {samples_per_s:.0} of {GOAL_SAMPLES_PER_S} samples/s"),
        );
    }
    let (ours, plain) = writing(&samples)?;
    println!(
        "writing MCAP: {:.0} thousand rows/s; the plain mcap crate with JSON messages of similar size: {:.0}; ratio {:.2}",
        ours * 1e-3,
        plain * 1e-3,
        ours / plain
    );
    let watching = monitor()?;
    println!(
        "bowden monitor at 10 kHz: {:.0} % of a core (goal {:.0} %), with {:.0} samples/s or more on its screen, none lost",
        watching.share * 100.0,
        GOAL_MONITOR_SHARE * 100.0,
        watching.least_samples_per_s
    );
    goal(
        watching.share < GOAL_MONITOR_SHARE,
        format!("bowden monitor takes {:.0} % of a core", watching.share * 100.0),
    );
    Ok(missed)
}

/// A simulated board in real time behind a pseudo terminal.
struct Board {
    port: String,
    stop: Arc<AtomicBool>,
    thread: Option<JoinHandle<()>>,
    // Keeps the terminal alive between two programs that use it.
    _slave: File,
}

/// A terminal without any processing: its master, the slave's name, and the slave.
fn terminal() -> Outcome<(File, String, File)> {
    let master = openpt(OpenptFlags::RDWR | OpenptFlags::NOCTTY | OpenptFlags::CLOEXEC)?;
    grantpt(&master)?;
    unlockpt(&master)?;
    let port = ptsname(&master, Vec::new())?.into_string()?;
    let slave = File::options().read(true).write(true).open(&port)?;
    let mut settings = tcgetattr(&slave)?;
    settings.make_raw();
    tcsetattr(&slave, OptionalActions::Now, &settings)?;
    Ok((File::from(master), port, slave))
}

impl Board {
    fn new() -> Outcome<Self> {
        let (mut master, port, slave) = terminal()?;
        fcntl_setfl(&master, OFlags::NONBLOCK)?;
        let stop = Arc::new(AtomicBool::new(false));
        let stopped = Arc::clone(&stop);
        let thread = std::thread::spawn(move || {
            let mut board = Paced::new(SimTransport::new());
            let (mut to_board, mut from_board, mut waiting) = ([0; 4096], [0; 4096], Vec::new());
            while !stopped.load(Ordering::Relaxed) {
                if let Ok(length @ 1..) = master.read(&mut to_board)
                    && board.write(&to_board[..length]).is_err()
                {
                    return;
                }
                let Ok(length) = board.read(&mut from_board, Duration::from_millis(1)) else { return };
                waiting.extend_from_slice(&from_board[..length]);
                while let Ok(written @ 1..) = master.write(&waiting) {
                    waiting.drain(..written);
                    if waiting.is_empty() {
                        break;
                    }
                }
            }
        });
        Ok(Self { port, stop, thread: Some(thread), _slave: slave })
    }
}

impl Drop for Board {
    fn drop(&mut self) {
        self.stop.store(true, Ordering::Relaxed);
        if let Some(thread) = self.thread.take() {
            // A thread that panicked has nothing left to clean up.
            let _ = thread.join();
        }
    }
}

/// Samples, those lost, and kB/s, with the control rate of 20 kHz divided by `divider`.
fn at_rate(seconds: f64, divider: f32) -> Outcome<(u64, u64, f64)> {
    let board = Board::new()?;
    let mut client = Client::connect(
        Box::new(SerialTransport::open(&board.port)?),
        board.port.clone(),
        Duration::from_secs(5),
    )?;
    let rate = ParameterSet::read(&mut client)?.find("control.rate_divider").map(|rate| rate.index);
    client.set_parameter(rate.map_err(|failure| failure.message().to_owned())?, divider)?;
    client.note_orders(OrderBook::default());
    client.switch_telemetry(true)?;
    let (begun, before) = (Instant::now(), client.heard_bytes());
    let mut samples = 0;
    let mut said = Instant::now();
    while begun.elapsed().as_secs_f64() < seconds {
        client.listen(Duration::from_millis(5))?;
        while let Some(telemetry) = client.telemetry() {
            samples += telemetry.batch.samples.len() as u64;
        }
        if said.elapsed() > Duration::from_millis(100) {
            said = Instant::now();
            client.alive()?;
        }
    }
    let bytes = client.heard_bytes() - before;
    Ok((samples, client.losses().samples, bytes as f64 * 1e-3 / begun.elapsed().as_secs_f64()))
}

/// Samples a second and kB/s of ready-made frames through a pseudo terminal, decoded behind it.
fn flat_out() -> Outcome<(f64, f64)> {
    let (mut master, port, _slave) = terminal()?;
    let mut transport = SerialTransport::open(&port)?;
    let frames = raw_frames(&samples()[..RAW_BATCH_LENGTH * 10_000])?;
    let total = frames.len();
    let writer = std::thread::spawn(move || master.write_all(&frames).map(|()| master));
    let begun = Instant::now();
    let (mut buffer, mut accumulator) = ([0; 4096], Accumulator::<1400>::default());
    let (mut bytes, mut samples) = (0, 0);
    while bytes < total {
        let length = transport.read(&mut buffer, Duration::from_secs(5))?;
        if length == 0 {
            return Err("the terminal fell silent".into());
        }
        bytes += length;
        for byte in &buffer[..length] {
            if let Some(Ok(Answer { message: FromBoard::RawTelemetry(batch), .. })) = accumulator.push(*byte)
            {
                samples += batch.ticks.len();
            }
        }
    }
    let elapsed_s = begun.elapsed().as_secs_f64();
    let _master = writer.join().map_err(|_| "the writing thread failed")??;
    Ok((samples as f64 / elapsed_s, bytes as f64 * 1e-3 / elapsed_s))
}

/// What a running joint sends.
fn samples() -> Vec<Sample> {
    let sample = |k: usize| {
        let wave = (f64::from(k as u32 % 20_000) * 3.14e-4).sin();
        let code = |middle: f64, swing: f64| (middle + swing * wave) as u16;
        Sample {
            encoder_count_raw: [1000 + (300.0 * wave) as i32, 1000 + (280.0 * wave) as i32],
            tension_raw: [
                code(1450.0, 300.0),
                code(1400.0, 200.0),
                code(1500.0, -300.0),
                code(1450.0, -200.0),
            ],
            current_raw: code(2048.0, 150.0),
            bus_raw: 2707,
            duty_raw: (9000.0 * wave) as i16,
            reference_raw: (300_000.0 * wave) as i32,
            command_raw: (310_000.0 * wave) as i32,
            state: bowden_link::State::Run,
            limits: bowden_link::Limits(0),
        }
    };
    (0..SAMPLES).map(sample).collect()
}

fn frame(sequence: u16, message: FromBoard, into: &mut Vec<u8>) -> Outcome<()> {
    let mut buffer = [0; 1400];
    into.extend_from_slice(encode(&Answer { sequence, answers: None, message }, &mut buffer)?);
    Ok(())
}

fn raw_frames(samples: &[Sample]) -> Outcome<Vec<u8>> {
    let mut frames = Vec::new();
    for (number, samples) in samples.chunks(RAW_BATCH_LENGTH).enumerate() {
        let inputs = bowden_link::Inputs {
            encoder_word_raw: [bowden_link::sample::WordRaw::new(0xabcd, number as u8 & 127, false); 2],
            ..bowden_link::Inputs::default()
        };
        let ticks = samples.iter().map(|sample| RawTick { sample: *sample, inputs }).collect();
        let first_tick = (number * RAW_BATCH_LENGTH) as u32;
        let batch = RawBatch { first_tick, period_ns: 100_000, lost: 0, ticks };
        frame(number as u16, FromBoard::RawTelemetry(batch), &mut frames)?;
    }
    Ok(frames)
}

/// Samples that are decoded a second.
fn decoding(samples: &[Sample]) -> Outcome<f64> {
    let mut frames = Vec::new();
    for (number, samples) in samples.chunks(BATCH_LENGTH).enumerate() {
        let first_tick = (number * BATCH_LENGTH) as u32;
        let batch =
            Batch { first_tick, period_ns: 100_000, lost: 0, samples: samples.iter().copied().collect() };
        frame(number as u16, FromBoard::Telemetry(batch), &mut frames)?;
    }
    decoded(&frames)
}

fn decoding_raw(samples: &[Sample]) -> Outcome<f64> {
    decoded(&raw_frames(samples)?)
}

fn decoded(frames: &[u8]) -> Outcome<f64> {
    let mut accumulator = Accumulator::<1400>::default();
    let (begun, mut count) = (Instant::now(), 0);
    for byte in frames {
        match accumulator.push::<Answer>(*byte) {
            None => {}
            Some(Ok(Answer { message: FromBoard::Telemetry(batch), .. })) => count += batch.samples.len(),
            Some(Ok(Answer { message: FromBoard::RawTelemetry(batch), .. })) => count += batch.ticks.len(),
            Some(other) => return Err(format!("{other:?} of a frame").into()),
        }
    }
    Ok(std::hint::black_box(count) as f64 / begun.elapsed().as_secs_f64())
}

/// Rows a second of this program, and of the plain crate with JSON messages of similar size; in memory.
fn writing(samples: &[Sample]) -> Outcome<(f64, f64)> {
    let rows = &samples[..SAMPLES / 10];
    let session =
        Session::new(Client::connect(Box::new(SimTransport::new()), "sim", Duration::from_secs(1))?)?;
    let conversion = Conversion::new(session.parameters())?;
    let mode = Some(Mode::Position);
    let begun = Instant::now();
    let mut writer =
        RowWriter::new(Format::Mcap, &columns(mode), &Metadata::default(), Cursor::new(Vec::new()))?;
    for (tick, sample) in rows.iter().enumerate() {
        writer.row(tick as f64 * 1e-4, conversion.cells(sample, mode))?;
    }
    writer.finish(&Metadata::default())?;
    let ours = rows.len() as f64 / begun.elapsed().as_secs_f64();
    // One message of the size that a row has.
    let names = columns(mode);
    let cells: Vec<String> =
        names.iter().map(|column| format!("\"{}\":12345.678901", column.name())).collect();
    let message = format!("{{\"t_s\":1.2345,{}}}", cells.join(","));
    let begun = Instant::now();
    let options = mcap::WriteOptions::new().chunk_size(Some(1 << 20)).compression_threads(0);
    let mut plain = options.create(Cursor::new(Vec::new()))?;
    let schema = plain.add_schema("sample", "jsonschema", b"{}")?;
    let channel_id = plain.add_channel(schema, "/samples", "json", &std::collections::BTreeMap::new())?;
    let mut bytes = message.into_bytes();
    for sequence in 0..rows.len() as u32 {
        // Not all alike, or compression would have nothing to do.
        let place = sequence as usize % (bytes.len() - 8) + 4;
        bytes[place] = bytes[place].wrapping_add(1).clamp(b'0', b'z');
        let log_time = u64::from(sequence) * 100_000;
        let header = mcap::records::MessageHeader { channel_id, sequence, log_time, publish_time: log_time };
        plain.write_to_known_channel(&header, &bytes)?;
    }
    plain.finish()?;
    Ok((ours, rows.len() as f64 / begun.elapsed().as_secs_f64()))
}
