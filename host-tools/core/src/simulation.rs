//! A replay: the joint driven by what a recording says went in, sampled where the recording was.
//!
//! With a motor and a recorded duty the motor itself is simulated, and a torque guides its angle to the recorded one:
//! stiff enough to follow, soft enough that what an encoder cannot resolve comes from the physics. A first pass finds
//! the guiding torque; its slow part, filtered without phase, is what friction or a wrong parameter took from the
//! motor, and the second pass applies it ahead so that the guide itself can be soft. The guide pulls only where the
//! simulated angle leaves the uncertainty of the reconstructed one. Of the first pass nothing is kept that is faster than the filter: a search
//! simulates it in longer steps.
//!
//! Without tendons a soft guide keeps the joint from drifting away in a single pass, see `guide`.
//!
//! Compared with a prescribed low-passed angle this lets the input pulley give way to the load as the real one does;
//! `cargo xtask bench` prints what that gains.

mod delay_line;
mod guide;
mod input;
mod prediction;
mod run;
mod sensors;

use bowden_model::channel::Channel;

use crate::joint_model::{Drive, JointModel};
use crate::outcome::Failure;
use crate::progress::Progress;
use crate::reconstruct::moving_average;

pub(crate) use delay_line::DelayLine;
use guide::{FILTER_S, Guide};
pub use input::ReplayInput;
pub use prediction::{Prediction, Sink};
use prediction::{StoppedBy, Watched};
use run::{Pace, Run};
pub use sensors::through;

/// Which of the two passes of a guided motor are simulated; other drives have one.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Passes {
    /// Both.
    All,
    /// The first alone, in half the time. The outputs differ from those of both, because the stiff guide lets the pulley give way less. What a
    /// change of the sheath's friction changes in them has the same course within a fifth, but up to 1.5 times the size, and what little
    /// stiffness changes can differ more: enough to rank and to set out by, not to find a place or to judge.
    First,
    /// The same in steps as long as those that find the guiding torque: enough to rank what has no moment.
    Rough,
}

impl Passes {
    /// Whether a replay of `model` takes two passes; not where the model cannot be driven.
    #[must_use]
    pub fn are_two(model: &JointModel) -> bool {
        model.guided_by.is_none() && model.drive().is_ok_and(|drive| drive == Drive::GuidedMotor)
    }

    /// What is enough to rank, and to set out by.
    #[must_use]
    pub fn roughly(model: &JointModel) -> Self {
        if Self::are_two(model) { Self::First } else { Self::All }
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
    let mut prediction = empty(model, input, outputs)?;
    replay_into(model, input, outputs, &mut prediction)?;
    Ok(prediction)
}

/// All outputs of the model; `None` when `progress` asks for an early end, which is looked for at every sample.
///
/// # Errors
/// When the model cannot be driven by these inputs.
pub fn replay_watched(
    model: &JointModel,
    input: &ReplayInput,
    progress: &dyn Progress,
) -> Result<Option<Prediction>, Failure> {
    let mut watched = Watched { prediction: empty(model, input, &model.outputs)?, progress };
    replay_into(model, input, &model.outputs, &mut watched)?;
    Ok((!progress.interrupted()).then_some(watched.prediction))
}

/// A prediction without samples.
fn empty(model: &JointModel, input: &ReplayInput, outputs: &[Channel]) -> Result<Prediction, Failure> {
    let samples = input.t_s.len();
    let guided = if model.drive()? == Drive::GuidedMotor { samples } else { 0 };
    Ok(Prediction {
        channels: outputs.iter().map(|channel| (*channel, Vec::with_capacity(samples))).collect(),
        guide_nm: Vec::with_capacity(guided),
    })
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
    replay_passes_into(Passes::All, model, input, outputs, sink)
}

/// The same of some passes.
///
/// # Errors
/// When the model cannot be driven.
pub fn replay_passes_into(
    passes: Passes,
    model: &JointModel,
    input: &ReplayInput,
    outputs: &[Channel],
    sink: &mut impl Sink,
) -> Result<(), Failure> {
    let config = model.plant()?;
    let drive = model.drive()?;
    let run = Run { model, config: &config, input, drive, pace: Pace::whole(model, input, &config) };
    if drive != Drive::GuidedMotor {
        run.execute(Guide::NONE, outputs, sink);
        return Ok(());
    }
    if model.guided_by.is_some() {
        run.execute(input.hold.only_pass(model), outputs, sink);
        return Ok(());
    }
    if passes == Passes::First {
        run.execute(input.hold.first_pass(model), outputs, sink);
        return Ok(());
    }
    let rough = Run { pace: Pace::rough(model, input, &config), ..run };
    if passes == Passes::Rough {
        rough.execute(input.hold.first_pass(model), outputs, sink);
        return Ok(());
    }
    let ahead_nm = rough.ahead_nm(sink);
    if sink.is_stopped() {
        return Ok(());
    }
    run.execute(input.hold.second_pass(model, &ahead_nm), outputs, sink);
    Ok(())
}

impl Run<'_> {
    /// Torque that a second pass applies ahead, at each sample, N·m: what guides the motor in this pass, without what is fast. It ends early where
    /// `sink` is stopped.
    fn ahead_nm(&self, sink: &mut impl Sink) -> Vec<f64> {
        let prediction =
            Prediction { channels: Vec::new(), guide_nm: Vec::with_capacity(self.input.t_s.len()) };
        let mut first = StoppedBy { prediction, sink };
        self.execute(self.input.hold.first_pass(self.model), &[], &mut first);
        let half = (FILTER_S / self.input.step_s).round() as usize;
        moving_average(moving_average(first.prediction.guide_nm, half), half)
    }
}

