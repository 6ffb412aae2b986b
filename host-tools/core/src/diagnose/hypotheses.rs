//! Hypotheses of the user among the candidates, and what is said of each.

use std::fmt::Write;

use bowden_model::effect::{ActiveEffect, Effect};

use super::candidates::{Candidate, fits};
use super::selection::{BestRival, Selected, Trial};
use super::stated_laws::{coefficients, in_numbers, looseness};
use super::verdict::{FoundLaw, RivalLoss, TriedHypothesis};
use super::words::{on_unseen_data, short};
use crate::fit::objective::Objective;
use crate::hypothesis::Hypothesis;
use crate::joint_model::JointModel;
use crate::outcome::Failure;
use crate::progress::Progress;

/// Strengths, in those of a start, at which a hypothesis of one sign is tried.
const STRENGTHS: [f64; 3] = [0.4, 1.0, 2.5];

/// What a search tries beside what it always does.
#[derive(Clone, Copy, Default)]
pub struct Asked<'a> {
    /// Effects of the catalogue that are tried on request only.
    pub effects: &'a [&'a str],
    /// Hypotheses; their names differ.
    pub hypotheses: &'a [&'static Hypothesis],
}

impl Asked<'_> {
    /// Lets every hypothesis see what its variables do while `model` replays the recordings, and fixes their grids by that. The progress that is
    /// returned ends the work as soon as a hypothesis fails.
    ///
    /// # Errors
    /// Two of one name, or one on a part that the rig lacks.
    pub(super) fn settled<'p>(
        &'p self,
        objective: &Objective,
        model: &JointModel,
        progress: &'p dyn Progress,
    ) -> Result<Attentive<'p>, Failure> {
        for (place, hypothesis) in self.hypotheses.iter().enumerate() {
            let name = hypothesis.name();
            if self.hypotheses[..place].iter().any(|other| other.name() == name) {
                return Err(Failure::bad_input(format!("hypothesis `{name}`: is stated twice; rename one")));
            }
            let mut with = model.clone();
            with.effects.extend(hypothesis.starts().first());
            if fits(model, hypothesis.descriptor().component) {
                objective.predict(&with)?;
            }
            hypothesis.settle()?;
        }
        Ok(Attentive { progress, asked: self })
    }

    /// What the first hypothesis that failed says.
    pub(super) fn failure(&self) -> Option<Failure> {
        self.hypotheses.iter().find_map(|hypothesis| hypothesis.failure())
    }

    /// Every hypothesis that `model` does not contain.
    pub(super) fn candidates(&self, model: &JointModel) -> Vec<Candidate> {
        let absent = |hypothesis: &&&'static Hypothesis| {
            model.effects.iter().all(|active| active.descriptor().id != hypothesis.descriptor().id)
        };
        self.hypotheses.iter().filter(absent).map(|hypothesis| candidate(hypothesis)).collect()
    }
}

/// A hypothesis from all its starts; one that vanishes with its first coefficient, and has one sign, at several strengths.
pub(super) fn candidate(hypothesis: &'static Hypothesis) -> Candidate {
    let descriptor = hypothesis.descriptor();
    let strength = descriptor.parameters[0];
    let one_sign = descriptor.neutral.is_some() && strength.lower >= 0.0;
    let factors: &[f64] = if one_sign { &STRENGTHS } else { &[1.0] };
    let at = |start: ActiveEffect| {
        factors.iter().map(move |factor| {
            let value = factor * start.parameters[0];
            start.with(strength.name, value.clamp(strength.lower, strength.upper))
        })
    };
    Candidate { starts: hypothesis.starts().into_iter().flat_map(at).collect() }
}

/// Progress of work that a failing hypothesis ends.
pub(super) struct Attentive<'a> {
    progress: &'a dyn Progress,
    asked: &'a Asked<'a>,
}

impl Progress for Attentive<'_> {
    fn stage(&self, name: &str, steps: u64) {
        self.progress.stage(name, steps);
    }

    fn advance(&self, steps: u64) {
        self.progress.advance(steps);
    }

    fn interrupted(&self) -> bool {
        self.asked.failure().is_some() || self.progress.interrupted()
    }
}

/// A hypothesis that was found, as a law.
pub(super) fn stated(
    hypothesis: &Hypothesis,
    active: &ActiveEffect,
    [loss_before, loss_after]: [f64; 2],
    training_improvement: f64,
    stds: &[Option<f64>],
) -> FoundLaw {
    let heldout_improvement = 1.0 - loss_after / loss_before;
    let mut found = FoundLaw {
        bench: None,
        component: active.descriptor().component.name().to_owned(),
        port: hypothesis.port().name().to_owned(),
        variables: names_of(hypothesis),
        channel: active.target.name().map(str::to_owned),
        formula: hypothesis.formula(),
        coefficients: coefficients(active, stds),
        heldout_improvement,
        training_improvement,
        sentence: String::new(),
    };
    let strength = active.descriptor().parameters.first().map_or("", |spec| spec.name);
    found.sentence = format!(
        "Hypothesis {}: {}. It {}.{}",
        hypothesis.name(),
        in_numbers(&found),
        on_unseen_data(heldout_improvement),
        looseness(&found, strength)
    );
    found
}

