//! `bowden faults`: what a board says about its state, and what led to a fault.

use std::fmt::Write;
use std::path::{Path, PathBuf};

use bowden_core::outcome::{Failure, Outcome};
use bowden_core::output;
use bowden_core::recording::{Format, Metadata, RowWriter};
use bowden_host_link::conversion::{Conversion, columns};
use bowden_host_link::recorder::tick_time_s;
use bowden_host_link::{Client, LinkError, ParameterSet};
use bowden_link::message::{Boot, Chip, Goal, Refusal, Status};
use bowden_link::{FaultRecord, Limit, Sample};
use serde::Serialize;

use super::port::PortArguments;
use super::{print, print_json};

/// Arguments of `bowden faults`.
#[derive(Clone, Debug, clap::Args)]
pub struct FaultsArguments {
    #[command(flatten)]
    port: PortArguments,
    /// Forget the fault afterwards; the board is then off
    #[arg(long)]
    clear: bool,
    /// Write the last control ticks before the fault, or before now if there is none (.csv, .csv.gz, .mcap)
    #[arg(long, value_name = "OUT.csv")]
    snapshot: Option<PathBuf>,
    /// Print JSON: one object
    #[arg(long)]
    json: bool,
}

/// What a board says of itself.
#[derive(Serialize)]
struct Facts<'f> {
    #[serde(flatten)]
    status: StatusFacts,
    firmware: &'f str,
    firmware_revision: &'f str,
    board: &'f str,
    board_serial: &'f str,
    started_by: &'static str,
    clock: String,
    panic: &'f str,
}

/// State, fault, limits and counters, and how many of the last ticks are kept.
#[derive(Serialize)]
pub(super) struct StatusFacts {
    state: String,
    fault: Option<FaultFacts>,
    limits: Vec<&'static str>,
    tick: u32,
    period_ns: u32,
    longest_tick_cycles: u32,
    samples_lost: u32,
    unreadable_frames: u32,
    failed_encoder_exchanges: u32,
    snapshot: u8,
}

impl From<&Status> for StatusFacts {
    fn from(status: &Status) -> Self {
        Self {
            state: status.state.to_string(),
            fault: status.fault.map(FaultFacts::from),
            limits: acting(status),
            tick: status.tick,
            period_ns: status.period_ns,
            longest_tick_cycles: status.longest_tick_cycles,
            samples_lost: status.lost,
            unreadable_frames: status.bad_frames,
            failed_encoder_exchanges: status.bus_errors,
            snapshot: status.snapshot,
        }
    }
}

/// A fault in numbers and words.
#[derive(Serialize)]
struct FaultFacts {
    number: u8,
    channel: u8,
    tick: u32,
    got: f32,
    limit: f32,
    words: String,
}

impl From<FaultRecord> for FaultFacts {
    fn from(record: FaultRecord) -> Self {
        let FaultRecord { fault, channel, tick, got, limit } = record;
        Self { number: fault as u8, channel, tick, got, limit, words: record.to_string() }
    }
}

impl FaultsArguments {
    /// Prints state, fault, limits and the cause of the last start; writes the snapshot; clears the fault.
    ///
    /// # Errors
    /// Exit status 2, if the output or the port is not usable; 1, if the board refused or the link broke.
    pub fn run(&self) -> Result<Outcome, Failure> {
        if let Some(path) = &self.snapshot {
            Format::for_rows(path)?;
            output::check_file(path, &[])?;
        }
        let mut client = self.port.connect()?;
        let status = client.status()?;
        let mut text = describe(&status);
        let greeting = client.greeting();
        let boot = match greeting.boot {
            Boot::Power => "supply switched on",
            Boot::Pin => "reset pin or debugger",
            Boot::Software => "the firmware itself, after a panic or a processor fault",
            Boot::Watchdog => "the watchdog",
        };
        let _ = writeln!(text, "firmware {} on {}, started by: {boot}", greeting.firmware, greeting.board);
        let _ = writeln!(text, "clock: {}", greeting.chip.clock);
        let (level, expected) = (greeting.chip.brown_out_level, Chip::EXPECTED.brown_out_level);
        if level != expected {
            let _ = writeln!(
                text,
                "brown-out level {level}, expected {expected} (2.8 V): set the option bytes BOR_LEV"
            );
        }
        let clock = greeting.chip.clock.to_string();
        let greeting = greeting.clone();
        let panic = client.panic_text()?;
        if !panic.is_empty() {
            let _ = writeln!(text, "panic before that: {}", bowden_core::outcome::one_line(&panic));
        }
        let _ = writeln!(text, "samples of the last ticks: {}", status.snapshot);
        let mut outcome = Outcome::done();
        if let Some(path) = &self.snapshot {
            outcome.extend(save_snapshot(&mut client, &status, path)?);
        }
        if self.clear && status.fault.is_some() {
            client.enter(Goal::ClearFault)?;
            text += "fault cleared\n";
        }
        if self.json {
            print_json(&Facts {
                status: StatusFacts::from(&status),
                firmware: &greeting.firmware,
                firmware_revision: &greeting.revision,
                board: &greeting.board,
                board_serial: &greeting.serial,
                started_by: boot,
                clock,
                panic: &panic,
            })?;
            return Ok(outcome);
        }
        print(&text)?;
        Ok(outcome)
    }
}

