//! One pass of a replay: from sample to sample, in steps that the plant bears.
//!
//! A rough pass, which only finds the guiding torque or ranks what changes, may go from every other sample to the next, by the mean of what the
//! recording says in between.

use std::ops::Range;
use std::sync::Arc;

use bowden_model::channel::Channel;
use bowden_model::drive::BridgeInput;
use bowden_model::effect::SensorPort;
use bowden_model::effect_set::FRESH_STATES;
use bowden_model::plant::{Plant, PlantConfig, StepInput};
use bowden_model::transmission::Outside;

use super::delay_line::DelayLine;
use super::guide::{DEAD_BAND, Guide, LEAD};
use super::input::ReplayInput;
use super::prediction::Sink;
use super::sensors::Sampler;
use crate::joint_model::{Drive, JointModel};

/// Steps of a rough pass over those that keep well inside stability: half of what is unstable, where the stiffest oscillation that there may be is
/// 5 % too fast.
const NEARER_TO_STABILITY: f64 = 1.5;

/// A model and the recording that drives it.
pub(super) struct Run<'a> {
    pub model: &'a JointModel,
    pub config: &'a PlantConfig,
    pub input: &'a ReplayInput,
    pub drive: Drive,
    pub pace: Pace,
}

/// Part of the longest step by which a recording's own interval may be longer and still be one step: clocks are not exact.
const LONGER_INTERVAL: f64 = 0.1;

/// Part of a step by which one of a clock that jitters may be longer than the others: with none, half of its intervals would take two.
const JITTER: f64 = 0.4;

/// How finely a pass is simulated.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Pace {
    /// Samples from one that is simulated to the next.
    stride: usize,
    /// Step between samples that are as far apart as most, s.
    usual_s: f64,
}

impl Pace {
    /// Every sample, in steps of the model's length at most, but for [`LONGER_INTERVAL`] and [`JITTER`].
    pub fn whole(model: &JointModel, input: &ReplayInput, config: &PlantConfig) -> Self {
        Self::of(1, input, model.step_s.min(config.stable_step_s()))
    }

    /// As many samples at a time, and steps as long, as the plant bears, up to the model's stride.
    pub fn rough(model: &JointModel, input: &ReplayInput, config: &PlantConfig) -> Self {
        if model.guide_stride <= 1 {
            return Self::whole(model, input, config);
        }
        let longest_s =
            (model.guide_stride as f64 * model.step_s).min(NEARER_TO_STABILITY * config.stable_step_s());
        let samples = (longest_s / input.step_s + 1e-6).floor();
        Self::of((samples as usize).max(1), input, longest_s)
    }

    fn of(stride: usize, input: &ReplayInput, longest_s: f64) -> Self {
        let span_s = stride as f64 * input.step_s;
        Self { stride, usual_s: span_s / steps_in(span_s / longest_s, LONGER_INTERVAL) }
    }
}

