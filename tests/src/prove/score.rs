//! How right one diagnosis is.

use super::outcome::{Errors, Outcome, Said, SaidEffect};
use super::plan::Group;
use super::true_law::TrueLaw;
use super::truth::{TrueEffect, Truth};

/// Scores of one case; `None` where a score does not apply.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Score {
    /// Whether the case counts as solved: exactly what is concealed was said, and nothing else.
    pub right: bool,
    /// Whether the first named effect is concealed.
    pub top1: Option<bool>,
    /// Whether all concealed effects are named.
    pub all_named: Option<bool>,
    /// Whether the named effects are the concealed ones, no more and no less.
    pub exact: bool,
    /// Named effects that are not concealed.
    pub false_alarms: Vec<String>,
    /// Whether structure is left that the diagnosis explains by nothing it named.
    pub unexplained: bool,
    /// Whether the first named effect, or what is left unexplained, lies in a component that conceals something.
    pub component: Option<bool>,
    /// Whether a stated law has port (and channel), variable and form of the concealed one, each beside what stands before it; `None`
    /// where no rig file could state one.
    pub law: Option<[bool; 3]>,
    /// Stated onset minus true one, s, for each concealed effect that has one and is named.
    pub onset_errors_s: Vec<f64>,
    /// Relative error of each parameter of the named concealed effects: `id.parameter` and error.
    pub parameter_errors: Vec<(String, f64)>,
    /// Relative error of each recalibrated nominal parameter: `section.name` and error.
    pub nominal_errors: Vec<(String, f64)>,
    /// Held-out error of the diagnosed rig over that of the true one.
    pub heldout_ratio: Option<f64>,
    /// Held-out error of the true rig without its effects over that of the true one: what the effects are worth.
    pub effects_worth: Option<f64>,
    /// Concealed effects, and those of them that are named.
    pub named: [usize; 2],
    /// Held-out error of the diagnosed rig over that of the rig file, of the channels that the training recording lacks.
    pub unmeasured_ratio: Option<f64>,
    /// Stated probability and whether it was right, for each named effect.
    pub statements: Vec<(f64, bool)>,
}

/// Scores an outcome.
#[must_use]
pub fn score(outcome: &Outcome) -> Score {
    let silent = catalogued(outcome).then_some(false);
    let Some(said) = &outcome.said else {
        let named = [outcome.truth.effects.len(), 0];
        let law = outcome.truth.laws.first().map(|_| [false; 3]);
        return Score { top1: silent, all_named: silent, named, law, ..Score::default() };
    };
    let truth = &outcome.truth;
    let concealed = |id: &str| truth.effects.iter().any(|effect| effect.id == id);
    let named = |id: &str| said.effects.iter().any(|effect| effect.id == id);
    let false_alarms: Vec<String> =
        said.effects.iter().filter(|effect| !concealed(&effect.id)).map(|effect| effect.id.clone()).collect();
    let all_named = truth.effects.iter().all(|effect| named(&effect.id));
    let exact = all_named && false_alarms.is_empty();
    let replays = &outcome.replays;
    Score {
        right: match outcome.group {
            Group::Outside => said.verdict == "unexplained" && component(said, truth) == Some(true),
            Group::Mixed => {
                let left = said.unexplained.as_ref().map(|unexplained| &unexplained.component);
                exact && truth.outside.iter().any(|(_, component)| Some(component) == left)
            }
            Group::Nothing => exact && matches!(said.verdict.as_str(), "consistent" | "recalibrate"),
            Group::Parameters => exact && said.verdict == "recalibrate",
            Group::Geometry if truth.effects.is_empty() => exact && said.verdict == "recalibrate",
            Group::NoTensions | Group::MotorSide | Group::Dirty | Group::Slow if truth.effects.is_empty() => {
                exact && matches!(said.verdict.as_str(), "consistent" | "recalibrate")
            }
            _ => exact,
        },
        top1: catalogued(outcome).then(|| said.effects.first().is_some_and(|effect| concealed(&effect.id))),
        all_named: catalogued(outcome).then_some(all_named),
        exact,
        false_alarms,
        unexplained: said.unexplained.is_some(),
        component: component(said, truth),
        law: truth.laws.first().map(|law| law_found(said, law)),
        onset_errors_s: of_named(said, truth)
            .filter_map(|(true_effect, effect)| Some(effect.onset_s? - true_effect.onset_s?))
            .collect(),
        parameter_errors: of_named(said, truth).flat_map(parameter_errors).collect(),
        nominal_errors: said
            .recalibrated
            .iter()
            .filter_map(|stated| {
                let value = truth.nominal.get(&stated.parameter)?;
                Some((stated.parameter.clone(), (stated.fitted / value - 1.0).abs()))
            })
            .collect(),
        heldout_ratio: ratio(&replays.diagnosed, &replays.truth),
        effects_worth: ratio(&replays.truth_without_effects, &replays.truth),
        named: [truth.effects.len(), truth.effects.iter().filter(|effect| named(&effect.id)).count()],
        unmeasured_ratio: {
            let missing = outcome.group.recorded().missing();
            let mut lacking = replays.diagnosed.clone();
            lacking.retain(|channel, _| missing.contains(&channel.as_str()));
            ratio(&lacking, &replays.believed)
        },
        statements: said.effects.iter().map(|effect| (effect.probability, concealed(&effect.id))).collect(),
    }
}

