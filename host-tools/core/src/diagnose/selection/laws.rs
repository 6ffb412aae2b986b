//! Laws that the data ask for beside the names: tried once no further name is found, and held to more than a name is.

use super::{Chosen, Fitted, Kind, Round, Search};
use crate::outcome::Failure;

/// Share of the held-out loss that a law must remove. It is chosen among many forms with up to three coefficients each, so that
/// more of what two realities differ by is imitated by one of them than by a name.
const LAW_SHARE: f64 = 0.3;

/// Held-out loss, in squared scales, that a law must remove whatever the share: where less than that is left no law is looked for.
const LAW_LOSS: f64 = 0.4;

/// Most laws that are found.
const MOST_LAWS: usize = 2;

/// Whether a law that brings the held-out loss from `before` to `after` is worth stating.
pub(super) fn worth_stating(before: f64, after: f64) -> bool {
    before - after > LAW_LOSS && before - after > LAW_SHARE * before
}

impl Search<'_> {
    /// Adds the laws that are worth stating to what was found, and takes out names that one of them makes superfluous: a name
    /// may have been the nearest thing on the list.
    pub(super) fn add_laws(
        &self,
        present: &mut Fitted,
        chosen: &mut Vec<Chosen>,
        rounds: &mut Vec<Round>,
    ) -> Result<(), Failure> {
        for _ in 0..MOST_LAWS {
            if self.progress.interrupted() || !worth_stating(present.loss, 0.0) {
                break;
            }
            let before = self.without_exhausted(present)?;
            let (record, fits) = self.one_more(&before, Kind::Law)?;
            rounds.push(Round { loss_before: before.loss, candidates: record });
            let Some((found, with)) = self.found(&before, present, fits, worth_stating)? else { break };
            chosen.push(found);
            *present = with;
            self.prune(present, chosen)?;
        }
        Ok(())
    }
}
