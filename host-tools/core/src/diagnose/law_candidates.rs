//! Laws that the parts of a joint can have, and where to start: places and periods are read off what is left.

use bowden_model::channel::Channel;
use bowden_model::effect::{ActiveEffect, Effect, Target};
use bowden_model::law::{self, Form, LAWS, Law, Port, Variable};

use super::candidates::{Candidate, fits, targets};
use super::unexplained::samples::{Samples, Variable as Seen};
use super::unexplained::structure::{frequencies_hz, rates_along};
use crate::fit::objective::{Objective, Series};
use crate::fit::typical::sized;
use crate::joint_model::JointModel;
use crate::simulation::Prediction;

/// Exponents at which a power of speed or angle is tried.
const EXPONENTS: [f64; 3] = [0.5, 2.0, 3.0];

/// Exponents and asymmetries at which a friction that differs with the direction is tried.
const BY_DIRECTION: [[f64; 2]; 4] = [[0.3, 0.5], [0.3, -0.5], [1.0, 0.5], [1.0, -0.5]];

/// Exponents at which a change with the tension is tried.
const EXPONENTS_FROM_ONE: [f64; 3] = [-0.7, 0.7, 2.0];

/// Places along the travel among which those are sought at which most is left, and how many of them a bump is tried at.
const PLACES: usize = 9;
const PLACES_TRIED: usize = 3;

/// Half width of such a bump, as a part of the travel.
const WIDTH: f64 = 0.08;

/// Turns of a branch at which a loop of hysteresis is tried, as parts of the travel.
const BRANCHES: [f64; 2] = [0.03, 0.15];

/// Torque that is missing at the motor's stall, as a part of it, at which a saturating motor is tried.
const MISSING_AT_STALL: f64 = 1.0;

/// Time constants at which something that sets in is tried, as parts of the recordings' length.
const SETTING_IN: [f64; 3] = [0.05, 0.13, 0.35];

/// Phases of a wave; the others are these with the other sign.
const PHASES_RAD: [f64; 2] = [0.0, std::f64::consts::FRAC_PI_2];

/// What is known of the motion and of what is left, for all laws.
struct Ground<'a> {
    objective: &'a Objective,
    /// What the drive can do, N·m.
    strength_nm: Option<f64>,
    samples: Samples,
    input_rates: Vec<f64>,
    joint_rates: Vec<f64>,
    frequencies_hz: Vec<f64>,
}

/// All laws that the parts of `model` can have and that it does not contain yet, of all benches or of one. `predictions` are those of the
/// model with all that was found.
#[must_use]
pub(super) fn law_candidates(
    bench: Option<u16>,
    model: &JointModel,
    objective: &Objective,
    predictions: &[Prediction],
) -> Vec<Candidate> {
    let samples = Samples::new(objective, predictions);
    let ground = Ground {
        objective,
        strength_nm: model.strength_nm(),
        input_rates: rates_along(&samples, Seen::ThetaIn),
        joint_rates: rates_along(&samples, Seen::ThetaOut),
        frequencies_hz: frequencies_hz(&samples, None),
        samples,
    };
    let mut found = Vec::new();
    for law in LAWS.iter().filter(|law| fits(model, law.descriptor().component)) {
        let seen = |target: &Target| match target {
            Target::One(channel) => ground.samples.of(Series::Channel(*channel)).is_some(),
            _ => true,
        };
        for target in targets(model, law).into_iter().filter(seen) {
            let contained = model.effects.iter().any(|active| {
                law::of(active).is_some_and(|other| other.port() == law.port() && other.form() == law.form())
                    && active.target.overlaps(target)
                    && bench.is_none_or(|bench| active.is_on(bench))
            });
            if contained {
                continue;
            }
            let starts = ground.starts(law, ActiveEffect { target, bench, ..sized(model, law) });
            found.extend(
                apart(law.form(), starts)
                    .into_iter()
                    .filter(|starts| !starts.is_empty())
                    .map(|starts| Candidate { starts }),
            );
        }
    }
    found
}

/// Starts that lead to optima of their own. A torque that rises steeply at the ends of the travel is almost one that opposes it with a steep
/// rise in the middle, because the weight of the load takes up the difference; which of them is better only a fit to convergence shows.
fn apart(form: Form, starts: Vec<ActiveEffect>) -> [Vec<ActiveEffect>; 2] {
    if form != Form::Power {
        return [starts, Vec::new()];
    }
    let is_steepest_in_the_middle = |start: &ActiveEffect| {
        start.descriptor().index_of("exponent").is_some_and(|index| start.parameters[index] < 1.0)
    };
    let (below, above) = starts.into_iter().partition(is_steepest_in_the_middle);
    [above, below]
}

