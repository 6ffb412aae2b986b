//! A replay: the joint driven by what a recording says went in, sampled where the recording was.
//!
//! With a motor and a recorded duty the motor itself is simulated, and a torque guides its angle to the recorded one:
//! stiff enough to follow, soft enough that what an encoder cannot resolve comes from the physics. A first pass finds
//! the guiding torque; its slow part, filtered without phase, is what friction or a wrong parameter took from the
//! motor, and the second pass applies it ahead so that the guide itself can be soft. The guide pulls only where the
//! simulated angle leaves the uncertainty of the reconstructed one.
//!
//! Compared with a prescribed low-passed angle this lets the input pulley give way to the load as the real one does;
//! `cargo xtask bench` prints what that gains.

use std::sync::Arc;

use bowden_model::channel::Channel;
use bowden_model::drive::BridgeInput;
use bowden_model::effect::{ActiveEffect, SensorPort};
use bowden_model::effect_set::{EffectSet, EffectStates, FRESH_STATES};
use bowden_model::plant::{Plant, PlantConfig, StepInput};
use bowden_model::transmission::Outside;

use crate::joint_model::{Drive, JointModel};
use crate::outcome::Failure;
use crate::reconstruct::{Motion, moving_average};
use crate::recording::Recording;

/// Stiffness of the guide in the first pass over that of both tendons at the input pulley, `2 EA/L r1²`: so stiff that the
/// angle follows.
const STIFF_GUIDE: f64 = 4.5;

/// The same in the second pass.
const SOFT_GUIDE: f64 = 1.5;

/// The same on a pulley inside a play of the gear: that of the tendons or less, so that tensions there are those of a pulley
/// that nothing turns.
const PLAY_GUIDE: f64 = 0.6;

/// Part of the angle's standard deviation within which the guide does not pull.
const GUIDE_DEAD_BAND: f64 = 0.3;

/// Half width of the zero-phase filter of the guiding torque, s.
const GUIDE_FILTER_S: f64 = 0.03;

/// Inputs of a replay, prepared once and used for every set of parameters.
#[derive(Clone, Debug)]
pub struct ReplayInput {
    t_s: Arc<Vec<f64>>,
    /// Median distance of two samples, s.
    step_s: f64,
    motion: Option<Motion>,
    duty: Option<Arc<Vec<f64>>>,
    bus_v: Option<Arc<Vec<f64>>>,
    enabled: Option<Arc<Vec<f64>>>,
    theta_ref_rad: Option<Arc<Vec<f64>>>,
    torque_out_nm: Option<Arc<Vec<f64>>>,
    start_rad: Option<f64>,
    start_rad_s: f64,
    clock_offset_s: f64,
    /// Stiffness of both tendons at the input pulley, as the model that the input was prepared for has it: a fit moves
    /// the model, and the guide stays the same.
    cables_nm_per_rad: f64,
}

impl ReplayInput {
    /// Takes time and the input roles of `model` from a recording, and nothing else.
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
        let motion = take(Channel::ThetaIn)?.map(|theta| Motion::from_encoder(&t_s, &theta));
        let duty = take(Channel::Duty)?;
        let theta_ref_rad = take(Channel::ThetaRef)?;
        // A joint whose angle is no input is taken to stand where its reference begins, until it is told otherwise.
        let reference_rad = theta_ref_rad.as_ref().and_then(|reference| reference.first().copied());
        let start_rad = motion.as_ref().map(|m| m.theta_rad[0]).or(reference_rad);
        Ok(Self {
            motion,
            duty,
            bus_v: take(Channel::BusVoltage)?,
            enabled: take(Channel::DriveEnable)?,
            theta_ref_rad,
            torque_out_nm: take(Channel::TorqueOut)?,
            start_rad,
            start_rad_s: 0.0,
            clock_offset_s: 0.0,
            cables_nm_per_rad: cables_nm_per_rad(model),
            step_s,
            t_s,
        })
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
            clock_offset_s: self.clock_offset_s,
            cables_nm_per_rad: self.cables_nm_per_rad,
        }
    }

    /// States how long the bench had run before the first sample, s: what happened to it then has happened already.
    pub fn continues_after(&mut self, clock_s: f64) {
        self.clock_offset_s = clock_s;
    }

    /// Clock of the bench at the first and at the last sample, s.
    #[must_use]
    pub fn clock_s(&self) -> [f64; 2] {
        [self.t_s.first(), self.t_s.last()].map(|t_s| self.clock_offset_s + t_s.copied().unwrap_or(0.0))
    }

    /// Sampling instants, s.
    #[must_use]
    pub fn t_s(&self) -> &[f64] {
        &self.t_s
    }

    /// Reconstructed motion of the input pulley, if it is an input.
    #[must_use]
    pub fn motion(&self) -> Option<&Motion> {
        self.motion.as_ref()
    }
}