fn names_of(hypothesis: &Hypothesis) -> Vec<String> {
    hypothesis.variables().iter().map(|variable| variable.name().to_owned()).collect()
}

/// What is said of a hypothesis by itself; `heldout_loss` judges a model.
///
/// # Errors
/// When a model cannot be driven.
pub(super) fn tried(
    trial: &Trial,
    selected: &Selected,
    heldout_loss: impl Fn(&JointModel) -> Result<f64, Failure>,
) -> Result<TriedHypothesis, Failure> {
    let Trial { hypothesis, effect, stds, without, with, rivals, .. } = trial;
    let loss = heldout_loss(with)?;
    let judged = |rival: &Option<BestRival>| -> Result<Option<RivalLoss>, Failure> {
        let Some(BestRival { id, model, .. }) = rival else { return Ok(None) };
        Ok(Some(RivalLoss { id: id.clone(), heldout_loss: heldout_loss(model)? }))
    };
    let [catalogue, closed_form, free_curve] =
        [&rivals.catalogue, &rivals.closed_form, &rivals.free_curve].map(judged);
    let [catalogue, closed_form, free_curve] = [catalogue?, closed_form?, free_curve?];
    let descriptor = effect.descriptor();
    let found = selected.chosen.iter().any(|chosen| chosen.effect.descriptor().id == descriptor.id);
    let beats = |rival: &Option<RivalLoss>| rival.as_ref().is_none_or(|rival| loss < rival.heldout_loss);
    let mut tried = TriedHypothesis {
        name: hypothesis.name().to_owned(),
        component: descriptor.component.name().to_owned(),
        port: hypothesis.port().name().to_owned(),
        variables: names_of(hypothesis),
        channel: effect.target.name().map(str::to_owned),
        coefficients: coefficients(effect, stds),
        heldout_loss_without: heldout_loss(without)?,
        heldout_loss: loss,
        beats_catalogue: beats(&catalogue),
        beats_closed_form: beats(&closed_form),
        beats_free_curve: beats(&free_curve),
        catalogue,
        closed_form,
        free_curve,
        found,
        sentence: String::new(),
    };
    tried.sentence = sentence(&tried);
    Ok(tried)
}

fn sentence(tried: &TriedHypothesis) -> String {
    let mut text = format!(
        "Beside the recalibrated rig, {} brings the held-out loss from {} to {}",
        tried.name,
        short(tried.heldout_loss_without),
        short(tried.heldout_loss)
    );
    let rivals = [
        ("the best effect of the catalogue", "", &tried.catalogue),
        ("the best closed form", "", &tried.closed_form),
        ("the best free curve", ", over", &tried.free_curve),
    ];
    for (what, over, rival) in rivals {
        // Writing to a String cannot fail.
        let _ = match rival {
            Some(RivalLoss { id, heldout_loss }) => {
                write!(text, "; {what}{over} {id} to {}", short(*heldout_loss))
            }
            None => write!(text, "; {what} reduces the loss too little to be fitted"),
        };
    }
    let end = if tried.found { "The diagnosed rig simulates it." } else { "It is not in the diagnosed rig." };
    format!("{text}. {end}")
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeMap;

    use super::*;

    #[test]
    fn a_rival_that_is_not_fitted_is_named_with_the_reason() {
        let mut tried = TriedHypothesis {
            name: "drag".to_owned(),
            component: "load".to_owned(),
            port: "joint".to_owned(),
            variables: vec!["omega_rad_s".to_owned()],
            channel: None,
            coefficients: BTreeMap::new(),
            heldout_loss_without: 5.0,
            heldout_loss: 1.5,
            catalogue: Some(RivalLoss { id: "joint_spring".to_owned(), heldout_loss: 4.0 }),
            closed_form: None,
            free_curve: None,
            beats_catalogue: true,
            beats_closed_form: true,
            beats_free_curve: true,
            found: false,
            sentence: String::new(),
        };
        assert_eq!(
            sentence(&tried),
            "Beside the recalibrated rig, drag brings the held-out loss from 5.00 to 1.50; the best effect of the catalogue joint_spring to \
             4.00; the best closed form reduces the loss too little to be fitted; the best free curve reduces the loss too little to be fitted. \
             It is not in the diagnosed rig."
        );
        tried.free_curve = Some(RivalLoss { id: "theta_rad".to_owned(), heldout_loss: 2.0 });
        assert!(
            sentence(&tried).contains("; the best free curve, over theta_rad to 2.00."),
            "{}",
            sentence(&tried)
        );
    }
}
