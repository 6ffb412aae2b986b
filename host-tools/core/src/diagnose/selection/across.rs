//! Cross-validation between recordings: with three or more, an effect that was found on all of them is fitted to some and must reduce the
//! loss of the others. A fit to many recordings can otherwise adapt to each.

use super::{Fitted, PATIENCE, Search};
use crate::fit::objective::Part;
use crate::fit::solver::{FINE_STEP, solve_in_rounds};
use crate::outcome::Failure;

/// Number of groups into which recordings are divided; each group is left out once.
const GROUPS: usize = 3;

impl Search<'_> {
    /// Whether `with` is `worth` more than `without` on recordings to which neither was fitted; true with fewer than three recordings.
    pub(super) fn holds_across_recordings(
        &self,
        without: &Fitted,
        with: &Fitted,
        worth: impl Fn(f64, f64) -> bool,
    ) -> Result<bool, Failure> {
        if !self.recordings_judge_one_another() || self.progress.interrupted() {
            return Ok(true);
        }
        self.progress.stage("judging recordings by one another", 2 * GROUPS as u64);
        let [without, with] = [self.loss_across(without)?, self.loss_across(with)?];
        Ok(worth(without, with))
    }

    /// Whether there are enough recordings for cross-validation.
    pub(super) fn recordings_judge_one_another(&self) -> bool {
        self.objective.recordings() >= GROUPS
    }

    /// Mean loss of the recordings, each after a fit to those of the other groups.
    fn loss_across(&self, fitted: &Fitted) -> Result<f64, Failure> {
        let (mut sum, mut weight) = (0.0, 0.0);
        for group in 0..GROUPS {
            let objective = self.objective.holding_out(|recording| recording % GROUPS == group);
            let model = &fitted.solution.model;
            let free = fitted.layout.free(self.believed, model);
            let solution = solve_in_rounds(&objective, model, &free, PATIENCE, &[FINE_STEP])?;
            let held_out =
                objective.entries().filter(|entry| entry.block.part == Part::HeldOut).count() as f64;
            sum += held_out * objective.mean_loss(&solution.residuals, Part::HeldOut);
            weight += held_out;
            self.progress.advance(1);
        }
        Ok(sum / f64::max(weight, 1.0))
    }
}
