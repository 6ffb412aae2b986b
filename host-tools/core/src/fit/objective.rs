//! What a fit makes small: differences between recordings and replays, each in units of what it may be.
//!
//! Every output channel is compared in two ways, because stick-slip and impacts are chaotic: their strength can be
//! predicted, their phase cannot. *Means*: the difference of the means over blocks of 50 ms, one period of the arm on its
//! tendons. *Flutter*: over half a second, the root mean square of what the block means leave, measured against simulated,
//! where the simulated one has the sensor's noise added.
//!
//! Both are divided by the channel's scale: sensor noise, a twelfth of a count squared, and 1.5 % of the channel's spread,
//! which no model of a real bench undercuts. The torque that had to guide the motor counts as one more channel whose
//! measured value is zero. A residual beyond three scales enters with its root only (soft L1), so that a few violent
//! moments do not decide.
//!
//! Tendons of the nominal model may push, amplifiers read from zero: where a recording lies on that zero and never below,
//! predictions are cut there as well.

mod blockwise;
mod dataset;

use std::sync::Arc;

use bowden_model::channel::Channel;
use bowden_model::drive::pulley_stall_torque_nm;
use bowden_model::effect::ActiveEffect;

use crate::fit::observed::{Observed, Use};
use crate::joint_model::JointModel;
use crate::outcome::Failure;
use crate::reconstruct::quantum_of;
use crate::recording::Recording;
use crate::simulation::{Prediction, ReplayInput, replay_into};
use blockwise::{Blockwise, Moments, moments, moments_of};
pub use dataset::Block;
use dataset::Dataset;

/// Share of a channel's standard deviation that counts as agreement.
const MODEL_FLOOR: f64 = 0.015;

/// Same for angles, which a transmission of a few N·m/mrad reproduces far better than its tensions.
const ANGLE_FLOOR: f64 = 0.002;

/// Residual at which the soft L1 loss bends, in scales.
const LOSS_BEND: f64 = 3.0;

/// What the residual of one series measures.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum Series {
    /// A recorded output.
    Channel(Channel),
    /// The torque that guided the motor, N·m.
    Guide,
}

impl Series {
    /// Name in reports.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::Channel(channel) => channel.role(),
            Self::Guide => "motor_torque_nm",
        }
    }

    /// What a simulation says of it.
    #[must_use]
    pub fn of(self, prediction: &Prediction) -> Option<&[f64]> {
        match self {
            Self::Channel(channel) => prediction.channel(channel),
            Self::Guide => Some(&prediction.guide_nm),
        }
    }
}

/// Which part of the data a sum covers.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Part {
    /// What parameters are fitted to.
    Training,
    /// What they have not seen.
    HeldOut,
}

/// What one residual compares.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Aspect {
    /// Means over a block.
    Mean,
    /// Root mean square of what the means of several blocks leave.
    Flutter,
}

/// Where one residual comes from.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Entry {
    /// Series that is compared.
    pub series: Series,
    /// Number of the recording.
    pub recording: usize,
    /// Samples and use.
    pub block: Block,
    /// What is compared.
    pub aspect: Aspect,
}

/// Recordings, prepared for comparison.
#[derive(Clone, Debug)]
pub struct Objective {
    datasets: Vec<Arc<Dataset>>,
    scales: Vec<(Series, f64)>,
    noise_variances: Vec<(Series, f64)>,
}

/// Residuals of every series and block, in scales.
#[derive(Clone, Debug, PartialEq)]
pub struct Residuals {
    /// In the order of [`Objective::entries`].
    pub values: Vec<f64>,
}

impl Residuals {
    /// Whether every value is a number.
    #[must_use]
    pub fn is_finite(&self) -> bool {
        self.values.iter().all(|value| value.is_finite())
    }
}

impl Objective {
    /// Prepares recordings, which are taken to follow one another in the order given, held-out ones last: an effect with an
    /// onset stays. With `split`, stretches of every recording are held out in turn; without it the recordings
    /// in `heldout` are, and all of `training` is fitted.
    ///
    /// # Errors
    /// When an input is missing, or nothing can be compared.
    pub fn new(
        model: &JointModel,
        training: &[Recording],
        heldout: &[Recording],
        split: bool,
    ) -> Result<Self, Failure> {
        let part = if split { Use::Both } else { Use::Training };
        let training = training.iter().map(|recording| Observed::alone(recording, part));
        let heldout = heldout.iter().map(|recording| Observed::alone(recording, Use::HeldOut));
        Self::of(model, training.chain(heldout).collect())
    }

