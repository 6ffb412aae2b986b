//! Structure that is left after all named physics: where it acts, what it varies with, and a free form of it.
//!
//! What sensors and an ordinary bench leave is broad: contact and mesh of two realities differ most near reversals, and no
//! curve over one variable describes that. Structure is something that a free form, fitted to a part of the data, takes off
//! the rest.

mod locate;
mod repeated;
pub(super) mod samples;
pub(super) mod shape;
pub(super) mod structure;

use std::collections::BTreeMap;
use std::f64::consts::TAU;

use super::verdict::{FreeForm, Unexplained};
use super::words::short;
use crate::fit::objective::{Aspect, Objective, Part, Residuals, Series, loss};
use crate::joint_model::JointModel;
use crate::outcome::Failure;
use locate::Answer;
use samples::{Left, Samples, Variable};
use shape::{Factor, Fitted, Shape};

/// Mean loss of a channel's means from which on something is left although no free form describes it: three scales,
/// where the loss itself begins to bend. None of fifty virtual benches without concealed effects reaches it.
const LEFT_OVER: f64 = 9.0;

/// The strongest structure in what `model` leaves of the recordings of `objective`, if there is more than an ordinary bench leaves.
/// What is held out chooses nothing; a form is judged by what is held out of them and by the recordings of `judging`.
///
/// # Errors
/// When the model cannot be driven.
pub(crate) fn unexplained(
    objective: &Objective,
    judging: Option<&Objective>,
    model: &JointModel,
) -> Result<Option<Unexplained>, Failure> {
    let (samples, residuals) = {
        let predictions = objective.predict(model)?;
        (Samples::new(objective, &predictions), objective.compare(&predictions))
    };
    let judging = match judging {
        Some(judging) => Some(Samples::new(judging, &judging.predict(model)?)),
        None => None,
    };
    Ok(found(objective, &samples, judging.as_ref(), &residuals))
}

/// The same where what `model` leaves of a channel is beyond what any bench without concealed physics leaves ([`LEFT_OVER`]).
///
/// # Errors
/// When the model cannot be driven.
pub(crate) fn far_off(
    objective: &Objective,
    judging: Option<&Objective>,
    model: &JointModel,
) -> Result<Option<Unexplained>, Failure> {
    match loudest(objective, &objective.residuals(model)?) {
        Some(_) => unexplained(objective, judging, model),
        None => Ok(None),
    }
}

fn found(
    objective: &Objective,
    samples: &Samples,
    judging: Option<&Samples>,
    residuals: &Residuals,
) -> Option<Unexplained> {
    if let Some(found) = structure::strongest(samples) {
        let left = samples.of(found.series)?;
        return Some(described(samples, judging, left, &[(found.shape, found.fitted)]));
    }
    let left = samples.of(loudest(objective, residuals)?)?;
    Some(described(samples, judging, left, &structure::dependence(samples, left)))
}

/// The series with the largest loss, if it is more than [`LEFT_OVER`].
fn loudest(objective: &Objective, residuals: &Residuals) -> Option<Series> {
    let mut by_series: BTreeMap<Series, (f64, f64)> = BTreeMap::new();
    for (entry, value) in objective.entries().zip(&residuals.values) {
        if entry.block.part == Part::Training && entry.aspect == Aspect::Mean {
            let sum = by_series.entry(entry.series).or_insert((0.0, 0.0));
            sum.0 += loss(*value);
            sum.1 += 1.0;
        }
    }
    let means = by_series.into_iter().map(|(series, (sum, count))| (series, sum / count));
    let (series, mean) = means.max_by(|a, b| a.1.total_cmp(&b.1))?;
    (mean > LEFT_OVER).then_some(series)
}

/// What is left of `left`, with the forms that describe it, best first.
fn described(
    samples: &Samples,
    judging: Option<&Samples>,
    left: &Left,
    forms: &[(Shape, Fitted)],
) -> Unexplained {
    let choosing = |values: &[f64]| -> Vec<f64> {
        (0..samples.len()).filter(|row| samples.may_choose(*row)).map(|row| values[row]).collect()
    };
    let patterns: Vec<(Series, f64, Vec<f64>)> = samples
        .left
        .iter()
        .map(|other| match forms.first().and_then(|(shape, _)| shape.fit(samples, &other.soft)) {
            Some(fitted) => {
                let pattern: Vec<f64> = fitted.form.iter().map(|value| value * other.scale).collect();
                (other.series, fitted.removed(), choosing(&pattern))
            }
            // Without a form all that is more than usual is the pattern.
            None => (other.series, mean_square(&choosing(&other.soft)) - 1.0, choosing(&other.plain)),
        })
        .collect();
    let answers: Vec<Answer<'_>> = patterns
        .iter()
        .map(|(series, strength, pattern)| Answer { series: *series, strength: *strength, pattern })
        .collect();
    let (component, why) = locate::component(&answers)
        .map_or((super::place::component_of(left.series).name(), ""), |(part, why)| (part.name(), why));
    let mut depends_on: Vec<String> = Vec::new();
    for (shape, _) in forms {
        let factor = match shape {
            _ if shape.turns() => Some(Variable::Speed),
            Shape::Curve { times: Factor::Current, .. } | Shape::Wave { times: Factor::Current, .. } => {
                Some(Variable::Current)
            }
            _ => None,
        };
        for variable in std::iter::once(shape.variable()).chain(factor) {
            if !depends_on.iter().any(|name| name == variable.name()) {
                depends_on.push(variable.name().to_owned());
            }
        }
    }
    let free_form = forms.first().map(|(shape, fitted)| free_form(samples, judging, left, *shape, fitted));
    let (period_rad, frequency_hz) = match forms.first() {
        Some((Shape::Wave { of: Variable::Time, rate, .. }, _)) => (None, Some(rate / TAU)),
        Some((Shape::Wave { rate, .. }, _)) => (Some(TAU / rate), None),
        _ => (None, None),
    };
    Unexplained {
        component: component.to_owned(),
        channel: left.series.name().to_owned(),
        sentence: sentence(left, forms, free_form.as_ref(), why),
        depends_on,
        period_rad,
        frequency_hz,
        free_form,
        modelled: false,
        law: None,
    }
}

