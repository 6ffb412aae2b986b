//! Sentences for people.

use std::fmt::Write;

use bowden_model::effect::{ActiveEffect, Component, ParameterSpec};
use bowden_model::law;

use super::place::unit_of;
use super::policy::POLICY;
use super::selection::{Chosen, Tried};
use super::verdict::{ChannelFit, NamedEffect, Recalibrated, Rival, StageLoss, Verdict};
use crate::fit::calibrated::wrong_from;
use crate::fit::objective::Series;

/// What a summary says after Ctrl-C.
pub(super) const STOPPED: &str = "The search was stopped before every effect had been tried.";

/// Probability of the chosen effect, and what it could be instead. `separate` finds the experiment that parts the two;
/// where it finds none, a general one is named.
pub(super) fn rivals(
    chosen: &Chosen,
    improvement: f64,
    mut separate: impl FnMut(&Tried) -> Option<String>,
) -> (f64, Vec<Rival>) {
    let own_id = chosen.effect.descriptor().id;
    let odds: Vec<(&Tried, f64)> = chosen
        .others
        .iter()
        .filter(|tried| tried.effect.descriptor().id != own_id)
        .map(|tried| (tried, chosen.odds_of(tried)))
        .collect();
    let sum: f64 = 1.0 + odds.iter().map(|(_, odds)| odds).sum::<f64>();
    let present = POLICY.presence(improvement);
    let mut rivals: Vec<Rival> = Vec::new();
    for (tried, odds) in odds {
        let descriptor = tried.effect.descriptor();
        if POLICY.is_listed(odds) && rivals.iter().all(|rival| rival.id != descriptor.id) {
            let general = || experiment(&tried.effect).to_owned();
            rivals.push(Rival {
                id: descriptor.id.to_owned(),
                formula: law::of(&tried.effect).map(|law| law.formula().to_owned()),
                probability: present * odds / sum,
                separating_experiment: separate(tried).unwrap_or_else(general),
            });
        }
    }
    (present / sum, rivals)
}

/// What to record so that an effect shows apart from others.
fn experiment(effect: &ActiveEffect) -> &'static str {
    effect.effect.told_apart_by().unwrap_or(match effect.descriptor().component {
        Component::Motor => "slow triangles with the tendons unloaded",
        Component::Transmission => "slow triangles at three amplitudes with holds of two seconds at the ends",
        Component::Joint => "slow triangles with the weight removed",
        Component::Sensors => "the same motion with the channel's sensor exchanged for its neighbour's",
    })
}

/// One plain sentence on an effect of which a part has several instances.
pub(super) fn sentence_of_instances(active: &ActiveEffect, named: &NamedEffect) -> String {
    let strongest = active.descriptor().parameters.iter().fold(*active, |active, spec| {
        named.parameters.get(spec.name).map_or(active, |estimate| active.with(spec.name, estimate.value))
    });
    // What happens at a moment has no instances.
    let text = sentence(&strongest, named.heldout_improvement, 0.0);
    let Some(name) = active.effect.instances_differ_in() else { return text };
    let others = named.further.iter().filter_map(|one| one.get(name)).map(|estimate| short(estimate.value));
    let others: Vec<String> = others.collect();
    let meaning =
        active.descriptor().parameters.iter().find(|spec| spec.name == name).map(|spec| spec.meaning);
    format!(
        "{text} There are {} more of it, with {} {}.",
        others.len(),
        meaning.unwrap_or(name),
        others.join(", ")
    )
}

/// One plain sentence on an effect.
pub(super) fn sentence(active: &ActiveEffect, improvement: f64, duration_s: f64) -> String {
    let descriptor = active.descriptor();
    let mut text = String::new();
    let mut summary = descriptor.summary.chars();
    if let Some(first) = summary.next() {
        let _ = write!(text, "{}{}", first.to_uppercase(), summary.as_str());
    }
    if let Some(channel) = active.target.name() {
        let _ = write!(text, " ({channel})");
    }
    let told = |(spec, value): &(&ParameterSpec, f64)| spec.searched || *value != spec.default;
    for (spec, value) in descriptor.parameters.iter().zip(active.parameters).filter(told).take(2) {
        let name = spec.meaning;
        if spec.name.ends_with("time_s") || spec.name == "start_s" {
            let _ = write!(text, ", at {value:.2} s of {duration_s:.0} s");
        } else {
            let _ = write!(text, ", {name} {}", quantity(value, spec.unit));
        }
    }
    let _ = write!(text, "; it {}.", on_unseen_data(improvement));
    text
}