    /// Prepares recordings of which each may differ from the joint that all share; those that are held out come last. The
    /// recordings of a bench are taken to follow one another.
    ///
    /// # Errors
    /// When an input is missing, or nothing can be compared.
    pub fn of(model: &JointModel, observed: Vec<Observed>) -> Result<Self, Failure> {
        let mut datasets: Vec<Dataset> = Vec::new();
        let mut clocks_s: Vec<f64> = Vec::new();
        for Observed { recording, used_for, bench, variation } in observed {
            let (part, split) = match used_for {
                Use::Training => (Part::Training, false),
                Use::Both => (Part::Training, true),
                Use::HeldOut => (Part::HeldOut, false),
            };
            let mut dataset = Dataset::new(model, recording, variation, part, split)?;
            clocks_s.resize(clocks_s.len().max(bench + 1), 0.0);
            dataset.input.continues_after(clocks_s[bench]);
            clocks_s[bench] += recording.duration_s();
            datasets.push(dataset);
        }
        let mut series: Vec<Series> =
            datasets.iter().flat_map(|d| d.measured.iter().map(|(s, _)| *s)).collect();
        series.sort_unstable();
        series.dedup();
        if series.is_empty() {
            let names: Vec<&str> = model.outputs.iter().map(|c| c.role()).collect();
            return Err(Failure::bad_input(format!(
                "the recordings hold none of the outputs that the rig predicts ({}); map a column to one of them",
                names.join(", ")
            )));
        }
        let noise_variances: Vec<_> =
            series.iter().map(|s| (*s, noise_variance(model, *s, &datasets))).collect();
        let scales = noise_variances
            .iter()
            .map(|(series, noise)| (*series, scale_of(model, *series, *noise, &datasets)))
            .collect();
        let datasets = datasets.into_iter().map(Arc::new).collect();
        Ok(Self { datasets, scales, noise_variances })
    }

    /// The recordings of which anything is fitted to, and those that only judge. The residuals of all are those of the
    /// first followed by those of the others.
    #[must_use]
    pub fn split(&self) -> [Self; 2] {
        let fitted = |dataset: &Dataset| dataset.blocks.iter().any(|block| block.part == Part::Training);
        let count = self.datasets.iter().take_while(|dataset| fitted(dataset)).count();
        let (fitted, judging) = self.datasets.split_at(count);
        [fitted, judging].map(|datasets| Self { datasets: datasets.to_vec(), ..self.clone() })
    }

    /// The same recordings, compared in the scales of others where these have the series.
    #[must_use]
    pub fn in_scales(mut self, scales: &[(Series, f64)]) -> Self {
        for (series, scale) in &mut self.scales {
            if let Some((_, other)) = scales.iter().find(|(other, _)| other == series) {
                *scale = *other;
            }
        }
        self
    }

    /// The same recordings with every sample used for fitting.
    #[must_use]
    pub fn all_training(&self) -> Self {
        let mut all = self.clone();
        for block in all.datasets.iter_mut().flat_map(|dataset| &mut Arc::make_mut(dataset).blocks) {
            block.part = Part::Training;
        }
        all
    }

    /// All series with their scales, in the unit of the series.
    #[must_use]
    pub fn scales(&self) -> &[(Series, f64)] {
        &self.scales
    }

    /// Number of recordings.
    #[must_use]
    pub fn recordings(&self) -> usize {
        self.datasets.len()
    }

    /// Blocks of one recording.
    #[must_use]
    pub fn blocks(&self, recording: usize) -> &[Block] {
        &self.datasets[recording].blocks
    }

    /// Inputs of one recording.
    #[must_use]
    pub fn input(&self, recording: usize) -> &ReplayInput {
        &self.datasets[recording].input
    }

