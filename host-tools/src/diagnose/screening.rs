//! Which candidates are worth a fit: each is simulated at its starting points, and what a recalibration could still take
//! off the difference is projected out with the slopes of the present model.
//!
//! With residuals `r` of the present model, slopes `J` over its parameters and residuals `r_c` of a candidate, the loss
//! after a refit is estimated as `min_b |P (r + b (r_c - r))|²` with the projection `P = 1 - J (JᵀJ)⁻¹ Jᵀ`: exact for an
//! effect that enters linearly, a ranking for the others; those that it ranks first are simulated at their estimated strength.

use bowden_model::effect::{ActiveEffect, Component};
use nalgebra::{DMatrix, DVector};
use rayon::prelude::*;

use super::candidates::Candidate;
use super::layout::Layout;
use crate::fit::objective::{Objective, Residuals};
use crate::fit::solver::{Solution, training_rows};
use crate::outcome::Failure;
use crate::progress::Progress;
use crate::simulation::Prediction;

/// Candidates whose estimated strength is simulated, of those that the estimate ranks first.
const VERIFIED: usize = 10;

/// Strength, in starting strengths, below which the linear estimate is not followed, on either side for what has either
/// sign: such an effect is hardly there.
const WEAKEST: f64 = 0.15;

/// Strength, in starting strengths, up to which the linear estimate is followed.
const STRONGEST: f64 = 3.0;

/// A candidate after screening.
#[derive(Clone, Debug)]
pub struct Screened {
    /// The effect at its best starting point.
    pub start: ActiveEffect,
    /// Estimated share of the present loss that it would take off.
    pub gain: f64,
}

/// A starting point that was simulated, and what follows from it for another strength.
struct Judged {
    start: Screened,
    linear: Option<Screened>,
}

impl Judged {
    fn best(&self) -> &Screened {
        self.linear.as_ref().filter(|linear| linear.gain > self.start.gain).unwrap_or(&self.start)
    }
}

/// What candidates are judged against.
pub struct Present<'a> {
    /// Model so far, fitted.
    pub solution: &'a Solution,
    /// Whose its effects are.
    pub layout: &'a Layout,
    /// What it predicts.
    pub predictions: &'a [Prediction],
}

/// Ranks candidates, best first.
#[must_use]
pub fn screen(
    objective: &Objective,
    present: &Present<'_>,
    candidates: &[Candidate],
    progress: &dyn Progress,
) -> Vec<Screened> {
    let [objective, _] = &objective.split();
    let basis = Basis::new(&present.solution.jacobian);
    let now = basis.without(&rows(objective, &present.solution.residuals));
    let background = Background { objective, present, basis, loss_now: now.norm_squared(), now };
    let starts: Vec<(usize, ActiveEffect)> = candidates
        .iter()
        .enumerate()
        .flat_map(|(c, candidate)| candidate.starts.iter().map(move |s| (c, *s)))
        .collect();
    let judged: Vec<(usize, Option<Judged>)> = starts
        .par_iter()
        .map(|(candidate, start)| {
            let judged = if progress.interrupted() { None } else { background.judge(*start) };
            progress.advance(1);
            (*candidate, judged)
        })
        .collect();
    let mut best: Vec<Option<Judged>> = candidates.iter().map(|_| None).collect();
    for (candidate, judged) in judged {
        if let Some(judged) = judged
            && best[candidate].as_ref().is_none_or(|b| judged.best().gain > b.best().gain)
        {
            best[candidate] = Some(judged);
        }
    }
    let mut ranked: Vec<Judged> = best.into_iter().flatten().collect();
    ranked.sort_by(|a, b| b.best().gain.total_cmp(&a.best().gain));
    let mut screened: Vec<Screened> = ranked
        .into_par_iter()
        .enumerate()
        .map(|(place, judged)| match &judged.linear {
            Some(linear) if place < VERIFIED && linear.gain > judged.start.gain => {
                // Play and stick bend the way between two strengths; only a simulation tells.
                let there = background.judge(linear.start);
                there
                    .map(|there| there.start)
                    .filter(|there| there.gain > judged.start.gain)
                    .unwrap_or(judged.start)
            }
            _ => judged.best().clone(),
        })
        .collect();
    screened.sort_by(|a, b| b.gain.total_cmp(&a.gain));
    screened
}

/// What every start is compared with.
struct Background<'a> {
    objective: &'a Objective,
    present: &'a Present<'a>,
    basis: Basis,
    /// What the present parameters cannot take off.
    now: DVector<f64>,
    loss_now: f64,
}

