//! What many cases say together: rates beside their goals, confusion, calibration.

use std::collections::BTreeMap;

use super::outcome::Outcome;
use super::plan::Group;
use super::score::{Score, score};

/// So many of so many.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Rate {
    /// Cases of which it holds.
    pub hits: usize,
    /// All cases.
    pub of: usize,
}

impl Rate {
    /// Counts the answers that are there.
    pub fn count(answers: impl IntoIterator<Item = bool>) -> Self {
        answers
            .into_iter()
            .fold(Self::default(), |rate, hit| Self { hits: rate.hits + usize::from(hit), of: rate.of + 1 })
    }

    /// Share, 0 to 1; `None` without cases.
    #[must_use]
    pub fn share(self) -> Option<f64> {
        (self.of > 0).then(|| self.hits as f64 / self.of as f64)
    }
}

impl std::fmt::Display for Rate {
    fn fmt(&self, f: &mut std::fmt::Formatter) -> std::fmt::Result {
        match self.share() {
            Some(share) => write!(f, "{} of {} ({:.1} %)", self.hits, self.of, 100.0 * share),
            None => f.write_str("no case"),
        }
    }
}

/// A score and what is wanted of it.
#[derive(Clone, Debug, PartialEq)]
pub struct Goal {
    /// What is measured.
    pub what: &'static str,
    /// What came out.
    pub found: String,
    /// What is wanted.
    pub wanted: &'static str,
    /// Whether it is met; `None` without a case.
    pub met: Option<bool>,
}

/// Statements whose probability lies in one range.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Bin {
    /// From this probability.
    pub from: f64,
    /// Below this one; the last bin holds 1 as well.
    pub to: f64,
    /// Mean of what was stated.
    pub stated: Option<f64>,
    /// Statements that were right.
    pub right: Rate,
}

/// Edges of the calibration's bins.
const BIN_EDGES: [f64; 7] = [0.0, 0.5, 0.7, 0.8, 0.9, 0.97, 1.0];

/// Median, `None` for nothing.
#[must_use]
pub fn median(values: impl IntoIterator<Item = f64>) -> Option<f64> {
    quantile(values, 0.5)
}

/// Quantile by linear interpolation, `None` for nothing.
#[must_use]
pub fn quantile(values: impl IntoIterator<Item = f64>, share: f64) -> Option<f64> {
    let mut values: Vec<f64> = values.into_iter().collect();
    values.sort_by(f64::total_cmp);
    let place = share * values.len().checked_sub(1)? as f64;
    let (low, high) = (values[place.floor() as usize], values[place.ceil() as usize]);
    Some(low + place.fract() * (high - low))
}

/// Outcomes with their scores.
#[derive(Clone, Debug)]
pub struct Summary {
    /// Each case, in the order of the run.
    pub cases: Vec<(Outcome, Score)>,
}

impl Summary {
    /// Scores all outcomes.
    #[must_use]
    pub fn of(outcomes: Vec<Outcome>) -> Self {
        let cases = outcomes.into_iter().map(|outcome| {
            let score = score(&outcome);
            (outcome, score)
        });
        Self { cases: cases.collect() }
    }

    /// Scores of a group.
    pub fn group(&self, group: Group) -> impl Iterator<Item = &Score> {
        self.cases.iter().filter(move |(outcome, _)| outcome.group == group).map(|(_, score)| score)
    }

    /// Cases that are not right.
    pub fn failed(&self) -> impl Iterator<Item = &(Outcome, Score)> {
        self.cases.iter().filter(|(_, score)| !score.right)
    }

