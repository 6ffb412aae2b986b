//! What could be missing: every effect of the catalogue, each with the starting points from which its parameters are
//! looked for.

use bowden_model::channel::Channel;
use bowden_model::effect::{ActiveEffect, Component, Effect, Target};
use bowden_model::effects::CATALOGUE;
use bowden_model::search::Starts;

use super::locked::locked_start;
use super::one_body;
use super::onset::moment_of;
use crate::fit::objective::{Objective, Series};
use crate::fit::typical::sized;
use crate::joint_model::JointModel;
use crate::simulation::Prediction;

/// Strengths, in typical ones, at which an effect is tried, and speeds at which friction falls.
const STEADY: [f64; 3] = [0.4, 1.0, 2.5];

/// Relative rises of a winding's resistance at which its heating is tried.
const RISES: [f64; 3] = [0.05, 0.15, 0.45];

/// One effect and where to start.
#[derive(Clone, Debug)]
pub struct Candidate {
    /// The effect at its starting points; a sensor's effect stands once for every channel it may be on, one that has several forms
    /// once for each.
    pub starts: Vec<ActiveEffect>,
}

/// All effects that the parts of `model` can have and that it does not contain yet; of those that are tried on request
/// only the `asked` ones. Where there are several benches each effect is also one of a single bench.
///
/// `predictions` are those of `model`; effects whose starting point can be read off their differences use them.
#[must_use]
pub fn candidates(
    model: &JointModel,
    objective: &Objective,
    predictions: &[Prediction],
    asked: &[&str],
) -> Vec<Candidate> {
    let mut found = candidates_on(None, model, objective, predictions, asked);
    let benches = objective.benches();
    for bench in benches.iter().copied().filter(|_| benches.len() > 1) {
        let (objective, seen) = seen_on(bench, objective, predictions);
        found.extend(candidates_on(Some(bench), model, &objective, &seen, asked));
    }
    found
}

/// The recordings of one bench, and what is predicted of them.
pub(super) fn seen_on(
    bench: u16,
    objective: &Objective,
    predictions: &[Prediction],
) -> (Objective, Vec<Prediction>) {
    let seen = predictions.iter().enumerate().filter(|(recording, _)| objective.bench(*recording) == bench);
    (objective.on(Some(bench)), seen.map(|(_, prediction)| prediction.clone()).collect())
}

/// The same of one bench, whose recordings these are, or of all.
fn candidates_on(
    bench: Option<u16>,
    model: &JointModel,
    objective: &Objective,
    predictions: &[Prediction],
    asked: &[&str],
) -> Vec<Candidate> {
    let mut found = Vec::new();
    for effect in CATALOGUE {
        let descriptor = effect.descriptor();
        // On a rig whose friction is distributed already, an effect that distributes it changes nothing.
        let redundant = effect.friction_law() == Some(model.parameters.friction);
        let unasked = effect.on_request() && !asked.contains(&descriptor.id);
        if unasked || redundant || one_body::has(model, effect) || !fits(model, descriptor.component) {
            continue;
        }
        for target in targets(model, effect) {
            let usual = ActiveEffect { target, bench, ..sized(model, effect) };
            if model.effects.iter().any(|active| active.is_beside(&usual)) {
                continue;
            }
            for base in forms(usual) {
                let starts = starts(base, model, objective, predictions);
                if !starts.is_empty() {
                    found.push(Candidate { starts });
                }
            }
        }
    }
    found
}

/// The effect once for each form that one of its parameters may have, but for those that are tried once it is found.
fn forms(base: ActiveEffect) -> Vec<ActiveEffect> {
    let formed = base.descriptor().parameters.iter().find(|spec| !spec.forms.is_empty() && !spec.is_choice);
    formed.map_or_else(
        || vec![base],
        |spec| spec.forms.iter().map(|form| base.with(spec.name, *form)).collect(),
    )
}

pub(super) fn fits(model: &JointModel, component: Component) -> bool {
    match component {
        // Without a motor, its effects are the friction of an input spindle that is turned as prescribed.
        Component::Motor => model.parameters.motor.is_some() || model.outputs.contains(&Channel::TorqueIn),
        Component::Transmission => model.parameters.tendon.is_some(),
        Component::Joint | Component::Sensors => true,
    }
}