#[cfg(test)]
mod tests {
    use bowden_model::effect::{ActiveEffect, Component, Target};
    use bowden_model::effects::CATALOGUE;

    use super::*;
    use crate::joint_model::PRETENSION;
    use crate::recording::Recording;
    use crate::rig::RigParameter;
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

    /// A channel that reached the end of its scale in the recording shows no more than that, with an offset as well; one that did not shows what
    /// there is.
    #[test]
    fn a_tension_beyond_its_scale_is_shown_as_the_end_of_it() {
        const END_N: f64 = 30.0 * (1.0 - 1.0 / 4096.0);
        let mut recording = test_bench::swung(1500);
        let mut model = JointModel::from_rig(&test_bench::rig(), &recording).unwrap();
        let within = replay(&model, &ReplayInput::new(&model, &recording).unwrap()).unwrap();
        let largest = |values: &[f64]| values.iter().copied().fold(f64::NEG_INFINITY, f64::max);
        let [f1, f2] = [Channel::F1, Channel::F2].map(|channel| within.channel(channel).unwrap());
        assert!(largest(f1) > 31.0 && largest(f2) > 31.0);

        model.parameters.sensors.tension_full_scale_n = 30.0;
        let expected: Vec<f64> = f1.iter().map(|n| n.min(END_N)).collect();
        recording.set(Channel::F1, expected.clone());
        let input = ReplayInput::new(&model, &recording).unwrap();
        let ended = replay(&model, &input).unwrap();
        assert_eq!(ended.channel(Channel::F1).unwrap(), expected);
        assert_eq!(ended.channel(Channel::F2).unwrap(), f2);

        let offset = bowden_model::effects::find("sensor_offset").unwrap();
        let mut offset = ActiveEffect::with_defaults(offset).with("offset", 2.0);
        offset.target = Target::One(Channel::F1);
        let seen = ended.seen_through(Channel::F1, offset, &input).unwrap();
        assert!(
            largest(&seen) == END_N && seen.iter().zip(f1).all(|(seen, n)| (n + 2.0).min(END_N) == *seen)
        );
    }

    /// A joint a hundredth as strong answers the same motion with a hundredth of every tension and torque, guide included.
    #[test]
    fn a_weaker_joint_is_guided_as_the_strong_one_is() {
        const SHARE: f64 = 0.01;
        let (strong, recording) = guided(3000);
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

    /// Where no tension is recorded, a joint half as strong is guided by what the strong one is, as it is told; otherwise by about half of it. Both
    /// are replayed with the input of the strong one, as in a fit.
    #[test]
    fn without_tensions_the_guide_is_told_in_proportion_to_the_motor() {
        const SHARE: f64 = 0.5;
        let (mut strong, recording) = guided(3000);
        let mut on_weak = recording.clone();
        on_weak.set(Channel::BusVoltage, vec![24.0 * SHARE; 3000]);
        let rms = |values: &[f64]| (values.iter().map(|x| x * x).sum::<f64>() / 3000.0).sqrt();
        let mut apart = |untold: Option<RigParameter>| {
            strong.own.untold = Vec::from_iter(untold);
            let weak = test_bench::smaller(strong.clone(), SHARE);
            let guide_nm = |model: &JointModel, recording: &Recording| {
                replay(model, &ReplayInput::new(&strong, recording).unwrap()).unwrap().guide_nm
            };
            let [of_strong, of_weak] = [guide_nm(&strong, &recording), guide_nm(&weak, &on_weak)];
            let apart: Vec<f64> =
                of_strong.iter().zip(&of_weak).map(|(strong, weak)| strong - weak).collect();
            rms(&apart) / rms(&of_strong)
        };
        let [unseen, seen] = [apart(RigParameter::parse(PRETENSION).ok()), apart(None)];
        assert!(unseen < 1e-6, "{unseen} of the guide");
        assert!((0.4..0.6).contains(&seen), "{seen} of the guide");
    }

    /// A motor with recorded duty, whose pulley swings.
    fn guided(samples: u32) -> (JointModel, Recording) {
        let mut recording = test_bench::swung(samples);
        let wave = |k: u32| 0.12 * (4e-3 * f64::from(k)).cos() + 0.05;
        recording.set(Channel::Duty, (0..samples).map(wave).collect());
        recording.set(Channel::BusVoltage, vec![24.0; samples as usize]);
        let model = JointModel::from_rig(&test_bench::rig(), &recording).unwrap();
        assert_eq!(model.drive().unwrap(), Drive::GuidedMotor);
        (model, recording)
    }

    /// Of a guided joint, what a change of the sheath's friction changes in the first pass, compared with what it changes in both: the size of
    /// the part that is along it, and the share that is beside it.
    #[test]
    fn a_first_pass_shows_what_a_change_of_the_joint_changes() {
        let (model, recording) = guided(4000);
        let input = ReplayInput::new(&model, &recording).unwrap();
        let shown = |passes: Passes, model: &JointModel| {
            let mut prediction = empty(model, &input, &model.outputs).unwrap();
            replay_passes_into(passes, model, &input, &model.outputs, &mut prediction).unwrap();
            prediction
        };
        let change = |passes: Passes, changed: &JointModel, channel: Channel| -> Vec<f64> {
            let [before, after] = [&model, changed].map(|model| shown(passes, model));
            let pairs = before.channel(channel).unwrap().iter().zip(after.channel(channel).unwrap());
            let differences: Vec<f64> = pairs.map(|(before, after)| after - before).collect();
            differences.chunks(50).skip(6).map(|block| block.iter().sum::<f64>() / 50.0).collect()
        };
        let mut changed = model.clone();
        changed.parameters.sheath.as_mut().unwrap().friction_coefficient *= 1.1;
        let dot = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| a * b).sum::<f64>();
        for channel in [Channel::F2, Channel::ThetaOut] {
            let [first, both] = [Passes::First, Passes::All].map(|passes| change(passes, &changed, channel));
            let along = dot(&first, &both) / dot(&both, &both);
            let beside = (1.0 - along * dot(&first, &both) / dot(&first, &first)).sqrt();
            assert!((0.9..1.5).contains(&along) && beside < 0.2, "{}: {along}, {beside}", channel.role());
        }
    }

