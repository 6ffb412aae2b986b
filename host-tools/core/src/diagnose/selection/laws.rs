//! Laws that the data ask for in place of the names, or beside them: tried once no further name is found, and held to more than a
//! name is.

use super::{Chosen, Fitted, Kind, PROMISING, Round, Search, Worth};
use crate::diagnose::policy::{POLICY, Policy};
use crate::diagnose::unexplained::unexplained;
use crate::fit::solver::{COARSE_STEP, FINE_STEP};
use crate::outcome::Failure;

/// Most laws that are found.
const MOST_LAWS: usize = 2;

/// Part of what names take off the loss that a law must promise to take off in their place, to be fitted.
const RIVALLING: f64 = 0.5;

impl Search<'_> {
    /// Puts one law in the place of all names, or of all but the first, where it predicts clearly better than they do: by [`Policy::worth_stating`]
    /// what one name does, and what several do by as much as a name must be worth. `nothing` is the fit without either. Says whether it
    /// did.
    pub(super) fn law_in_place_of_names(
        &self,
        nothing: &Fitted,
        present: &mut Fitted,
        chosen: &mut Vec<Chosen>,
        rounds: &mut Vec<Round>,
    ) -> Result<bool, Failure> {
        for kept in 0..chosen.len().min(2) {
            let better: Worth =
                if chosen.len() - kept > 1 { Policy::worth_naming } else { Policy::worth_stating };
            if self.progress.interrupted() || !better(&POLICY, present.loss, 0.0) {
                return Ok(false);
            }
            let beside = match chosen.first().filter(|_| kept == 1) {
                Some(first) => {
                    let (layout, with) = nothing.layout.with(&nothing.solution.model, first.effect);
                    self.fit(layout, &with, &[COARSE_STEP, FINE_STEP])?
                }
                None => nothing.clone(),
            };
            let before = self.without_exhausted(&beside)?;
            let removed_share = 1.0 - present.loss / before.loss;
            let (record, fits) =
                self.one_more(&before, Kind::Law, (RIVALLING * removed_share).max(PROMISING))?;
            rounds.push(Round { loss_before: before.loss, candidates: record });
            if let Some((found, with)) = self.found(&before, &beside, fits, Policy::worth_stating)?
                && with.shows(present, &with.newest(), |without, with| better(&POLICY, without, with))
            {
                chosen.truncate(kept);
                chosen.push(found);
                *present = with;
                return Ok(true);
            }
        }
        Ok(false)
    }

    /// Adds the laws that are worth stating to what was found, and takes out names that one of them makes superfluous: a name
    /// may have been the nearest thing on the list.
    pub(super) fn add_laws(
        &self,
        present: &mut Fitted,
        chosen: &mut Vec<Chosen>,
        rounds: &mut Vec<Round>,
    ) -> Result<(), Failure> {
        for _ in 0..MOST_LAWS {
            if self.progress.interrupted() || !POLICY.worth_stating(present.loss, 0.0) {
                break;
            }
            // Where a free form has shown that something is left, and where, a law of that part need be worth no more than a name.
            let left = unexplained(self.objective, None, &present.solution.model)?;
            let before = self.without_exhausted(present)?;
            let (record, fits) = self.one_more(&before, Kind::Law, PROMISING)?;
            rounds.push(Round { loss_before: before.loss, candidates: record });
            let there = |fitted: &Fitted| {
                let component = fitted.newest().descriptor().component.name();
                left.as_ref().is_some_and(|left| left.component == component)
            };
            let worth: Worth =
                if fits.first().is_some_and(there) { Policy::worth_naming } else { Policy::worth_stating };
            let Some((found, with)) = self.found(&before, present, fits, worth)? else { break };
            chosen.push(found);
            *present = with;
            self.prune(present, chosen)?;
        }
        Ok(())
    }
}