    /// Measured values of a series in one recording.
    #[must_use]
    pub fn measured(&self, recording: usize, series: Series) -> Option<&[f64]> {
        self.datasets[recording].measured.iter().find(|(s, _)| *s == series).map(|(_, v)| v.as_slice())
    }

    /// Time that all recordings with training data take together, s: the clock of effects with an onset.
    #[must_use]
    pub fn duration_s(&self) -> f64 {
        self.datasets
            .iter()
            .filter(|d| d.blocks.iter().any(|block| block.part == Part::Training))
            .map(|d| d.input.t_s().last().unwrap_or(&0.0) - d.input.t_s()[0])
            .sum()
    }

    /// Whether something was set differently in a recording that is fitted to.
    #[must_use]
    pub fn states_conditions(&self) -> bool {
        let [fitted, _] = self.split();
        fitted.datasets.iter().any(|dataset| dataset.states_conditions())
    }

    /// The recordings that are fitted to and run through `time_s` of their bench's clock.
    #[must_use]
    pub fn running_at(&self, time_s: f64) -> Self {
        let [fitted, _] = self.split();
        let datasets =
            fitted.datasets.iter().filter(|dataset| dataset.runs_through(time_s)).cloned().collect();
        Self { datasets, ..fitted }
    }

    /// Origin of every entry of [`Residuals::values`].
    pub fn entries(&self) -> impl Iterator<Item = Entry> + '_ {
        self.datasets.iter().enumerate().flat_map(|(recording, dataset)| {
            dataset.measured.iter().flat_map(move |(series, _)| {
                let entry = move |block, aspect| Entry { series: *series, recording, block, aspect };
                let means = dataset.blocks.iter().map(move |block| entry(*block, Aspect::Mean));
                let flutter = dataset.flutter.iter().map(move |group| {
                    let (first, last) = (dataset.blocks[group.start], dataset.blocks[group.end - 1]);
                    entry(Block { start: first.start, end: last.end, part: first.part }, Aspect::Flutter)
                });
                means.chain(flutter)
            })
        })
    }

    /// Replays every recording with `model`: what was measured, and the current of the motor.
    ///
    /// # Errors
    /// When the model cannot be driven.
    pub fn predict(&self, model: &JointModel) -> Result<Vec<Prediction>, Failure> {
        self.datasets.iter().map(|dataset| dataset.replay(model)).collect()
    }

    /// The same of the first recording alone.
    ///
    /// # Errors
    /// When the model cannot be driven.
    pub fn predict_first(&self, model: &JointModel) -> Result<Prediction, Failure> {
        self.datasets.first().map_or_else(|| Ok(Prediction::default()), |dataset| dataset.replay(model))
    }

    /// Residuals of `model`.
    ///
    /// # Errors
    /// When the model cannot be driven.
    pub fn residuals(&self, model: &JointModel) -> Result<Residuals, Failure> {
        let mut values = Vec::new();
        for dataset in &self.datasets {
            let mut seen = Blockwise::new(dataset);
            replay_into(&dataset.joint(model), &dataset.input, &dataset.outputs, &mut seen)?;
            self.append(dataset, &seen.simulated, &mut values);
        }
        Ok(Residuals { values })
    }

    /// Residuals where `predictions` are seen with one more effect on sensors whose channels drive nothing.
    ///
    /// # Errors
    /// When the effect cannot be applied.
    pub fn residuals_seen_through(
        &self,
        predictions: &[Prediction],
        effect: ActiveEffect,
    ) -> Result<Residuals, Failure> {
        let mut values = Vec::new();
        for (dataset, prediction) in self.datasets.iter().zip(predictions) {
            let seen = |(series, _): &(Series, _)| match series {
                Series::Channel(channel) if effect.target.includes(*channel) => {
                    let mut seen = prediction.seen_through(*channel, effect, &dataset.input)?;
                    dataset.cut(*channel, &mut seen);
                    Ok(moments_of(&seen, &dataset.blocks))
                }
                _ => Ok(dataset.moments_in(prediction, *series)),
            };
            let simulated: Result<Vec<_>, Failure> = dataset.measured.iter().map(seen).collect();
            self.append(dataset, &simulated?, &mut values);
        }
        Ok(Residuals { values })
    }

    /// Residuals of given predictions.
    #[must_use]
    pub fn compare(&self, predictions: &[Prediction]) -> Residuals {
        let mut values = Vec::new();
        for (dataset, prediction) in self.datasets.iter().zip(predictions) {
            let series = dataset.measured.iter().map(|(series, _)| *series);
            let simulated: Vec<_> = series.map(|series| dataset.moments_in(prediction, series)).collect();
            self.append(dataset, &simulated, &mut values);
        }
        Residuals { values }
    }

    /// Residuals of one recording, in scales; `simulated` has what was simulated of every series, block by block.
    fn append(&self, dataset: &Dataset, simulated: &[Vec<Moments>], values: &mut Vec<f64>) {
        for (((series, _), real), simulated) in dataset.measured.iter().zip(&dataset.moments).zip(simulated) {
            let scale = self.scale(*series);
            let noise_variance = self.noise_variance(*series);
            let offset = Self::offset(*series, dataset, real, simulated);
            let pairs = || real.iter().zip(simulated);
            values.extend(pairs().map(|(real, simulated)| (real.mean - simulated.mean - offset) / scale));
            for group in &dataset.flutter {
                let blocks = (group.end - group.start) as f64;
                let [real, simulated] = pairs()
                    .skip(group.start)
                    .take(group.end - group.start)
                    .map(|(real, simulated)| [real.variance, simulated.variance + noise_variance])
                    .fold([0.0; 2], |sum, pair| [sum[0] + pair[0] / blocks, sum[1] + pair[1] / blocks])
                    .map(f64::sqrt);
                values.push((real - simulated) / scale);
            }
        }
    }

    /// Zero of a channel in one recording, where the rig says that it is arbitrary; else 0.
    fn offset(series: Series, dataset: &Dataset, real: &[Moments], simulated: &[Moments]) -> f64 {
        match series {
            Series::Channel(channel) if dataset.free_offsets.contains(&channel) => {
                let (mut sum, mut count) = (0.0, 0.0);
                for ((block, real), simulated) in dataset.blocks.iter().zip(real).zip(simulated) {
                    let samples = (block.end - block.start) as f64;
                    sum += samples * (real.mean - simulated.mean);
                    count += samples;
                }
                sum / f64::max(count, 1.0)
            }
            _ => 0.0,
        }
    }

    /// Scale of a series, in its unit.
    #[must_use]
    pub fn scale(&self, series: Series) -> f64 {
        self.scales.iter().find(|(s, _)| *s == series).map_or(1.0, |(_, scale)| *scale)
    }

    /// Variance that the sensor of a series adds, in its unit squared.
    #[must_use]
    pub fn noise_variance(&self, series: Series) -> f64 {
        self.noise_variances.iter().find(|(s, _)| *s == series).map_or(0.0, |(_, variance)| *variance)
    }

    /// Mean loss over a part of the data; 1 where every residual is one scale.
    #[must_use]
    pub fn mean_loss(&self, residuals: &Residuals, part: Part) -> f64 {
        let (mut sum, mut count) = (0.0, 0.0);
        for (entry, value) in self.entries().zip(&residuals.values) {
            if entry.block.part == part {
                sum += loss(*value);
                count += 1.0;
            }
        }
        sum / f64::max(count, 1.0)
    }

    /// Root mean square difference of a series over a part of the data, sample by sample, in its unit.
    #[must_use]
    pub fn rmse(&self, predictions: &[Prediction], series: Series, part: Part) -> f64 {
        let (mut sum, mut count) = (0.0, 0.0);
        for (dataset, prediction) in self.datasets.iter().zip(predictions) {
            let Some(place) = dataset.measured.iter().position(|(s, _)| *s == series) else { continue };
            let measured = &dataset.measured[place].1;
            let predicted = series.of(prediction).unwrap_or(&[]);
            let simulated = moments_of(predicted, &dataset.blocks);
            let offset = Self::offset(series, dataset, &dataset.moments[place], &simulated);
            for block in dataset.blocks.iter().filter(|block| block.part == part) {
                for k in block.start..block.end {
                    sum += (measured[k] - predicted[k] - offset).powi(2);
                    count += 1.0;
                }
            }
        }
        f64::sqrt(sum / f64::max(count, 1.0))
    }
}

