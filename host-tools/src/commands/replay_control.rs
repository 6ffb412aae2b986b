//! `bowden replay-control`: the board's control law on this machine, compared bit for bit.

use std::path::PathBuf;

use bowden_core::outcome::{Failure, Outcome};
use bowden_core::recording::{ReadOptions, Recording};
use bowden_host_link::replay_control::{Difference, Replayed, replay};

use super::{outcome_of, print, print_json};

/// Arguments of `bowden replay-control`.
#[derive(Clone, Debug, clap::Args)]
#[command(
    after_help = "The recording has to be one of `bowden record --raw`, of a board with the control law of this program. Exit status: 0 every \
                  output is equal, 1 one differs, 3 the recording has a gap and everything before it is equal."
)]
pub struct ReplayControlArguments {
    /// Raw recording (.csv, .csv.gz, .mcap, .parquet)
    recording: PathBuf,
    /// Print JSON
    #[arg(long)]
    json: bool,
}

impl ReplayControlArguments {
    /// Computes and compares.
    ///
    /// # Errors
    /// Exit status 2, if the recording is none that can be replayed; 1, if an output differs.
    pub fn run(&self) -> Result<Outcome, Failure> {
        let recording = Recording::load(&self.recording, &ReadOptions::default())?;
        let replayed = replay(&recording)?;
        if self.json {
            print_json(&replayed)?;
        }
        if let Some(difference) = &replayed.difference {
            return Err(Failure::failed(line(difference, replayed.ticks - 1)));
        }
        let source = recording.source();
        if !self.json {
            print(&format!("{source}: {}\n", words(&replayed)))?;
        }
        let mut outcome = outcome_of([&recording]);
        outcome.extend(replayed.gap_after_tick.map(|tick| {
            format!("{source}: ticks are missing behind tick {tick}; nothing behind them can be computed, record again")
        }));
        Ok(outcome)
    }
}

fn words(replayed: &Replayed) -> String {
    format!(
        "{} ticks with {} orders computed again from tick {} on: every output is the board's, bit for bit",
        replayed.ticks, replayed.orders, replayed.first_tick
    )
}

fn line(difference: &Difference, equal: u64) -> String {
    let Difference { tick, t_s, place, signals } = difference;
    let signals: Vec<String> = signals
        .iter()
        .map(|signal| {
            format!("{} is {} on the board and {} computed again", signal.column, signal.board, signal.replay)
        })
        .collect();
    format!(
        "{place}: tick {tick}, t_s = {t_s:?}: {}; the {equal} ticks before are equal; if nobody changed the recording, report this with it",
        signals.join(", ")
    )
}
