//! Levenberg–Marquardt on the replay residuals.

mod problem;
mod solution;

use std::sync::Mutex;

use levenberg_marquardt::LevenbergMarquardt;
use nalgebra::{DMatrix, DVector};

use super::free::Free;
use super::objective::{Aspect, Entry, Objective, Part, Residuals, soft};
use crate::joint_model::JointModel;
use crate::outcome::Failure;
use crate::progress::{Progress, Quiet, ended_early};
use problem::{Problem, Start};
use solution::End;
pub use solution::{Slopes, Solution};

/// Step of the difference quotients in the optimiser's coordinate that sees the slope through the roughness that stick,
/// slip and impacts leave in the residuals.
pub const COARSE_STEP: f64 = 0.1;

/// Step that then finds the place.
pub const FINE_STEP: f64 = 0.02;

/// Longest first step of a round, in the optimiser's coordinate of the parameter that the residuals answer to least.
const FIRST_STEP: f64 = 0.5;

/// Standard deviation of weighted training residuals, at least 1, what scales say, allowing for how long they stay alike: what two
/// descriptions of a contact differ by lasts as long as a motion, also where it is small, and tells so much less.
fn spread(objective: &Objective, rows: &[f64], parameters: usize) -> f64 {
    let freedom = rows.len() as f64 / CORRELATED_BLOCKS - parameters as f64;
    let variance = rows.iter().map(|row| row * row).sum::<f64>() / freedom.max(1.0);
    let alike = blocks_alike(objective, rows);
    (variance.max(1.0) * (alike / CORRELATED_BLOCKS).max(1.0)).sqrt()
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
    solve_watched(objective, model, free, patience, &Quiet)
}

/// Like [`solve`]; fails at the next simulation when `progress` asks for an early end.
///
/// # Errors
/// As [`solve`]; exit status 1 after an early end.
pub fn solve_watched(
    objective: &Objective,
    model: &JointModel,
    free: &[Free],
    patience: usize,
    progress: &dyn Progress,
) -> Result<Solution, Failure> {
    solve_rounds_watched(objective, model, free, patience, &[COARSE_STEP, FINE_STEP, FINE_STEP], progress)
}

/// Like [`solve_watched`] with the given steps of the difference quotients, one round each.
///
/// # Errors
/// As [`solve_watched`].
pub fn solve_rounds_watched(
    objective: &Objective,
    model: &JointModel,
    free: &[Free],
    patience: usize,
    rounds: &[f64],
    progress: &dyn Progress,
) -> Result<Solution, Failure> {
    let solution = solve_knowing(objective, model, free, patience, rounds, None, progress)?;
    solution.slopes_watched(progress);
    refuse_interrupted(progress)?;
    Ok(solution)
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
    solve_knowing(objective, model, free, patience, rounds, None, &Quiet)
}

/// What a fit of the same model without its last parameters knows.
pub struct Known<'a> {
    /// Slopes over the first parameters; without them, or without a row, every slope is found anew.
    pub jacobian: Option<&'a DMatrix<f64>>,
    /// What a weighted residual was spread by.
    pub spread: f64,
}

/// Like [`solve_in_rounds`] in one coarse round, beside what `known` tells: with its slopes it takes a third of the simulations, for
/// candidates that are only to be ranked, and the solution then has neither slopes nor standard deviations.
///
/// # Errors
/// When the model cannot be driven.
pub fn solve_for_ranking(
    objective: &Objective,
    model: &JointModel,
    free: &[Free],
    patience: usize,
    known: &Known,
) -> Result<Solution, Failure> {
    solve_knowing(objective, model, free, patience, &[COARSE_STEP], Some(known), &Quiet)
}

/// What a fit moves, and what it is fitted to.
struct Fit {
    /// The recordings that are fitted to.
    objective: Objective,
    /// Model before the fit.
    model: JointModel,
    free: Vec<Free>,
}

impl Fit {
    /// The model at a place of the optimiser.
    fn model_at(&self, x: &DVector<f64>) -> JointModel {
        let mut model = self.model.clone();
        for (free, x) in self.free.iter().zip(x.iter()) {
            free.apply(*x, &mut model);
        }
        model
    }
}