/// Loss of a residual: `r²` up to the bend, growing with `|r|` beyond.
#[must_use]
pub fn loss(residual: f64) -> f64 {
    soft(residual).powi(2)
}

/// The number whose square is the soft L1 loss of `residual`.
#[must_use]
pub fn soft(residual: f64) -> f64 {
    let z = residual / LOSS_BEND;
    LOSS_BEND * (2.0 * ((1.0 + z * z).sqrt() - 1.0)).sqrt().copysign(residual)
}

fn recorded(datasets: &[Dataset], series: Series) -> impl Iterator<Item = &[f64]> {
    datasets
        .iter()
        .flat_map(move |d| d.measured.iter().filter(move |(s, _)| *s == series).map(|(_, v)| v.as_slice()))
}

/// White noise of the sensor, and a twelfth of its step squared.
fn noise_variance(model: &JointModel, series: Series, datasets: &[Dataset]) -> f64 {
    let Series::Channel(channel) = series else { return 0.0 };
    let sensors = &model.parameters.sensors;
    let noise = match channel {
        Channel::F1 | Channel::F2 | Channel::F3 | Channel::F4 => sensors.tension_noise_n,
        Channel::MotorCurrent => sensors.current_noise_a,
        _ => 0.0,
    };
    let quantum = recorded(datasets, series).filter_map(quantum_of).fold(0.0, f64::max);
    noise * noise + quantum * quantum / 12.0
}

