//! Which effects the data ask for: forward, the best candidate at a time, judged on what the fit has not seen; then
//! backward, each effect must still be worth its place.

use bowden_model::effect::ActiveEffect;

use super::candidates::candidates;
use super::screening::screen;
use crate::fit::free::{Free, recalibrated};
use crate::fit::objective::{Objective, Part};
use crate::fit::solver::{COARSE_STEP, FINE_STEP, Solution, solve_in_rounds, solve_with_slopes};
use crate::joint_model::JointModel;
use crate::outcome::Failure;
use crate::progress::Progress;

/// Share of the held-out loss that an effect must remove. Contact, mesh and solver of a real bench differ from the
/// simulation by some 0.2 N, and effects that imitate that remove a part of it.
pub const WORTHWHILE_SHARE: f64 = 0.25;

/// Loss, in squared scales, that an effect must remove whatever the share.
pub const WORTHWHILE_LOSS: f64 = 0.3;

/// Advantage in held-out loss that each further parameter must earn between two candidates.
const LOSS_PER_PARAMETER: f64 = 0.03;

/// Strength, as a part of the typical one, below which an effect is not worth a name.
const NAMED_STRENGTH: f64 = 0.1;

/// Presliding below which a contact is an ordinary one, m: every real contact gives way by about ten micrometres before
/// it slips.
const ORDINARY_PRESLIDING_M: f64 = 4e-5;

/// Candidates that are fitted, of those that screening ranks first.
const FITTED: usize = 7;

/// Candidates whose fit is brought to an end, of those that fit best so far.
const FINALISTS: usize = 3;

/// Estimated gain below which a candidate is not fitted.
const PROMISING: f64 = 0.05;

/// Most effects that are named at once.
const MOST_EFFECTS: usize = 3;

/// Optimiser evaluations per parameter and round.
const PATIENCE: usize = 5;

/// A candidate that was fitted.
#[derive(Clone, Debug)]
pub struct Tried {
    /// The effect as it was fitted.
    pub effect: ActiveEffect,
    /// Model with it.
    pub model: JointModel,
    /// Held-out loss with it.
    pub heldout_loss: f64,
}

/// One effect that was chosen.
#[derive(Clone, Debug)]
pub struct Chosen {
    /// The effect, with its target, as it was first fitted.
    pub effect: ActiveEffect,
    /// Model with it, as it was first fitted.
    pub model: JointModel,
    /// Held-out loss before it was added.
    pub loss_before: f64,
    /// Held-out loss with it.
    pub loss_after: f64,
    /// Other candidates of the same round, best first.
    pub others: Vec<Tried>,
}

/// Result of the selection.
#[derive(Clone, Debug)]
pub struct Selected {
    /// Model with nominal parameters recalibrated, without any new effect.
    pub baseline: Solution,
    /// Model with all chosen effects.
    pub solution: Solution,
    /// Chosen effects in the order of the model's new effects.
    pub chosen: Vec<Chosen>,
    /// Whether the search came to its end.
    pub complete: bool,
}

/// Finds the effects that improve the held-out data.
///
/// # Errors
/// When the model cannot be driven.
pub fn select(
    objective: &Objective,
    model: &JointModel,
    progress: &dyn Progress,
) -> Result<Selected, Failure> {
    progress.stage("recalibrating", 0);
    let own = model.effects.len();
    let baseline = fit(objective, model, own, &[COARSE_STEP, FINE_STEP, FINE_STEP])?;
    let mut present = baseline.clone();
    let mut chosen: Vec<Chosen> = Vec::new();
    while chosen.len() < MOST_EFFECTS && !progress.interrupted() {
        let loss_before = objective.mean_loss(&present.residuals, Part::HeldOut);
        let predictions = objective.predict(&present.model)?;
        let all = candidates(&present.model, objective, &predictions);
        progress.stage("screening effects", all.iter().map(|c| c.starts.len() as u64).sum());
        let ranked = screen(objective, &present, &all, progress);
        let promising: Vec<_> = ranked.iter().filter(|s| s.gain > PROMISING).take(FITTED).collect();
        progress.stage("fitting effects", promising.len() as u64);
        let mut fits: Vec<(f64, Solution)> = Vec::new();
        for screened in promising {
            if progress.interrupted() {
                break;
            }
            let mut with = present.model.clone();
            with.effects.push(screened.start);
            let solution = fit_new(objective, &with, own, &present)?;
            fits.push((objective.mean_loss(&solution.residuals, Part::HeldOut), solution));
            progress.advance(1);
        }
        fits.retain(|(_, solution)| !solution.model.effects.last().is_some_and(negligible));
        fits.sort_by(|a, b| handicapped(a.0, &a.1).total_cmp(&handicapped(b.0, &b.1)));
        for (loss, solution) in fits.iter_mut().take(FINALISTS) {
            if progress.interrupted() {
                break;
            }
            *solution = fit(objective, &solution.model, own, &[FINE_STEP])?;
            *loss = objective.mean_loss(&solution.residuals, Part::HeldOut);
        }
        fits.retain(|(_, solution)| !solution.model.effects.last().is_some_and(negligible));
        fits.sort_by(|a, b| handicapped(a.0, &a.1).total_cmp(&handicapped(b.0, &b.1)));
        if fits.is_empty() {
            break;
        }
        let (loss_after, solution) = fits.remove(0);
        if !worthwhile(loss_before, loss_after) {
            break;
        }
        let newest = |solution: &Solution| solution.model.effects[solution.model.effects.len() - 1];
        let effect = newest(&solution);
        let others = fits
            .iter()
            .map(|(heldout_loss, solution)| Tried {
                effect: newest(solution),
                model: solution.model.clone(),
                heldout_loss: *heldout_loss,
            })
            .collect();
        let model = solution.model.clone();
        chosen.push(Chosen { effect, model, loss_before, loss_after, others });
        present = solution;
    }
    if !progress.interrupted() {
        prune(objective, own, &mut present, &mut chosen, progress)?;
    }
    Ok(Selected { baseline, solution: present, chosen, complete: !progress.interrupted() })
}