/// The same of an effect that one bench alone has.
pub(super) fn on_bench(bench: &str, sentence: &str) -> String {
    format!("On bench {bench}: {sentence}")
}

/// The named effects, each once, with the benches that have it where not all have.
fn names(effects: &[NamedEffect]) -> Vec<String> {
    let mut named: Vec<(&str, Vec<&str>)> = Vec::new();
    for effect in effects {
        let bench = effect.bench.as_deref();
        match (named.iter_mut().find(|(id, benches)| *id == effect.id && !benches.is_empty()), bench) {
            (Some((_, benches)), Some(bench)) => {
                if !benches.contains(&bench) {
                    benches.push(bench);
                }
            }
            _ => named.push((&effect.id, bench.into_iter().collect())),
        }
    }
    let said = |(id, benches): &(&str, Vec<&str>)| match &benches[..] {
        [] => (*id).to_owned(),
        some => format!("{id} ({})", some.join(", ")),
    };
    named.iter().map(said).collect()
}

/// What something does to the loss of held-out data, of which it removes such a part.
pub(super) fn on_unseen_data(improvement: f64) -> String {
    if improvement >= 0.005 {
        format!("removes {:.0} % of the difference on data the fit did not see", 100.0 * improvement)
    } else {
        "removes nothing of the difference on data the fit did not see, and is supported by the fitted data alone".to_owned()
    }
}

/// Three significant digits, in plain digits where that is readable.
pub(crate) fn short(value: f64) -> String {
    if value == 0.0 {
        return "0".to_owned();
    }
    let decade = value.abs().log10().floor();
    if (-4.0..5.0).contains(&decade) {
        format!("{value:.*}", (2.0 - decade).max(0.0) as usize)
    } else {
        format!("{value:.2e}")
    }
}

/// A value with its unit, if it has one.
fn quantity(value: f64, unit: &str) -> String {
    if unit == "1" { short(value) } else { format!("{} {unit}", short(value)) }
}

/// States that no parameter is significantly wrong, and the largest deviation.
fn as_stated(recalibrated: &[Recalibrated]) -> String {
    let share = |p: &Recalibrated| p.change().abs() / wrong_from(&p.parameter);
    recalibrated.iter().filter(|p| p.nominal != 0.0).max_by(|a, b| share(a).total_cmp(&share(b))).map_or_else(
        || "The rig has no parameter to recalibrate.".to_owned(),
        |p| {
            format!(
                "No parameter is significantly wrong; {} deviates most from the rig file, by {:+.1} %.",
                p.name(),
                100.0 * p.change()
            )
        },
    )
}

/// What recalibration did to a parameter: its change, or where it is to where the rig file has zero, of which there is no share.
fn change(p: &Recalibrated) -> String {
    if p.nominal == 0.0 {
        format!("{} 0 to {}", p.name(), quantity(p.fitted, &p.unit))
    } else {
        format!("{} {:+.0} %", p.name(), 100.0 * p.change())
    }
}

/// Items as "a", "a and b", "a, b and c".
fn listed(items: &[&str]) -> String {
    match items {
        [] => String::new(),
        [one] => (*one).to_owned(),
        [first @ .., last] => format!("{} and {last}", first.join(", ")),
    }
}

