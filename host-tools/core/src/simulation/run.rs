//! One pass of a replay: from sample to sample, in steps that the plant bears.

use std::sync::Arc;

use bowden_model::channel::Channel;
use bowden_model::drive::BridgeInput;
use bowden_model::effect::SensorPort;
use bowden_model::effect_set::FRESH_STATES;
use bowden_model::plant::{Plant, PlantConfig, StepInput};
use bowden_model::transmission::Outside;

use super::delay_line::DelayLine;
use super::input::ReplayInput;
use super::prediction::Sink;
use super::sensors::Sampler;
use crate::joint_model::{Drive, JointModel};

/// Stiffness of the guide over that of both tendons at the input pulley, `2 EA/L r1²`, on a pulley inside a play of the gear: that of the tendons or less, so that tensions there are those of a pulley
/// that nothing turns.
const PLAY_GUIDE: f64 = 0.6;

/// Part of the angle's standard deviation within which the guide does not pull.
const GUIDE_DEAD_BAND: f64 = 0.3;

/// What holds the simulated angle to the recorded one.
#[derive(Clone, Copy)]
pub(super) struct Guide<'a> {
    pub stiffness_nm_per_rad: f64,
    /// Torque at each sample that needs no angle to be left for it; none where it is empty.
    pub ahead_nm: &'a [f64],
}

/// A model and the recording that drives it.
pub(super) struct Run<'a> {
    pub model: &'a JointModel,
    pub config: &'a PlantConfig,
    pub input: &'a ReplayInput,
    pub drive: Drive,
}

impl Run<'_> {
    /// One pass; only `outputs` are sampled.
    pub fn execute(&self, guide: Guide<'_>, outputs: &[Channel], sink: &mut impl Sink) {
        let input = self.input;
        let n = input.t_s.len();
        let longest_s = self.model.step_s.min(self.config.stable_step_s());
        let effects = self.config.effects();
        let mut states = FRESH_STATES;
        let mut theta_in_rad = |k: usize, dt_s: f64| {
            let motion = input.motion.as_ref()?;
            let mut port = SensorPort { t_s: input.clock_at_s(k), dt_s, value: motion.theta_rad[k] };
            effects.correct(Channel::ThetaIn, &mut states, &mut port);
            Some(port.value)
        };
        let mut wanted_rad = theta_in_rad(0, 0.0);
        let start_rad = wanted_rad.or(input.start_rad).unwrap_or(0.0);
        let mut plant = Plant::at_rest(self.config, start_rad, start_rad * self.ratio());
        plant.set_time_s(input.clock_at_s(0));
        if self.drive == Drive::Duty || self.drive == Drive::Servo {
            plant.set_speed_rad_s(input.start_rad_s);
        }
        plant.settle(self.config, &self.step_input(0, start_rad));
        let mut sampler = Sampler::new(outputs, effects);
        let mut delayed = DelayLine::new(self.model.servo.map_or(0.0, |servo| servo.delay_s), start_rad);
        let mut duty = 0.0;
        for k in 0..n {
            if sink.is_stopped() {
                return;
            }
            let mut torque_sum = 0.0;
            let span_s = if k == 0 { 0.0 } else { input.t_s[k] - input.t_s[k - 1] };
            if k > 0 {
                let from_rad = wanted_rad;
                wanted_rad = theta_in_rad(k, span_s);
                let steps = (span_s / longest_s - 1e-9).ceil().max(1.0);
                let dt_s = span_s / steps;
                for sub in 1..=steps as usize {
                    // Where the recording stands after a part of the steps between two samples.
                    let recorded_rad = |steps_done: usize| {
                        let share = steps_done as f64 / steps;
                        from_rad.zip(wanted_rad).map_or(0.0, |(from, to)| from + (to - from) * share)
                    };
                    // An angle that is prescribed is the one at the end of the step.
                    let mut step = self.step_input(k - 1, recorded_rad(sub));
                    match self.drive {
                        Drive::GuidedMotor => {
                            let band = input
                                .motion
                                .as_ref()
                                .map_or(0.0, |m| GUIDE_DEAD_BAND * m.std_rad[k].min(m.half_count_rad));
                            // The plant stands where the step begins, and so does what it is held against: with the
                            // end of the step it would run ahead of the recording by a step.
                            let error = plant.theta_in_rad() - recorded_rad(sub - 1);
                            let beyond = error - error.clamp(-band, band);
                            if beyond != 0.0 {
                                let stiffness_nm_per_rad = PLAY_GUIDE * input.cables_nm_per_rad;
                                step.loose_pulley = Outside {
                                    torque_nm: -stiffness_nm_per_rad * beyond,
                                    stiffness_nm_per_rad,
                                };
                            }
                            // The rotor inside a play is not measured; what the pulley does there says nothing of it.
                            if !plant.inside_gear_play() {
                                let ahead_nm = guide.ahead_nm.get(k).copied().unwrap_or(0.0);
                                step.input_torque_nm = ahead_nm - guide.stiffness_nm_per_rad * beyond;
                            }
                            torque_sum += step.input_torque_nm / steps;
                        }
                        Drive::Servo => {
                            if let (Some(servo), Some(reference)) = (self.model.servo, &input.theta_ref_rad) {
                                let error = reference[k - 1] - delayed.at(plant.t_s(), plant.theta_in_rad());
                                step.bridge.duty = (servo.gain_duty_per_rad * error)
                                    .clamp(-servo.duty_limit, servo.duty_limit);
                            }
                        }
                        Drive::Angle | Drive::Duty => {}
                    }
                    duty = step.bridge.duty;
                    plant.step(self.config, &step, dt_s);
                }
            }
            let outputs = sampler.sample(self.config, &plant, duty, (input.clock_at_s(k), span_s));
            sink.sample(outputs, (self.drive == Drive::GuidedMotor).then_some(torque_sum));
        }
    }

    fn ratio(&self) -> f64 {
        self.model.parameters.pulleys.map_or(1.0, |p| p.input_radius_m / p.output_radius_m)
    }

    fn step_input(&self, k: usize, theta_in_rad: f64) -> StepInput {
        let input = self.input;
        let at = |values: &Option<Arc<Vec<f64>>>, otherwise: f64| values.as_ref().map_or(otherwise, |v| v[k]);
        StepInput {
            bridge: BridgeInput {
                duty: at(&input.duty, 0.0),
                bus_v: at(&input.bus_v, self.model.parameters.motor.map_or(0.0, |m| m.supply_v)),
                enabled: at(&input.enabled, 1.0) > 0.5,
            },
            theta_in_rad,
            theta_out_rad: 0.0,
            input_torque_nm: 0.0,
            loose_pulley: Outside::NOTHING,
            // The recorded torque is that of the cables on the joint; the load answers with its negative.
            external_torque_nm: -at(&input.torque_out_nm, 0.0),
        }
    }
}