/// Whether an effect that brings the held-out loss from `before` to `after` is worth naming.
#[must_use]
pub fn worthwhile(before: f64, after: f64) -> bool {
    before - after > WORTHWHILE_LOSS && before - after > WORTHWHILE_SHARE * before
}

/// Whether an effect was fitted so weak that it is hardly there.
fn negligible(effect: &ActiveEffect) -> bool {
    let descriptor = effect.descriptor();
    let Some(strength) = descriptor.parameters.first() else { return false };
    let value = effect.parameters[0];
    match descriptor.id {
        "presliding_compliance" => value < ORDINARY_PRESLIDING_M,
        // Friction that hardly falls with speed is dry friction, which has a name of its own.
        "motor_stribeck_friction" => value < 0.3 * effect.parameters[2].max(strength.default),
        // The typical offset depends on the channel; the loss alone decides.
        "sensor_offset" => false,
        _ => descriptor.neutral.is_some_and(|neutral| {
            (value - neutral).abs() < NAMED_STRENGTH * (strength.default - neutral).abs()
        }),
    }
}

/// Held-out loss with the advantage that simpler effects get.
fn handicapped(loss: f64, solution: &Solution) -> f64 {
    let parameters = solution.model.effects.last().map_or(0, |effect| effect.descriptor().parameters.len());
    loss * (1.0 + LOSS_PER_PARAMETER * parameters as f64)
}

/// Removes effects that the later ones have made superfluous.
fn prune(
    objective: &Objective,
    own: usize,
    present: &mut Solution,
    chosen: &mut Vec<Chosen>,
    progress: &dyn Progress,
) -> Result<(), Failure> {
    if chosen.len() < 2 {
        return Ok(());
    }
    progress.stage("testing each effect again", chosen.len() as u64);
    let mut index = 0;
    while index < chosen.len() && chosen.len() > 1 && !progress.interrupted() {
        let loss_with = objective.mean_loss(&present.residuals, Part::HeldOut);
        let mut without = present.model.clone();
        without.effects.remove(own + index);
        let solution = fit(objective, &without, own, &[COARSE_STEP, FINE_STEP])?;
        let loss_without = objective.mean_loss(&solution.residuals, Part::HeldOut);
        progress.advance(1);
        if worthwhile(loss_without, loss_with) {
            chosen[index].loss_before = loss_without;
            chosen[index].loss_after = loss_with;
            index += 1;
        } else {
            chosen.remove(index);
            *present = solution;
        }
    }
    Ok(())
}

/// Like [`fit`], for a model that is that of `present` with one more effect, and only as far as a ranking needs.
fn fit_new(
    objective: &Objective,
    model: &JointModel,
    own: usize,
    present: &Solution,
) -> Result<Solution, Failure> {
    let free = free_parameters(model, own);
    solve_with_slopes(objective, model, &free, PATIENCE, &[COARSE_STEP], Some(&present.jacobian))
}

/// Fits the nominal parameters and those of all effects beyond the first `own`, which the rig itself stated.
fn fit(objective: &Objective, model: &JointModel, own: usize, rounds: &[f64]) -> Result<Solution, Failure> {
    solve_in_rounds(objective, model, &free_parameters(model, own), PATIENCE, rounds)
}

fn free_parameters(model: &JointModel, own: usize) -> Vec<Free> {
    let mut free = recalibrated(model);
    for effect in own..model.effects.len() {
        free.extend(Free::of_effect(model, effect));
    }
    free
}
