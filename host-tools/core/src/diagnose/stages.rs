//! What is kept of the simulations with the rig as it was, recalibrated, and diagnosed: differences and what the report draws.
//!
//! A prediction of an hour at 1 kHz takes a quarter of a gigabyte, so none outlives its comparison.

use crate::fit::objective::{Objective, Part, Residuals, Series};
use crate::joint_model::JointModel;
use crate::outcome::Failure;

use super::verdict::{StageLoss, Trace};

/// Samples up to which a trace is kept as it is.
const ALL_DRAWN: usize = 100_000;

/// Parts of a longer one of which the extremes are kept: five for each column of pixels that the report has.
const COLUMNS: usize = 5000;

/// One stage.
#[derive(Clone)]
pub(crate) struct Stage {
    /// Against all recordings.
    pub residuals: Residuals,
    /// Root mean square difference of every series on held-out data, in its unit, in the order of the scales: of channels from a free run, if
    /// the joint is guided by one.
    pub heldout_rmse: Vec<f64>,
}

impl Stage {
    /// The stage of a model.
    ///
    /// # Errors
    /// When the model cannot be driven.
    pub fn of(objective: &Objective, model: &JointModel) -> Result<Self, Failure> {
        let mut predictions = objective.predict(model)?;
        let residuals = objective.compare(&predictions);
        objective.run_freely(model, &mut predictions)?;
        let rmse = |(series, _): &(Series, f64)| objective.rmse(&predictions, *series, Part::HeldOut);
        Ok(Self { residuals, heldout_rmse: objective.scales().iter().map(rmse).collect() })
    }

    /// Mean loss over a part of the data.
    pub fn loss(&self, objective: &Objective, part: Part) -> f64 {
        objective.mean_loss(&self.residuals, part)
    }
}

/// The three stages.
pub(crate) struct Stages {
    pub before: Stage,
    pub recalibrated: Stage,
    pub after: Stage,
}

impl Stages {
    /// Their mean losses over a part of the data.
    pub fn loss(&self, objective: &Objective, part: Part) -> StageLoss {
        StageLoss {
            before: self.before.loss(objective, part),
            recalibrated: self.recalibrated.loss(objective, part),
            after: self.after.loss(objective, part),
        }
    }
}

/// What was simulated of the first recording, to be drawn: seven digits are more than a plot shows.
struct Drawn(Vec<(Series, Vec<f32>)>);

impl Drawn {
    /// Every compared series.
    fn new(objective: &Objective, model: &JointModel) -> Result<Self, Failure> {
        let mut prediction = objective.predict_first(model)?;
        objective.run_freely(model, std::slice::from_mut(&mut prediction))?;
        let drawn = |(series, _): &(Series, f64)| {
            let values = match series {
                Series::Channel(channel) => prediction.take(*channel),
                Series::Guide => std::mem::take(&mut prediction.guide_nm),
            };
            (*series, values.into_iter().map(|value| value as f32).collect())
        };
        Ok(Self(objective.scales().iter().map(drawn).collect()))
    }

    fn of(&self, series: Series) -> Option<&[f32]> {
        let found = self.0.iter().find(|(s, values)| *s == series && !values.is_empty());
        found.map(|(_, values)| values.as_slice())
    }
}

/// Traces of the first recording, and what the rig as it was and the diagnosed one predict of it.
///
/// # Errors
/// When a model cannot be driven.
pub(crate) fn traces(
    objective: &Objective,
    before: &JointModel,
    after: &JointModel,
) -> Result<Vec<Trace>, Failure> {
    let before = Drawn::new(objective, before)?;
    let after = Drawn::new(objective, after)?;
    let t_s = objective.input(0).t_s();
    let mut held_out = vec![false; t_s.len()];
    for block in objective.blocks(0).iter().filter(|block| block.part == Part::HeldOut) {
        held_out[block.start..block.end].fill(true);
    }
    let traces = objective
        .scales()
        .iter()
        .filter_map(|(series, _)| {
            let measured = objective.measured(0, *series)?;
            let (before, after) = (before.of(*series)?, after.of(*series)?);
            let kept = kept(measured, before, after);
            Some(Trace {
                channel: series.name().to_owned(),
                unit: super::place::unit_of(*series).to_owned(),
                t_s: kept.iter().map(|k| t_s[*k]).collect(),
                measured: kept.iter().map(|k| measured[*k]).collect(),
                before: kept.iter().map(|k| f64::from(before[*k])).collect(),
                after: kept.iter().map(|k| f64::from(after[*k])).collect(),
                held_out: kept.iter().map(|k| held_out[*k]).collect(),
            })
        })
        .collect();
    Ok(traces)
}

/// Samples that are drawn: all, or the extremes of the lines and of their differences in each of [`COLUMNS`] parts.
fn kept(measured: &[f64], before: &[f32], after: &[f32]) -> Vec<usize> {
    let samples = measured.len().min(before.len()).min(after.len());
    if samples <= ALL_DRAWN {
        return (0..samples).collect();
    }
    let lines: [&dyn Fn(usize) -> f64; 5] = [
        &|k| measured[k],
        &|k| f64::from(before[k]),
        &|k| f64::from(after[k]),
        &|k| measured[k] - f64::from(before[k]),
        &|k| measured[k] - f64::from(after[k]),
    ];
    let mut kept = Vec::with_capacity(2 * lines.len() * COLUMNS);
    for column in 0..COLUMNS {
        let part = samples * column / COLUMNS..samples * (column + 1) / COLUMNS;
        let first = kept.len();
        for line in lines {
            kept.extend(part.clone().min_by(|a, b| line(*a).total_cmp(&line(*b))));
            kept.extend(part.clone().max_by(|a, b| line(*a).total_cmp(&line(*b))));
        }
        kept[first..].sort_unstable();
    }
    kept.dedup();
    kept
}

#[cfg(test)]
mod tests {
    use super::{ALL_DRAWN, kept};

    #[test]
    fn of_a_long_trace_every_spike_is_kept() {
        let (samples, spike) = (4 * ALL_DRAWN, 271_828);
        let wave: Vec<f64> = (0..samples).map(|k| (1e-3 * k as f64).sin()).collect();
        let plain: Vec<f32> = wave.iter().map(|value| *value as f32).collect();
        assert!(!kept(&wave, &plain, &plain).contains(&spike), "is nothing special as it is");
        let mut measured = wave.clone();
        measured[spike] += 0.01;
        let mut simulated = plain.clone();
        simulated[spike] -= 0.01;
        for (measured, before, after) in
            [(&measured, &plain, &plain), (&wave, &simulated, &plain), (&wave, &plain, &simulated)]
        {
            let kept = kept(measured, before, after);
            assert!(kept.contains(&spike) && kept.len() < ALL_DRAWN, "{} samples", kept.len());
            assert!(kept.is_sorted_by(|a, b| a < b), "in order of time, each once");
        }
    }

    #[test]
    fn a_short_trace_is_kept_whole() {
        let plain = vec![0.0; ALL_DRAWN];
        assert_eq!(kept(&vec![0.0; ALL_DRAWN], &plain, &plain).len(), ALL_DRAWN);
    }
}