pub(super) fn targets(model: &JointModel, effect: &dyn Effect) -> Vec<Target> {
    let channels = effect.descriptor().channels;
    if channels.is_empty() {
        return vec![Target::None];
    }
    let simulated = |channel: &Channel| model.outputs.contains(channel);
    let drives = |channel: &Channel| !simulated(channel) && model.inputs.contains(channel);
    let looked_for = |channel: &&Channel| {
        (simulated(channel) || drives(channel)) && effect.is_looked_for_on(**channel, drives(channel))
    };
    let mut targets: Vec<Target> = channels.iter().filter(looked_for).map(|c| Target::One(*c)).collect();
    // As many as there are: a bench may have tensions at the motor alone.
    let tensions = Channel::TENSIONS.iter().filter(|c| channels.contains(c) && simulated(c)).count();
    if tensions > 1 && effect.is_shared_by_tensions() {
        targets.push(Target::Tensions);
    }
    targets
}

fn starts(
    base: ActiveEffect,
    model: &JointModel,
    objective: &Objective,
    predictions: &[Prediction],
) -> Vec<ActiveEffect> {
    let strengths = |base: ActiveEffect| STEADY.map(|factor| with_strength(base, from_neutral(base, factor)));
    match base.effect.starts() {
        Starts::Usual => usual_starts(base, objective),
        Starts::ThirdsOfOctaves => (-6..=6)
            .map(|third| with_strength(base, base.parameters[0] * (f64::from(third) / 3.0).exp2()))
            .collect(),
        Starts::At(name, values) => values.iter().map(|value| base.with(name, *value)).collect(),
        Starts::StrengthsAt(name, values) => {
            values.iter().flat_map(|value| strengths(base.with(name, *value))).collect()
        }
        Starts::LockedTo(angle) => {
            locked_start(base, angle, model, objective, predictions).into_iter().collect()
        }
        Starts::HeatByPower => {
            let currents =
                predictions.iter().filter_map(|prediction| prediction.channel(Channel::MotorCurrent));
            heating_starts(base, model, currents.flatten().copied())
        }
        Starts::MeanDifference => offset_start(base, objective, predictions).into_iter().collect(),
        Starts::LargestShown => saturation_start(base, objective).into_iter().collect(),
        Starts::EndsOfTravel => end_stop_starts(base, model, objective),
    }
}

/// At some strengths, or at a moment.
fn usual_starts(base: ActiveEffect, objective: &Objective) -> Vec<ActiveEffect> {
    let parameters = base.descriptor().parameters;
    match (parameters.first(), moment_of(&base)) {
        (None, _) => vec![base],
        // Screening finds the moments that tell most.
        (Some(_), Some(moment)) => vec![half_way(base, moment, objective.duration_s())],
        (Some(strength), None) => {
            // What has either sign goes nearly with its strength; screening finds the sign.
            let factors: &[f64] = if strength.lower < 0.0 { &[1.0] } else { &STEADY };
            let values: Vec<f64> = factors
                .iter()
                .map(|factor| from_neutral(base, *factor))
                .map(|value| value.clamp(strength.lower, strength.upper))
                .collect();
            steady_starts(base, &values)
        }
    }
}

/// In the middle of the recordings.
fn half_way(mut base: ActiveEffect, moment: usize, duration_s: f64) -> ActiveEffect {
    base.parameters[moment] = 0.5 * duration_s;
    base.with("duration_s", duration_s / 6.0)
}

/// The given strengths; where friction falls with speed, the speed matters as much as the strength.
fn steady_starts(base: ActiveEffect, strengths: &[f64]) -> Vec<ActiveEffect> {
    let speed = base.descriptor().parameters.iter().find(|spec| spec.name.starts_with("speed_"));
    let factors: &[f64] = if speed.is_some() { &STEADY } else { &[1.0] };
    strengths
        .iter()
        .flat_map(|value| {
            factors.iter().map(|factor| {
                let start = as_strong(base, *value);
                speed.map_or(start, |spec| start.with(spec.name, factor * spec.default))
            })
        })
        .collect()
}

/// The effect with this strength, and what is counted in the same unit scaled with it: little friction that falls with speed is
/// little at speed too. A number without a unit, such as an exponent, is a shape and not an amount.
fn as_strong(base: ActiveEffect, value: f64) -> ActiveEffect {
    let specs = base.descriptor().parameters;
    let mut effect = with_strength(base, value);
    if base.descriptor().neutral.unwrap_or(0.0) == 0.0 && base.parameters[0] > 0.0 {
        let alike = specs.iter().skip(1).zip(&mut effect.parameters[1..]);
        alike
            .filter(|(spec, _)| spec.unit == specs[0].unit && spec.unit != "1")
            .for_each(|(_, parameter)| *parameter *= value / base.parameters[0]);
    }
    effect
}

