//! One fit over recordings of several benches: physics that all share, mountings that each group has for itself.
//!
//! Every value is its start times `exp(x)`, with `x` the sum of a shared coordinate and, where the parameter belongs to
//! the mounting, one of the group. A group without training recordings keeps the shared value. Weak priors hold what
//! the recordings do not tell: they pull the shared coordinate to the start and a group to the others.

use std::path::Path;

use bowden_core::fit::free::Free;
use bowden_core::joint_model::JointModel;
use bowden_core::outcome::Failure;
use bowden_core::rig::Rig;
use bowden_core::simulation::{ReplayInput, replay};
use bowden_model::channel::Channel;
use levenberg_marquardt::{LeastSquaresProblem, LevenbergMarquardt};
use nalgebra::storage::Owned;
use nalgebra::{DMatrix, DVector, Dyn};
use rayon::prelude::*;

use super::{mean, root_mean_square};

/// Recorded values of one output and what a difference of one mark is.
#[derive(Clone, Debug)]
pub struct Compared {
    /// The output.
    pub channel: Channel,
    /// Recorded values, one a sample of the input.
    pub measured: Vec<f64>,
    /// Difference that counts as 1.
    pub scale: f64,
    /// First sample that is compared.
    pub from: usize,
    /// Whether the mean difference is removed.
    pub free_offset: bool,
}

/// One recording, prepared.
#[derive(Clone, Debug)]
pub struct Run {
    /// Name of the recording.
    pub name: String,
    /// Bench or mounting it belongs to.
    pub group: usize,
    /// Joint at the start of the fit.
    pub model: JointModel,
    /// What drives it.
    pub input: ReplayInput,
    /// What it is compared with.
    pub compared: Vec<Compared>,
}

impl Run {
    /// Recording `name` of `folder`, whole, with the joint as `rig` states it; `compared` are outputs and the difference
    /// of each that counts as 1.
    ///
    /// # Errors
    /// When the file is missing, cannot be used with the rig, or lacks an output.
    pub fn load(
        rig: &Rig,
        folder: &Path,
        name: String,
        group: usize,
        compared: &[(Channel, f64)],
    ) -> Result<Self, Failure> {
        let recording = rig.load_recording(&folder.join(format!("{name}.csv")))?;
        let model = JointModel::from_rig(rig, &recording)?;
        let input = ReplayInput::new(&model, &recording)?;
        let compare = |&(channel, scale): &(Channel, f64)| {
            let measured = recording.channel(channel).map(<[f64]>::to_vec).ok_or_else(|| {
                Failure::bad_input(format!(
                    "{}: no column for {}, which is compared; name the folder that holds the data sets",
                    recording.source(),
                    channel.role()
                ))
            })?;
            let free_offset = model.free_offsets.contains(&channel);
            Ok(Compared { channel, measured, scale, from: 0, free_offset })
        };
        let compared: Result<Vec<Compared>, Failure> = compared.iter().map(compare).collect();
        let compared = compared?;
        Ok(Self { name, group, model, input, compared })
    }

    /// The same with the joint at rest where the first compared output begins, for joints whose angle is no input.
    #[must_use]
    pub fn from_rest(mut self) -> Self {
        if let Some(first) = self.compared.first().and_then(|compared| compared.measured.first()) {
            self.input.start_at(*first, 0.0);
        }
        self
    }

    /// One sample in `every`, simulated in steps of `step_s`.
    #[must_use]
    pub fn thinned(&self, every: usize, step_s: f64) -> Self {
        let mut thin = self.clone();
        thin.input = self.input.thinned(every);
        thin.model.step_s = step_s;
        for compared in &mut thin.compared {
            compared.measured = compared.measured.iter().step_by(every).copied().collect();
            compared.from = compared.from.div_ceil(every);
        }
        thin
    }

