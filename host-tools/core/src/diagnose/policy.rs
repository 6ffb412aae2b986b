//! When something is said: the numbers by which losses become names, laws, odds and a verdict.
//!
//! They stand in every `diagnosis.json`, so that a reader can hold the losses there against them. A loss is in squared scales: 1 where
//! every residual is what sensor noise and an ordinary bench leave.

use serde::{Deserialize, Serialize};

/// The numbers.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Policy {
    /// Share of the loss that an effect must remove to be named: what two realities differ by is not all ordinary contact and
    /// friction, and effects that imitate the rest remove a part of it.
    pub name_share: f64,
    /// Loss that an effect must remove whatever the share. On fifty virtual benches that hide nothing (`prove`, groups `nothing` and
    /// `parameters`) candidates remove up to 0.04, as `search` in their `diagnosis.json` tells, but for friction of the sheath that falls
    /// at a crawl (`sheath_stribeck_friction`), up to 0.27, and for one bench, up to 0.20, where the rig that would be written does not
    /// gain by it.
    pub name_loss: f64,
    /// Loss from which on more is left than noise and an ordinary bench leave: every residual beyond the three scales at which the loss
    /// bends.
    pub much_left: f64,
    /// Advantage in loss that each further parameter must earn between two candidates.
    pub share_per_parameter: f64,
    /// Share of the loss that a law must remove. It is chosen among many forms with up to three coefficients each, so that more
    /// of what two realities differ by is imitated by one of them than by a name.
    pub law_share: f64,
    /// Loss that a law must remove whatever the share: where less than that is left no law is looked for.
    pub law_loss: f64,
    /// Share of the loss of the recalibrated rig that the diagnosed one must take off, for what was found to be said
    /// (`training_loss` in each `diagnosis.json`): far below it lies what imitates the rest of an ordinary bench, above it what
    /// is there.
    pub paying_share: f64,
    /// Standard deviations by which a wrong parameter is off at least.
    pub sure_stds: f64,
    /// Sharpness with which a ratio of losses turns into odds: at 10 a candidate that leaves a fifth more is six times less
    /// likely.
    pub odds_per_loss_ratio: f64,
    /// Odds below which a rival is not listed.
    pub listed_odds: f64,
    /// Improvement at which an effect is as likely as not.
    pub even_improvement: f64,
}

/// The policy of every diagnosis.
pub const POLICY: Policy = Policy {
    name_share: 0.15,
    name_loss: 0.1,
    much_left: 10.0,
    share_per_parameter: 0.03,
    law_share: 0.3,
    law_loss: 0.4,
    paying_share: 0.05,
    sure_stds: 3.0,
    odds_per_loss_ratio: 10.0,
    listed_odds: 0.03,
    even_improvement: 0.1,
};

impl Policy {
    /// Whether an effect that brings the loss from `before` to `after` is worth naming.
    ///
    /// Where what is left stands far above what an ordinary bench leaves, other physics is missing too, and what takes a little off may
    /// only imitate it: every factor of a hundred beyond `much_left` asks for `name_share` more.
    #[must_use]
    pub fn worth_naming(&self, before: f64, after: f64) -> bool {
        let share = self.name_share * (1.0 + 0.5 * (after / self.much_left).log10().max(0.0));
        before - after > self.name_loss && before - after > share * before
    }

    /// Whether an effect is worth naming that its own channel does not tell from a parameter: it takes off the share of a law too.
    #[must_use]
    pub fn worth_naming_untold(&self, before: f64, after: f64) -> bool {
        self.worth_naming(before, after) && before - after > self.law_share * before
    }

    /// Whether an effect that is worth its name shows where it takes least off, too: what limits a reading or stops a joint is idle most of
    /// the time, and other physics that is missing hides all but a little of it there. Where more than `much_left` is left that little is
    /// more likely an imitation, and is not taken for it.
    #[must_use]
    pub fn shows_elsewhere(&self, before: f64, after: f64) -> bool {
        before - after > self.name_loss && self.pays(before, after) && after <= self.much_left
    }

    /// Whether so many further instances of an effect that has its name are worth having.
    #[must_use]
    pub fn worth_having(&self, before: f64, after: f64, instances: usize) -> bool {
        before - after > self.name_loss
            && before - after > self.share_per_parameter * instances as f64 * before
    }

    /// Whether a law is worth stating.
    #[must_use]
    pub fn worth_stating(&self, before: f64, after: f64) -> bool {
        before - after > self.law_loss && before - after > self.law_share * before
    }

