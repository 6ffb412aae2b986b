//! Levenberg–Marquardt on the replay residuals.

use levenberg_marquardt::{LeastSquaresProblem, LevenbergMarquardt};
use nalgebra::storage::Owned;
use nalgebra::{DMatrix, DVector, Dyn};
use rayon::prelude::*;

use super::free::Free;
use super::objective::{Aspect, Entry, Objective, Part, Residuals, soft};
use crate::joint_model::JointModel;
use crate::outcome::Failure;

/// Step of the difference quotients in the optimiser's coordinate that sees the slope through the roughness that stick,
/// slip and impacts leave in the residuals.
pub const COARSE_STEP: f64 = 0.1;

/// Step that then finds the place.
pub const FINE_STEP: f64 = 0.02;

/// Result of a fit.
#[derive(Clone, Debug)]
pub struct Solution {
    /// Model with the fitted values.
    pub model: JointModel,
    /// Fitted values.
    pub values: Vec<f64>,
    /// Their standard deviations; `None` for a value at a bound.
    pub stds: Vec<Option<f64>>,
    /// Residuals of the fitted model.
    pub residuals: Residuals,
    /// Slopes of the weighted residuals over the optimiser's coordinates, training rows and priors; empty after a fit that
    /// only ranks.
    pub jacobian: DMatrix<f64>,
}

struct Problem<'a> {
    objective: &'a Objective,
    model: &'a JointModel,
    free: &'a [Free],
    fixed: &'a [bool],
    step: f64,
    /// Slopes over the first parameters that are taken as known.
    known: Option<&'a DMatrix<f64>>,
    x: DVector<f64>,
    current: Option<Residuals>,
}

impl Problem<'_> {
    fn model_at(&self, x: &DVector<f64>) -> JointModel {
        let mut model = self.model.clone();
        for (free, x) in self.free.iter().zip(x.iter()) {
            free.apply(*x, &mut model);
        }
        model
    }

    fn residuals_at(&self, x: &DVector<f64>) -> Option<Residuals> {
        self.objective.residuals(&self.model_at(x)).ok().filter(Residuals::is_finite)
    }

    /// Column `j` of `known`, whose rows end with the priors of its own parameters.
    fn known_column(&self, known: &DMatrix<f64>, j: usize, rows: usize) -> DVector<f64> {
        let data = rows - self.free.len();
        let mut column = known.column(j).rows(0, data).into_owned().resize_vertically(rows, 0.0);
        column[data + j] = self.free[j].prior_slope();
        column
    }

    /// Standard deviation of a weighted residual, allowing for how long residuals stay alike.
    fn spread(&self) -> f64 {
        let rows = self.residuals().unwrap_or_else(|| DVector::zeros(0));
        let freedom = rows.len() as f64 / CORRELATED_BLOCKS - self.free.len() as f64;
        let variance = (rows.norm_squared() / freedom.max(1.0)).max(1e-300);
        let alike = self.current.as_ref().map_or(1.0, |residuals| blocks_alike(self.objective, residuals));
        (variance * (alike / CORRELATED_BLOCKS).max(1.0)).sqrt()
    }

    /// Weighted training residuals followed by the priors.
    fn weighted(&self, residuals: &Residuals, x: &DVector<f64>) -> DVector<f64> {
        let mut rows = training_rows(self.objective, residuals);
        rows.extend(self.free.iter().zip(x.iter()).map(|(free, x)| free.prior_residual(*x)));
        DVector::from_vec(rows)
    }
}

/// Training residuals after the soft loss, weighted as in a fit. Neighbouring blocks tell nearly the same: their weight is that of one block
/// in two, which keeps priors and standard deviations honest.
pub(crate) fn training_rows(objective: &Objective, residuals: &Residuals) -> Vec<f64> {
    let weight = CORRELATED_BLOCKS.sqrt().recip();
    objective
        .entries()
        .zip(&residuals.values)
        .filter(|(entry, _)| entry.block.part == Part::Training)
        .map(|(_, value)| weight * soft(*value))
        .collect()
}

/// Blocks over which the residuals of a real bench stay alike, 0.1 s: the time in which a front crosses a sheath.
const CORRELATED_BLOCKS: f64 = 2.0;