/// The best of the stated laws: port, variable, form.
fn law_found(said: &Said, truth: &TrueLaw) -> [bool; 3] {
    let found = said.laws.iter().map(|law| {
        let port = law.port == truth.port && law.channel == truth.channel;
        let variable = port && law.variables == [truth.variable.clone()];
        [port, variable, variable && law.formula == truth.formula]
    });
    found.max().unwrap_or_default()
}

/// Whether the case conceals an effect of the catalogue.
fn catalogued(outcome: &Outcome) -> bool {
    !outcome.truth.effects.is_empty()
}

/// `None` where nothing is concealed.
fn component(said: &Said, truth: &Truth) -> Option<bool> {
    let components = truth.components();
    let stated = match (said.effects.first(), &said.unexplained) {
        (Some(effect), _) => Some(effect.component.as_str()),
        (None, Some(unexplained)) => Some(unexplained.component.as_str()),
        (None, None) => None,
    };
    (!components.is_empty()).then(|| stated.is_some_and(|stated| components.contains(&stated)))
}

/// Concealed effects beside what was said of them; an effect of a sensor counts where its channel is right.
fn of_named<'a>(said: &'a Said, truth: &'a Truth) -> impl Iterator<Item = (&'a TrueEffect, &'a SaidEffect)> {
    truth.effects.iter().filter_map(|true_effect| {
        let mut of_it = said.effects.iter().filter(|effect| effect.id == true_effect.id);
        let channel = &true_effect.channel;
        Some((true_effect, of_it.find(|effect| channel.is_none() || effect.channel == *channel)?))
    })
}

fn parameter_errors((true_effect, effect): (&TrueEffect, &SaidEffect)) -> Vec<(String, f64)> {
    let stated = |name: &str| effect.parameters.get(name).map(|stated| stated.value);
    let errors = true_effect.parameters.iter().filter_map(|(name, truth)| {
        let mut difference = stated(name)? - truth.value;
        if name == "amplitude_rad" {
            // −A at half a turn's other phase is the same wave.
            difference = stated(name)?.abs() - truth.value.abs();
        }
        let error = difference.abs() / (truth.value - truth.neutral).abs();
        error.is_finite().then(|| (format!("{}.{name}", true_effect.id), error))
    });
    errors.collect()
}

/// Error over error, each channel by itself, root mean square over the channels that both have.
#[must_use]
pub fn ratio(of: &Errors, to: &Errors) -> Option<f64> {
    let squares: Vec<f64> = of
        .iter()
        .filter_map(|(channel, error)| Some((error / to.get(channel)?).powi(2)))
        .filter(|square| square.is_finite())
        .collect();
    (!squares.is_empty()).then(|| (squares.iter().sum::<f64>() / squares.len() as f64).sqrt())
}

