//! Structure that is left after all named physics.

use std::collections::BTreeMap;

use bowden_model::channel::Channel;

use super::place::component_of;
use super::verdict::Unexplained;
use crate::fit::objective::{Aspect, Objective, Residuals, Series, loss};
use crate::joint_model::JointModel;

/// Mean loss of a channel from which on something is left that the sensors and the usual difference between two
/// realities do not account for: on the virtual bench without concealed effects channels reach 2.
const LEFT_OVER: f64 = 4.0;

/// Share of a channel's residual that a variable must account for to be named.
const EXPLAINING_SHARE: f64 = 0.2;

/// Bins of a variable.
const BINS: usize = 24;

/// The channel with most structure left, if it is more than usual.
pub(crate) fn unexplained(
    objective: &Objective,
    model: &JointModel,
    residuals: &Residuals,
) -> Option<Unexplained> {
    let mut by_series: BTreeMap<Series, (f64, f64)> = BTreeMap::new();
    for (entry, value) in objective.entries().zip(&residuals.values) {
        let sum = by_series.entry(entry.series).or_insert((0.0, 0.0));
        sum.0 += loss(*value);
        sum.1 += 1.0;
    }
    let (series, mean) = by_series
        .into_iter()
        .map(|(series, (sum, count))| (series, sum / count))
        .max_by(|a, b| a.1.total_cmp(&b.1))?;
    if mean < LEFT_OVER {
        return None;
    }
    let depends_on = dependence(objective, model, residuals, series);
    let component = component_of(series).name();
    let on = if depends_on.is_empty() {
        "on none of position, speed, tension and time alone".to_owned()
    } else {
        format!("with {}", depends_on.join(", "))
    };
    Some(Unexplained {
        component: component.to_owned(),
        channel: series.name().to_owned(),
        sentence: format!(
            "{} is left {:.1} times above what sensors and an ordinary bench leave, varying {on}; no effect of the \
             catalogue explains it.",
            series.name(),
            mean.sqrt()
        ),
        depends_on,
    })
}

/// Variables whose bins account for a good part of the residual's variance.
fn dependence(
    objective: &Objective,
    model: &JointModel,
    residuals: &Residuals,
    series: Series,
) -> Vec<String> {
    let mut values: Vec<f64> = Vec::new();
    let mut variables: Vec<(&str, Vec<f64>)> = [
        ("theta_in_rad", Vec::new()),
        ("omega_in_rad_s", Vec::new()),
        ("t_s", Vec::new()),
        ("tension_n", Vec::new()),
    ]
    .to_vec();
    for (entry, value) in objective.entries().zip(&residuals.values) {
        if entry.series != series || entry.aspect != Aspect::Mean {
            continue;
        }
        let k = usize::midpoint(entry.block.start, entry.block.end);
        let input = objective.input(entry.recording);
        let tension = Channel::TENSIONS
            .iter()
            .filter_map(|c| objective.measured(entry.recording, Series::Channel(*c)))
            .map(|v| v[k])
            .fold(0.0, f64::max);
        values.push(value.clamp(-30.0, 30.0));
        let motion = input.motion();
        variables[0].1.push(motion.map_or(0.0, |m| m.theta_rad[k]));
        variables[1].1.push(motion.map_or(0.0, |m| m.omega_rad_s[k]));
        variables[2].1.push(input.t_s()[k]);
        variables[3].1.push(tension);
    }
    if model.parameters.tendon.is_none() {
        variables.truncate(3);
    }
    variables
        .into_iter()
        .filter(|(_, variable)| explained_share(variable, &values) > EXPLAINING_SHARE)
        .map(|(name, _)| name.to_owned())
        .collect()
}

/// Share of the variance of `values` between bins of equal count of `variable`, less what chance gives.
fn explained_share(variable: &[f64], values: &[f64]) -> f64 {
    let n = values.len();
    if n < 4 * BINS {
        return 0.0;
    }
    let mut order: Vec<usize> = (0..n).collect();
    order.sort_by(|a, b| variable[*a].total_cmp(&variable[*b]));
    let mean = values.iter().sum::<f64>() / n as f64;
    let total: f64 = values.iter().map(|v| (v - mean).powi(2)).sum();
    let between: f64 = order
        .chunks(n.div_ceil(BINS))
        .map(|chunk| {
            let chunk_mean = chunk.iter().map(|i| values[*i]).sum::<f64>() / chunk.len() as f64;
            chunk.len() as f64 * (chunk_mean - mean).powi(2)
        })
        .sum();
    between / total.max(f64::MIN_POSITIVE) - (BINS - 1) as f64 / (n - 1) as f64
}