fn with_strength(mut effect: ActiveEffect, value: f64) -> ActiveEffect {
    effect.parameters[0] = value;
    effect
}

/// The usual strength, with its distance from no effect scaled by `factor`.
fn from_neutral(base: ActiveEffect, factor: f64) -> f64 {
    let neutral = base.descriptor().neutral.unwrap_or(0.0);
    neutral + factor * (base.parameters[0] - neutral)
}

/// Gains with which the power of the recordings, kept up, would raise the resistance by [`RISES`]: what a watt does to a winding
/// depends on its size, which the rig file does not tell.
fn heating_starts(
    base: ActiveEffect,
    model: &JointModel,
    currents_a: impl Iterator<Item = f64>,
) -> Vec<ActiveEffect> {
    let (mut squares, mut count) = (0.0, 0.0);
    for current_a in currents_a {
        squares += current_a * current_a;
        count += 1.0;
    }
    let resistance_ohm = model.parameters.motor.map_or(0.0, |motor| motor.resistance_ohm);
    let power_w = resistance_ohm * squares / f64::max(count, 1.0);
    if power_w <= 0.0 {
        return vec![base];
    }
    let upper = base.descriptor().parameters[0].upper;
    RISES.map(|rise| with_strength(base, (rise / power_w).min(upper))).to_vec()
}

/// Offset from the mean difference of the channel.
fn offset_start(
    base: ActiveEffect,
    objective: &Objective,
    predictions: &[Prediction],
) -> Option<ActiveEffect> {
    let Target::One(channel) = base.target else { return None };
    let (mut sum, mut count) = (0.0, 0.0);
    for (recording, prediction) in predictions.iter().enumerate() {
        let measured = objective.measured(recording, Series::Channel(channel))?;
        for (m, p) in measured.iter().zip(prediction.channel(channel)?) {
            sum += m - p;
            count += 1.0;
        }
    }
    Some(base.with("offset", sum / f64::max(count, 1.0)))
}

/// Limit at the largest value that was shown.
fn saturation_start(base: ActiveEffect, objective: &Objective) -> Option<ActiveEffect> {
    let Target::One(channel) = base.target else { return None };
    let largest = (0..objective.recordings())
        .filter_map(|recording| objective.measured(recording, Series::Channel(channel)))
        .flatten()
        .copied()
        .fold(f64::NEG_INFINITY, f64::max);
    Some(base.with("limit", largest))
}

/// Hard and soft stops at some parts of the travel, on both sides: into a soft one the arm goes far, and from a hard one at
/// the end of the travel no fit finds the way there.
fn end_stop_starts(base: ActiveEffect, model: &JointModel, objective: &Objective) -> Vec<ActiveEffect> {
    let channel =
        if model.outputs.contains(&Channel::ThetaOut) { Channel::ThetaOut } else { Channel::ThetaIn };
    let travel: Vec<f64> = (0..objective.recordings())
        .filter_map(|recording| objective.measured(recording, Series::Channel(channel)))
        .flatten()
        .copied()
        .collect();
    let (low, high) = travel.iter().fold((0.0_f64, 0.0_f64), |(l, h), v| (l.min(*v), h.max(*v)));
    [(0.95, 1.0), (0.8, 1.0), (0.8, 0.15), (0.6, 0.15)]
        .iter()
        .flat_map(|(share, hardness)| {
            let base = base.with("stiffness_nm_per_rad", hardness * base.parameters[0]);
            [base.with("stop_rad", share * high), base.with("stop_rad", share * low)]
        })
        .filter(|start| start.parameters[1].abs() > 1e-3)
        .collect()
}

#[cfg(test)]
mod tests {
    use bowden_model::effects::find;

    use super::*;
    use crate::simulation::replay;
    use crate::test_bench;