fn scale_of(model: &JointModel, series: Series, noise_variance: f64, datasets: &[Dataset]) -> f64 {
    match series {
        Series::Guide => {
            // Of the stall torque of the motor: what a gear loses unnoticed.
            const SHARE: f64 = 0.0015;
            SHARE * model.parameters.motor.map_or(1.0, |motor| pulley_stall_torque_nm(&motor))
        }
        Series::Channel(channel) => {
            let floor = match channel {
                Channel::ThetaIn | Channel::ThetaOut | Channel::ThetaMotor => ANGLE_FLOOR,
                _ => MODEL_FLOOR,
            };
            let spread = recorded(datasets, series).map(|v| moments(v).variance).fold(0.0, f64::max);
            (noise_variance + floor * floor * spread).sqrt().max(f64::MIN_POSITIVE)
        }
    }
}

#[cfg(test)]
mod tests {
    use bowden_model::effect::Target;
    use bowden_model::effects::find;

    use super::*;
    use crate::simulation::replay;
    use crate::test_bench;

    /// What a fit compares block by block is what stands in whole predictions, bit for bit: amplifiers that stop at zero, an angle
    /// whose zero is free, and the torque that guides a motor among it.
    #[test]
    fn a_replay_compared_as_it_runs_is_compared_as_a_whole() {
        let samples = 2345;
        let mut recording = test_bench::swung(samples);
        let wave = |k: u32| 0.12 * (4e-3 * f64::from(k)).cos() + 0.05;
        recording.set(Channel::Duty, (0..samples).map(wave).collect());
        recording.set(Channel::BusVoltage, vec![24.0; samples as usize]);
        let mut model = JointModel::from_rig(&test_bench::rig(), &recording).unwrap();
        model.free_offsets = vec![Channel::ThetaOut];
        let objective = Objective::new(&model, &[recording.clone(), recording], &[], true).unwrap();
        assert!(objective.datasets[0].cut_at_zero.contains(&Channel::F1));
        assert!(objective.scales().iter().any(|(series, _)| *series == Series::Guide));
        let as_it_runs = objective.residuals(&model).unwrap();
        assert_eq!(as_it_runs, objective.compare(&objective.predict(&model).unwrap()));
        assert_eq!(as_it_runs.values.len(), objective.entries().count());
        assert!(as_it_runs.values.iter().any(|value| value.abs() > 1.0));
    }