    /// All scores that have a goal.
    #[must_use]
    pub fn goals(&self) -> Vec<Goal> {
        let at_least = |rate: Rate, wanted: f64| rate.share().map(|share| share >= wanted);
        let top1 = Rate::count(self.group(Group::Single).filter_map(|score| score.top1));
        let exact = Rate::count(self.group(Group::Single).map(|score| score.exact));
        let pairs = Rate::count(self.group(Group::Pair).filter_map(|score| score.all_named));
        let hiding_nothing = || self.group(Group::Nothing).chain(self.group(Group::Parameters));
        let false_physics = Rate::count(hiding_nothing().map(|score| !score.false_alarms.is_empty()));
        let outside = Rate::count(self.group(Group::Outside).map(|score| score.right));
        let laws: Vec<[bool; 3]> = self.group(Group::Outside).filter_map(|score| score.law).collect();
        let [port, variable, form] = [0, 1, 2].map(|part| Rate::count(laws.iter().map(|law| law[part])));
        let with_law = |score: &&Score| score.law.is_some();
        let unlisted =
            Rate::count(self.group(Group::Outside).filter(with_law).map(|s| s.false_alarms.is_empty()));
        let modelled: Vec<f64> =
            self.group(Group::Outside).filter(with_law).filter_map(|s| s.heldout_ratio).collect();
        let of_modelled = |part| quantile(modelled.iter().copied(), part);
        let mixed = Rate::count(self.group(Group::Mixed).map(|score| score.right));
        let of_many = self.group(Group::Many).map(|score| score.named);
        let [concealed, named] = of_many.fold([0, 0], |sum, part| [sum[0] + part[0], sum[1] + part[1]]);
        let named = Rate { hits: named, of: concealed };
        let clean = Rate::count(self.group(Group::Many).map(|score| score.false_alarms.is_empty()));
        let right = |group| Rate::count(self.group(group).map(|score| score.right));
        let [geometry, dirty, slow, no_tensions, motor_side] =
            [Group::Geometry, Group::Dirty, Group::Slow, Group::NoTensions, Group::MotorSide].map(right);
        let unmeasured = median(self.cases.iter().filter_map(|(_, score)| score.unmeasured_ratio));
        let ratio = median(self.heldout_ratios());
        let certain = self.certain();
        let share = |value: Option<f64>| value.map_or("no case".to_owned(), |value| format!("{value:.2}"));
        vec![
            Goal {
                what: "single effects: first name right",
                found: top1.to_string(),
                wanted: "≥ 95 %",
                met: at_least(top1, 0.95),
            },
            Goal {
                what: "single effects: exact set",
                found: exact.to_string(),
                wanted: "≥ 90 %",
                met: at_least(exact, 0.90),
            },
            Goal {
                what: "pairs: both named",
                found: pairs.to_string(),
                wanted: "≥ 85 %",
                met: at_least(pairs, 0.85),
            },
            Goal {
                what: "nothing or parameters only: false physics",
                found: false_physics.to_string(),
                wanted: "none",
                met: false_physics.share().map(|share| share == 0.0),
            },
            Goal {
                what: "outside the catalogue: `unexplained`, right component",
                found: outside.to_string(),
                wanted: "≥ 90 %",
                met: at_least(outside, 0.90),
            },
            Goal {
                what: "laws: not named as something listed",
                found: unlisted.to_string(),
                wanted: "≥ 90 %",
                met: at_least(unlisted, 0.90),
            },
            Goal {
                what: "laws: right port",
                found: port.to_string(),
                wanted: "≥ 90 %",
                met: at_least(port, 0.90),
            },
            Goal {
                what: "laws: right port and variable",
                found: variable.to_string(),
                wanted: "≥ 85 %",
                met: at_least(variable, 0.85),
            },
            Goal {
                what: "laws: right port, variable and form",
                found: form.to_string(),
                wanted: "≥ 75 %",
                met: at_least(form, 0.75),
            },
            Goal {
                what: "laws: held-out error over that of the true law, median",
                found: share(of_modelled(0.5)),
                wanted: "≤ 1.3",
                met: of_modelled(0.5).map(|ratio| ratio <= 1.3),
            },
            Goal {
                what: "laws: the same, nine of ten",
                found: share(of_modelled(0.9)),
                wanted: "≤ 2",
                met: of_modelled(0.9).map(|ratio| ratio <= 2.0),
            },
            Goal {
                what: "a listed effect and a law: both right",
                found: mixed.to_string(),
                wanted: "≥ 75 %",
                met: at_least(mixed, 0.75),
            },
            Goal {
                what: "four or five effects: named",
                found: named.to_string(),
                wanted: "≥ 80 %",
                met: at_least(named, 0.80),
            },
            Goal {
                what: "four or five effects: nothing false beside them",
                found: clean.to_string(),
                wanted: "≥ 90 %",
                met: at_least(clean, 0.90),
            },
            Goal {
                what: "radius and arm wrong: right",
                found: geometry.to_string(),
                wanted: "≥ 90 %",
                met: at_least(geometry, 0.90),
            },
            Goal {
                what: "dirty files: right",
                found: dirty.to_string(),
                wanted: "≥ 90 %",
                met: at_least(dirty, 0.90),
            },
            Goal {
                what: "recorded at 100 Hz: right",
                found: slow.to_string(),
                wanted: "≥ 90 %",
                met: at_least(slow, 0.90),
            },
            Goal {
                what: "encoders and motor alone: right",
                found: no_tensions.to_string(),
                wanted: "≥ 80 %",
                met: at_least(no_tensions, 0.80),
            },
            Goal {
                what: "tensions at the motor alone: right",
                found: motor_side.to_string(),
                wanted: "≥ 80 %",
                met: at_least(motor_side, 0.80),
            },
            Goal {
                what: "channels that were not recorded: error over the rig file's, median",
                found: share(unmeasured),
                wanted: "≤ 1",
                met: unmeasured.map(|ratio| ratio <= 1.0),
            },
            Goal {
                what: "held-out error over that of the truth, median",
                found: share(ratio),
                wanted: "≤ 1.2",
                met: ratio.map(|ratio| ratio <= 1.2),
            },
            Goal {
                what: "statements at ≥ 90 %: right",
                found: certain.to_string(),
                wanted: "≥ 85 %",
                met: at_least(certain, 0.85),
            },
        ]
    }

