//! Section 3.2, Fig. 4: the torque loop and its segments A to H.

use bowden_model::paper::{TorquePhase, TorqueState, torque_transmission};

use crate::error::ExperimentError;
use crate::loop_run::{LoopSample, LoopSetup, run, width_at_zero};

/// Input of Fig. 4: with mu = 0.12 the input torque passes 2 M, so that all segments are visited.
///
/// At an amplitude of 0.8 rad the weight of 2.5 kg at 30 mm takes 0.52 Nm; M is 0.34 Nm.
#[must_use]
pub fn setup() -> LoopSetup {
    LoopSetup { friction_coefficient: 0.12, amplitude_rad: 0.8, ..LoopSetup::default() }
}

/// Time after which the loop is closed \[s\]: it starts from rest.
pub const FROM_S: f64 = 10.0;

/// Speed of the joint, as a part of its largest, below which it stands \[1\].
const STANDS_BELOW: f64 = 0.1;

/// Shortest segment that counts \[s\].
const SHORTEST_SEGMENT_S: f64 = 0.03;

/// Samples over which torque and motion are averaged: 0.2 s, a fiftieth of a period. The controller moves by counts of
/// 1.5 mrad, which Eq. (17) would follow into and out of slip.
const AVERAGED: usize = 201;

/// One moment of the run with what Eq. (17) makes of its input torque.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PhasedSample {
    /// What was recorded.
    pub sample: LoopSample,
    /// Output torque of Eq. (17) \[Nm\].
    pub torque_predicted_nm: f64,
    /// Segment of Eq. (17).
    pub predicted: TorquePhase,
    /// Segment in which the recorded joint is.
    pub recorded: TorquePhase,
}

/// Fig. 4, reproduced.
#[derive(Debug, Clone)]
pub struct TorqueLoop {
    /// Course.
    pub samples: Vec<PhasedSample>,
    /// Width of the loop in `T_in` at `T_out` = 0 by the equations, `2·2 F0 r2 mu K·r1/r2` \[Nm\].
    pub width_predicted_nm: f64,
    /// The same, recorded \[Nm\].
    pub width_nm: f64,
    /// Root mean square of Eq. (17) less the recorded output torque \[Nm\].
    pub prediction_rms_nm: f64,
    /// Largest recorded output torque \[Nm\].
    pub largest_torque_nm: f64,
    /// Part of the time in which recorded and predicted segment agree \[1\].
    pub agreement: f64,
}

/// Segment of the recorded joint, by its speed, the last direction in which it moved and the sign of `T_in`.
#[derive(Debug, Clone, Copy, Default)]
struct RecordedPhase {
    last_direction: i8,
    has_moved_backward: bool,
}

impl RecordedPhase {
    fn step(&mut self, speed: f64, torque_in_nm: f64, stands_below: f64) -> TorquePhase {
        if speed.abs() < stands_below {
            return match self.last_direction {
                0 => TorquePhase::InitialHold,
                1 => TorquePhase::HoldAfterForward,
                _ => TorquePhase::HoldAfterBackward,
            };
        }
        self.last_direction = if speed > 0.0 { 1 } else { -1 };
        self.has_moved_backward |= speed < 0.0;
        match (speed > 0.0, torque_in_nm >= 0.0) {
            (true, true) if self.has_moved_backward => TorquePhase::ForwardLoading,
            (true, true) => TorquePhase::FirstForwardLoading,
            (true, false) => TorquePhase::ForwardUnloading,
            (false, true) => TorquePhase::BackwardUnloading,
            (false, false) => TorquePhase::BackwardLoading,
        }
    }
}

/// Means over [`AVERAGED`] samples around each sample; the first and last ones are as they are there.
fn averaged(samples: &[LoopSample], of: fn(&LoopSample) -> f64) -> Vec<f64> {
    let half = AVERAGED / 2;
    (0..samples.len())
        .map(|n| {
            let window = &samples[n.saturating_sub(half)..(n + half + 1).min(samples.len())];
            window.iter().map(of).sum::<f64>() / window.len() as f64
        })
        .collect()
}

/// Letters of the segments in the order in which they are passed; those shorter than 30 ms are left out.
#[must_use]
pub fn letters(samples: &[PhasedSample], phase: fn(&PhasedSample) -> TorquePhase) -> String {
    let mut word = String::new();
    for segment in samples.chunk_by(|one, next| phase(one) == phase(next)) {
        let letter = phase(&segment[0]).letter();
        let length_s = segment[segment.len() - 1].sample.t_s - segment[0].sample.t_s;
        if length_s >= SHORTEST_SEGMENT_S && !word.ends_with(letter) {
            word.push(letter);
        }
    }
    word
}

/// Runs Fig. 4.
///
/// # Errors
/// [`ExperimentError`] if the run or its evaluation fails.
pub fn torque_loop() -> Result<TorqueLoop, ExperimentError> {
    let setup = setup();
    evaluate(&setup, run(&setup, 1)?)
}

/// Compares a recording of Fig. 4, a thousand samples a second, with Eq. (17).
///
/// # Errors
/// [`ExperimentError`] if the setup has no equations or the loop is not closed.
pub fn evaluate(setup: &LoopSetup, recorded: Vec<LoopSample>) -> Result<TorqueLoop, ExperimentError> {
    let pair = setup.pair()?;
    let speeds = averaged(&recorded, |sample| sample.omega_out_rad_per_s);
    let torques = averaged(&recorded, |sample| sample.torque_in_nm);
    let fastest = speeds.iter().copied().map(f64::abs).fold(0.0, f64::max);
    let mut state = TorqueState::at_rest(0.0)?;
    let mut phase = RecordedPhase::default();
    let mut samples = Vec::with_capacity(recorded.len());
    for ((sample, speed), torque_in_nm) in recorded.into_iter().zip(speeds).zip(torques) {
        let step = state.step(&pair, torque_in_nm)?;
        samples.push(PhasedSample {
            sample,
            torque_predicted_nm: step.torque_out_nm,
            predicted: step.phase,
            recorded: phase.step(speed, torque_in_nm, STANDS_BELOW * fastest),
        });
    }
    let recorded: Vec<LoopSample> = samples.iter().map(|sample| sample.sample).collect();
    let count = samples.len() as f64;
    let squares: f64 =
        samples.iter().map(|all| (all.torque_predicted_nm - all.sample.torque_out_nm).powi(2)).sum();
    Ok(TorqueLoop {
        width_predicted_nm: 2.0 * torque_transmission::friction_torque_nm(&pair),
        width_nm: width_at_zero(&recorded, FROM_S, |s| s.torque_out_nm, |s| s.torque_in_nm)?,
        prediction_rms_nm: (squares / count).sqrt(),
        largest_torque_nm: recorded.iter().map(|s| s.torque_out_nm.abs()).fold(0.0, f64::max),
        agreement: samples.iter().filter(|all| all.recorded == all.predicted).count() as f64 / count,
        samples,
    })
}
