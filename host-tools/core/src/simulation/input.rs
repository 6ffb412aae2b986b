//! What drives a replay, taken from a recording.

use std::sync::Arc;

use bowden_model::channel::Channel;

use super::guide::Hold;
use super::sensors::end_of_scale_n;
use crate::joint_model::{GuidedBy, JointModel};
use crate::outcome::Failure;
use crate::reconstruct::{Motion, moving_average};
use crate::recording::Recording;

/// Inputs of a replay, prepared once and used for every set of parameters.
#[derive(Clone, Debug)]
pub struct ReplayInput {
    pub(super) t_s: Arc<Vec<f64>>,
    /// Median distance of two samples, s.
    pub(super) step_s: f64,
    pub(super) motion: Option<Motion>,
    pub(super) duty: Option<Arc<Vec<f64>>>,
    pub(super) bus_v: Option<Arc<Vec<f64>>>,
    pub(super) enabled: Option<Arc<Vec<f64>>>,
    pub(super) theta_ref_rad: Option<Arc<Vec<f64>>>,
    pub(super) torque_out_nm: Option<Arc<Vec<f64>>>,
    pub(super) start_rad: Option<f64>,
    pub(super) start_rad_s: f64,
    /// Clock of the bench at the first sample, whatever the recording's shows there.
    clock_begins_s: f64,
    pub(super) hold: Hold,
    /// Torque by the duty, root mean square, of a joint without tendons that its angle guides, N·m.
    driven_nm: Option<f64>,
    /// Channels that reached the end of their scale in the recording, with the largest value that they show.
    ends_of_scale: Arc<[(Channel, f64)]>,
}

impl ReplayInput {
    /// Takes time and the input roles of `model` from a recording, and of the predicted channels no more than whether they reached the end of
    /// their scale.
    ///
    /// # Errors
    /// When an input role is missing.
    pub fn new(model: &JointModel, recording: &Recording) -> Result<Self, Failure> {
        let t_s = recording.shared_t_s();
        let step_s = median_step_s(&t_s);
        let take = |channel: Channel| -> Result<Option<Arc<Vec<f64>>>, Failure> {
            if !model.inputs.contains(&channel) {
                return Ok(None);
            }
            let values = recording.shared(channel).ok_or_else(|| {
                Failure::bad_input(format!(
                    "{}: no column for the input {}; map one in [recording.columns] or leave it out of replay.inputs",
                    recording.source(),
                    channel.role()
                ))
            })?;
            let zero = match values.first() {
                Some(first) if model.relative_inputs.contains(&channel) => *first,
                _ => 0.0,
            };
            let values = match zero {
                0.0 => values,
                zero => Arc::new(values.iter().map(|value| value - zero).collect()),
            };
            Ok(Some(match model.smoothing_s.iter().find(|(smoothed, _)| *smoothed == channel) {
                Some((_, time_s)) => {
                    Arc::new(moving_average(values.to_vec(), (0.5 * time_s / step_s) as usize))
                }
                None => values,
            }))
        };
        let guiding = match model.guided_by {
            Some(GuidedBy { angle, .. }) => Some(recording.shared(angle).ok_or_else(|| {
                let (source, role) = (recording.source(), angle.role());
                Failure::bad_input(format!(
                    "{source}: no column for {role}, which other recordings have; map one in [recording.columns]"
                ))
            })?),
            None => take(Channel::ThetaIn)?,
        };
        let motion = guiding.map(|theta| Motion::from_encoder(&t_s, &theta));
        let start_rad_s =
            motion.as_ref().filter(|_| model.guided_by.is_some()).map_or(0.0, |m| m.omega_rad_s[0]);
        let duty = take(Channel::Duty)?;
        let bus_v = take(Channel::BusVoltage)?;
        let theta_ref_rad = take(Channel::ThetaRef)?;
        // A joint whose angle is no input is taken to stand where its reference begins, until it is told otherwise.
        let reference_rad = theta_ref_rad.as_ref().and_then(|reference| reference.first().copied());
        let start_rad = motion.as_ref().map(|m| m.theta_rad[0]).or(reference_rad);
        let end_of_scale = |channel: &Channel| {
            Some((*channel, end_of_scale_n(&model.parameters.sensors, recording, *channel)?))
        };
        Ok(Self {
            ends_of_scale: model.outputs.iter().filter_map(end_of_scale).collect(),
            motion,
            duty,
            bus_v,
            enabled: take(Channel::DriveEnable)?,
            theta_ref_rad,
            torque_out_nm: take(Channel::TorqueOut)?,
            start_rad,
            start_rad_s,
            clock_begins_s: 0.0,
            hold: Hold::of(model),
            driven_nm: model.guided_by.map(|_| model.driven_nm(recording)),
            step_s,
            t_s,
        })
    }