    /// Differences simulated minus recorded of every compared output, in its unit.
    ///
    /// # Errors
    /// When the model cannot be driven.
    pub fn differences(&self, model: &JointModel) -> Result<Vec<Vec<f64>>, Failure> {
        let prediction = replay(model, &self.input)?;
        self.compared
            .iter()
            .map(|compared| {
                let predicted = prediction.channel(compared.channel).ok_or_else(|| {
                    Failure::failed(format!("{}: no prediction of {}", self.name, compared.channel.role()))
                })?;
                let pairs = predicted.iter().zip(&compared.measured).skip(compared.from);
                let mut differences: Vec<f64> =
                    pairs.map(|(predicted, measured)| predicted - measured).collect();
                if compared.free_offset {
                    let offset = mean(differences.iter().copied());
                    for difference in &mut differences {
                        *difference -= offset;
                    }
                }
                Ok(differences)
            })
            .collect()
    }

    /// Root mean square difference of every compared output, in its unit.
    ///
    /// # Errors
    /// When the model cannot be driven.
    pub fn rmse(&self, model: &JointModel) -> Result<Vec<f64>, Failure> {
        Ok(self.differences(model)?.into_iter().map(root_mean_square).collect())
    }

    /// Differences in scales, each output weighing as one residual.
    fn residuals(&self, model: &JointModel) -> Option<Vec<f64>> {
        let mut rows = Vec::new();
        for (differences, compared) in self.differences(model).ok()?.into_iter().zip(&self.compared) {
            let weight = 1.0 / (compared.scale * (differences.len() as f64).sqrt());
            rows.extend(differences.into_iter().map(|difference| weight * difference));
        }
        rows.iter().all(|value| value.is_finite()).then_some(rows)
    }
}

/// A parameter that is fitted.
#[derive(Clone, Copy)]
pub struct Knob {
    /// Where it stands.
    pub free: Free,
    /// Standard deviation of the shared coordinate about the start, as a ratio.
    pub prior: f64,
    /// Standard deviation of a group's coordinate about the shared one; `None` where all groups share the value.
    pub spread: Option<f64>,
}

impl Knob {
    /// Nominal parameter `section.name` of `model`, shared by all groups; `None` when the joint lacks it.
    #[must_use]
    pub fn nominal(model: &JointModel, section: &str, name: &str) -> Option<Self> {
        Free::nominal(model, section, name).map(Self::shared)
    }

    /// Parameter `name` of effect `id`, shared by all groups; `None` when the model lacks it.
    #[must_use]
    pub fn effect(model: &JointModel, id: &str, name: &str) -> Option<Self> {
        let place = model.effects.iter().position(|active| active.descriptor().id == id)?;
        let parameter = model.effects[place].descriptor().index_of(name)?;
        Free::effect(model, place, parameter).map(Self::shared)
    }

    fn shared(free: Free) -> Self {
        /// A factor of e either way costs as much as 0.15 marks in one recording.
        const WEAK: f64 = 1.0 / 0.15;
        Self { free: free.as_ratio(), prior: WEAK, spread: None }
    }

    /// The same parameter with a value for each group, about `spread` (as a ratio) apart.
    #[must_use]
    pub const fn per_group(mut self, spread: f64) -> Self {
        self.spread = Some(spread);
        self
    }
}

/// Fitted values.
#[derive(Clone, Debug, PartialEq)]
pub struct Fitted {
    x: DVector<f64>,
    groups: Vec<usize>,
}

struct Problem<'a> {
    runs: &'a [&'a Run],
    knobs: &'a [Knob],
    groups: Vec<usize>,
    step: f64,
    x: DVector<f64>,
    current: Option<Vec<Vec<f64>>>,
}

/// Place of the coordinate of `knob` for the group at `place` among those that are fitted.
fn local_index(knobs: &[Knob], knob: usize, place: usize) -> Option<usize> {
    knobs[knob].spread?;
    let locals = knobs.iter().filter(|k| k.spread.is_some()).count();
    let before = knobs[..knob].iter().filter(|k| k.spread.is_some()).count();
    Some(knobs.len() + place * locals + before)
}

fn model_at(run: &Run, knobs: &[Knob], groups: &[usize], x: &DVector<f64>) -> JointModel {
    let mut model = run.model.clone();
    let place = groups.iter().position(|group| *group == run.group);
    for (index, knob) in knobs.iter().enumerate() {
        let local = place.and_then(|place| local_index(knobs, index, place)).map_or(0.0, |i| x[i]);
        knob.free.apply(x[index] + local, &mut model);
    }
    model
}