impl LeastSquaresProblem<f64, Dyn, Dyn> for Problem<'_> {
    type ResidualStorage = Owned<f64, Dyn>;
    type JacobianStorage = Owned<f64, Dyn, Dyn>;
    type ParameterStorage = Owned<f64, Dyn>;

    fn set_params(&mut self, x: &DVector<f64>) {
        self.x.copy_from(x);
        self.current = self.residuals_at(x);
    }

    fn params(&self) -> DVector<f64> {
        self.x.clone()
    }

    fn residuals(&self) -> Option<DVector<f64>> {
        self.current.as_ref().map(|residuals| self.weighted(residuals, &self.x))
    }

    fn jacobian(&self) -> Option<DMatrix<f64>> {
        let here = self.weighted(self.current.as_ref()?, &self.x);
        let columns: Option<Vec<DVector<f64>>> = (0..self.free.len())
            .into_par_iter()
            .map(|j| {
                if self.fixed[j] {
                    return Some(DVector::zeros(here.len()));
                }
                let free = &self.free[j];
                if let Some(known) = self.known.filter(|known| j < known.ncols()) {
                    return Some(self.known_column(known, j, here.len()));
                }
                let at = |step: f64| {
                    let mut x = self.x.clone();
                    x[j] += step;
                    Some(self.weighted(&self.residuals_at(&x)?, &x))
                };
                let [before, ahead] =
                    [-self.step, self.step].map(|step| free.at_bound(free.value_at(self.x[j] + step)));
                // A moment that lies too late is wrong about what went before it, which only a step back changes.
                if free.is_moment() && !before && !ahead {
                    return Some((at(self.step)? - at(-self.step)?) / (2.0 * self.step));
                }
                // Step away from the nearer bound.
                let step = if ahead { -self.step } else { self.step };
                Some((at(step)? - &here) / step)
            })
            .collect();
        Some(DMatrix::from_columns(&columns?))
    }
}

/// Fits the free parameters of `model` to the training part.
///
/// A parameter that runs into a bound is kept there and the others are fitted again.
///
/// # Errors
/// When the model cannot be driven.
pub fn solve(
    objective: &Objective,
    model: &JointModel,
    free: &[Free],
    patience: usize,
) -> Result<Solution, Failure> {
    solve_in_rounds(objective, model, free, patience, &[COARSE_STEP, FINE_STEP, FINE_STEP])
}

/// Like [`solve`] with the given steps of the difference quotients, one round each.
///
/// # Errors
/// When the model cannot be driven.
pub fn solve_in_rounds(
    objective: &Objective,
    model: &JointModel,
    free: &[Free],
    patience: usize,
    rounds: &[f64],
) -> Result<Solution, Failure> {
    solve_knowing(objective, model, free, patience, rounds, None)
}

/// Like [`solve_in_rounds`] in one coarse round, but the slopes over the first parameters are taken from `known`, those of a fit
/// of the same model without the last parameters: a third of the simulations, for candidates that are only to be ranked.
/// The solution has neither slopes nor standard deviations.
///
/// # Errors
/// When the model cannot be driven.
pub fn solve_for_ranking(
    objective: &Objective,
    model: &JointModel,
    free: &[Free],
    patience: usize,
    known: &DMatrix<f64>,
) -> Result<Solution, Failure> {
    solve_knowing(objective, model, free, patience, &[COARSE_STEP], Some(known))
}

fn solve_knowing(
    objective: &Objective,
    model: &JointModel,
    free: &[Free],
    patience: usize,
    rounds: &[f64],
    known: Option<&DMatrix<f64>>,
) -> Result<Solution, Failure> {
    let [objective, judging] = &objective.split();
    // Inside the optimiser an error could not be told.
    let mut start = objective.residuals(model)?;
    if free.is_empty() {
        start.values.extend(judging.residuals(model)?.values);
        return Ok(Solution {
            model: model.clone(),
            values: Vec::new(),
            stds: Vec::new(),
            residuals: start,
            jacobian: DMatrix::zeros(0, 0),
        });
    }
    let mut fixed = vec![false; free.len()];
    let mut x = DVector::zeros(free.len());
    // Residuals at `x`: no round simulates again where the one before it ended.
    let mut current = Some(start).filter(Residuals::is_finite);
    for (round, &step) in rounds.iter().enumerate() {
        let problem = Problem { objective, model, free, fixed: &fixed, step, known, x, current };
        // Farther than this the difference quotients do not lead.
        let tolerance = if step >= COARSE_STEP { 3e-3 } else { 5e-4 };
        let optimiser = LevenbergMarquardt::new()
            .with_patience(patience)
            .with_stepbound(0.5)
            .with_ftol(tolerance)
            .with_xtol(3.0 * tolerance)
            .with_gtol(1e-6);
        let (problem, _report) = optimiser.minimize(problem);
        (x, current) = (problem.x, problem.current);
        let mut newly = false;
        for (j, free) in free.iter().enumerate() {
            if !fixed[j] && free.at_bound(free.value_at(x[j])) {
                fixed[j] = true;
                newly = true;
            }
        }
        let repeated = round > 0 && rounds[round - 1] == step;
        if (repeated && !newly) || fixed.iter().all(|f| *f) {
            break;
        }
    }
    let problem = Problem { objective, model, free, fixed: &fixed, step: FINE_STEP, known, x, current };
    let values: Vec<f64> = free.iter().zip(problem.x.iter()).map(|(free, x)| free.value_at(*x)).collect();
    let model = problem.model_at(&problem.x);
    let (jacobian, stds) = if known.is_some() {
        (DMatrix::zeros(0, 0), vec![None; free.len()])
    } else {
        let jacobian = problem.jacobian().unwrap_or_else(|| DMatrix::zeros(0, free.len()));
        let spread = problem.spread();
        let stds = standard_deviations(&jacobian, &fixed)
            .into_iter()
            .zip(free.iter().zip(&values))
            .map(|(std, (free, value))| std.map(|s| s * spread * free.slope_at(*value)))
            .collect();
        (jacobian, stds)
    };
    let mut residuals = match problem.current {
        Some(residuals) => residuals,
        None => objective.residuals(&model)?,
    };
    residuals.values.extend(judging.residuals(&model)?.values);
    Ok(Solution { model, values, stds, residuals, jacobian })
}