    /// Held-out error over that of the truth, where a rig file can say the truth.
    pub fn heldout_ratios(&self) -> impl Iterator<Item = f64> {
        let sayable = self.cases.iter().filter(|(outcome, _)| outcome.group != Group::Outside);
        sayable.filter_map(|(_, score)| score.heldout_ratio)
    }

    fn statements(&self) -> impl Iterator<Item = (f64, bool)> {
        self.cases.iter().flat_map(|(_, score)| score.statements.iter().copied())
    }

    /// Of the statements at 90 % or more, how many are right.
    #[must_use]
    pub fn certain(&self) -> Rate {
        Rate::count(self.statements().filter(|(probability, _)| *probability >= 0.9).map(|(_, right)| right))
    }

    /// Stated probability against share right.
    #[must_use]
    pub fn calibration(&self) -> Vec<Bin> {
        let bins = BIN_EDGES.windows(2).map(|edges| {
            let (from, to) = (edges[0], edges[1]);
            let inside: Vec<(f64, bool)> = self
                .statements()
                .filter(|(probability, _)| *probability >= from && (*probability < to || to == 1.0))
                .collect();
            let stated: f64 = inside.iter().map(|(probability, _)| probability).sum();
            Bin {
                from,
                to,
                stated: (!inside.is_empty()).then(|| stated / inside.len() as f64),
                right: Rate::count(inside.iter().map(|(_, right)| *right)),
            }
        });
        bins.collect()
    }

