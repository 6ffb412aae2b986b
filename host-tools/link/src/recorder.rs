//! Rows of a recording from the ticks of a run, one at a time.
//!
//! A thread of its own writes them, so that a slow medium does not silence the host, whom the board would stop the joint for.

use std::io;
use std::path::{Path, PathBuf};
use std::sync::mpsc::{Receiver, RecvTimeoutError, SyncSender, sync_channel};
use std::sync::{Arc, OnceLock};
use std::thread::{self, JoinHandle};

use bowden_core::outcome::Failure;
use bowden_core::output;
use bowden_core::recording::{Cell, DurableFile, DurableWriter, Format, Metadata, Saved};
use bowden_link::message::Mode;

use super::conversion::{Conversion, columns};
use super::evidence;
use super::losses::Losses;
use super::raw::{self, OrderBook};
use super::rig_file;
use super::session::RunTick;

/// Rows that may wait for the medium: 6.5 s at 10 kHz, 5 MB.
const QUEUE: usize = 1 << 16;

/// Writes ticks and counts what is missing between them.
pub struct Recorder {
    path: PathBuf,
    rows: SyncSender<RunTick>,
    writer: JoinHandle<Written>,
    conversion: Conversion,
    every: u64,
    metadata_file: Option<PathBuf>,
    /// Clocks at the first row, which the thread that writes may see late.
    started: Arc<OnceLock<Vec<(String, String)>>>,
    tally: Tally,
}

/// What a recording is, beside its ticks.
#[derive(Clone, Debug)]
pub struct Form {
    /// Format of the file.
    pub format: Format,
    /// SI values from raw ones.
    pub conversion: Conversion,
    /// What is controlled.
    pub mode: Mode,
    /// Only every N-th tick is written, beginning with the first.
    pub every: u64,
    /// Orders, where what went into a tick is written as well.
    pub orders: Option<OrderBook>,
    /// What stands before the rows; the time of the first one is added.
    pub metadata: Metadata,
    /// Rig file that stands before the rows too, with the supply of the first one.
    pub rig: Option<rig_file::Draft>,
    /// Files that stand beside the recording, with their text.
    pub beside: Vec<(PathBuf, String)>,
    /// File that the metadata go to where the format has no place for them.
    pub metadata_file: Option<PathBuf>,
}

/// The writer and what stands before its rows; nothing without a row.
type Written = Result<Option<(DurableWriter, Metadata)>, Broken>;

/// The medium refused.
#[derive(Debug)]
struct Broken {
    error: io::Error,
    /// What is kept all the same.
    saved: Saved,
}

/// What was recorded.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Tally {
    /// Rows written.
    pub rows: u64,
    /// Ticks of the first and the last sample.
    pub ticks: Option<(u64, u64)>,
    /// Time between two ticks, ns.
    pub period_ns: u32,
    /// Samples that are missing between them.
    pub missing: u64,
    /// Gaps that they leave.
    pub gaps: u64,
    /// First tick that is missing.
    pub first_missing: Option<u64>,
    /// Voltage of the bus in the first sample, V.
    pub bus_v: Option<f64>,
    /// How often the board was unplugged and came back.
    pub unplugged: usize,
    /// Last tick before the first time.
    pub first_unplugged: Option<u64>,
}

/// Time of a tick, s: the nearest number to the exact product.
pub fn tick_time_s(tick: u64, period_ns: u32) -> f64 {
    (u128::from(tick) * u128::from(period_ns)) as f64 / 1e9
}

impl Recorder {
    /// Writes to a file, whose name is `path` in messages. What it holds stays until the first tick comes.
    pub fn new(file: DurableFile, form: Form, path: &Path) -> Self {
        let (rows, received) = sync_channel(QUEUE);
        let (conversion, every) = (form.conversion, form.every.max(1));
        let metadata_file = form.metadata_file.clone();
        let started = Arc::new(OnceLock::new());
        let started_there = Arc::clone(&started);
        let writer = thread::spawn(move || write(file, &form, &received, &started_there));
        let path = path.to_owned();
        Self { path, rows, writer, conversion, every, metadata_file, started, tally: Tally::default() }
    }

    /// Takes a tick; `false` once the medium has refused, which [`Recorder::finish`] tells.
    #[must_use]
    pub fn tick(&mut self, tick: &RunTick) -> bool {
        let RunTick { tick: number, period_ns, sample, .. } = *tick;
        let tally = &mut self.tally;
        tally.period_ns = period_ns;
        let first = match tally.ticks {
            None => number,
            Some((first, last)) => {
                let missing = number.saturating_sub(last + 1);
                if missing > 0 {
                    tally.missing += missing;
                    tally.gaps += 1;
                    tally.first_missing.get_or_insert(last + 1);
                }
                first
            }
        };
        tally.ticks = Some((first, number));
        tally.bus_v.get_or_insert_with(|| self.conversion.bus_v(&sample));
        if !(number - first).is_multiple_of(self.every) {
            return true;
        }
        tally.rows += 1;
        self.started.get_or_init(evidence::started);
        self.rows.send(*tick).is_ok()
    }

    /// What was recorded so far.
    pub fn tally(&self) -> &Tally {
        &self.tally
    }