/// Over how many blocks the residuals of the fitted model stay alike, on average: what is left is mostly the difference
/// between two descriptions of the same contact, which lasts as long as a motion does, and tells so much less.
fn blocks_alike(objective: &Objective, residuals: &Residuals) -> f64 {
    let (mut weighted, mut weight) = (0.0, 0.0);
    let mut run: Vec<f64> = Vec::new();
    let mut before: Option<Entry> = None;
    let mut close = |run: &mut Vec<f64>| {
        // A shorter run does not show how long its values stay alike.
        if run.len() >= 4 {
            let power: f64 = run.iter().map(|r| r * r).sum();
            weighted += power * autocorrelation_time(run);
            weight += power;
        }
        run.clear();
    };
    for (entry, value) in objective.entries().zip(&residuals.values) {
        let follows = before.is_some_and(|before| {
            (before.series, before.recording, before.aspect) == (entry.series, entry.recording, entry.aspect)
        });
        if !follows {
            close(&mut run);
        }
        if entry.aspect == Aspect::Mean && entry.block.part == Part::Training {
            run.push(soft(*value));
        }
        before = Some(entry);
    }
    close(&mut run);
    if weight > 0.0 { weighted / weight } else { 1.0 }
}

/// Integrated autocorrelation time `1 + 2 Σ ρ_k` of values about zero, in samples, summed up to five times itself
/// (Sokal's window); at least 1.
fn autocorrelation_time(values: &[f64]) -> f64 {
    let at = |lag: usize| values.iter().zip(&values[lag..]).map(|(a, b)| a * b).sum::<f64>();
    let power = at(0);
    if power <= 0.0 {
        return 1.0;
    }
    let mut time = 1.0;
    for lag in 1..values.len() {
        if lag as f64 >= 5.0 * time {
            break;
        }
        time += 2.0 * at(lag) / power;
    }
    time.max(1.0)
}

/// Square roots of the diagonal of `(JᵀJ)⁻¹`.
fn standard_deviations(jacobian: &DMatrix<f64>, fixed: &[bool]) -> Vec<Option<f64>> {
    // A parameter without any slope has no spread to tell and would make the others' unsolvable.
    let open: Vec<usize> = (0..fixed.len())
        .filter(|j| !fixed[*j] && jacobian.nrows() > 0 && jacobian.column(*j).norm_squared() > 0.0)
        .collect();
    let columns: Vec<_> = open.iter().map(|j| jacobian.column(*j).into_owned()).collect();
    let mut stds = vec![None; fixed.len()];
    if columns.is_empty() || jacobian.nrows() == 0 {
        return stds;
    }
    let reduced = DMatrix::from_columns(&columns);
    if let Some(inverse) = (reduced.transpose() * &reduced).try_inverse() {
        for (position, j) in open.iter().enumerate() {
            stds[*j] = Some(inverse[(position, position)].max(0.0).sqrt());
        }
    }
    stds
}

#[cfg(test)]
mod tests {
    use rand_distr::{Distribution, StandardNormal};
    use rand_pcg::Pcg64;

    use super::autocorrelation_time;

    /// A first-order process of pole `p` stays alike for `(1 + p)/(1 - p)` samples.
    #[test]
    fn values_stay_alike_as_long_as_their_process_says() {
        let mut random = Pcg64::new(7, 11);
        for (pole, expected) in [(0.0, 1.0), (0.5, 3.0), (0.8, 9.0)] {
            let mut state = 0.0;
            let values: Vec<f64> = (0..40_000)
                .map(|_| {
                    let noise: f64 = StandardNormal.sample(&mut random);
                    state = pole * state + noise;
                    state
                })
                .collect();
            let time = autocorrelation_time(&values);
            assert!((time / expected - 1.0).abs() < 0.12, "pole {pole}: {time} samples, expected {expected}");
        }
    }
}