fn solve_knowing(
    objective: &Objective,
    model: &JointModel,
    free: &[Free],
    patience: usize,
    rounds: &[f64],
    known: Option<&Known>,
    progress: &dyn Progress,
) -> Result<Solution, Failure> {
    // There are none where a simulation beside the fitted model ran away.
    let slopes = known.and_then(|known| known.jacobian).filter(|jacobian| jacobian.nrows() > 0);
    let [objective, judging] = objective.split();
    // Inside the optimiser an error could not be told.
    let mut start = objective.residuals(model)?;
    if free.is_empty() {
        start.values.extend(judging.residuals(model)?.values);
        return Ok(Solution::with_slopes(model.clone(), Vec::new(), start, Slopes::none(0, 1.0)));
    }
    let fit = Fit { objective, model: model.clone(), free: free.to_vec() };
    let mut fixed = vec![false; free.len()];
    let prior_weight = known.map_or(1.0, |known| known.spread);
    let mut x = DVector::zeros(free.len());
    // Residuals at `x`: no round simulates again where the one before it ended.
    let mut current = Some(start).filter(Residuals::is_finite);
    // Slopes where the round before ended, if they were simulated there, with the step of their quotients.
    let mut ended: Option<(f64, Start)> = None;
    // Slopes near there.
    let mut nearby: Option<(f64, Start)> = None;
    let found_with =
        |step, ended: Option<(f64, Start)>| ended.filter(|(with, _)| *with == step).map(|(_, begun)| begun);
    for (round, &step) in rounds.iter().enumerate() {
        let begun = found_with(step, ended);
        let mut problem = Problem {
            fit: &fit,
            progress,
            fixed: fixed.clone(),
            step,
            prior_weight,
            known: slopes,
            x,
            current,
            begun,
            stood: Mutex::default(),
            simulated: Mutex::default(),
        };
        if known.is_none() {
            problem.weigh_priors();
        }
        // Farther than this the difference quotients do not lead.
        let first_step = problem.first_step(FIRST_STEP);
        let tolerance = if step >= COARSE_STEP { 3e-3 } else { 5e-4 };
        let optimiser = LevenbergMarquardt::new()
            .with_patience(patience)
            .with_stepbound(first_step)
            .with_ftol(tolerance)
            .with_xtol(3.0 * tolerance)
            .with_gtol(1e-6);
        let (problem, _report) = optimiser.minimize(problem);
        refuse_interrupted(progress)?;
        ended = problem.simulated_slopes().map(|begun| (step, begun));
        nearby = problem.slopes_nearby().map(|begun| (step, begun));
        (x, current) = (problem.x, problem.current);
        let mut newly = false;
        for (j, free) in free.iter().enumerate() {
            if !fixed[j] && free.at_bound(free.value_at(x[j])) {
                fixed[j] = true;
                newly = true;
                (ended, nearby) = (None, None);
            }
        }
        let repeated = round > 0 && rounds[round - 1] == step;
        if (repeated && !newly) || fixed.iter().all(|f| *f) {
            break;
        }
    }
    let begun = found_with(FINE_STEP, nearby);
    let model = fit.model_at(&x);
    let values: Vec<f64> = free.iter().zip(x.iter()).map(|(free, x)| free.value_at(*x)).collect();
    let mut residuals = match current {
        Some(residuals) => residuals,
        None => fit.objective.residuals(&model)?,
    };
    residuals.values.extend(judging.residuals(&model)?.values);
    if known.is_some() {
        let none = Slopes::none(values.len(), prior_weight);
        return Ok(Solution::with_slopes(model, values, residuals, none));
    }
    let end = End { fit, fixed, x, begun, prior_weight };
    Ok(Solution::ended(model, values, residuals, end))
}

/// A solution of which simulations are missing is none.
fn refuse_interrupted(progress: &dyn Progress) -> Result<(), Failure> {
    if progress.interrupted() { Err(ended_early("fit")) } else { Ok(()) }
}