impl Problem<'_> {
    fn residuals_of(&self, run: &Run, x: &DVector<f64>) -> Option<Vec<f64>> {
        run.residuals(&model_at(run, self.knobs, &self.groups, x))
    }

    /// Knob behind a coordinate, and the group that it moves; `None` moves all.
    fn coordinate(&self, column: usize) -> (usize, Option<usize>) {
        if column < self.knobs.len() {
            return (column, None);
        }
        let locals: Vec<usize> = (0..self.knobs.len()).filter(|k| self.knobs[*k].spread.is_some()).collect();
        let place = (column - self.knobs.len()) / locals.len();
        (locals[(column - self.knobs.len()) % locals.len()], Some(self.groups[place]))
    }

    fn prior_std(&self, column: usize) -> f64 {
        let (knob, group) = self.coordinate(column);
        match (group, self.knobs[knob].spread) {
            (Some(_), Some(spread)) => spread,
            _ => self.knobs[knob].prior,
        }
    }
}

impl LeastSquaresProblem<f64, Dyn, Dyn> for Problem<'_> {
    type ResidualStorage = Owned<f64, Dyn>;
    type JacobianStorage = Owned<f64, Dyn, Dyn>;
    type ParameterStorage = Owned<f64, Dyn>;

    fn set_params(&mut self, x: &DVector<f64>) {
        self.x.copy_from(x);
        self.current = self.runs.par_iter().map(|run| self.residuals_of(run, x)).collect();
    }

    fn params(&self) -> DVector<f64> {
        self.x.clone()
    }

    fn residuals(&self) -> Option<DVector<f64>> {
        let mut rows: Vec<f64> = self.current.as_ref()?.concat();
        rows.extend(self.x.iter().enumerate().map(|(column, x)| x / self.prior_std(column)));
        Some(DVector::from_vec(rows))
    }

    fn jacobian(&self) -> Option<DMatrix<f64>> {
        let current = self.current.as_ref()?;
        let starts: Vec<usize> = current
            .iter()
            .scan(0, |next, rows| {
                let start = *next;
                *next += rows.len();
                Some(start)
            })
            .collect();
        let total: usize = current.iter().map(Vec::len).sum();
        let columns = self.x.len();
        let tasks: Vec<(usize, usize)> = (0..columns)
            .flat_map(|column| (0..self.runs.len()).map(move |run| (column, run)))
            .filter(|(column, run)| {
                self.coordinate(*column).1.is_none_or(|group| group == self.runs[*run].group)
            })
            .collect();
        let slopes: Option<Vec<Vec<f64>>> = tasks
            .par_iter()
            .map(|(column, run)| {
                let mut x = self.x.clone();
                x[*column] += self.step;
                let there = self.residuals_of(self.runs[*run], &x)?;
                Some(
                    there
                        .iter()
                        .zip(&current[*run])
                        .map(|(there, here)| (there - here) / self.step)
                        .collect(),
                )
            })
            .collect();
        let mut jacobian = DMatrix::zeros(total + columns, columns);
        for ((column, run), slope) in tasks.into_iter().zip(slopes?) {
            for (offset, value) in slope.into_iter().enumerate() {
                jacobian[(starts[run] + offset, column)] = value;
            }
        }
        for column in 0..columns {
            jacobian[(total + column, column)] = 1.0 / self.prior_std(column);
        }
        Some(jacobian)
    }
}

