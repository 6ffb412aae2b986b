//! How much each stage of a diagnosis leaves, by what the input does.

use std::collections::BTreeMap;

use super::place::{Regime, regimes_of, unit_of};
use super::stages::Stages;
use super::verdict::RegimeResidual;
use crate::fit::objective::{Objective, Series};

/// Root mean square differences by channel and regime, over all recordings.
pub(crate) fn regimes(objective: &Objective, stages: &Stages) -> Vec<RegimeResidual> {
    let regimes: Vec<Vec<Regime>> = (0..objective.recordings()).map(|r| regimes_of(objective, r)).collect();
    let by_stage = [&stages.before, &stages.recalibrated, &stages.after].map(|stage| {
        let mut sums: BTreeMap<(Series, Regime), (f64, f64)> = BTreeMap::new();
        for (entry, value) in objective.entries().zip(&stage.residuals.values) {
            let regime = regimes[entry.recording][usize::midpoint(entry.block.start, entry.block.end)];
            let sum = sums.entry((entry.series, regime)).or_insert((0.0, 0.0));
            sum.0 += (value * objective.scale(entry.series)).powi(2);
            sum.1 += 1.0;
        }
        sums
    });
    let [before, recalibrated, after] = by_stage;
    before
        .iter()
        .map(|(key, sum)| {
            let rms = |sum: Option<&(f64, f64)>| sum.map_or(0.0, |(sum, count)| (sum / count).sqrt());
            let (series, regime) = *key;
            RegimeResidual {
                channel: series.name().to_owned(),
                unit: unit_of(series).to_owned(),
                regime: regime.name().to_owned(),
                before_rmse: rms(Some(sum)),
                recalibrated_rmse: rms(recalibrated.get(key)),
                after_rmse: rms(after.get(key)),
            }
        })
        .collect()
}
