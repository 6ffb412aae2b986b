//! Thresholds of the diagnosis: which reduction of the loss is enough to name an effect, to state a law, to report either.
//!
//! Every `diagnosis.json` repeats them next to the losses they were applied to. The loss is the mean squared residual in units of the noise
//! scale: 1 means that sensor noise and the tolerances of an ordinary bench explain all of it.

use serde::{Deserialize, Serialize};

/// Thresholds on losses and probabilities.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Policy {
    /// Minimum relative reduction of the loss for an effect to be named. The model differs from any real bench in more than the catalogue
    /// holds, and an effect that only imitates that difference reduces the loss by a smaller share.
    pub name_share: f64,
    /// Minimum absolute reduction of the loss for an effect to be named. On fifty virtual benches without a concealed effect (`prove`, groups
    /// `nothing` and `parameters`) candidates reduce it by up to 0.04 (`search` in each `diagnosis.json`), with two exceptions:
    /// `sheath_stribeck_friction`, up to 0.27, and one bench, up to 0.20, whose diagnosed rig would not fit better.
    pub name_loss: f64,
    /// Minimum absolute reduction of the loss where the effect acts least: above the 0.04 of those candidates. An effect that begins at a
    /// moment is chosen from all moments of the recordings and must reach `name_loss` there as well.
    pub elsewhere_loss: f64,
    /// Loss above which the residual is far beyond noise and bench tolerances: every residual is beyond the three noise scales at which the
    /// loss function changes from quadratic to linear.
    pub much_left: f64,
    /// Loss that sensor noise and the tolerances of an ordinary bench leave: residuals of one noise scale.
    pub noise_loss: f64,
    /// Relative reduction of the loss that each further parameter of a candidate must achieve in a comparison.
    pub share_per_parameter: f64,
    /// Minimum relative reduction of the loss for a law to be stated. A law is selected from many forms with up to three coefficients, so
    /// that it imitates a model error more easily than a named effect does.
    pub law_share: f64,
    /// Minimum absolute reduction of the loss for a law to be stated; below this loss no law is searched for.
    pub law_loss: f64,
    /// Minimum relative reduction of the training loss, from the recalibrated to the diagnosed rig, before any effect is reported
    /// (`training_loss` in each `diagnosis.json`). Effects that imitate bench tolerances stay far below it.
    pub paying_share: f64,
    /// Minimum deviation of a parameter from the rig file, in standard deviations, for it to be reported as wrong.
    pub sure_stds: f64,
    /// Half of the 90 % interval of a normally distributed value, in standard deviations.
    pub interval_stds: f64,
    /// Exponent that turns a ratio of losses into odds: at 10, a candidate whose loss is 20 % higher is six times less likely.
    pub odds_per_loss_ratio: f64,
    /// Minimum odds for a rival to be listed.
    pub listed_odds: f64,
    /// Relative improvement at which the probability that an effect exists is 50 %.
    pub even_improvement: f64,
}

/// Thresholds that every diagnosis uses.
pub const POLICY: Policy = Policy {
    name_share: 0.15,
    name_loss: 0.1,
    elsewhere_loss: 0.05,
    much_left: 10.0,
    noise_loss: 1.0,
    share_per_parameter: 0.03,
    law_share: 0.3,
    law_loss: 0.4,
    paying_share: 0.05,
    sure_stds: 3.0,
    interval_stds: 1.645,
    odds_per_loss_ratio: 10.0,
    listed_odds: 0.03,
    even_improvement: 0.1,
};

impl Policy {
    /// Whether an effect that reduces the loss from `before` to `after` is named.
    ///
    /// A remaining loss above [`much_left`](Self::much_left) means that other physics is missing as well, which a small reduction may only
    /// imitate: each factor of 100 above it raises the required share by `name_share`.
    #[must_use]
    pub fn worth_naming(&self, before: f64, after: f64) -> bool {
        let share = self.name_share * (1.0 + 0.5 * (after / self.much_left).log10().max(0.0));
        before - after > self.name_loss && before - after > share * before
    }

    /// The same where the reduction may have another cause: for an error of a sensor that its own channel cannot distinguish from a change
    /// of parameters. It must reach the share of a law.
    #[must_use]
    pub fn worth_naming_in_doubt(&self, before: f64, after: f64) -> bool {
        self.worth_naming(before, after) && before - after > self.law_share * before
    }

    /// Whether an effect of one bench of several takes enough off there. What is special about a bench may have other causes than an effect,
    /// parameters and mounting among them, and is looked for on each of the benches.
    #[must_use]
    pub fn shows_on_one_bench(&self, before: f64, after: f64) -> bool {
        before - after > self.law_share * before
    }