/// Over how many blocks the residuals of the fitted model stay alike, on average: what is left is mostly the difference
/// between two descriptions of the same contact, which lasts as long as a motion does, and tells so much less.
fn blocks_alike(objective: &Objective, rows: &[f64]) -> f64 {
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
    let trained = objective.entries().filter(|entry| entry.block.part == Part::Training);
    for (entry, value) in trained.zip(rows) {
        let follows = before.is_some_and(|before| {
            (before.series, before.recording, before.aspect) == (entry.series, entry.recording, entry.aspect)
        });
        if !follows {
            close(&mut run);
        }
        if entry.aspect == Aspect::Mean {
            run.push(*value);
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

/// What is left of `rows` when the columns have taken off what they can.
fn left_over(columns: &DMatrix<f64>, rows: DVector<f64>) -> DVector<f64> {
    let seen: Vec<_> = (0..columns.ncols())
        .filter(|j| columns.column(*j).norm_squared() > 0.0)
        .map(|j| columns.column(j).into_owned())
        .collect();
    if seen.is_empty() || rows.is_empty() {
        return rows;
    }
    let basis = DMatrix::from_columns(&seen).qr().q();
    let inside = basis.tr_mul(&rows);
    rows - basis * inside
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
    use bowden_model::channel::Channel;
    use nalgebra::DMatrix;
    use rand_distr::{Distribution, StandardNormal};
    use rand_pcg::Pcg64;

    use super::{
        COARSE_STEP, FINE_STEP, Known, autocorrelation_time, solve_for_ranking, solve_in_rounds, spread,
        training_rows,
    };
    use crate::fit::free::Free;
    use crate::fit::objective::{Objective, Residuals};
    use crate::joint_model::JointModel;
    use crate::recording::Recording;
    use crate::simulation::{ReplayInput, replay};
    use crate::test_bench;

    /// Independent residuals of so many scales are spread by as much, but by no less than one.
    #[test]
    fn beliefs_weigh_as_much_as_the_residuals_are_spread() {
        let model = JointModel::from_rig(&test_bench::rig(), &test_bench::swung(8000)).unwrap();
        let objective = Objective::new(&model, &[test_bench::swung(8000)], &[], true).unwrap();
        let of_scales = |scales: f64| {
            let sign = |k: usize| if k.is_multiple_of(2) { 1.0 } else { -1.0 };
            let values = (0..objective.entries().count()).map(|k| scales * sign(k)).collect();
            training_rows(&objective, &Residuals { values })
        };
        assert_eq!(spread(&objective, &of_scales(0.1), 0), 1.0);
        // The bent loss of 2 is 9 * 2 (sqrt(1 + 4/9) - 1) = 3.633.
        assert!((spread(&objective, &of_scales(2.0), 0) / 3.633_f64.sqrt() - 1.0).abs() < 1e-3);
    }

    /// Only the joint's angle is recorded, and it follows another law than the model's: the pretension, which it hardly answers to,
    /// stays near the rig file. Recorded tensions of the same bench move it all the way.
    #[test]
    fn what_the_recordings_do_not_touch_stays_where_the_rig_file_has_it() {
        let mut recording = test_bench::swung(8000);
        let model = JointModel::from_rig(&test_bench::rig(), &recording).unwrap();
        let mut real = model.clone();
        real.parameters.tendon.as_mut().unwrap().pretension_n *= 1.3;
        let measured = replay(&real, &ReplayInput::new(&model, &recording).unwrap()).unwrap();
        for (channel, values) in measured.channels() {
            recording.set(channel, values.to_vec());
        }
        let bent =
            recording.channel(Channel::ThetaOut).unwrap().iter().map(|theta| theta + 0.3 * theta * theta);
        let bent: Vec<f64> = bent.collect();
        let found = |channels: &[Channel]| {
            let mut seen = Recording::new("seen", recording.t_s().to_vec());
            for channel in [Channel::ThetaIn].iter().chain(channels) {
                seen.set(*channel, recording.channel(*channel).unwrap().to_vec());
            }
            if channels == [Channel::ThetaOut] {
                seen.set(Channel::ThetaOut, bent.clone());
            }
            let free = [Free::nominal(&model, "tendon", "pretension_n").unwrap()];
            let objective = Objective::new(&model, &[seen], &[], true).unwrap();
            solve_in_rounds(&objective, &model, &free, 5, &[COARSE_STEP, FINE_STEP]).unwrap().values[0] / 30.0
        };
        let (angle_alone, tensions) = (found(&[Channel::ThetaOut]), found(&Channel::TENSIONS));
        assert!((angle_alone - 1.0).abs() < 0.05, "{angle_alone}");
        assert!((tensions - 1.3).abs() < 0.02, "{tensions}");
    }

    /// Where a neighbour of the fitted model could not be simulated its slopes have no row.
    #[test]
    fn a_fit_beside_slopes_without_a_row_finds_its_own() {
        let recording = test_bench::turned(2000, &[]);
        let model = JointModel::from_rig(&test_bench::direct_rig(), &recording).unwrap().guided(&recording);
        let free = [Free::nominal(&model, "load", "inertia_kg_m2").unwrap()];
        let objective = Objective::new(&model, &[recording], &[], true).unwrap();
        let empty = DMatrix::zeros(0, 1);
        let fitted = [None, Some(&empty)].map(|jacobian| {
            let known = Known { jacobian, spread: 1.0 };
            solve_for_ranking(&objective, &model, &free, 5, &known).unwrap().values
        });
        assert_eq!(fitted[0], fitted[1]);
    }

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