/// Summary of the diagnosis in two or three sentences, and one more for each channel of which a free run got worse. In the parameters
/// `differing` the benches of the study differ.
pub(super) fn summary(
    verdict: Verdict,
    effects: &[NamedEffect],
    recalibrated: &[Recalibrated],
    differing: &[String],
    by_a_law: bool,
    heldout_loss: &StageLoss,
    compared: &[(Series, ChannelFit)],
) -> String {
    let changed: Vec<String> = recalibrated.iter().filter(|p| p.is_wrong()).map(change).collect();
    let mut parameters: Vec<String> = Vec::new();
    if !changed.is_empty() {
        parameters.push(format!("Parameters that were wrong: {}.", changed.join(", ")));
    } else if differing.is_empty() {
        parameters.push(as_stated(recalibrated));
    }
    parameters.extend(benches_differ(differing));
    let parameters = parameters.join(" ");
    let StageLoss { recalibrated: loss_recalibrated, after: loss_after, .. } = *heldout_loss;
    let changes = if loss_after < loss_recalibrated { "reduces" } else { "raises" };
    let effect = format!(
        "{changes} the held-out loss from {loss_recalibrated:.2} to {loss_after:.2} (normalised error; 1 is what sensor noise and \
         an ordinary bench leave)"
    );
    // Of many benches one alone counts little.
    let shows_on_its_bench =
        |effect: &NamedEffect| effect.bench.is_some() && POLICY.pays(1.0, 1.0 - effect.heldout_improvement);
    let doubt = if POLICY.pays(loss_recalibrated, loss_after) || effects.iter().any(shows_on_its_bench) {
        ""
    } else {
        " Held-out data do not confirm this: the effect is absent there, or hardly visible."
    };
    let mut said = match verdict {
        Verdict::Consistent => {
            format!(
                "The simulation agrees with the recordings; nothing needs to be added or changed. {parameters}"
            )
        }
        Verdict::Recalibrate => format!("Parameters were wrong, and no physics is missing. {parameters}"),
        Verdict::MissingPhysics => {
            let names = names(effects);
            let names: Vec<&str> = names.iter().map(String::as_str).collect();
            let them = if names.len() > 1 { "them" } else { "it" };
            format!("The simulation lacks {}: adding {them} {effect}.{doubt} {parameters}", listed(&names))
        }
        Verdict::Unexplained if by_a_law => format!(
            "The recordings contain structure that no effect of the catalogue explains; a formula for it {effect}.{doubt} {parameters}"
        ),
        Verdict::Unexplained => {
            format!("The recordings contain structure that no effect of the catalogue explains. {parameters}")
        }
    };
    said.extend(compared.iter().filter_map(|(series, fit)| worse_free_run(*series, fit)));
    said
}

/// What a summary says where benches differ in parameters that their study says they share.
fn benches_differ(parameters: &[String]) -> Option<String> {
    let names: Vec<&str> = parameters.iter().map(String::as_str).collect();
    let them = if names.len() > 1 { "them" } else { "it" };
    (!names.is_empty()).then(|| {
        format!(
            "The benches differ in {}: list {them} under `own` of each bench in the study.",
            listed(&names)
        )
    })
}

