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

mod block;
mod blockwise;
mod dataset;
mod memory;
mod scale;

use std::collections::BTreeMap;
use std::sync::Arc;

use bowden_model::channel::Channel;
use bowden_model::effect::ActiveEffect;

use crate::fit::observed::{Observed, Use};
use crate::joint_model::JointModel;
use crate::outcome::Failure;
use crate::recording::Recording;
use crate::simulation::{Passes, Prediction, ReplayInput};
pub use block::Block;
use block::{Moments, moments_of};
use dataset::Dataset;
pub use scale::{loss, soft};
use scale::{noise_variance, scale_of};

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
    /// What parameters are fitted to, and physics is chosen on.
    Training,
    /// What neither has seen.
    HeldOut,
    /// What is held out of something else.
    Unused,
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

/// Sum and number of losses of every stretch of every recording.
pub type StretchLosses = BTreeMap<(usize, usize), [f64; 2]>;

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
            dataset.bench = bench as u16;
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
        let count = self.datasets.iter().take_while(|dataset| dataset.is_fitted()).count();
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

    /// The same recordings in free runs, where `model` is guided by a channel that is compared; `None` where nothing guides it but what its
    /// inputs name.
    #[must_use]
    pub fn freely(&self, model: &JointModel) -> Option<Self> {
        model.guided_by?;
        let is_guide = |series: Series| series == Series::Guide;
        let mut free = self.clone();
        free.datasets = self.datasets.iter().map(|dataset| Arc::new(dataset.freely())).collect();
        free.scales.retain(|(series, _)| !is_guide(*series));
        free.noise_variances.retain(|(series, _)| !is_guide(*series));
        Some(free)
    }

    /// The same recordings, of those that are fitted to some held out as a whole; these come last.
    #[must_use]
    pub fn holding_out(&self, is_held_out: impl Fn(usize) -> bool) -> Self {
        let (mut fitted, mut judging) = (Vec::new(), Vec::new());
        for (recording, dataset) in self.datasets.iter().enumerate() {
            let judges = is_held_out(recording);
            let mut dataset = Dataset::clone(dataset);
            for block in &mut dataset.blocks {
                block.part = match block.part {
                    Part::Training if judges => Part::HeldOut,
                    Part::Training => Part::Training,
                    // What was held out before judges something else.
                    Part::HeldOut | Part::Unused => Part::Unused,
                };
            }
            if judges { &mut judging } else { &mut fitted }.push(Arc::new(dataset));
        }
        fitted.append(&mut judging);
        Self { datasets: fitted, ..self.clone() }
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

    /// Bench of one recording.
    #[must_use]
    pub fn bench(&self, recording: usize) -> u16 {
        self.datasets[recording].bench
    }

    /// Benches of the recordings that are fitted to, in ascending order.
    #[must_use]
    pub fn benches(&self) -> Vec<u16> {
        let fitted = self.datasets.iter().filter(|dataset| dataset.is_fitted());
        let mut benches: Vec<u16> = fitted.map(|dataset| dataset.bench).collect();
        benches.sort_unstable();
        benches.dedup();
        benches
    }

    /// The recordings of one bench, or all of them.
    #[must_use]
    pub fn on(&self, bench: Option<u16>) -> Self {
        let mut some = self.clone();
        some.datasets.retain(|dataset| bench.is_none_or(|bench| dataset.bench == bench));
        some
    }

    /// Blocks of one recording.
    #[must_use]
    pub fn blocks(&self, recording: usize) -> &[Block] {
        &self.datasets[recording].blocks
    }

    /// What is not compared of recordings because it follows gaps in them, one line each.
    pub fn notes(&self) -> impl Iterator<Item = &str> {
        self.datasets.iter().filter_map(|dataset| dataset.note.as_deref())
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
            .filter(|dataset| dataset.is_fitted())
            .map(|d| d.input.t_s().last().unwrap_or(&0.0) - d.input.t_s()[0])
            .sum()
    }

    /// Time of the first sample of a bench, s, by the clock of its recording; of several benches together 0, because their clocks are not one.
    #[must_use]
    pub fn begins_at_s(&self, bench: Option<u16>) -> f64 {
        let is_of = |dataset: &&Arc<Dataset>| bench.is_none_or(|bench| dataset.bench == bench);
        let [first, others @ ..] = &self.datasets.iter().filter(is_of).collect::<Vec<_>>()[..] else {
            return 0.0;
        };
        let are_one = others.iter().all(|other| other.bench == first.bench);
        if are_one { first.input.t_s().first().copied().unwrap_or(0.0) } else { 0.0 }
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
                let flutter = dataset.flutter_of(*series).iter().map(move |group| {
                    let (first, last) = (dataset.blocks[group.start], dataset.blocks[group.end - 1]);
                    entry(Block { start: first.start, end: last.end, ..first }, Aspect::Flutter)
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

    /// Replaces the channels of `predictions`, those of `model`, by what a free run shows, where the joint was guided by a channel that is
    /// compared: what a user will simulate. The guiding torque stays.
    ///
    /// # Errors
    /// When the model cannot be driven.
    pub fn run_freely(&self, model: &JointModel, predictions: &mut [Prediction]) -> Result<(), Failure> {
        for (dataset, prediction) in self.datasets.iter().zip(predictions) {
            if let Some(mut free) = dataset.replay_freely(model)? {
                free.guide_nm = std::mem::take(&mut prediction.guide_nm);
                *prediction = free;
            }
        }
        Ok(())
    }

    /// The same as [`Self::predict`] of the first recording alone.
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
        self.residuals_in(Passes::All, model)
    }

    /// Residuals of what some passes of the replays show of `model`.
    ///
    /// # Errors
    /// When the model cannot be driven.
    pub fn residuals_in(&self, passes: Passes, model: &JointModel) -> Result<Residuals, Failure> {
        let mut values = Vec::new();
        for dataset in &self.datasets {
            self.append(dataset, &dataset.seen(model, passes)?, &mut values);
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
                Series::Channel(channel)
                    if effect.target.includes(*channel) && effect.is_on(dataset.bench) =>
                {
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
            for group in dataset.flutter_of(*series) {
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
                let part = if dataset.is_fitted() { Part::Training } else { Part::HeldOut };
                let all = dataset.blocks.iter().zip(real).zip(simulated);
                for ((block, real), simulated) in all.filter(|((block, _), _)| block.part == part) {
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
        self.mean_loss_on(None, residuals, part)
    }

    /// The same over the recordings of one bench, or all of them.
    #[must_use]
    pub fn mean_loss_on(&self, bench: Option<u16>, residuals: &Residuals, part: Part) -> f64 {
        let (mut sum, mut count) = (0.0, 0.0);
        for (entry, value) in self.entries().zip(&residuals.values) {
            if entry.block.part == part && bench.is_none_or(|bench| self.bench(entry.recording) == bench) {
                sum += loss(*value);
                count += 1.0;
            }
        }
        sum / f64::max(count, 1.0)
    }

    /// Loss of every stretch that is fitted to, by the number of its recording and its own in that: its sum, and over how many
    /// residuals.
    #[must_use]
    pub fn stretch_losses(&self, residuals: &Residuals) -> StretchLosses {
        let mut of = StretchLosses::new();
        for (entry, value) in self.entries().zip(&residuals.values) {
            if entry.block.part == Part::Training {
                let [sum, count] = of.entry((entry.recording, entry.block.stretch)).or_default();
                *sum += loss(*value);
                *count += 1.0;
            }
        }
        of
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

#[cfg(test)]
mod tests;