    /// The largest value that a channel can show: the end of its scale if the recording reached it.
    pub(super) fn largest_shown(&self, channel: Channel) -> f64 {
        let end = self.ends_of_scale.iter().find(|(of, _)| *of == channel);
        end.map_or(f64::INFINITY, |(_, largest)| *largest)
    }

    /// States where the joint stands and how it moves at the first sample, for joints whose angle is not an input.
    pub fn start_at(&mut self, theta_rad: f64, omega_rad_s: f64) {
        self.start_rad = Some(theta_rad);
        self.start_rad_s = omega_rad_s;
    }

    /// Every `every`-th sample of what was prepared, for fits that need less than the recorded rate.
    #[must_use]
    pub fn thinned(&self, every: usize) -> Self {
        let every = every.max(1);
        let thin = |values: &[f64]| -> Vec<f64> { values.iter().step_by(every).copied().collect() };
        let some = |values: &Option<Arc<Vec<f64>>>| values.as_ref().map(|values| Arc::new(thin(values)));
        let t_s = thin(&self.t_s);
        Self {
            step_s: median_step_s(&t_s),
            t_s: Arc::new(t_s),
            motion: self.motion.as_ref().map(|motion| Motion {
                theta_rad: thin(&motion.theta_rad),
                omega_rad_s: thin(&motion.omega_rad_s),
                std_rad: thin(&motion.std_rad),
                half_count_rad: motion.half_count_rad,
            }),
            duty: some(&self.duty),
            bus_v: some(&self.bus_v),
            enabled: some(&self.enabled),
            theta_ref_rad: some(&self.theta_ref_rad),
            torque_out_nm: some(&self.torque_out_nm),
            start_rad: self.start_rad,
            start_rad_s: self.start_rad_s,
            clock_begins_s: self.clock_begins_s,
            hold: self.hold,
            driven_nm: self.driven_nm,
            ends_of_scale: Arc::clone(&self.ends_of_scale),
        }
    }

    /// States how long the bench had run before the first sample, s: what happened to it then has happened already.
    pub fn continues_after(&mut self, clock_s: f64) {
        self.clock_begins_s = clock_s;
    }

    /// Clock of the bench at the first and at the last sample, s.
    #[must_use]
    pub fn clock_s(&self) -> [f64; 2] {
        [0, self.t_s.len().saturating_sub(1)].map(|k| self.clock_at_s(k))
    }

    /// Clock of the bench at sample `k`, s.
    #[must_use]
    pub fn clock_at_s(&self, k: usize) -> f64 {
        self.clock_begins_s + (self.t_s[k] - self.t_s[0])
    }

    /// Sampling instants, s.
    #[must_use]
    pub fn t_s(&self) -> &[f64] {
        &self.t_s
    }

    /// Torque that the guide takes for what the encoder of the angle leaves open, as a standard deviation, N·m.
    #[must_use]
    pub fn guide_noise_nm(&self) -> f64 {
        self.motion.as_ref().map_or(0.0, |motion| self.hold.answer_nm(rms(&motion.std_rad)))
    }

    /// Torque by the duty, root mean square, N·m, of the model that the input was prepared for; `None` but for a joint without tendons that its
    /// angle guides.
    #[must_use]
    pub const fn driven_nm(&self) -> Option<f64> {
        self.driven_nm
    }

    /// Reconstructed motion of the input pulley, if it is an input.
    #[must_use]
    pub fn motion(&self) -> Option<&Motion> {
        self.motion.as_ref()
    }
}

fn rms(values: &[f64]) -> f64 {
    (values.iter().map(|value| value * value).sum::<f64>() / values.len().max(1) as f64).sqrt()
}

fn median_step_s(t_s: &[f64]) -> f64 {
    let mut steps: Vec<f64> = t_s.windows(2).map(|pair| pair[1] - pair[0]).collect();
    if steps.is_empty() {
        return 1e-3;
    }
    let middle = steps.len() / 2;
    *steps.select_nth_unstable_by(middle, f64::total_cmp).1
}