/// What a summary adds on a channel that a free run of the diagnosed rig predicts worse than one of the recalibrated rig does.
fn worse_free_run(series: Series, fit: &ChannelFit) -> Option<String> {
    (fit.free_run && fit.after_rmse > fit.recalibrated_rmse).then(|| {
        let shown = |rmse: f64| quantity(rmse, unit_of(series));
        let (channel, recalibrated, after) =
            (series.name(), shown(fit.recalibrated_rmse), shown(fit.after_rmse));
        format!(
            " In a free run the diagnosed rig predicts {channel} worse than the recalibrated rig does: {after} off instead of {recalibrated}. Compare \
             both before you simulate with it."
        )
    })
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeMap;

    use super::{listed, short, summary};
    use crate::diagnose::verdict::{ChannelFit, NamedEffect, Recalibrated, StageLoss, Verdict};
    use crate::fit::objective::Series;
    use bowden_model::channel::Channel;

    /// A joint that was held to its angle, and turns over once more than it should when nothing holds it.
    #[test]
    fn a_free_run_that_got_worse_is_said_to_be() {
        let said = |after_rmse: f64, free_run: bool| {
            let fit = ChannelFit {
                before_rmse: 69.3,
                recalibrated_rmse: 1.004,
                after_rmse,
                noise_rmse: 0.001,
                free_run,
            };
            let loss = StageLoss { before: 9.0, recalibrated: 4.0, after: 1.0 };
            let compared = [(Series::Channel(Channel::ThetaOut), fit)];
            summary(Verdict::MissingPhysics, &[], &[], &[], false, &loss, &compared)
        };
        let plain = said(0.01, true);
        assert_eq!(
            said(36.0, true).strip_prefix(&plain).unwrap(),
            " In a free run the diagnosed rig predicts theta_out_rad worse than the recalibrated rig does: 36.0 rad off instead of \
             1.00 rad. Compare both before you simulate with it."
        );
        assert_eq!((said(1.004, true), said(36.0, false)), (plain.clone(), plain));
    }

    /// A joint whose rig file has no mass, and whose arm turns out to be a tenth longer.
    #[test]
    fn a_parameter_that_was_zero_has_no_share_to_tell() {
        let recalibrated = |parameter: &str, unit: &str, nominal: f64, fitted: f64| Recalibrated {
            parameter: parameter.to_owned(),
            bench: None,
            nominal,
            fitted,
            std: Some(0.001),
            unit: unit.to_owned(),
            at_bound: false,
        };
        let found =
            [recalibrated("load.mass_kg", "kg", 0.0, 0.512), recalibrated("load.arm_m", "m", 0.2, 0.22)];
        let loss = StageLoss { before: 9.0, recalibrated: 4.0, after: 4.0 };
        let said = summary(Verdict::Recalibrate, &[], &found, &[], false, &loss, &[]);
        assert!(
            said.ends_with("Parameters that were wrong: load.mass_kg 0 to 0.512 kg, load.arm_m +10 %."),
            "{said}"
        );
    }

    /// A loss that falls, one that falls too little to confirm anything, and one that rises.
    #[test]
    fn a_summary_says_whether_the_held_out_loss_falls_and_whether_that_is_enough() {
        let said = |after: f64| {
            let loss = StageLoss { before: 9.0, recalibrated: 4.0, after };
            summary(Verdict::Unexplained, &[], &[], &[], true, &loss, &[])
        };
        assert!(
            said(1.0).contains("a formula for it reduces the held-out loss from 4.00 to 1.00 (")
                && !said(1.0).contains("not confirm")
        );
        assert!(
            said(3.9).contains(" reduces the held-out loss from 4.00 to 3.90 (")
                && said(3.9).contains("do not confirm this")
        );
        assert!(
            said(5.0).contains(" raises the held-out loss from 4.00 to 5.00 (")
                && said(5.0).contains("do not confirm this")
        );
    }

    /// Late tensions of two benches, a spring that all have, and a wrong gain of one bench on two channels.
    #[test]
    fn an_effect_is_named_once_with_the_benches_that_have_it() {
        let on = |id: &str, bench: Option<&str>| NamedEffect {
            id: id.to_owned(),
            component: "sensors".to_owned(),
            probability: 0.9,
            onset_s: None,
            channel: None,
            bench: bench.map(str::to_owned),
            parameters: BTreeMap::new(),
            further: Vec::new(),
            heldout_improvement: 0.5,
            training_improvement: 0.5,
            sentence: String::new(),
            rivals: Vec::new(),
        };
        let effects = [
            on("sensor_lag", Some("left")),
            on("joint_spring", None),
            on("sensor_gain_error", Some("left")),
            on("sensor_lag", Some("right")),
            on("sensor_gain_error", Some("left")),
        ];
        let loss = StageLoss { before: 9.0, recalibrated: 4.0, after: 3.9 };
        let said = summary(Verdict::MissingPhysics, &effects, &[], &[], false, &loss, &[]);
        let lacks = "The simulation lacks sensor_lag (left, right), joint_spring and sensor_gain_error (left): adding them";
        assert!(said.starts_with(lacks), "{said}");
        // The loss of all hardly falls, that of the benches does.
        assert!(!said.contains("do not confirm this"), "{said}");
        let shared = summary(Verdict::MissingPhysics, &effects[1..2], &[], &[], false, &loss, &[]);
        assert!(shared.contains("do not confirm this"), "{shared}");
    }

    /// It takes the place of the sentence that no parameter is wrong.
    #[test]
    fn benches_that_differ_are_told_with_what_to_do() {
        let loss = StageLoss { before: 9.0, recalibrated: 4.0, after: 4.0 };
        let said = |differing: &[&str]| {
            let differing: Vec<String> = differing.iter().map(|name| (*name).to_owned()).collect();
            summary(Verdict::Recalibrate, &[], &[], &differing, false, &loss, &[])
        };
        assert_eq!(
            said(&["load.mass_kg", "tendon.pretension_n"]),
            "Parameters were wrong, and no physics is missing. The benches differ in load.mass_kg and tendon.pretension_n: list them under \
             `own` of each bench in the study."
        );
        assert!(said(&["load.mass_kg"]).ends_with("list it under `own` of each bench in the study."));
        assert!(!said(&[]).contains("differ in"));
    }

    #[test]
    fn the_last_item_of_a_list_follows_an_and() {
        assert_eq!(listed(&["a"]), "a");
        assert_eq!(listed(&["a", "b"]), "a and b");
        assert_eq!(listed(&["a", "b", "c"]), "a, b and c");
    }

    #[test]
    fn numbers_keep_three_digits_and_stay_readable() {
        for (value, text) in [
            (0.0, "0"),
            (0.236, "0.236"),
            (-1.2424, "-1.24"),
            (1234.6, "1235"),
            (0.000_123, "0.000123"),
            (1e-7, "1.00e-7"),
        ] {
            assert_eq!(short(value), text);
        }
    }
}