/// The form in numbers that a report can draw.
fn free_form(
    samples: &Samples,
    judging: Option<&Samples>,
    left: &Left,
    shape: Shape,
    fitted: &Fitted,
) -> FreeForm {
    let here = (0..samples.len()).filter(|row| !samples.may_choose(*row));
    let mut pairs: Vec<[f64; 2]> = here.map(|row| [left.plain[row], fitted.form[row]]).collect();
    if let Some(judging) = judging
        && let Some(there) = judging.of(left.series)
    {
        let form = shape.at_rows_of(judging, samples, fitted);
        pairs.extend(there.plain.iter().zip(form).map(|(plain, form)| [*plain, form]));
    }
    let told = |pair: &[f64; 2]| pair.iter().all(|value| value.is_finite());
    pairs.retain(told);
    let heldout = !pairs.is_empty();
    if !heldout {
        let confirming = (0..samples.len()).filter(|row| fitted.confirmed_by[*row]);
        pairs = confirming.map(|row| [left.plain[row], fitted.form[row]]).filter(told).collect();
    }
    let mean = |of: &dyn Fn(&[f64; 2]) -> f64| {
        pairs.iter().map(|pair| of(pair).powi(2)).sum::<f64>() / f64::max(pairs.len() as f64, 1.0)
    };
    let before = mean(&|[plain, _]| *plain);
    let after = mean(&|[plain, form]| plain - left.scale * form);
    let drawn = |direction: f64| -> Vec<[f64; 2]> {
        let points = shape.drawn(samples, fitted, direction);
        points.into_iter().map(|(x, value)| [x, left.scale * value]).collect()
    };
    FreeForm {
        variable: shape.variable().name().to_owned(),
        variable_unit: shape.variable().unit().to_owned(),
        per_ampere: matches!(
            shape,
            Shape::Curve { times: Factor::Current, .. } | Shape::Wave { times: Factor::Current, .. }
        ),
        unit: super::place::unit_of(left.series).to_owned(),
        points: drawn(1.0),
        points_backwards: if shape.turns() { drawn(-1.0) } else { Vec::new() },
        heldout,
        heldout_rms_before: before.sqrt(),
        heldout_rms_after: after.sqrt(),
        heldout_share: if before > 0.0 { 1.0 - after / before } else { 0.0 },
    }
}

fn sentence(left: &Left, forms: &[(Shape, Fitted)], free_form: Option<&FreeForm>, why: &str) -> String {
    let name = left.series.name();
    let Some(((shape, _), form)) = forms.first().zip(free_form) else {
        return format!(
            "{name} is left {:.1} times above what sensors and an ordinary bench leave, and follows none of position, \
             speed, tension and time alone; no effect of the catalogue explains it.",
            mean_square(&left.soft).sqrt()
        );
    };
    let variable = shape.variable().name();
    let pattern = match shape {
        Shape::Wave { times: Factor::Current, rate, .. } => {
            format!("a swing at {} Hz that grows with the motor's current", short(rate / TAU))
        }
        Shape::Wave { of: Variable::Time, rate, .. } => format!("an oscillation at {} Hz", short(rate / TAU)),
        Shape::Wave { rate, .. } => {
            let (period, cycles) = (short(TAU / rate), short(*rate));
            format!("a pattern that repeats every {period} rad of {variable}, {cycles} times a turn")
        }
        Shape::Spot { at, reach, .. } => format!(
            "a bump at one place, {variable} from {} to {} rad, that turns with the direction of motion",
            short(at - reach),
            short(at + reach)
        ),
        Shape::Curve { times: Factor::Direction, .. } => {
            format!("a pattern along {variable} that depends on the direction of motion")
        }
        Shape::Curve { times: Factor::Current, .. } => {
            "a pattern over time that grows with the motor's current".to_owned()
        }
        Shape::Curve { of: Variable::Time, .. } => "a slow change over time".to_owned(),
        Shape::Curve { .. } => format!("a pattern along {variable}"),
    };
    let reason = if why.is_empty() { String::new() } else { format!("; {why}") };
    format!(
        "{name} shows {pattern}, which no effect of the catalogue explains{reason}. A free form of it, which is no \
         physics, brings the difference on {} from {} to {} {}.",
        if form.heldout { "held-out data" } else { "every third second, to which it was not fitted," },
        short(form.heldout_rms_before),
        short(form.heldout_rms_after),
        form.unit
    )
}

fn mean_square(values: &[f64]) -> f64 {
    let (sum, count) = values
        .iter()
        .filter(|v| v.is_finite())
        .fold((0.0, 0.0), |(sum, count), v| (sum + v * v, count + 1.0));
    sum / f64::max(count, 1.0)
}

#[cfg(test)]
mod tests;