/// Limits that act, in words.
fn acting(status: &Status) -> Vec<&'static str> {
    Limit::ALL.into_iter().filter(|limit| status.limits.contains(*limit)).map(Limit::title).collect()
}

/// State, fault, limits and counters in lines.
pub(super) fn describe(status: &Status) -> String {
    let Status { state, fault, tick, period_ns, longest_tick_cycles, lost, bad_frames, bus_errors, .. } =
        status;
    let mut text = format!("state: {state}\n");
    let _ = match fault {
        Some(fault) => writeln!(text, "{fault}"),
        None => writeln!(text, "no fault"),
    };
    let acting = acting(status);
    let acting = if acting.is_empty() { "none".to_owned() } else { acting.join(", ") };
    let _ = writeln!(text, "limits that act: {acting}");
    let _ = writeln!(
        text,
        "tick {tick} ({:.6} s since the start), period {:.1} us, longest tick {longest_tick_cycles} cycles",
        tick_time_s((*tick).into(), *period_ns),
        f64::from(*period_ns) * 1e-3
    );
    let _ =
        writeln!(text, "samples lost on the board: {lost}, unreadable frames from the host: {bad_frames}");
    let _ = writeln!(text, "failed exchanges with encoders: {bus_errors}");
    text
}

/// Writes what the board kept of the last ticks; returns what is missing of them.
fn save_snapshot(client: &mut Client, status: &Status, path: &Path) -> Result<Option<String>, Failure> {
    let format = Format::for_rows(path)?;
    let parameters = ParameterSet::read(client)?;
    let conversion = Conversion::new(&parameters)?;
    let mut samples: Vec<(u64, Sample)> = Vec::with_capacity(status.snapshot.into());
    for index in 0..status.snapshot {
        // While no fault holds them, the oldest are overwritten as they are read.
        match client.snapshot(index) {
            Ok((tick, sample)) => match samples.last() {
                None => samples.push((tick.into(), sample)),
                Some((before, _)) => {
                    // The board's count wraps; that of the file goes on.
                    let later = tick.wrapping_sub(*before as u32);
                    if (1..u32::MAX / 2).contains(&later) {
                        samples.push((before + u64::from(later), sample));
                    }
                }
            },
            Err(LinkError::Refused { refusal: Refusal::NoSuchIndex, .. }) => {}
            Err(error) => return Err(error.into()),
        }
    }
    let shown = path.display();
    if samples.is_empty() {
        return Err(Failure::failed(format!(
            "{shown}: the board keeps no ticks yet; ask again after a fault"
        )));
    }
    output::write_file(path, |file| {
        let mut writer = RowWriter::new(format, &columns(None), &Metadata::default(), file)?;
        for (tick, sample) in &samples {
            let t_s = tick_time_s(*tick, status.period_ns);
            writer.row(t_s, conversion.cells(sample, None))?;
        }
        writer.finish(&Metadata::default())
    })?;
    let consecutive = samples.windows(2).all(|pair| pair[1].0 == pair[0].0 + 1);
    let whole = consecutive && samples.len() == usize::from(status.snapshot);
    Ok((!whole).then(|| {
        format!(
            "{shown}: {} ticks with gaps: control went on while they were read; only a fault holds them",
            samples.len()
        )
    }))
}