impl Run<'_> {
    /// One pass; only `outputs` are sampled. Samples inside a stride show what its end does.
    pub fn execute(&self, guide: Guide<'_>, outputs: &[Channel], sink: &mut impl Sink) {
        let input = self.input;
        let n = input.t_s.len();
        let Pace { stride, usual_s } = self.pace;
        let effects = self.config.effects();
        let mut states = FRESH_STATES;
        let guiding = self.model.guiding_channel();
        let mut theta_in_rad = |k: usize, dt_s: f64| {
            let motion = input.motion.as_ref()?;
            let mut port = SensorPort { t_s: input.clock_at_s(k), dt_s, value: motion.theta_rad[k] };
            effects.correct(guiding, &mut states, &mut port);
            Some(port.value)
        };
        let mut wanted_rad = theta_in_rad(0, 0.0);
        let start_rad = wanted_rad.or(input.start_rad).unwrap_or(0.0);
        let mut plant = Plant::at_rest(self.config, start_rad, start_rad * self.ratio());
        plant.set_time_s(input.clock_at_s(0));
        if self.model.guided_by.is_some() || matches!(self.drive, Drive::Duty | Drive::Servo) {
            plant.set_speed_rad_s(input.start_rad_s);
        }
        let recorded = Recorded::of(self);
        plant.settle(self.config, &recorded.step_input(0..1, start_rad));
        let mut sampler = Sampler::new(outputs, effects, input);
        let mut delayed = DelayLine::new(self.model.servo.map_or(0.0, |servo| servo.delay_s), start_rad);
        let mut duty = 0.0;
        // Error of the angle as the lead of the guide has it.
        let mut late_rad = 0.0;
        let strides = (0..n.min(1)).chain((1..n).step_by(stride).map(|first| (first + stride).min(n) - 1));
        let mut before = 0;
        for k in strides {
            if sink.is_stopped() {
                return;
            }
            let mut torque_sum = 0.0;
            let span_s = input.t_s[k] - input.t_s[before];
            if k > 0 {
                let from_rad = wanted_rad;
                wanted_rad = theta_in_rad(k, span_s);
                let steps = steps_in(span_s / usual_s, JITTER);
                let dt_s = span_s / steps;
                for sub in 1..=steps as usize {
                    // Where the recording stands after a part of the steps between two samples.
                    let recorded_rad = |steps_done: usize| {
                        let share = steps_done as f64 / steps;
                        from_rad.zip(wanted_rad).map_or(0.0, |(from, to)| from + (to - from) * share)
                    };
                    // An angle that is prescribed is the one at the end of the step.
                    let mut step = recorded.step_input(before..k, recorded_rad(sub));
                    match self.drive {
                        Drive::GuidedMotor => {
                            let band = input
                                .motion
                                .as_ref()
                                .map_or(0.0, |m| DEAD_BAND * m.std_rad[k].min(m.half_count_rad));
                            // The plant stands where the step begins, and so does what it is held against: with the
                            // end of the step it would run ahead of the recording by a step.
                            let error = plant.theta_in_rad() - recorded_rad(sub - 1);
                            let beyond = error - error.clamp(-band, band);
                            if beyond != 0.0 {
                                let stiffness_nm_per_rad = input.hold.loose_nm_per_rad;
                                step.loose_pulley = Outside {
                                    torque_nm: -stiffness_nm_per_rad * beyond,
                                    stiffness_nm_per_rad,
                                };
                            }
                            // The rotor inside a play is not measured; what the pulley does there says nothing of it.
                            let mut shown_nm = 0.0;
                            if !plant.inside_gear_play() {
                                let ahead_nm = guide.ahead_nm.get(k).copied().unwrap_or(0.0);
                                shown_nm = ahead_nm - guide.stiffness_nm_per_rad * beyond;
                                if let Some(lead_s) = guide.lead_s {
                                    late_rad += (beyond - late_rad) * dt_s / (lead_s + dt_s);
                                    shown_nm -= guide.stiffness_nm_per_rad * LEAD * (beyond - late_rad);
                                }
                                step.input_torque_nm = shown_nm / guide.shown;
                            }
                            torque_sum += shown_nm / steps;
                        }
                        Drive::Servo => {
                            if let (Some(servo), Some(reference)) = (self.model.servo, &input.theta_ref_rad) {
                                let error = reference[before] - delayed.at(plant.t_s(), plant.theta_in_rad());
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
            for _ in before..k.max(1) {
                sink.sample(outputs, (self.drive == Drive::GuidedMotor).then_some(torque_sum));
            }
            before = k;
        }
    }

    fn ratio(&self) -> f64 {
        self.model.parameters.pulleys.map_or(1.0, |p| p.input_radius_m / p.output_radius_m)
    }
}

/// What a recording says of the inputs of a step, found once for all steps.
struct Recorded<'a> {
    duty: Option<&'a [f64]>,
    bus_v: Option<&'a [f64]>,
    enabled: Option<&'a [f64]>,
    torque_out_nm: Option<&'a [f64]>,
    /// Supply of the rig, V, where none is recorded.
    supply_v: f64,
}

impl<'a> Recorded<'a> {
    fn of(run: &Run<'a>) -> Self {
        let values = |of: &'a Option<Arc<Vec<f64>>>| of.as_ref().map(|values| values.as_slice());
        let input = run.input;
        Self {
            duty: values(&input.duty),
            bus_v: values(&input.bus_v),
            enabled: values(&input.enabled),
            torque_out_nm: values(&input.torque_out_nm),
            supply_v: run.model.parameters.motor.map_or(0.0, |motor| motor.supply_v),
        }
    }

    /// Input of a step by what these samples say, on average.
    #[inline]
    fn step_input(&self, samples: Range<usize>, theta_in_rad: f64) -> StepInput {
        let mean = |values: &[f64]| match &values[samples.clone()] {
            [value] => *value,
            several => several.iter().sum::<f64>() / several.len() as f64,
        };
        let at = |values: Option<&[f64]>, otherwise: f64| values.map_or(otherwise, mean);
        StepInput {
            bridge: BridgeInput {
                duty: at(self.duty, 0.0),
                bus_v: at(self.bus_v, self.supply_v),
                enabled: at(self.enabled, 1.0) > 0.5,
            },
            theta_in_rad,
            theta_out_rad: 0.0,
            input_torque_nm: 0.0,
            loose_pulley: Outside::NOTHING,
            // The recorded torque is that of the cables on the joint; the load answers with its negative.
            external_torque_nm: -at(self.torque_out_nm, 0.0),
        }
    }
}

/// Steps between two samples that lie so many of the wanted steps apart, each longer than these by the part `longer` at most.
#[inline]
fn steps_in(wanted: f64, longer: f64) -> f64 {
    let whole = wanted - longer;
    // Rounding up is a call.
    if whole > 1.0 { whole.ceil() } else { 1.0 }
}

#[cfg(test)]
mod tests {
    use super::{JITTER, LONGER_INTERVAL, Pace, steps_in};
    use crate::joint_model::JointModel;
    use crate::simulation::ReplayInput;
    use crate::test_bench;

    /// Intervals of 0.7 to 1.3 times the usual one are as many steps as that; two rows that are lost are two more.
    #[test]
    fn a_clock_that_jitters_takes_no_more_steps_than_an_even_one() {
        let recording = test_bench::swung(3000);
        let model = JointModel::from_rig(&test_bench::rig(), &recording).unwrap();
        let input = ReplayInput::new(&model, &recording).unwrap();
        let interval_s = input.step_s;
        for (longest, steps) in [(1.0, 1.0), (0.5, 2.0), (0.93, 1.0), (0.89, 2.0), (0.9995, 1.0)] {
            let pace = Pace::of(1, &input, longest * interval_s);
            let in_intervals = |intervals: f64| steps_in(intervals * interval_s / pace.usual_s, JITTER);
            assert_eq!([in_intervals(1.0), in_intervals(3.0)], [steps, 3.0 * steps], "even, {longest}");
            if steps == 1.0 {
                assert_eq!([0.7, 1.3, 1.5].map(in_intervals), [1.0, 1.0, 2.0], "{longest}");
            }
        }
        assert_eq!([steps_in(1.09, LONGER_INTERVAL), steps_in(1.11, LONGER_INTERVAL)], [1.0, 2.0]);
    }
}