/// `2 EA/L r1²`; zero without tendons.
fn cables_nm_per_rad(model: &JointModel) -> f64 {
    let parameters = &model.parameters;
    parameters.tendon.zip(parameters.pulleys).map_or(0.0, |(tendon, pulleys)| {
        2.0 * tendon.axial_stiffness_n / tendon.length_m * pulleys.input_radius_m * pulleys.input_radius_m
    })
}

/// Predicted channels, one value a sample.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Prediction {
    channels: Vec<(Channel, Vec<f64>)>,
    /// Torque that guided the motor, N·m at the input pulley; what its model does not explain. Empty where none was
    /// needed.
    pub guide_nm: Vec<f64>,
}

impl Prediction {
    /// One channel.
    #[must_use]
    pub fn channel(&self, channel: Channel) -> Option<&[f64]> {
        self.channels.iter().find(|(c, _)| *c == channel).map(|(_, values)| values.as_slice())
    }

    /// One channel of the same joint seen with one more effect on its sensor, in the last place; empty for what was not
    /// predicted.
    ///
    /// # Errors
    /// When the set of one effect cannot be made.
    pub fn seen_through(
        &self,
        channel: Channel,
        effect: ActiveEffect,
        input: &ReplayInput,
    ) -> Result<Vec<f64>, Failure> {
        let effects = EffectSet::from_slice(&[effect]).map_err(Failure::bad_input)?;
        let values = self.channel(channel).unwrap_or_default();
        Ok(through(&input.t_s, values, |states, port| effects.measure(channel, states, port)))
    }

    /// Values of a channel, which is left empty; empty for what was not predicted.
    pub fn take(&mut self, channel: Channel) -> Vec<f64> {
        let found = self.channels.iter_mut().find(|(c, _)| *c == channel);
        found.map(|(_, values)| std::mem::take(values)).unwrap_or_default()
    }

    /// All channels, to be changed.
    pub fn channels_mut(&mut self) -> impl Iterator<Item = (Channel, &mut [f64])> {
        self.channels.iter_mut().map(|(channel, values)| (*channel, values.as_mut_slice()))
    }

    /// All channels.
    pub fn channels(&self) -> impl Iterator<Item = (Channel, &[f64])> {
        self.channels.iter().map(|(channel, values)| (*channel, values.as_slice()))
    }
}

/// What takes the samples of a replay, so that nobody has to keep them who only compares.
pub trait Sink {
    /// The next sample: every output in the order in which they were asked for, and the torque that guided the motor, N·m at the input
    /// pulley, where one did.
    fn sample(&mut self, outputs: &[f64], guide_nm: Option<f64>);
}

/// Keeps everything.
impl Sink for Prediction {
    fn sample(&mut self, outputs: &[f64], guide_nm: Option<f64>) {
        for ((_, values), value) in self.channels.iter_mut().zip(outputs) {
            values.push(*value);
        }
        self.guide_nm.extend(guide_nm);
    }
}

/// Simulates the joint with the inputs of a recording: all outputs of the model.
///
/// # Errors
/// When the model cannot be driven by these inputs.
pub fn replay(model: &JointModel, input: &ReplayInput) -> Result<Prediction, Failure> {
    replay_of(model, input, &model.outputs)
}

/// The same, of some of the outputs.
///
/// # Errors
/// When the model cannot be driven by these inputs.
pub fn replay_of(
    model: &JointModel,
    input: &ReplayInput,
    outputs: &[Channel],
) -> Result<Prediction, Failure> {
    let samples = input.t_s.len();
    let guided = if model.drive()? == Drive::GuidedMotor { samples } else { 0 };
    let mut prediction = Prediction {
        channels: outputs.iter().map(|channel| (*channel, Vec::with_capacity(samples))).collect(),
        guide_nm: Vec::with_capacity(guided),
    };
    replay_into(model, input, outputs, &mut prediction)?;
    Ok(prediction)
}

/// The same, sample by sample.
///
/// # Errors
/// When the model cannot be driven by these inputs.
pub fn replay_into(
    model: &JointModel,
    input: &ReplayInput,
    outputs: &[Channel],
    sink: &mut impl Sink,
) -> Result<(), Failure> {
    let config = model.plant()?;
    let drive = model.drive()?;
    let run = Run { model, config: &config, input, drive };
    if drive != Drive::GuidedMotor {
        run.execute(Guide { stiffness_nm_per_rad: 0.0, ahead_nm: &[] }, outputs, sink);
        return Ok(());
    }
    let stiffness_nm_per_rad = STIFF_GUIDE * input.cables_nm_per_rad;
    let mut first = Prediction { channels: Vec::new(), guide_nm: Vec::with_capacity(input.t_s.len()) };
    run.execute(Guide { stiffness_nm_per_rad, ahead_nm: &[] }, &[], &mut first);
    let half = (GUIDE_FILTER_S / input.step_s).round() as usize;
    let ahead_nm = moving_average(moving_average(first.guide_nm, half), half);
    let guide = Guide { stiffness_nm_per_rad: SOFT_GUIDE * input.cables_nm_per_rad, ahead_nm: &ahead_nm };
    run.execute(guide, outputs, sink);
    Ok(())
}

