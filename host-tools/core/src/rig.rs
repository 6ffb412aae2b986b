//! The rig file `bowden-rig/1`: what a user believes about the bench.
//!
//! Beside the sections of the format, some keys and a section may be given: `simulation.elements`, the number of
//! slip elements into which a tendon is divided (1 to 64), `simulation.step_s`, the longest simulation step, and
//! `[controller]`, the law of the position loop, for rigs where it is known. A diagnosis also writes `[[undecided]]`: values of the
//! file that recordings did not settle, see [`Undecided`].
//!
//! `[replay]` may say more about what was recorded:
//!
//! ```toml
//! free_offsets = ["theta_out_rad"]          # outputs with an arbitrary zero in each recording: fits and diagnoses
//!                                           # remove their mean difference; the prediction itself stays as it is
//! relative_inputs = ["theta_in_rad"]        # inputs with an arbitrary zero: counted from their first sample
//! smoothing_s = { torque_out_nm = 0.031 }   # inputs that are averaged without phase, and over which time, up to 1 s
//! ```
//!
//! A rig without `[motor]` whose input angle drives may contain motor effects: they are the friction of the input
//! spindle, and `torque_in_nm` is then what a sensor outside its bearings shows.

mod document;
mod effects;
mod laws;
mod parameter;
mod parse;
mod plausible;
mod points;
mod roles;
pub mod section;
mod undecided;

use std::path::Path;

use bowden_model::channel::Channel;
use bowden_model::effect::ActiveEffect;
use bowden_model::parameters::JointParameters;

use crate::outcome::Failure;
use crate::output;
use crate::recording::{ColumnMap, ReadOptions, Recording};

pub use document::RigDocument;
pub use parameter::{Assignment, ControllerParameter, RigParameter};
pub use plausible::MINIMUM_SAMPLES;
pub use roles::ReplayRoles;
pub use undecided::Undecided;

/// Value of `schema`.
pub const SCHEMA: &str = "bowden-rig/1";

/// Law of the position loop between reference and duty: `duty = clamp(gain · (theta_ref − theta), ±duty_limit)`, on the angle of
/// `delay_s` ago.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ProportionalLaw {
    /// Gain, duty per rad; positive.
    pub gain_duty_per_rad: f64,
    /// Largest duty, 0 to 1.
    pub duty_limit: f64,
    /// Time between the measurement and the duty that follows from it, s.
    pub delay_s: f64,
}

/// A bench as its user describes it.
#[derive(Clone, Debug, PartialEq)]
pub struct Rig {
    /// Name of the bench.
    pub name: String,
    /// Nominal parameters; a missing section is a missing part.
    pub joint: JointParameters,
    /// Effects that the simulation contains beyond the nominal model.
    pub effects: Vec<ActiveEffect>,
    /// Law of the position loop, if it is known.
    pub controller: Option<ProportionalLaw>,
    /// Slip elements of a tendon.
    pub elements: usize,
    /// Longest simulation step, s.
    pub step_s: f64,
    /// Names and units of the recordings' columns.
    pub columns: ColumnMap,
    /// Inputs of a replay, if the file names them.
    pub replay_inputs: Option<Vec<Channel>>,
    /// Outputs of a replay, if the file names them.
    pub replay_outputs: Option<Vec<Channel>>,
    /// Outputs whose zero is arbitrary in every recording.
    pub free_offsets: Vec<Channel>,
    /// Inputs whose zero is arbitrary in every recording.
    pub relative_inputs: Vec<Channel>,
    /// Inputs that are averaged without phase, and over which time, s.
    pub smoothing_s: Vec<(Channel, f64)>,
    /// What the recordings behind the file's values did not settle.
    pub undecided: Vec<Undecided>,
}

impl Rig {
    /// Reads a rig file.
    ///
    /// # Errors
    /// One line with file, line and column: no TOML, wrong schema, unknown section, key, role or effect (with the
    /// nearest name), missing key of a present section, wrong type, value outside its range.
    pub fn load(path: &Path) -> Result<Self, Failure> {
        Self::parse(&read_text(path)?, &path.display().to_string())
    }

    /// Reads the text of a rig file; `source` is its name in messages.
    ///
    /// # Errors
    /// See [`Rig::load`].
    pub fn parse(text: &str, source: &str) -> Result<Self, Failure> {
        parse::parse(text, source)
    }