    /// Whether the diagnosed rig, which stands without what is ordinary, fits better than the recalibrated one.
    #[must_use]
    pub fn pays(&self, recalibrated: f64, diagnosed: f64) -> bool {
        recalibrated - diagnosed > self.paying_share * recalibrated
    }

    /// Factor of the loss with an effect, where candidates are compared: its parameters count, and a form that is not the usual one
    /// must be worth its choice as a name must.
    #[must_use]
    pub fn handicap(&self, parameters: usize, is_usual_form: bool) -> f64 {
        let share = if is_usual_form { 0.0 } else { self.name_share };
        (1.0 + self.share_per_parameter * parameters as f64) / (1.0 - share)
    }

    /// Odds of a candidate whose loss is so many times that of the named effect.
    #[must_use]
    pub fn odds(&self, loss_ratio: f64) -> f64 {
        loss_ratio.powf(-self.odds_per_loss_ratio)
    }

    /// Whether a candidate with these odds is listed as a rival of the named effect.
    #[must_use]
    pub fn is_listed(&self, odds: f64) -> bool {
        odds > self.listed_odds
    }

    /// Probability that anything is there at all which takes so much off the loss.
    #[must_use]
    pub fn presence(&self, improvement: f64) -> f64 {
        1.0 - 0.5 * (-(improvement - self.even_improvement).max(0.0) / self.even_improvement).exp()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A fifth of what is left is worth a name up to ten squared scales; of a hundred it takes more than 22 %.
    #[test]
    fn where_much_is_left_an_effect_has_to_take_more_off() {
        for (before, after, named) in [
            (10.0, 8.0, true),
            (12.5, 10.0, true),
            (125.0, 100.0, false),
            (145.0, 100.0, true),
            (0.2, 0.11, false),
        ] {
            assert_eq!(POLICY.worth_naming(before, after), named, "{before} to {after}");
        }
    }

    /// By hand: 1.2^-10 = 0.16, one in six; 1.42^-10 = 0.030.
    #[test]
    fn a_rival_that_leaves_two_fifths_more_is_no_longer_listed() {
        assert!((POLICY.odds(1.2) - 0.1615).abs() < 1e-4);
        assert!(POLICY.is_listed(POLICY.odds(1.41)) && !POLICY.is_listed(POLICY.odds(1.43)));
        assert_eq!(POLICY.presence(0.1), 0.5);
        assert!(POLICY.presence(0.9) > 0.999);
    }

    #[test]
    fn a_law_takes_more_than_a_name_and_an_instance_less() {
        assert!(POLICY.worth_naming(2.0, 1.6) && !POLICY.worth_stating(2.0, 1.6));
        assert!(POLICY.worth_stating(2.0, 1.3));
        assert!(!POLICY.worth_naming(10.0, 9.0) && POLICY.worth_having(10.0, 9.0, 1));
        assert!(!POLICY.worth_having(10.0, 9.8, 1));
        // Four of them, 3 % each.
        assert!(!POLICY.worth_having(10.0, 9.0, 4) && POLICY.worth_having(10.0, 8.7, 4));
    }

    /// A weak fault that takes half of a small loss off is named, though no law is looked for there.
    #[test]
    fn what_its_own_channel_does_not_tell_takes_the_share_of_a_law_off() {
        for (before, after, named) in
            [(2.85, 2.3, false), (0.84, 0.38, true), (0.7, 0.35, true), (0.15, 0.08, false)]
        {
            assert_eq!(POLICY.worth_naming_untold(before, after), named, "{before} to {after}");
        }
        assert!(!POLICY.worth_stating(0.7, 0.35));
    }

    /// A reading that is cut off at its limit, beside a winding that heats up unseen: of 3.52 it takes 0.45 off away from its limit, an
    /// eighth. What a single moment asks for takes nothing off elsewhere.
    #[test]
    fn what_is_idle_most_of_the_time_has_to_show_elsewhere_and_no_more() {
        assert!(!POLICY.worth_naming(3.52, 3.07) && POLICY.shows_elsewhere(3.52, 3.07));
        for (before, after) in [(3.52, 3.4), (0.5, 0.41), (3.5, 3.6), (80.0, 70.0)] {
            assert!(!POLICY.shows_elsewhere(before, after), "{before} to {after}");
        }
    }

    #[test]
    fn what_hardly_pays_is_not_said() {
        for scale in [0.01, 1.0, 100.0] {
            assert!(POLICY.pays(scale, 0.94 * scale) && !POLICY.pays(scale, 0.96 * scale), "scale {scale}");
        }
        assert!(!POLICY.pays(1.0, 1.1), "worse than without");
    }
}