/// Why a case is not right, as far as the files tell.
#[must_use]
pub fn reason(outcome: &Outcome, score: &Score) -> String {
    let mut reasons: Vec<String> = outcome.failure.iter().cloned().collect();
    let Some(said) = &outcome.said else { return reasons.join("; ") };
    for missing in
        outcome.truth.effects.iter().filter(|effect| said.effects.iter().all(|s| s.id != effect.id))
    {
        let beside = said.effects.iter().find_map(|effect| {
            let rival = effect.rivals.iter().find(|rival| rival.id == missing.id)?;
            Some(format!("{} is a rival of {} at {:.0} %", missing.id, effect.id, 100.0 * rival.probability))
        });
        reasons.extend(beside);
    }
    for effect in said.effects.iter().filter(|effect| score.false_alarms.contains(&effect.id)) {
        reasons.push(format!(
            "{} removes {:.0} % of the held-out loss",
            effect.id,
            100.0 * effect.heldout_improvement
        ));
    }
    if let (Some(worth), false) = (score.effects_worth, outcome.truth.effects.is_empty()) {
        reasons.push(format!("the truth without its effects errs {worth:.2} times as much as with them"));
    }
    if let Some(ratio) = score.heldout_ratio {
        reasons.push(if ratio <= 1.05 {
            format!("what was said predicts as well as the truth ({ratio:.2})")
        } else {
            format!("what was said errs {ratio:.2} times as much as the truth")
        });
    }
    reasons.join("; ")
}

/// What a diagnosis says, in a few words.
#[must_use]
pub fn said_shortly(outcome: &Outcome) -> String {
    let Some(said) = &outcome.said else { return "no diagnosis".to_owned() };
    let mut words: Vec<String> = said
        .effects
        .iter()
        .map(|effect| {
            let on = effect.channel.as_ref().map_or(String::new(), |channel| format!(" on {channel}"));
            format!("{}{on} {:.0} %", effect.id, 100.0 * effect.probability)
        })
        .collect();
    if let Some(unexplained) = &said.unexplained {
        words.push(format!("unexplained in {} ({})", unexplained.component, unexplained.channel));
    }
    if words.is_empty() { said.verdict.clone() } else { words.join(", ") }
}