    /// Reads a recording for a comparison with the rig: all columns, and at least [`MINIMUM_SAMPLES`]. What is repaired or dropped stands in
    /// its notes.
    ///
    /// # Errors
    /// See [`Recording::load`]; also fewer samples, and magnitudes that tell of another unit.
    pub fn load_recording(&self, path: &Path) -> Result<Recording, Failure> {
        let options = ReadOptions { columns: self.columns.clone(), only: None };
        self.accept(Recording::load(path, &options)?)
    }

    /// Makes a recording ready for a comparison with the rig, wherever it came from. What is repaired or dropped stands in its notes.
    ///
    /// # Errors
    /// No column that could drive or judge a replay, or only the one that drives it; fewer than [`MINIMUM_SAMPLES`]; magnitudes that tell of
    /// another unit.
    pub fn accept(&self, recording: Recording) -> Result<Recording, Failure> {
        let roles = self.roles(&recording)?;
        let is_recorded = |channel: &&Channel| recording.channel(**channel).is_some();
        let compared: Vec<Channel> = roles.outputs.iter().filter(is_recorded).copied().collect();
        if let Some([input, output]) = self.compared_with_itself(&roles.inputs, &compared) {
            let (column, _) = self.columns.channel(output);
            let (input, output) = (input.role(), output.role());
            return Err(Failure::bad_input(format!(
                "{}: column `{}` drives the replay as {input} and is all that it is compared with, as {output}: without [tendon] that is \
                 the column itself; take {input} out of replay.inputs, or record i_motor_a as well",
                recording.source(),
                column.column
            )));
        }
        if compared.is_empty() {
            let names: Vec<&str> = roles.outputs.iter().map(|channel| channel.role()).collect();
            return Err(Failure::bad_input(format!(
                "{}: no column to compare a simulation with, expected one of {}; record one, or map it under \
                 [recording.columns] of the rig",
                recording.source(),
                names.join(", ")
            )));
        }
        let mut recording = plausible::accept(self, recording, MINIMUM_SAMPLES)?;
        // Not for a replay, which answers every row that was recorded.
        recording.drop_frozen_rows();
        Ok(recording)
    }

    /// An input and an output of one column, on a joint that turns with what drives it, where every output is one of these.
    fn compared_with_itself(&self, inputs: &[Channel], compared: &[Channel]) -> Option<[Channel; 2]> {
        if self.joint.tendon.is_some() {
            return None;
        }
        let column = |channel: Channel| self.columns.channel(channel).0.column;
        let twin = |output: &Channel| inputs.iter().find(|input| column(**input) == column(*output)).copied();
        let twins: Option<Vec<Channel>> = compared.iter().map(twin).collect();
        twins?.first().zip(compared.first()).map(|(input, output)| [*input, *output])
    }

    /// Reads what a replay needs of a recording: `t_s` and the input roles, nothing else.
    ///
    /// # Errors
    /// See [`Recording::load`]; also inputs that are missing, and magnitudes that tell of another unit.
    pub fn load_inputs(&self, path: &Path) -> Result<Recording, Failure> {
        let only = Some(self.possible_inputs());
        self.accept_inputs(Recording::load(path, &ReadOptions { columns: self.columns.clone(), only })?)
    }

    /// Makes a recording ready to drive a replay of the rig, wherever it came from.
    ///
    /// # Errors
    /// Inputs that are missing, and magnitudes that tell of another unit.
    pub fn accept_inputs(&self, recording: Recording) -> Result<Recording, Failure> {
        self.roles(&recording)?;
        plausible::accept(self, recording, 1)
    }
}

/// Text of a TOML file.
pub(crate) fn read_text(path: &Path) -> Result<String, Failure> {
    let shown = path.display();
    if path.is_dir() {
        return Err(Failure::bad_input(format!("{shown}: is a folder, expected a rig file; name a file")));
    }
    let bytes = std::fs::read(path).map_err(|error| {
        let reason = output::describe(&error);
        Failure::bad_input(format!("{shown}: cannot be read: {reason}; check the path"))
    })?;
    String::from_utf8(bytes).map_err(|error| {
        let byte = error.utf8_error().valid_up_to();
        let value = error.as_bytes()[byte];
        Failure::bad_input(format!(
            "{shown}: byte {byte}: got 0x{value:02x}, expected UTF-8 text; a rig is a TOML file"
        ))
    })
}