fn median_step_s(t_s: &[f64]) -> f64 {
    let mut steps: Vec<f64> = t_s.windows(2).map(|pair| pair[1] - pair[0]).collect();
    if steps.is_empty() {
        return 1e-3;
    }
    let middle = steps.len() / 2;
    *steps.select_nth_unstable_by(middle, f64::total_cmp).1
}

#[derive(Clone, Copy)]
struct Guide<'a> {
    stiffness_nm_per_rad: f64,
    /// Torque at each sample that needs no angle to be left for it; none where it is empty.
    ahead_nm: &'a [f64],
}

struct Run<'a> {
    model: &'a JointModel,
    config: &'a PlantConfig,
    input: &'a ReplayInput,
    drive: Drive,
}

impl Run<'_> {
    /// One pass; only `outputs` are sampled.
    fn execute(&self, guide: Guide<'_>, outputs: &[Channel], sink: &mut impl Sink) {
        let input = self.input;
        let n = input.t_s.len();
        let longest_s = self.model.step_s.min(self.config.stable_step_s());
        let effects = self.config.effects();
        let mut states = FRESH_STATES;
        let mut theta_in_rad = |k: usize, dt_s: f64| {
            let motion = input.motion.as_ref()?;
            let mut port = SensorPort { t_s: input.t_s[k], dt_s, value: motion.theta_rad[k] };
            effects.correct(Channel::ThetaIn, &mut states, &mut port);
            Some(port.value)
        };
        let mut wanted_rad = theta_in_rad(0, 0.0);
        let start_rad = wanted_rad.or(input.start_rad).unwrap_or(0.0);
        let mut plant = Plant::at_rest(self.config, start_rad, start_rad * self.ratio());
        plant.set_time_s(input.clock_s()[0]);
        if self.drive == Drive::Duty || self.drive == Drive::Servo {
            plant.set_speed_rad_s(input.start_rad_s);
        }
        plant.settle(self.config, &self.step_input(0, start_rad));
        let mut sampler = Sampler::new(outputs, effects);
        let mut delayed = DelayLine::new(self.model.servo.map_or(0.0, |servo| servo.delay_s), start_rad);
        let mut duty = 0.0;
        for k in 0..n {
            let mut torque_sum = 0.0;
            let span_s = if k == 0 { 0.0 } else { input.t_s[k] - input.t_s[k - 1] };
            if k > 0 {
                let from_rad = wanted_rad;
                wanted_rad = theta_in_rad(k, span_s);
                let steps = (span_s / longest_s - 1e-9).ceil().max(1.0);
                let dt_s = span_s / steps;
                for sub in 1..=steps as usize {
                    let share = sub as f64 / steps;
                    let wanted =
                        from_rad.zip(wanted_rad).map_or(0.0, |(from, to)| from + (to - from) * share);
                    let mut step = self.step_input(k - 1, wanted);
                    match self.drive {
                        Drive::GuidedMotor => {
                            let band = input
                                .motion
                                .as_ref()
                                .map_or(0.0, |m| GUIDE_DEAD_BAND * m.std_rad[k].min(m.half_count_rad));
                            let error = plant.theta_in_rad() - wanted;
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
            let outputs = sampler.sample(self.config, &plant, duty, (input.t_s[k], span_s));
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

/// Angle as it was a fixed time ago.
#[derive(Clone, Debug)]
pub(crate) struct DelayLine {
    delay_s: f64,
    history: std::collections::VecDeque<(f64, f64)>,
    last: f64,
}

impl DelayLine {
    pub(crate) fn new(delay_s: f64, start: f64) -> Self {
        Self { delay_s, history: std::collections::VecDeque::new(), last: start }
    }

    pub(crate) fn at(&mut self, t_s: f64, value: f64) -> f64 {
        if self.delay_s <= 0.0 {
            return value;
        }
        self.history.push_back((t_s, value));
        while let Some(&(then_s, old)) = self.history.front() {
            if then_s > t_s - self.delay_s {
                break;
            }
            self.last = old;
            self.history.pop_front();
        }
        self.last
    }
}

/// What the sensors would have shown had they no noise and no steps.
struct Sampler<'a> {
    effects: &'a EffectSet,
    outputs: &'a [Channel],
    states: Vec<EffectStates>,
    values: Vec<f64>,
}

impl<'a> Sampler<'a> {
    fn new(outputs: &'a [Channel], effects: &'a EffectSet) -> Self {
        let states = vec![FRESH_STATES; outputs.len()];
        Self { effects, outputs, states, values: vec![0.0; outputs.len()] }
    }

    fn sample(&mut self, config: &PlantConfig, plant: &Plant, duty: f64, (t_s, dt_s): (f64, f64)) -> &[f64] {
        for ((channel, value), states) in self.outputs.iter().zip(&mut self.values).zip(&mut self.states) {
            let outside = if *channel == Channel::Duty { duty } else { 0.0 };
            let mut port =
                SensorPort { t_s, dt_s, value: plant.channel(config, *channel).unwrap_or(outside) };
            self.effects.measure(*channel, states, &mut port);
            *value = port.value;
        }
        &self.values
    }
}

/// Values of one sensor, sample by sample.
pub fn through(
    t_s: &[f64],
    values: &[f64],
    mut sensor: impl FnMut(&mut EffectStates, &mut SensorPort),
) -> Vec<f64> {
    let mut states = FRESH_STATES;
    let mut before_s = t_s.first().copied().unwrap_or(0.0);
    t_s.iter()
        .zip(values)
        .map(|(&t_s, &value)| {
            let mut port = SensorPort { t_s, dt_s: t_s - before_s, value };
            before_s = t_s;
            sensor(&mut states, &mut port);
            port.value
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use bowden_model::effect::{Component, Target};
    use bowden_model::effects::CATALOGUE;

    use super::*;
    use crate::test_bench;

    /// What screening takes for a simulation with one more sensor effect is that simulation, bit for bit.
    #[test]
    fn a_sensor_that_drives_nothing_is_seen_through_without_another_simulation() {
        let recording = test_bench::swung(1500);
        let model = JointModel::from_rig(&test_bench::rig(), &recording).unwrap();
        let input = ReplayInput::new(&model, &recording).unwrap();
        let plain = replay(&model, &input).unwrap();
        let sensors = CATALOGUE.iter().filter(|effect| effect.descriptor().component == Component::Sensors);
        let mut tried = 0;
        for effect in sensors {
            let mut active = ActiveEffect::with_defaults(*effect);
            active.target = Target::One(Channel::F2);
            if active.descriptor().id == "sensor_saturation" {
                active = active.with("limit", 31.0);
            }
            if !active.descriptor().channels.contains(&Channel::F2) {
                active.target = Target::One(Channel::ThetaOut);
            }
            let with = JointModel { effects: vec![active], ..model.clone() };
            let simulated = replay(&with, &input).unwrap();
            assert_ne!(simulated, plain, "{} does nothing", active.descriptor().id);
            for (channel, values) in simulated.channels() {
                let seen = plain.seen_through(channel, active, &input).unwrap();
                assert_eq!(seen, values, "{} on {}", active.descriptor().id, channel.role());
            }
            tried += 1;
        }
        assert_eq!(tried, 5);
    }

    /// A joint a hundredth as strong answers the same motion with a hundredth of every tension and torque, guide included.
    #[test]
    fn a_weaker_joint_is_guided_as_the_strong_one_is() {
        const SHARE: f64 = 0.01;
        let mut recording = test_bench::swung(3000);
        let wave = |k: u32| 0.12 * (4e-3 * f64::from(k)).cos() + 0.05;
        recording.set(Channel::Duty, (0..3000).map(wave).collect());
        recording.set(Channel::BusVoltage, vec![24.0; 3000]);
        let strong = JointModel::from_rig(&test_bench::rig(), &recording).unwrap();
        assert_eq!(strong.drive().unwrap(), Drive::GuidedMotor);
        let weak = test_bench::smaller(strong.clone(), SHARE);
        let mut on_weak = recording.clone();
        on_weak.set(Channel::BusVoltage, vec![24.0 * SHARE; 3000]);
        let of_strong = replay(&strong, &ReplayInput::new(&strong, &recording).unwrap()).unwrap();
        let of_weak = replay(&weak, &ReplayInput::new(&weak, &on_weak).unwrap()).unwrap();
        let same = |a: &[f64], b: &[f64], share: f64| {
            let largest = a.iter().fold(0.0_f64, |largest, value| largest.max(value.abs()));
            a.iter().zip(b).all(|(a, b)| (share * a - b).abs() < 1e-6 * share * largest)
        };
        for (channel, values) in of_strong.channels() {
            let share =
                if channel.role().ends_with("_n") || channel.role().ends_with("_nm") { SHARE } else { 1.0 };
            assert!(same(values, of_weak.channel(channel).unwrap(), share), "{}", channel.role());
        }
        assert!(same(&of_strong.guide_nm, &of_weak.guide_nm, SHARE), "guide");
    }
}
