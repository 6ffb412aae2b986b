//! Cross-validation between recordings: with three or more, an effect that was found on all of them is fitted to some and must reduce the
//! loss of the others. A fit to many recordings can otherwise adapt to each.

use super::{Fitted, PATIENCE, Search};
use crate::fit::objective::{Entry, Part};
use crate::fit::solver::{FINE_STEP, solve_in_rounds};
use crate::outcome::Failure;

/// Number of groups into which recordings are divided; each group is left out once.
const GROUPS: usize = 3;

impl Search<'_> {
    /// Whether `with` is `worth` more than `without` on recordings to which neither was fitted, where its newest effect acts; true with fewer
    /// than three of them.
    pub(super) fn holds_across_recordings(
        &self,
        without: &Fitted,
        with: &Fitted,
        worth: impl Fn(f64, f64) -> bool,
    ) -> Result<bool, Failure> {
        let bench = with.solution.model.effects.last().and_then(|newest| newest.bench);
        let judging = self.objective.on(bench).recordings();
        if judging < GROUPS || self.progress.interrupted() {
            return Ok(true);
        }
        self.progress.stage("judging recordings by one another", 2 * GROUPS as u64);
        let [without, with] = [self.loss_across(without, bench)?, self.loss_across(with, bench)?];
        Ok(worth(without, with))
    }

    /// Whether there are enough recordings for cross-validation.
    pub(super) fn recordings_judge_one_another(&self) -> bool {
        self.objective.recordings() >= GROUPS
    }

    /// Mean loss of the recordings of a bench, or of all, each after a fit to those of the other groups.
    fn loss_across(&self, fitted: &Fitted, bench: Option<u16>) -> Result<f64, Failure> {
        let (mut sum, mut weight) = (0.0, 0.0);
        for group in 0..GROUPS {
            let objective = self.objective.holding_out(|recording| recording % GROUPS == group);
            let model = &fitted.solution.model;
            let free = fitted.layout.free(self.believed, model);
            let solution = solve_in_rounds(&objective, model, &free, PATIENCE, &[FINE_STEP])?;
            let judges = |entry: &Entry| {
                entry.block.part == Part::HeldOut
                    && bench.is_none_or(|bench| objective.bench(entry.recording) == bench)
            };
            let held_out = objective.entries().filter(judges).count() as f64;
            sum += held_out * objective.mean_loss_on(bench, &solution.residuals, Part::HeldOut);
            weight += held_out;
            self.progress.advance(1);
        }
        Ok(sum / f64::max(weight, 1.0))
    }
}