    /// What was not measured is not compared, but a winding heats whether its current was recorded or not.
    #[test]
    fn of_what_was_not_measured_the_current_alone_is_predicted() {
        let mut recording = test_bench::swung(2000);
        recording.set(Channel::Duty, vec![0.1; 2000]);
        recording.set(Channel::BusVoltage, vec![24.0; 2000]);
        let model = JointModel::from_rig(&test_bench::rig(), &recording).unwrap();
        let unmeasured = [Channel::MotorCurrent, Channel::ThetaMotor];
        assert!(unmeasured.iter().all(|channel| model.outputs.contains(channel)));
        let objective = Objective::new(&model, &[recording], &[], true).unwrap();
        let predictions = objective.predict(&model).unwrap();
        let is_predicted = |channel| predictions[0].channel(channel).is_some();
        assert_eq!(unmeasured.map(is_predicted), [true, false]);
    }

    /// Where the zero of an angle is free, another zero changes nothing, and where it is not, everything.
    #[test]
    fn a_free_zero_makes_no_difference() {
        let with_zero_at = |zero_rad: f64| {
            let theta_out_rad = |k: u32| 0.35 * (4e-3 * f64::from(k)).sin() + zero_rad;
            test_bench::swung(2345).with(Channel::ThetaOut, (0..2345).map(theta_out_rad).collect())
        };
        let (recording, shifted) = (with_zero_at(0.0), with_zero_at(0.1));
        let mut model = JointModel::from_rig(&test_bench::rig(), &recording).unwrap();
        let mut seen = |free_offsets: &[Channel], recording: &Recording| {
            model.free_offsets = free_offsets.to_vec();
            let objective = Objective::new(&model, std::slice::from_ref(recording), &[], true).unwrap();
            let predictions = objective.predict(&model).unwrap();
            let rmse = objective.rmse(&predictions, Series::Channel(Channel::ThetaOut), Part::HeldOut);
            (rmse, objective.residuals(&model).unwrap().values)
        };
        let change = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
        let [(rmse, plain), (rmse_shifted, other)] =
            [&recording, &shifted].map(|recording| seen(&[Channel::ThetaOut], recording));
        assert!((rmse - rmse_shifted).abs() < 1e-9 && change(&plain, &other) < 1e-6);
        let (stated, all) = seen(&[], &recording);
        let (stated_shifted, all_shifted) = seen(&[], &shifted);
        assert!((stated_shifted - stated).abs() > 0.01 && change(&all, &all_shifted) > 1.0);
    }

    /// A nominal tendon pushes where the real one hangs slack and its amplifier reads zero. Only where it does is the
    /// prediction cut.
    #[test]
    fn a_tension_that_stood_at_zero_is_predicted_at_zero() {
        let mut recording = test_bench::swung(2000);
        for (channel, rest) in Channel::TENSIONS.into_iter().zip([0.0, 2.0, 0.0, -0.1]) {
            let values = (0..2000).map(|k| if k % 2 == 0 { 0.0 } else { rest });
            let touched = values
                .enumerate()
                .map(|(k, value)| if channel == Channel::F2 && k > 30 { 1.0 } else { value });
            recording.set(channel, touched.collect());
        }
        let mut model = JointModel::from_rig(&test_bench::rig(), &recording).unwrap();
        model.parameters.tendon.as_mut().unwrap().pretension_n = 2.0;
        let objective = Objective::new(&model, &[recording], &[], true).unwrap();
        let predictions = objective.predict(&model).unwrap();
        let lowest = |channel: Channel| {
            predictions[0].channel(channel).unwrap().iter().copied().fold(f64::INFINITY, f64::min)
        };
        let plain = replay(&model, &objective.datasets[0].input).unwrap();
        for channel in Channel::TENSIONS {
            assert!(plain.channel(channel).unwrap().iter().any(|tension| *tension < -1.0), "{channel:?}");
        }
        assert_eq!([Channel::F1, Channel::F3].map(lowest), [0.0, 0.0]);
        // Hardly ever on zero, and below it.
        assert!([Channel::F2, Channel::F4].map(lowest).iter().all(|tension| *tension < -1.0));
        // A sensor that is found to read too little ends at the same zero.
        let mut offset = ActiveEffect::with_defaults(find("sensor_offset").unwrap()).with("offset", -1.0);
        offset.target = Target::One(Channel::F1);
        let seen = objective.residuals_seen_through(&predictions, offset).unwrap();
        model.effects.push(offset);
        assert_eq!(seen.values, objective.residuals(&model).unwrap().values);
    }
}
