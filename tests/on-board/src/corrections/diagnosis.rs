//! A recording made on the emulated board, and what `bowden diagnose` makes of it.

use std::path::{Path, PathBuf};
use std::process::Command;

use bowden_board::Board;

use super::{Case, Stored, write};
use crate::tool::{Plugged, tool};
use crate::{Failure, Outcome, fail};

/// Amplitude of the recording's reference \[rad\]: the largest of the runs that are measured. A diagnosis names a torque that is locked
/// to an angle only where it repeats one and a half times in the travel, and 14 cycles a turn repeat 1.3 times within ±0.3 rad.
const AMPLITUDE: &str = "0.5";

/// Reference of the recording: a multisine with its lowest line at 0.25 Hz, four periods, every tenth tick.
const RECORD: [&str; 11] = [
    "--home",
    "--reference",
    "multisine",
    "--amplitude",
    AMPLITUDE,
    "--frequency",
    "0.25",
    "--seconds",
    "16",
    "--every",
    "10",
];

/// Seed of the recording's sensor noise: not that of the runs that are measured.
const SEED: u64 = 401;

/// What a diagnosis found.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Found {
    /// The rig file that it wrote.
    pub rig: PathBuf,
    /// Its summary, one line.
    pub summary: String,
}

impl Case {
    /// Records the joint with its effect on the emulated board, and diagnoses the recording with a rig file that lacks the
    /// effect. Everything is written to `folder`.
    pub fn diagnosed(&self, elf: &[u8], stored: &Stored, folder: &Path) -> Outcome<Found> {
        let rig = folder.join("rig.toml");
        write(&rig, &self.rig_without())?;
        let recording = folder.join("recording.csv");
        let builder =
            Board::builder(elf).bench(&self.trial.bench, std::slice::from_ref(&self.effect)).seed(SEED);
        let mut plugged = Plugged::new(builder.flash_image(&stored.flash).build()?)?;
        let out = recording.to_string_lossy();
        let arguments = [&RECORD, ["--out", &*out].as_slice()].concat();
        let ran = plugged.run("record", &arguments)?;
        if ran.status != Some(0) {
            return fail(format!("{}: record: {}", self.name, ran.errors.trim()));
        }
        self.diagnose(&recording, &rig, &folder.join("diagnosis"))
    }

    fn diagnose(&self, recording: &Path, rig: &Path, out: &Path) -> Outcome<Found> {
        let mut command = Command::new(tool()?);
        command.arg("diagnose").arg(recording).arg("--rig").arg(rig).arg("--out").arg(out);
        let output =
            command.output().map_err(|error| Failure(format!("{}: diagnose: {error}", self.name)))?;
        // 3: done, with something to be told.
        if !matches!(output.status.code(), Some(0 | 3)) {
            let errors = String::from_utf8_lossy(&output.stderr);
            return fail(format!("{}: diagnose: {}", self.name, errors.trim()));
        }
        let said = String::from_utf8_lossy(&output.stdout);
        let summary = said.lines().next().unwrap_or_default().to_owned();
        Ok(Found { rig: out.join("rig.diagnosed.toml"), summary })
    }
}

#[cfg(test)]
mod tests {
    use bowden_link::message::{Mode, Reference};

    use super::*;
    use crate::corrections::cases;

    #[test]
    fn the_recording_covers_the_angles_of_every_run() {
        let recorded_rad: f32 = AMPLITUDE.parse().unwrap();
        let cases = cases::all();
        let amplitudes_rad = cases.iter().filter_map(|case| match case.trial.reference {
            Reference::Generated { amplitude, .. } if case.trial.mode == Mode::Position => Some(amplitude),
            _ => None,
        });
        let largest_rad = amplitudes_rad.fold(0.0, f32::max);
        assert!(
            0.0 < largest_rad && largest_rad <= recorded_rad,
            "{largest_rad} rad, {recorded_rad} rad recorded"
        );
    }
}