    /// Whether a named effect also reduces the loss where it acts least. A saturated sensor or an end stop is inactive most of the time, so
    /// that a small reduction is enough there; with a remaining loss above `much_left` it is not, because it may be an imitation.
    #[must_use]
    pub fn shows_elsewhere(&self, before: f64, after: f64, begins_at_a_moment: bool) -> bool {
        let least = if begins_at_a_moment { self.name_loss } else { self.elsewhere_loss };
        before - after > least && self.pays(before, after) && after <= self.much_left
    }

    /// The same for a law: it must reduce the loss by the same share as overall, and by what is enough for a named effect. Drag acts most at
    /// the highest speeds, so that its absolute reduction is smaller without the seconds in which these occur.
    #[must_use]
    pub fn law_shows_elsewhere(&self, before: f64, after: f64) -> bool {
        before - after > self.name_loss && before - after > self.law_share * before
    }

    /// Whether `instances` further instances of a named effect, such as harmonics of cogging, are kept.
    #[must_use]
    pub fn worth_having(&self, before: f64, after: f64, instances: usize) -> bool {
        before - after > self.name_loss
            && before - after > self.share_per_parameter * instances as f64 * before
    }

    /// Whether a law that reduces the loss from `before` to `after` is stated, or an effect named that shows beside a law alone, whose form may
    /// be right only roughly.
    #[must_use]
    pub fn worth_stating(&self, before: f64, after: f64) -> bool {
        before - after > self.law_loss && before - after > self.law_share * before
    }

    /// Whether the diagnosed rig, written without nuisance terms, fits better than the recalibrated one.
    #[must_use]
    pub fn pays(&self, recalibrated: f64, diagnosed: f64) -> bool {
        recalibrated - diagnosed > self.paying_share * recalibrated
    }

    /// Whether the difference between a fitted value and a stated one exceeds the uncertainty of the fit; without a standard deviation it
    /// counts as doing so.
    #[must_use]
    pub fn is_sure(&self, difference: f64, std: Option<f64>) -> bool {
        std.is_none_or(|std| difference.abs() > self.sure_stds * std)
    }

    /// Factor on the loss of a candidate in comparisons: it grows with the number of parameters, and by `name_share` for a form that is not
    /// the usual one.
    #[must_use]
    pub fn handicap(&self, parameters: usize, is_usual_form: bool) -> f64 {
        let share = if is_usual_form { 0.0 } else { self.name_share };
        (1.0 + self.share_per_parameter * parameters as f64) / (1.0 - share)
    }

    /// Whether the 90 % interval of a fitted value contains zero.
    #[must_use]
    pub fn may_be_zero(&self, value: f64, std: f64) -> bool {
        value.abs() < self.interval_stds * std
    }

    /// Odds of a candidate whose loss is `loss_ratio` times that of the named effect; 0 where its simulation ran away, so that it has no loss.
    #[must_use]
    pub fn odds(&self, loss_ratio: f64) -> f64 {
        if loss_ratio.is_nan() { 0.0 } else { loss_ratio.powf(-self.odds_per_loss_ratio) }
    }

    /// Whether a candidate with these odds is listed as a rival of the named effect.
    #[must_use]
    pub fn is_listed(&self, odds: f64) -> bool {
        odds > self.listed_odds
    }

    /// Probability that an effect with this relative improvement exists at all.
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
        assert_eq!([f64::INFINITY, f64::NAN].map(|ratio| POLICY.odds(ratio)), [0.0; 2]);
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
            assert_eq!(POLICY.worth_naming_in_doubt(before, after), named, "{before} to {after}");
        }
        assert!(!POLICY.worth_stating(0.7, 0.35));
    }

    /// A reading that is cut off at its limit, beside a winding that heats up unseen: of 3.52 it takes 0.45 off away from its limit, an
    /// eighth. What a single moment asks for takes nothing off elsewhere.
    #[test]
    fn what_is_idle_most_of_the_time_has_to_show_elsewhere_and_no_more() {
        assert!(!POLICY.worth_naming(3.52, 3.07) && POLICY.shows_elsewhere(3.52, 3.07, true));
        for (before, after) in [(3.52, 3.4), (0.5, 0.46), (3.5, 3.6), (80.0, 70.0)] {
            assert!(!POLICY.shows_elsewhere(before, after, false), "{before} to {after}");
        }
        for begins_at_a_moment in [false, true] {
            assert_eq!(POLICY.shows_elsewhere(0.5, 0.42, begins_at_a_moment), !begins_at_a_moment);
        }
    }

    /// Drag of a motor, without the tenth of the seconds in which it takes most off: 0.19 of 0.41. A shape that fits one moment takes off a
    /// large part of that and hardly anything elsewhere.
    #[test]
    fn a_law_shows_elsewhere_by_the_same_share() {
        assert!(!POLICY.worth_stating(0.41, 0.21) && POLICY.law_shows_elsewhere(0.41, 0.21));
        for (before, after) in [(0.41, 0.32), (0.3, 0.205), (3.0, 2.2), (1.0, 1.1)] {
            assert!(!POLICY.law_shows_elsewhere(before, after), "{before} to {after}");
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