impl Background<'_> {
    fn judge(&self, start: ActiveEffect) -> Option<Judged> {
        let Self { objective, basis, now, .. } = self;
        let residuals = self.residuals(start).ok()?;
        if !residuals.is_finite() {
            return None;
        }
        let there = basis.without(&rows(objective, &residuals));
        let gain_of = |loss: f64| 1.0 - loss / self.loss_now.max(f64::MIN_POSITIVE);
        let at_start = Screened { start, gain: gain_of(there.norm_squared()) };
        let direction = &there - now;
        let along = direction.norm_squared();
        let step = if along > 0.0 { -now.dot(&direction) / along } else { 0.0 };
        let step = step.clamp(-STRONGEST, STRONGEST);
        let linear = start.descriptor().neutral.filter(|_| step.abs() >= WEAKEST).and_then(|neutral| {
            let spec = start.descriptor().parameters[0];
            let mut moved = start;
            moved.parameters[0] = neutral + step * (start.parameters[0] - neutral);
            let possible = step > 0.0 || moved.parameters[0] >= spec.lower;
            moved.parameters[0] = moved.parameters[0].clamp(spec.lower, spec.upper);
            possible
                .then(|| Screened { start: moved, gain: gain_of((now + direction * step).norm_squared()) })
        });
        Some(Judged { start: at_start, linear })
    }

    fn residuals(&self, start: ActiveEffect) -> Result<Residuals, Failure> {
        let Present { solution, layout, predictions } = self.present;
        let model = &solution.model;
        // A sensor that drives nothing changes nothing but what is seen of the same motion.
        let only_seen = start.descriptor().component == Component::Sensors
            && !model.inputs.iter().any(|channel| start.target.includes(*channel));
        if only_seen {
            self.objective.residuals_seen_through(predictions, start)
        } else {
            self.objective.residuals(&layout.with(model, start).1)
        }
    }
}

fn rows(objective: &Objective, residuals: &Residuals) -> DVector<f64> {
    DVector::from_vec(training_rows(objective, residuals))
}

/// Orthonormal basis of what the present parameters can change.
struct Basis(DMatrix<f64>);

impl Basis {
    fn new(jacobian: &DMatrix<f64>) -> Self {
        if jacobian.ncols() == 0 || jacobian.nrows() == 0 {
            return Self(DMatrix::zeros(0, 0));
        }
        Self(jacobian.clone().qr().q())
    }

    /// The part of `rows` that they cannot take off. The rows of priors, last in the basis, count as zero.
    fn without(&self, rows: &DVector<f64>) -> DVector<f64> {
        if self.0.ncols() == 0 {
            return rows.clone();
        }
        let mut extended = rows.clone().resize_vertically(self.0.nrows(), 0.0);
        let inside = self.0.transpose() * &extended;
        extended -= &self.0 * inside;
        extended
    }
}

#[cfg(test)]
mod tests {
    use bowden_model::effects::find;

    use super::*;
    use crate::fit::solver::solve_in_rounds;
    use crate::joint_model::JointModel;
    use crate::progress::Quiet;
    use crate::simulation::{ReplayInput, replay};
    use crate::test_bench;

    /// What an effect of either sign is tried at says where it really is, on the other side and beyond what is trusted.
    #[test]
    fn a_strong_effect_is_promised_on_the_other_side_of_its_start() {
        let mut recording = test_bench::swung(6000);
        let model = JointModel::from_rig(&test_bench::rig(), &recording).unwrap();
        let start = ActiveEffect::with_defaults(find("asymmetric_friction").unwrap());
        let strong = -1.1 * STRONGEST * start.parameters[0];
        let mut real = model.clone();
        real.effects.push(start.with("asymmetry", strong));
        let measured = replay(&real, &ReplayInput::new(&model, &recording).unwrap()).unwrap();
        for (channel, values) in measured.channels() {
            recording.set(channel, values.to_vec());
        }
        let objective = Objective::new(&model, &[recording], &[], true).unwrap();
        let layout = Layout::of(&model);
        let free = layout.free(&model, &model);
        let solution = solve_in_rounds(&objective, &model, &free, 1, &[]).unwrap();
        let predictions = objective.predict(&model).unwrap();
        let present = Present { solution: &solution, layout: &layout, predictions: &predictions };
        let screened = screen(&objective, &present, &[Candidate { starts: vec![start] }], &Quiet);
        let found = &screened[0];
        assert!((found.start.parameters[0] / strong - 1.0).abs() < 0.3, "{:?}", found.start.parameters[0]);
        assert!(found.gain > 0.8, "{}", found.gain);
    }
}