    /// How often each concealed effect was given each name: true, named, cases. Where several effects are concealed or
    /// named, equal names go together first; what is left over is paired in order.
    #[must_use]
    pub fn confusion(&self) -> BTreeMap<(String, String), usize> {
        let mut cells = BTreeMap::new();
        for (outcome, _) in &self.cases {
            let truth = &outcome.truth;
            let mut concealed: Vec<String> = truth.effects.iter().map(|effect| effect.id.clone()).collect();
            concealed.extend(truth.outside.iter().map(|(id, _)| id.clone()));
            let Some(said) = &outcome.said else {
                for id in concealed {
                    *cells.entry((id, "no diagnosis".to_owned())).or_default() += 1;
                }
                continue;
            };
            let mut named: Vec<String> = said.effects.iter().map(|effect| effect.id.clone()).collect();
            concealed.retain(|id| {
                let place = named.iter().position(|name| name == id);
                if let Some(place) = place {
                    *cells.entry((id.clone(), named.remove(place))).or_default() += 1;
                }
                place.is_none()
            });
            let silent = if said.unexplained.is_some() { "unexplained" } else { "nothing" };
            let rows = concealed.len().max(named.len());
            // A rig that hides nothing and gets no name is a row of its own.
            let rows = if truth.effects.is_empty() && truth.outside.is_empty() { rows.max(1) } else { rows };
            for row in 0..rows {
                let of = |list: &[String], none: &str| list.get(row).map_or(none.to_owned(), Clone::clone);
                *cells.entry((of(&concealed, "nothing"), of(&named, silent))).or_default() += 1;
            }
        }
        cells
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::prove::outcome::tests::{diagnosis, outcome};

    fn cell(summary: &Summary, truth: &str, named: &str) -> usize {
        summary.confusion().get(&(truth.to_owned(), named.to_owned())).copied().unwrap_or(0)
    }

    fn summary() -> Summary {
        let spring = ("joint_spring", "joint");
        let said = |probability| diagnosis("missing_physics", &[("joint_spring", "joint", probability)]);
        let wrong = diagnosis("missing_physics", &[("joint_backlash", "joint", 0.92)]);
        Summary::of(vec![
            outcome(Group::Single, &[spring], said(0.95)),
            outcome(Group::Single, &[spring], said(0.99)),
            outcome(Group::Single, &[spring], said(0.75)),
            outcome(Group::Single, &[spring], wrong),
            outcome(Group::Pair, &[("sensor_lag", "sensors"), spring], said(0.6)),
            outcome(Group::Nothing, &[], diagnosis("consistent", &[])),
        ])
    }

    #[test]
    fn goals_stand_beside_what_was_found() {
        let goals = summary().goals();
        let found = |what: &str| goals.iter().find(|goal| goal.what.starts_with(what)).unwrap();
        assert_eq!(found("single effects: first").found, "3 of 4 (75.0 %)");
        assert_eq!(found("single effects: first").met, Some(false));
        assert_eq!((found("pairs").found.as_str(), found("pairs").met), ("0 of 1 (0.0 %)", Some(false)));
        assert_eq!(found("nothing").met, Some(true));
        assert_eq!((found("outside").found.as_str(), found("outside").met), ("no case", None));
    }

    #[test]
    fn confusion_pairs_equal_names_first_and_counts_silence() {
        let summary = summary();
        assert_eq!(cell(&summary, "joint_spring", "joint_spring"), 4);
        assert_eq!(cell(&summary, "joint_spring", "joint_backlash"), 1);
        assert_eq!(cell(&summary, "sensor_lag", "nothing"), 1);
        assert_eq!(cell(&summary, "nothing", "nothing"), 1);
        assert_eq!(summary.confusion().values().sum::<usize>(), 7);
    }

    #[test]
    fn calibration_counts_every_statement_once() {
        let summary = summary();
        assert_eq!(summary.certain(), Rate { hits: 2, of: 3 });
        let bins = summary.calibration();
        assert_eq!(bins.iter().map(|bin| bin.right.of).sum::<usize>(), 5);
        let at = |from: f64| bins.iter().find(|bin| bin.from == from).unwrap();
        assert_eq!(at(0.9).right, Rate { hits: 1, of: 2 });
        assert!((at(0.9).stated.unwrap() - 0.935).abs() < 1e-9);
        assert_eq!((at(0.97).right, at(0.0).stated), (Rate { hits: 1, of: 1 }, None));
    }

    #[test]
    fn medians_and_quantiles() {
        assert_eq!(median([3.0, 1.0, 2.0]), Some(2.0));
        assert_eq!(median([4.0, 1.0, 2.0, 3.0]), Some(2.5));
        assert_eq!(quantile([0.0, 10.0], 0.9), Some(9.0));
        assert_eq!(median([]), None);
    }
}