impl Ground<'_> {
    fn starts(&self, law: &Law, base: ActiveEffect) -> Vec<ActiveEffect> {
        match law.form() {
            Form::Ramp | Form::Square | Form::Sign => vec![base],
            Form::SignedSquare => {
                let start = |strength_nm| base.with("amplitude", -MISSING_AT_STALL / strength_nm);
                self.strength_nm.map(start).into_iter().collect()
            }
            Form::Hysteresis => self.loops(law, base),
            Form::PowerFromOne => EXPONENTS_FROM_ONE.map(|exponent| base.with("exponent", exponent)).to_vec(),
            Form::Power | Form::EvenPower => {
                // Behind the input pulley a spring has a name, before it none.
                let least = if law.port() == Port::MotorTorque { Some(&1.0) } else { None };
                let exponents = least.into_iter().chain(&EXPONENTS);
                exponents.filter_map(|exponent| self.as_large_at(law, base, *exponent)).collect()
            }
            Form::DirectedPower => {
                let start = |[exponent, asymmetry]: [f64; 2]| {
                    Some(self.as_large_at(law, base, exponent)?.with("asymmetry", asymmetry))
                };
                BY_DIRECTION.into_iter().filter_map(start).collect()
            }
            Form::Wave => {
                let rates = match law.variable() {
                    Variable::InputAngle => &self.input_rates,
                    Variable::Value if base.target == Target::One(Channel::ThetaIn) => &self.input_rates,
                    _ => &self.joint_rates,
                };
                waves(base, "cycles_per_turn", rates)
            }
            Form::Oscillation => {
                let own = match base.target {
                    Target::One(channel) => frequencies_hz(&self.samples, Some(Series::Channel(channel))),
                    _ => self.frequencies_hz.clone(),
                };
                waves(base, "frequency_hz", &own)
            }
            Form::Bump => {
                let Some((low, high)) = self.travel(law.variable()) else { return Vec::new() };
                let base = base.with("width_rad", WIDTH * (high - low));
                let places = self.where_most_is_left(law.variable(), low, high);
                places.into_iter().map(|place| base.with("at_rad", place)).collect()
            }
            Form::Decay => {
                let duration_s = self.objective.duration_s();
                let starting = |part: f64| base.with("time_constant_s", part * duration_s);
                // A law that takes a good part of friction away is not the mirror of one that adds it.
                let rise = base.parameters[0];
                let either =
                    |part| [rise, -rise].map(|amplitude| starting(part).with("amplitude", amplitude));
                SETTING_IN.into_iter().flat_map(either).collect()
            }
        }
    }

    /// A power law with another exponent that is as large where the variable is as it usually is; none where it does not change.
    fn as_large_at(&self, law: &Law, base: ActiveEffect, exponent: f64) -> Option<ActiveEffect> {
        let (usual, size) = (self.usual(law.variable()), base.parameters[0]);
        let amplitude_nm = size / usual.powf(exponent);
        (usual > 0.0).then(|| base.with("exponent", exponent).with("amplitude_nm", amplitude_nm))
    }

    /// A loop over the angle of a part, or over what a sensor shows.
    fn loops(&self, law: &Law, base: ActiveEffect) -> Vec<ActiveEffect> {
        let travel = match base.target {
            Target::One(channel) => range(
                (0..self.objective.recordings())
                    .filter_map(|recording| self.objective.measured(recording, Series::Channel(channel)))
                    .flatten(),
            ),
            _ => self.travel(law.variable()),
        };
        let Some((low, high)) = travel.filter(|(low, high)| high > low) else { return Vec::new() };
        let name = base.descriptor().parameters[1].name;
        BRANCHES.map(|part| base.with(name, part * (high - low))).to_vec()
    }

    /// Angle that a law depends on, or whose speed it depends on, as measured over all recordings.
    fn angle(&self, variable: Variable) -> Option<&[f64]> {
        let seen = match variable {
            Variable::JointAngle | Variable::JointSpeed => Seen::ThetaOut,
            _ => Seen::ThetaIn,
        };
        // A joint without an encoder of its own goes where the input takes it.
        self.samples.variable(seen).or_else(|| self.samples.variable(Seen::ThetaIn))
    }

    /// Ends of the travel; `None` where the joint hardly moves.
    fn travel(&self, variable: Variable) -> Option<(f64, f64)> {
        /// Least travel with places to tell apart, rad.
        const LEAST_RAD: f64 = 0.05;
        range(self.angle(variable)?.iter()).filter(|(low, high)| high - low > LEAST_RAD)
    }

    /// Middles of the parts of the travel from `low` to `high` in which the mean square of what is left of all series is largest.
    fn where_most_is_left(&self, variable: Variable, low: f64, high: f64) -> Vec<f64> {
        let mut parts = [(0.0, 0.0); PLACES];
        for (row, angle) in self.angle(variable).unwrap_or_default().iter().enumerate() {
            let part = (PLACES as f64 * (angle - low) / (high - low)) as usize;
            let (sum, count) = &mut parts[part.min(PLACES - 1)];
            for left in self.samples.left.iter().filter(|left| left.soft[row].is_finite()) {
                *sum += left.soft[row].powi(2);
                *count += 1.0;
            }
        }
        let mean = |part: &usize| parts[*part].0 / f64::max(parts[*part].1, 1.0);
        let mut order: Vec<usize> = (0..PLACES).collect();
        order.sort_by(|a, b| mean(b).total_cmp(&mean(a)));
        let middle = |part: &usize| low + (high - low) * (*part as f64 + 0.5) / PLACES as f64;
        order.iter().take(PLACES_TRIED).map(middle).collect()
    }

    /// Root mean square of an angle or a speed.
    fn usual(&self, variable: Variable) -> f64 {
        let values = match variable {
            Variable::JointAngle => self.angle(variable),
            // Joint and input turn alike but for the ratio of the pulleys, which the amplitude takes up.
            _ => self.samples.variable(Seen::Speed),
        };
        let values = values.unwrap_or_default();
        (values.iter().map(|x| x * x).sum::<f64>() / values.len().max(1) as f64).sqrt()
    }
}