    /// Ends the recording with what is known at its end. Without a row the file is as it was before.
    ///
    /// # Errors
    /// Exit status 1 with what is kept, if the medium refused.
    pub fn finish(self, metadata: &Metadata) -> Result<Tally, Failure> {
        let Self { path, rows, writer, metadata_file, tally, .. } = self;
        drop(rows);
        let written = match writer.join() {
            Ok(Ok(Some((mut rows, mut all)))) => {
                let beside = metadata_file.map_or(Ok(()), |path| {
                    metadata.groups().for_each(|(group, entries)| all.extend(group, entries.clone()));
                    output::write_text(&path, &all.to_toml())
                });
                let ended = rows.finish(metadata).and(beside);
                ended.map(|()| tally).map_err(|error| Broken { error, saved: rows.saved() })
            }
            Ok(written) => written.map(|_| tally),
            Err(_) => Err(Broken { error: io::Error::other("its thread ended"), saved: Saved::default() }),
        };
        written.map_err(|Broken { error, saved }| {
            let first_s = tally.ticks.map_or(0.0, |(first, _)| tick_time_s(first, tally.period_ns));
            Failure::failed(format!(
                "{}: cannot be written: {}; {} rows over {:.3} s are kept; make room and record again",
                path.display(),
                output::describe(&error),
                saved.rows,
                saved.last_s.map_or(0.0, |last_s| last_s - first_s)
            ))
        })
    }
}

/// Writes what comes, and puts it on the medium when it is due.
fn write(
    file: DurableFile,
    form: &Form,
    received: &Receiver<RunTick>,
    started: &OnceLock<Vec<(String, String)>>,
) -> Written {
    let Ok(first) = received.recv() else {
        file.abandon();
        return Ok(None);
    };
    let nothing = |error| Broken { error, saved: Saved::default() };
    for (path, text) in &form.beside {
        output::write_text(path, text).map_err(nothing)?;
    }
    let mut metadata = form.metadata.clone();
    let started = started.get_or_init(evidence::started).clone();
    evidence::begin(&mut metadata, started, first.tick, first.period_ns);
    if let Some(rig) = &form.rig {
        evidence::add_rig(&mut metadata, rig.text(form.conversion.bus_v(&first.sample)));
    }
    if let Some(path) = &form.metadata_file {
        output::write_text(path, &metadata.to_toml()).map_err(nothing)?;
    }
    let mut columns = columns(Some(form.mode));
    if form.orders.is_some() {
        columns.extend(raw::columns());
    }
    let mut rows = file.begin(form.format, &columns, &metadata).map_err(nothing)?;
    let mut next = Some(first);
    loop {
        let written = match next {
            Some(RunTick { tick, period_ns, sample, given }) => {
                let cells = form.conversion.cells(&sample, Some(form.mode));
                let t_s = tick_time_s(tick, period_ns);
                match &form.orders {
                    None => rows.row(t_s, cells),
                    Some(orders) => {
                        let write = |given: &[Cell]| {
                            rows.row(t_s, cells.map(as_short_lived).chain(given.iter().copied()))
                        };
                        orders.cells(&given.unwrap_or(raw::Given::NOTHING), write)
                    }
                }
            }
            None => rows.save(),
        };
        written.map_err(|error| Broken { error, saved: rows.saved() })?;
        let received = match rows.time_left() {
            Some(time_left) => received.recv_timeout(time_left),
            None => received.recv().map_err(|_| RecvTimeoutError::Disconnected),
        };
        next = match received {
            Ok(tick) => Some(tick),
            Err(RecvTimeoutError::Timeout) => None,
            Err(RecvTimeoutError::Disconnected) => return Ok(Some((rows, metadata))),
        };
    }
}

/// A cell beside others that borrow.
fn as_short_lived<'c>(cell: Cell<'static>) -> Cell<'c> {
    cell
}

impl Tally {
    /// Time from the first sample to the end of the last one, s.
    pub fn duration_s(&self) -> f64 {
        self.ticks.map_or(0.0, |(first, last)| tick_time_s(last + 1 - first, self.period_ns))
    }

    /// One line about absences of the board, `None` if it was always there.
    pub fn absences(&self) -> Option<String> {
        let first = self.first_unplugged?;
        let often = match self.unplugged {
            1 => "once".to_owned(),
            often => format!("{often} times"),
        };
        Some(format!(
            "the board was unplugged {often}, first after t_s = {:?}; the joint was stopped and is at rest behind the gap",
            tick_time_s(first, self.period_ns)
        ))
    }

    /// One line about what is missing, `None` if nothing is. `losses` are those of the link during the recording.
    pub fn loss(&self, losses: &Losses) -> Option<String> {
        let Self { missing, gaps, first_missing, period_ns, .. } = self;
        let first = (*first_missing)?;
        let plural = if *gaps == 1 { "" } else { "s" };
        let (dropped, damaged) = (losses.dropped_by_board, losses.damaged_frames);
        Some(format!(
            "{missing} samples lost in {gaps} gap{plural}, the first at t_s = {:?}; dropped by the board: {dropped}, damaged \
             frames: {damaged}; check cable and load of this machine, or lower the control rate",
            tick_time_s(first, *period_ns)
        ))
    }
}
