//! Rows of a recording from the ticks of a run, one at a time.

use std::io::{self, Seek, Write};

use bowden_core::recording::RowWriter;
use bowden_link::message::Mode;

use super::conversion::Conversion;
use super::losses::Losses;
use super::session::RunTick;

/// Writes ticks and counts what is missing between them.
pub struct Recorder<W: Write + Seek> {
    writer: RowWriter<W>,
    conversion: Conversion,
    mode: Mode,
    every: u64,
    tally: Tally,
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
}

/// Time of a tick, s: the nearest number to the exact product.
pub fn tick_time_s(tick: u64, period_ns: u32) -> f64 {
    (u128::from(tick) * u128::from(period_ns)) as f64 / 1e9
}

impl<W: Write + Seek> Recorder<W> {
    /// Writes every `every`-th tick, beginning with the first.
    pub fn new(writer: RowWriter<W>, conversion: Conversion, mode: Mode, every: u64) -> Self {
        Self { writer, conversion, mode, every: every.max(1), tally: Tally::default() }
    }

    /// Takes a tick.
    ///
    /// # Errors
    /// When the medium refuses.
    pub fn tick(&mut self, tick: &RunTick) -> io::Result<()> {
        let RunTick { tick, period_ns, sample } = tick;
        let tally = &mut self.tally;
        tally.period_ns = *period_ns;
        let first = match tally.ticks {
            None => *tick,
            Some((first, last)) => {
                let missing = tick.saturating_sub(last + 1);
                if missing > 0 {
                    tally.missing += missing;
                    tally.gaps += 1;
                    tally.first_missing.get_or_insert(last + 1);
                }
                first
            }
        };
        tally.ticks = Some((first, *tick));
        tally.bus_v.get_or_insert_with(|| self.conversion.bus_v(sample));
        if (tick - first).is_multiple_of(self.every) {
            tally.rows += 1;
            let cells = self.conversion.cells(sample, Some(self.mode));
            self.writer.row(tick_time_s(*tick, *period_ns), cells)?;
        }
        Ok(())
    }

    /// What was recorded so far.
    pub fn tally(&self) -> &Tally {
        &self.tally
    }

    /// Ends the recording.
    ///
    /// # Errors
    /// When the medium refuses.
    pub fn finish(self) -> io::Result<Tally> {
        self.writer.finish()?;
        Ok(self.tally)
    }
}

impl Tally {
    /// Time from the first sample to the end of the last one, s.
    pub fn duration_s(&self) -> f64 {
        self.ticks.map_or(0.0, |(first, last)| tick_time_s(last + 1 - first, self.period_ns))
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