/// Smallest and largest of some values; `None` without any.
fn range<'a>(values: impl Iterator<Item = &'a f64>) -> Option<(f64, f64)> {
    values.fold(None, |ends, x| {
        let (low, high) = ends.unwrap_or((*x, *x));
        Some((low.min(*x), high.max(*x)))
    })
}

/// At every rate, both phases.
fn waves(base: ActiveEffect, name: &str, rates: &[f64]) -> Vec<ActiveEffect> {
    let at = |rate: &f64| PHASES_RAD.map(|phase_rad| base.with(name, *rate).with("phase_rad", phase_rad));
    rates.iter().flat_map(at).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::test_bench;

    #[test]
    fn a_law_of_one_bench_is_tried_on_another_and_not_there_again() {
        let recording = test_bench::swung(2000);
        let mut model = JointModel::from_rig(&test_bench::rig(), &recording).unwrap();
        let objective = Objective::new(&model, &[recording], &[], true).unwrap();
        let predictions = objective.predict(&model).unwrap();
        let id = "law_joint_friction_by_sign";
        let law = ActiveEffect::with_defaults(law::find(id).expect("a law of this name"));
        model.effects.push(ActiveEffect { bench: Some(0), ..law });
        for (bench, is_tried) in [(Some(0), false), (Some(1), true), (None, false)] {
            let all = law_candidates(bench, &model, &objective, &predictions);
            let mut starts = all.iter().flat_map(|candidate| &candidate.starts);
            let is_it = |start: &&ActiveEffect| start.descriptor().id == id;
            assert_eq!(starts.find(is_it).map(|start| start.bench), is_tried.then_some(bench), "{bench:?}");
        }
    }

    #[test]
    fn a_power_of_an_angle_is_tried_below_and_above_a_straight_line_and_one_of_a_speed_once() {
        let starts = |id: &str| -> Vec<ActiveEffect> {
            let law = law::find(id).expect("a law of this name");
            EXPONENTS.map(|exponent| ActiveEffect::with_defaults(law).with("exponent", exponent)).to_vec()
        };
        let apart = |id: &str, form| {
            apart(form, starts(id))
                .map(|starts| starts.iter().map(|start| start.parameters[1]).collect::<Vec<_>>())
        };
        assert_eq!(apart("law_joint_torque_by_angle", Form::Power), [vec![2.0, 3.0], vec![0.5]]);
        assert_eq!(apart("law_joint_friction_by_speed", Form::EvenPower), [vec![0.5, 2.0, 3.0], vec![]]);
    }
}