/// Fits the knobs to `runs`, from `start` or else from the values of the models.
///
/// `steps` are the difference steps of the slopes, as ratios, one round of Levenberg–Marquardt each; `patience` bounds
/// its evaluations to `patience * (coordinates + 1)`.
///
/// # Errors
/// When a model cannot be driven.
pub fn fit(
    runs: &[&Run],
    knobs: &[Knob],
    start: Option<&Fitted>,
    steps: &[f64],
    patience: usize,
) -> Result<Fitted, Failure> {
    for run in runs {
        run.model.plant()?;
    }
    let mut groups: Vec<usize> = runs.iter().map(|run| run.group).collect();
    groups.sort_unstable();
    groups.dedup();
    let locals = knobs.iter().filter(|knob| knob.spread.is_some()).count();
    let mut x = DVector::zeros(knobs.len() + locals * groups.len());
    if let Some(start) = start {
        for knob in 0..knobs.len() {
            x[knob] = start.x[knob];
            for (place, group) in groups.iter().enumerate() {
                let before = start.groups.iter().position(|g| g == group);
                if let (Some(to), Some(from)) =
                    (local_index(knobs, knob, place), before.and_then(|p| local_index(knobs, knob, p)))
                {
                    x[to] = start.x[from];
                }
            }
        }
    }
    for step in steps {
        let mut problem =
            Problem { runs, knobs, groups: groups.clone(), step: *step, x: x.clone(), current: None };
        problem.set_params(&x);
        let optimiser = LevenbergMarquardt::new()
            .with_patience(patience)
            .with_stepbound(0.5)
            .with_ftol(1e-3)
            .with_xtol(1e-2)
            .with_gtol(1e-6);
        let (problem, _report) = optimiser.minimize(problem);
        x = problem.x;
    }
    Ok(Fitted { x, groups })
}

impl Fitted {
    /// Joint of a run with the fitted values.
    #[must_use]
    pub fn model(&self, run: &Run, knobs: &[Knob]) -> JointModel {
        model_at(run, knobs, &self.groups, &self.x)
    }

    /// Value of a knob for a group; the shared one where the group has none of its own.
    #[must_use]
    pub fn value(&self, knobs: &[Knob], knob: usize, group: Option<usize>) -> f64 {
        let place = group.and_then(|group| self.groups.iter().position(|g| *g == group));
        let local = place.and_then(|place| local_index(knobs, knob, place)).map_or(0.0, |i| self.x[i]);
        knobs[knob].free.value_at(self.x[knob] + local)
    }
}

/// Joints fitted with each part of the runs left out in turn, `key` naming the part; the joint for a run is the one
/// fitted without its part. Every fit starts from the values of the models, so that nothing of a left-out run enters.
/// The result has the order of `runs`.
///
/// # Errors
/// When a model cannot be driven.
pub fn leave_out<K: PartialEq + Sync>(
    runs: &[Run],
    knobs: &[Knob],
    steps: &[f64],
    patience: usize,
    key: impl Fn(&Run) -> K + Sync,
) -> Result<Vec<JointModel>, Failure> {
    let mut parts: Vec<K> = Vec::new();
    for run in runs {
        let part = key(run);
        if !parts.contains(&part) {
            parts.push(part);
        }
    }
    let models: Result<Vec<Vec<(usize, JointModel)>>, Failure> = parts
        .par_iter()
        .map(|part| {
            let training: Vec<&Run> = runs.iter().filter(|run| key(run) != *part).collect();
            let fitted = fit(&training, knobs, None, steps, patience)?;
            let left_out = runs.iter().enumerate().filter(|(_, run)| key(run) == *part);
            Ok(left_out.map(|(index, run)| (index, fitted.model(run, knobs))).collect())
        })
        .collect();
    let mut models = models?.concat();
    models.sort_by_key(|(index, _)| *index);
    Ok(models.into_iter().map(|(_, model)| model).collect())
}

/// Root mean square difference of every compared output of every run, each with its joint in `models` and the step of
/// the run: joints may come from thinned runs.
///
/// # Errors
/// When a model cannot be driven.
pub fn rmse_of(runs: &[Run], models: &[JointModel]) -> Result<Vec<Vec<f64>>, Failure> {
    let rmse = |(run, model): (&Run, &JointModel)| {
        run.rmse(&JointModel { step_s: run.model.step_s, ..model.clone() })
    };
    runs.par_iter().zip(models).map(rmse).collect()
}

/// Joint of a run after a fit of `knobs` to that run alone, everything else as in `model`: what belongs to a mounting
/// and no other recording can tell.
///
/// # Errors
/// When the model cannot be driven.
pub fn adapted(
    run: &Run,
    model: &JointModel,
    knobs: impl Fn(&JointModel) -> Vec<Knob>,
    steps: &[f64],
    patience: usize,
) -> Result<JointModel, Failure> {
    let run = Run { model: model.clone(), ..run.clone() };
    let knobs = knobs(&run.model);
    Ok(fit(&[&run], &knobs, None, steps, patience)?.model(&run, &knobs))
}