    /// A first pass of half as many steps finds the torque that one of every sample finds: the duty swings at 0.64 Hz, with a ripple of 333 Hz of
    /// which every other sample alone would show a torque that is not there. One sample is left over at the end.
    #[test]
    fn a_rough_first_pass_finds_the_torque_that_a_whole_one_finds() {
        let samples = 4002;
        let (model, mut recording) = guided(samples);
        let model = JointModel { elements: 4, step_s: 1e-3, guide_stride: 2, ..model };
        let rippled = recording.channel(Channel::Duty).unwrap().iter().enumerate();
        let rippled = rippled.map(|(k, duty)| duty + if k % 2 == 0 { 0.05 } else { -0.05 }).collect();
        recording.set(Channel::Duty, rippled);
        let input = ReplayInput::new(&model, &recording).unwrap();
        let config = model.plant().unwrap();
        let [whole, rough] = [Pace::whole(&model, &input, &config), Pace::rough(&model, &input, &config)]
            .map(|pace| {
                let run =
                    Run { model: &model, config: &config, input: &input, drive: Drive::GuidedMotor, pace };
                run.ahead_nm(&mut Prediction::default())
            });
        assert_eq!((whole.len(), rough.len()), (samples as usize, samples as usize));
        assert!(whole != rough, "the rough pass is no other");
        let rms = |values: &mut dyn Iterator<Item = f64>| {
            (values.map(|value| value * value).sum::<f64>() / f64::from(samples)).sqrt()
        };
        let torque_nm = rms(&mut whole.iter().copied());
        let apart_nm = rms(&mut whole.iter().zip(&rough).map(|(whole, rough)| whole - rough));
        assert!(apart_nm < 0.01 * torque_nm, "{apart_nm} of {torque_nm} N·m");
    }

    /// How late a guided angle is does not follow from the step: held against the end of its step it would run ahead by a step.
    #[test]
    fn a_guided_angle_does_not_run_ahead_by_a_step() {
        let mut recording = test_bench::swung(3000);
        recording.set(Channel::Duty, vec![0.0; 3000]);
        recording.set(Channel::BusVoltage, vec![24.0; 3000]);
        let model = JointModel::from_rig(&test_bench::rig(), &recording).unwrap();
        assert_eq!(model.drive().unwrap(), Drive::GuidedMotor);
        // Slope of the angle by which it is late over the speed, s.
        let late_s = |step_s: f64| -> f64 {
            let model = JointModel { step_s, ..model.clone() };
            let input = ReplayInput::new(&model, &recording).unwrap();
            let turned = replay_of(&model, &input, &[Channel::ThetaIn]).unwrap();
            let motion = input.motion().unwrap();
            let angles = motion.theta_rad.iter().zip(turned.channel(Channel::ThetaIn).unwrap());
            let (mut along, mut power) = (0.0, 0.0);
            for ((recorded, simulated), speed) in angles.zip(&motion.omega_rad_s).skip(500) {
                along += (recorded - simulated) * speed;
                power += speed * speed;
            }
            along / power
        };
        let (coarse_s, fine_s) = (5e-4, 1e-4);
        let later_s = late_s(coarse_s) - late_s(fine_s);
        assert!(
            later_s.abs() < 0.2 * (coarse_s - fine_s),
            "{later_s} s between steps of {coarse_s} and {fine_s} s"
        );
    }
}