/// What is concealed, in a few words.
#[must_use]
pub fn concealed_shortly(outcome: &Outcome) -> String {
    let truth = &outcome.truth;
    let effects = truth.effects.iter().map(|effect| {
        let on = effect.channel.as_ref().map_or(String::new(), |channel| format!(" on {channel}"));
        let since = effect.onset_s.map_or(String::new(), |onset_s| format!(" at {onset_s:.1} s"));
        format!("{}{on}{since}", effect.id)
    });
    let words: Vec<String> = effects
        .chain(truth.outside.iter().map(|(id, component)| format!("{id} ({component})")))
        .chain(truth.laws.iter().map(|law| format!("{} = {}", law.port, law.formula)))
        .chain(truth.parameters_off.iter().cloned())
        .collect();
    if words.is_empty() { "nothing".to_owned() } else { words.join(", ") }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::prove::outcome::tests::{diagnosis, outcome};
    use crate::prove::truth::TrueValue;
    use serde_json::json;

    const SPRING: (&str, &str) = ("joint_spring", "joint");
    const LAG: (&str, &str) = ("sensor_lag", "sensors");

    #[test]
    fn one_effect_named_alone_is_right() {
        let said = diagnosis("missing_physics", &[("joint_spring", "joint", 0.96)]);
        let found = score(&outcome(Group::Single, &[SPRING], said));
        assert!(found.right && found.exact);
        assert_eq!((found.top1, found.all_named, found.component), (Some(true), Some(true), Some(true)));
        assert_eq!(found.statements, [(0.96, true)]);
        assert!(found.false_alarms.is_empty());
    }

    #[test]
    fn an_extra_effect_spoils_the_set_but_not_the_first_place() {
        let effects = [("joint_spring", "joint", 0.9), ("motor_cogging", "motor", 0.6)];
        let found = score(&outcome(Group::Single, &[SPRING], diagnosis("missing_physics", &effects)));
        assert!(!found.right && !found.exact);
        assert_eq!((found.top1, found.all_named), (Some(true), Some(true)));
        assert_eq!(found.false_alarms, ["motor_cogging"]);
        assert_eq!(found.statements, [(0.9, true), (0.6, false)]);
    }

    #[test]
    fn a_wrong_name_in_the_right_component() {
        let effects = [("joint_backlash", "joint", 0.95)];
        let case = outcome(Group::Single, &[SPRING], diagnosis("missing_physics", &effects));
        let found = score(&case);
        assert_eq!((found.top1, found.component, found.right), (Some(false), Some(true), false));
        assert_eq!(said_shortly(&case), "joint_backlash 95 %");
        assert_eq!(concealed_shortly(&case), "joint_spring");
        assert!(reason(&case, &found).contains("joint_backlash removes 50 % of the held-out loss"));
    }

    #[test]
    fn half_of_a_pair_is_first_but_not_all() {
        let said = diagnosis("missing_physics", &[("sensor_lag", "sensors", 0.9)]);
        let found = score(&outcome(Group::Pair, &[SPRING, LAG], said));
        assert_eq!((found.top1, found.all_named, found.exact), (Some(true), Some(false), false));
    }

    #[test]
    fn nothing_said_of_an_effect_is_wrong_everywhere() {
        let found = score(&outcome(Group::Single, &[SPRING], diagnosis("consistent", &[])));
        assert_eq!((found.top1, found.component, found.right), (Some(false), Some(false), false));
        let failed =
            Outcome { said: None, ..outcome(Group::Single, &[SPRING], diagnosis("consistent", &[])) };
        assert_eq!((score(&failed).top1, score(&failed).right), (Some(false), false));
    }

    #[test]
    fn a_rig_that_hides_nothing_must_get_no_physics_and_wrong_parameters_their_verdict() {
        let right = |group, verdict| score(&outcome(group, &[], diagnosis(verdict, &[]))).right;
        assert!(right(Group::Nothing, "consistent") && right(Group::Nothing, "recalibrate"));
        assert!(!right(Group::Nothing, "unexplained"));
        assert!(right(Group::Parameters, "recalibrate") && !right(Group::Parameters, "consistent"));
        let named = diagnosis("missing_physics", &[("tendon_creep", "transmission", 0.7)]);
        let found = score(&outcome(Group::Nothing, &[], named));
        assert_eq!((found.right, found.component, found.top1), (false, None, None));
        assert_eq!(found.false_alarms, ["tendon_creep"]);
    }

    #[test]
    fn of_the_stated_laws_the_best_counts_and_a_form_only_of_the_right_variable() {
        let mut case = outcome(Group::Outside, &[], diagnosis("unexplained", &[]));
        case.truth.laws = vec![TrueLaw {
            port: "reading".to_owned(),
            variable: "t_s".to_owned(),
            formula: "a * t_s".to_owned(),
            channel: Some("f1_n".to_owned()),
        }];
        let mut found = |laws: serde_json::Value| {
            case.said.as_mut().unwrap().laws = serde_json::from_value(laws).unwrap();
            score(&case).law
        };
        let law = |port, variable, channel, formula| json!({ "port": port, "variables": [variable], "channel": channel, "formula": formula, "coefficients": {} });
        assert_eq!(found(json!([])), Some([false; 3]));
        assert_eq!(found(json!([law("reading", "t_s", "f2_n", "a * t_s")])), Some([false; 3]));
        assert_eq!(found(json!([law("reading", "value", "f1_n", "a * t_s")])), Some([true, false, false]));
        let near = law("reading", "t_s", "f1_n", "a * t_s^2");
        assert_eq!(found(json!([near])), Some([true, true, false]));
        assert_eq!(found(json!([near, law("reading", "t_s", "f1_n", "a * t_s")])), Some([true; 3]));
    }

    #[test]
    fn outside_the_catalogue_only_unexplained_in_the_right_component_is_right() {
        let outside = |diagnosis: serde_json::Value| {
            let mut case = outcome(Group::Outside, &[], diagnosis);
            case.truth.outside = vec![("joint_magnetic_detent".to_owned(), "joint".to_owned())];
            score(&case)
        };
        let mut said = diagnosis("unexplained", &[]);
        said["unexplained"] = json!({ "component": "joint", "channel": "theta_out_rad", "sentence": "…" });
        assert!(outside(said.clone()).right);
        said["unexplained"]["component"] = json!("motor");
        assert_eq!((outside(said.clone()).right, outside(said).component), (false, Some(false)));
        let named = outside(diagnosis("missing_physics", &[("joint_spring", "joint", 0.9)]));
        assert_eq!((named.right, named.component), (false, Some(true)));
        assert_eq!(named.false_alarms, ["joint_spring"]);
    }

    #[test]
    fn onset_and_parameters_are_compared_where_both_are_known() {
        let mut said = diagnosis("missing_physics", &[("pretension_loss", "transmission", 0.99)]);
        said["effects"][0]["onset_s"] = json!(12.25);
        said["effects"][0]["parameters"] = json!({
            "share": { "value": 0.22, "std": 0.01, "unit": "1" }, "time_s": { "value": 12.25, "std": null, "unit": "s" }
        });
        said["recalibrated"] = json!([
            { "parameter": "load.mass_kg", "nominal": 2.5, "fitted": 2.2, "std": 0.1, "unit": "kg" },
            { "parameter": "load.viscous_nm_s_per_rad", "nominal": 0.0, "fitted": 0.1, "std": 0.1, "unit": "…" }
        ]);
        let mut case = outcome(Group::Single, &[("pretension_loss", "transmission")], said);
        case.truth.effects[0].onset_s = Some(12.0);
        case.truth.effects[0].parameters.insert("share".to_owned(), TrueValue { value: 0.2, neutral: 0.0 });
        case.truth.nominal.insert("load.mass_kg".to_owned(), 2.0);
        let found = score(&case);
        assert_eq!(found.onset_errors_s, [0.25]);
        let [(name, error)] = found.parameter_errors.as_slice() else { panic!("{found:?}") };
        assert!(name == "pretension_loss.share" && (error - 0.1).abs() < 1e-9, "{name} {error}");
        let [(name, error)] = found.nominal_errors.as_slice() else { panic!("{found:?}") };
        assert!(name == "load.mass_kg" && (error - 0.1).abs() < 1e-9, "{name} {error}");
    }

    #[test]
    fn the_error_of_a_gain_is_relative_to_its_distance_from_one_and_needs_the_channel() {
        let mut said = diagnosis("missing_physics", &[("sensor_gain_error", "sensors", 0.9)]);
        said["effects"][0]["channel"] = json!("f2_n");
        said["effects"][0]["parameters"] = json!({ "gain": { "value": 1.08, "std": 0.01, "unit": "1" } });
        let mut case = outcome(Group::Single, &[("sensor_gain_error", "sensors")], said);
        case.truth.effects[0].channel = Some("f2_n".to_owned());
        case.truth.effects[0].parameters.insert("gain".to_owned(), TrueValue { value: 1.1, neutral: 1.0 });
        assert!((score(&case).parameter_errors[0].1 - 0.2).abs() < 1e-9);
        case.truth.effects[0].channel = Some("f3_n".to_owned());
        assert_eq!(score(&case).parameter_errors, []);
    }

    #[test]
    fn held_out_errors_are_compared_channel_by_channel() {
        let mut case = outcome(Group::Single, &[SPRING], diagnosis("missing_physics", &[]));
        let errors = |list: &[(&str, f64)]| list.iter().map(|(name, e)| ((*name).to_owned(), *e)).collect();
        case.replays.truth = errors(&[("f1_n", 0.2), ("theta_out_rad", 0.001)]);
        case.replays.diagnosed = errors(&[("f1_n", 0.2), ("theta_out_rad", 0.007), ("i_motor_a", 9.0)]);
        case.replays.truth_without_effects = errors(&[("f1_n", 0.6), ("theta_out_rad", 0.003)]);
        // Root mean square of 1 and 7 is 5, of 3 and 3 is 3.
        let found = score(&case);
        assert!((found.heldout_ratio.unwrap() - 5.0).abs() < 1e-9, "{found:?}");
        assert!((found.effects_worth.unwrap() - 3.0).abs() < 1e-9);
        assert!(reason(&case, &found).contains("errs 3.00 times as much as with them"));
    }
}
