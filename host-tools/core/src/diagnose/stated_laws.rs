//! Laws that were found, in words and numbers.

use std::collections::BTreeMap;
use std::fmt::Write;

use bowden_model::effect::ActiveEffect;
use bowden_model::law::{self, Form, Law};

use super::verdict::{Estimate, FoundLaw, Mismatch, Unexplained};
use super::words::{on_unseen_data, short};

/// A law as it was fitted, with the losses on held-out data without and with it, the part of the loss that it removes of the data that were
/// fitted, and the standard deviations of its coefficients.
pub(super) fn stated(
    law: &Law,
    active: &ActiveEffect,
    [loss_before, loss_after]: [f64; 2],
    training_improvement: f64,
    stds: &[Option<f64>],
) -> FoundLaw {
    let descriptor = active.descriptor();
    let coefficients = coefficients(active, stds);
    let heldout_improvement = 1.0 - loss_after / loss_before;
    let mut found = FoundLaw {
        bench: None,
        component: descriptor.component.name().to_owned(),
        port: law.port().name().to_owned(),
        variables: vec![law.variable().name().to_owned()],
        channel: active.target.name().map(str::to_owned),
        formula: law.formula().to_owned(),
        coefficients,
        heldout_improvement,
        training_improvement,
        sentence: String::new(),
    };
    let mut meaning = law.port().meaning().chars();
    let first: String = meaning.next().into_iter().flat_map(char::to_uppercase).collect();
    found.sentence = format!(
        "{first}{}{}: {}. It {} {}; it {}.{}",
        meaning.as_str(),
        found.channel.as_ref().map_or_else(String::new, |channel| format!(" ({channel})")),
        in_numbers(&found),
        law.form().behaviour(),
        law.variable().name(),
        on_unseen_data(heldout_improvement),
        looseness(&found, descriptor.parameters[0].name)
    );
    found
}

/// Coefficients of a law or a hypothesis with their standard deviations.
pub(super) fn coefficients(active: &ActiveEffect, stds: &[Option<f64>]) -> BTreeMap<String, Estimate> {
    let of = active.descriptor().parameters.iter().zip(active.parameters).zip(stds);
    of.map(|((spec, value), std)| {
        let at_bound = value <= spec.lower || value >= spec.upper;
        (spec.name.to_owned(), Estimate { value, std: *std, unit: spec.unit.to_owned(), at_bound })
    })
    .collect()
}

/// What is to be known of a law with coefficients that the data hardly tell: a strength that is not known to a half, and any at the end
/// of its range. A phase and a place may lie at zero, however well they are known.
pub(super) fn looseness(law: &FoundLaw, strength: &str) -> String {
    let is_unknown = |c: &Estimate| c.std.is_some_and(|std| std > 0.5 * c.value.abs());
    let weak = law.coefficients.get(strength).filter(|c| is_unknown(c));
    let weak = weak.map(|_| format!("{strength} is not known to a half"));
    let at_bound = law.coefficients.iter().filter(|(_, c)| c.at_bound);
    let at_bound = at_bound.map(|(name, _)| format!("{name} stands at the end of what is tried"));
    let reasons: Vec<String> = weak.into_iter().chain(at_bound).collect();
    if reasons.is_empty() {
        return String::new();
    }
    format!(
        " Only the curve is known, within the angles, speeds and tensions that were recorded: {}.",
        reasons.join(", and ")
    )
}

/// Port, formula and coefficients in one line.
pub(super) fn in_numbers(law: &FoundLaw) -> String {
    let mut text = format!("{} = {}", law.port, law.formula);
    for (place, (name, value)) in law.coefficients.iter().enumerate() {
        let before = if place == 0 { " with" } else { "," };
        let spread = match value.std {
            _ if value.at_bound => " (the end of what is tried)".to_owned(),
            std => std.map_or_else(String::new, |std| format!(" ± {}", short(std))),
        };
        let unit = if value.unit == "1" { String::new() } else { format!(" {}", value.unit) };
        // Writing to a String cannot fail.
        let _ = write!(text, "{before} {name} = {}{spread}{unit}", short(value.value));
    }
    text
}

/// What no name explains, where laws describe it; `left` is what not even they do.
pub(super) fn unexplained(
    laws: &[(FoundLaw, ActiveEffect)],
    left: Option<Unexplained>,
    mismatch: &[Mismatch],
) -> Option<Unexplained> {
    let Some((first, active)) = laws.first() else { return left };
    let answers = mismatch.iter().find(|mismatch| mismatch.component == first.component);
    let channel = first.channel.clone().or_else(|| Some(answers.or(mismatch.first())?.channel.clone()));
    let coefficient = |name: &str| first.coefficients.get(name).map(|value| value.value);
    let oscillates = law::of(active).is_some_and(|law| law.form() == Form::Oscillation);
    let sentences: Vec<&str> = laws.iter().map(|(law, _)| law.sentence.as_str()).collect();
    let rest = left.map(|left| format!(" What is left then: {}", left.sentence)).unwrap_or_default();
    Some(Unexplained {
        component: first.component.clone(),
        channel: channel.unwrap_or_default(),
        depends_on: first.variables.clone(),
        period_rad: coefficient("cycles_per_turn").map(|cycles| std::f64::consts::TAU / cycles),
        frequency_hz: coefficient("frequency_hz").filter(|_| oscillates),
        free_form: None,
        modelled: true,
        law: Some(laws.iter().map(|(law, _)| in_numbers(law)).collect::<Vec<_>>().join("; ")),
        sentence: format!(
            "No effect of the catalogue explains this, a law describes it. {}{rest}",
            sentences.join(" ")
        ),
    })
}

#[cfg(test)]
mod tests {
    use bowden_model::effect::Effect;
    use bowden_model::law::LAWS;

    use super::*;

    /// The first law with an exponent, at this exponent, with this deviation of its amplitude as a part of it.
    fn sentence(exponent: f64, amplitude_share: f64) -> String {
        let of_power = |law: &&Law| law.descriptor().index_of("exponent").is_some();
        let law = LAWS.iter().find(of_power).unwrap();
        let active = ActiveEffect::with_defaults(law).with("exponent", exponent);
        let stds = active.parameters.map(|value| Some(amplitude_share * value.abs()));
        stated(law, &active, [2.0, 1.0], 0.5, &stds).sentence
    }

    #[test]
    fn a_coefficient_that_the_data_hardly_tell_is_said_to_be_one() {
        let known = sentence(2.0, 0.1);
        assert!(!known.contains("Only the curve") && known.contains(" ± 0.200"), "{known}");
        let loose = sentence(2.0, 0.7);
        assert!(loose.ends_with(": amplitude_nm is not known to a half."), "{loose}");
        let at_the_end = sentence(5.0, 0.1);
        assert!(at_the_end.contains("exponent = 5.00 (the end of what is tried)"), "{at_the_end}");
        assert!(at_the_end.ends_with(": exponent stands at the end of what is tried."), "{at_the_end}");
    }
}
