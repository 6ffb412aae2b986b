//! Replay of one recording as a recording: what the rig's simulation answers to what went in.

use crate::joint_model::JointModel;
use crate::outcome::Failure;
use crate::progress::{Progress, Quiet, ended_early};
use crate::recording::Recording;
use crate::rig::Rig;
use crate::simulation::{Prediction, ReplayInput, replay_watched};

/// Simulates `rig` with the inputs of `recording`: one row a recorded sample, `t_s` and every output role.
///
/// Of the recording, `t_s` and the input roles are used and nothing else.
///
/// # Errors
/// What the rig or the recording lacks for a replay; exit status 1, if the simulated joint runs away.
pub fn predict(rig: &Rig, recording: &Recording) -> Result<Recording, Failure> {
    predict_watched(rig, recording, &Quiet)
}

/// Like [`predict`]; fails at the next sample when `progress` asks for an early end.
///
/// # Errors
/// As [`predict`]; exit status 1 after an early end.
pub fn predict_watched(
    rig: &Rig,
    recording: &Recording,
    progress: &dyn Progress,
) -> Result<Recording, Failure> {
    let model = JointModel::from_rig(rig, recording)?;
    let input = ReplayInput::new(&model, recording)?;
    let Some(prediction) = replay_watched(&model, &input, progress)? else {
        return Err(ended_early(&format!("replay of {}", recording.source())));
    };
    refuse_runaway(&prediction, recording)?;
    let source = format!("replay of {}", recording.source());
    let mut predicted = Recording::new(source, recording.t_s().to_vec());
    for (channel, values) in prediction.channels() {
        predicted.set(channel, values.to_vec());
    }
    Ok(predicted)
}

/// A file must not hold what is no number.
fn refuse_runaway(prediction: &Prediction, recording: &Recording) -> Result<(), Failure> {
    let first_bad = |values: &[f64]| values.iter().position(|value| !value.is_finite());
    match prediction.channels().find_map(|(channel, values)| Some((channel, first_bad(values)?))) {
        None => Ok(()),
        Some((channel, sample)) => Err(Failure::failed(format!(
            "{}: the simulated {} runs away at t = {} s; check the rig's stiffness, inertia and radii, or lower \
             simulation.step_s",
            recording.place(sample),
            channel.role(),
            recording.t_s()[sample]
        ))),
    }
}
