//! Which candidates are worth a fit: each is simulated at its starting points, and what a recalibration could still take
//! off the difference is projected out with the slopes of the present model.
//!
//! With residuals `r` of the present model, slopes `J` over its parameters and residuals `r_c` of a candidate, the loss
//! after a refit is estimated as `min_b |P (r + b (r_c - r))|²` with the projection `P = 1 - J (JᵀJ)⁻¹ Jᵀ`: exact for an
//! effect that enters linearly, a ranking for the others.

use bowden_model::effect::ActiveEffect;
use nalgebra::{DMatrix, DVector};
use rayon::prelude::*;

use super::candidates::Candidate;
use crate::fit::objective::{Objective, Residuals};
use crate::fit::solver::{Solution, training_rows};
use crate::joint_model::JointModel;
use crate::progress::Progress;

/// Strengths, in starting strengths, between which the linear estimate is trusted.
const TRUSTED: std::ops::RangeInclusive<f64> = 0.15..=3.0;

/// A candidate after screening.
#[derive(Clone, Debug)]
pub struct Screened {
    /// The effect at its best starting point.
    pub start: ActiveEffect,
    /// Estimated share of the present loss that it would take off.
    pub gain: f64,
}

/// Ranks candidates, best first.
#[must_use]
pub fn screen(
    objective: &Objective,
    present: &Solution,
    candidates: &[Candidate],
    progress: &dyn Progress,
) -> Vec<Screened> {
    let [objective, _] = &objective.split();
    let basis = Basis::new(&present.jacobian);
    let now = basis.without(&rows(objective, &present.residuals));
    let loss_now = now.norm_squared();
    let starts: Vec<(usize, ActiveEffect)> = candidates
        .iter()
        .enumerate()
        .flat_map(|(c, candidate)| candidate.starts.iter().map(move |s| (c, *s)))
        .collect();
    let judged: Vec<(usize, Option<Screened>)> = starts
        .par_iter()
        .map(|(candidate, start)| {
            let screened = if progress.interrupted() {
                None
            } else {
                judge(objective, &present.model, *start, &basis, &now, loss_now)
            };
            progress.advance(1);
            (*candidate, screened)
        })
        .collect();
    let mut best: Vec<Option<Screened>> = vec![None; candidates.len()];
    for (candidate, screened) in judged {
        if let Some(screened) = screened
            && best[candidate].as_ref().is_none_or(|b| screened.gain > b.gain)
        {
            best[candidate] = Some(screened);
        }
    }
    let mut ranked: Vec<Screened> = best.into_iter().flatten().collect();
    ranked.sort_by(|a, b| b.gain.total_cmp(&a.gain));
    ranked
}

fn judge(
    objective: &Objective,
    model: &JointModel,
    start: ActiveEffect,
    basis: &Basis,
    now: &DVector<f64>,
    loss_now: f64,
) -> Option<Screened> {
    let mut with = model.clone();
    with.effects.push(start);
    let residuals = objective.residuals(&with).ok()?;
    if !residuals.is_finite() {
        return None;
    }
    let there = basis.without(&rows(objective, &residuals));
    let gain_of = |loss: f64| 1.0 - loss / loss_now.max(f64::MIN_POSITIVE);
    let at_start = Screened { start, gain: gain_of(there.norm_squared()) };
    let direction = &there - now;
    let along = direction.norm_squared();
    let step = if along > 0.0 { -now.dot(&direction) / along } else { 0.0 };
    let linear = start.descriptor().neutral.filter(|_| TRUSTED.contains(&step)).map(|neutral| {
        let spec = start.descriptor().parameters[0];
        let mut moved = start;
        moved.parameters[0] =
            (neutral + step * (start.parameters[0] - neutral)).clamp(spec.lower, spec.upper);
        Screened { start: moved, gain: gain_of((now + direction * step).norm_squared()) }
    });
    match linear {
        Some(linear) if linear.gain > at_start.gain => Some(linear),
        _ => Some(at_start),
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