    fn tried(id: &str, change: impl Fn(JointModel) -> JointModel) -> Vec<ActiveEffect> {
        let recording = test_bench::swung(200);
        let model = change(JointModel::from_rig(&test_bench::rig(), &recording).unwrap());
        let objective = Objective::new(&model, &[recording], &[], true).unwrap();
        let predictions = [replay(&model, objective.input(0)).unwrap()];
        let all = candidates(&model, &objective, &predictions, &[]);
        all.into_iter()
            .flat_map(|candidate| candidate.starts)
            .filter(|start| start.descriptor().id == id)
            .collect()
    }

    #[test]
    fn an_encoder_that_counts_has_no_gain_to_be_wrong() {
        let channels: Vec<Target> =
            tried("sensor_gain_error", |model| model).iter().map(|start| start.target).collect();
        assert!(channels.contains(&Target::One(Channel::F3)), "{channels:?}");
        for angle in [Channel::ThetaIn, Channel::ThetaOut] {
            assert!(!channels.contains(&Target::One(angle)), "{angle:?}");
        }
    }

    /// One converter may give all tensions late, however many there are; of a single one that is nothing else.
    #[test]
    fn a_lag_is_looked_for_on_all_tensions_that_are_predicted() {
        let shared = |tensions: &[Channel]| {
            let predicts =
                |channel: &Channel| !Channel::TENSIONS.contains(channel) || tensions.contains(channel);
            let starts = tried("sensor_lag", |mut model| {
                model.outputs.retain(predicts);
                model
            });
            starts.iter().any(|start| start.target == Target::Tensions)
        };
        assert!(shared(&Channel::TENSIONS) && shared(&[Channel::F1, Channel::F3]));
        assert!(!shared(&[Channel::F1]));
    }

    #[test]
    fn a_joint_of_a_tenth_is_searched_for_torques_of_a_tenth() {
        let paper = tried("joint_coulomb_friction", |model| model);
        let finger = tried("joint_coulomb_friction", |model| test_bench::smaller(model, 0.1));
        assert_eq!((paper.len(), finger.len()), (STEADY.len(), STEADY.len()));
        for (a, b) in paper.iter().zip(&finger) {
            assert!((b.parameters[0] / a.parameters[0] - 0.1).abs() < 1e-9, "{b:?} for {a:?}");
        }
    }

    /// Each form stands by itself: the two are fitted and compared like two effects.
    #[test]
    fn friction_of_a_gear_is_looked_for_in_proportion_to_the_load_and_to_its_square() {
        let starts = tried("gear_load_friction", |model| model);
        let exponents: Vec<f64> = starts.iter().map(|start| start.parameters[1]).collect();
        assert_eq!(exponents, [[1.0; STEADY.len()], [2.0; STEADY.len()]].concat());
        assert_eq!(forms(starts[0]).len(), 2);
        // Of two kinds the usual one is looked for; the other is tried once the effect is found.
        for id in ["joint_spring", "joint_coulomb_friction"] {
            let effect = ActiveEffect::with_defaults(find(id).unwrap());
            assert_eq!(forms(effect), [effect], "{id}");
        }
    }

    #[test]
    fn a_spring_is_looked_for_at_rest_on_either_side_of_hanging_straight_down() {
        let rests: Vec<f64> = tried("joint_spring", |model| model)
            .iter()
            .map(|start| start.parameters[start.descriptor().index_of("rest_rad").unwrap()])
            .collect();
        assert!(rests.iter().any(|rest| *rest > 0.03) && rests.iter().any(|rest| *rest < -0.03), "{rests:?}");
    }

    /// 2 A through 2 Ω are 8 W, at which 5 % more resistance are 0.00625 a watt.
    #[test]
    fn heating_is_looked_for_by_the_power_that_the_recordings_put_in() {
        let mut model = JointModel::from_rig(&test_bench::rig(), &test_bench::swung(2)).unwrap();
        let base = ActiveEffect::with_defaults(find("winding_heating").unwrap());
        let gains = |model: &JointModel, currents_a: &[f64]| -> Vec<f64> {
            let starts = heating_starts(base, model, currents_a.iter().copied());
            starts.iter().map(|start| start.parameters[0]).collect()
        };
        model.parameters.motor.as_mut().unwrap().resistance_ohm = 2.0;
        assert_eq!(gains(&model, &[2.0, -2.0, 2.0]), [0.05 / 8.0, 0.15 / 8.0, 0.45 / 8.0]);
        assert_eq!(gains(&model, &[0.001]), [1.0; 3], "no more than the catalogue allows");
        assert_eq!(gains(&model, &[]), [base.parameters[0]]);
    }
}
