//! Whether parameters stay the same from recording to recording: what fits one has to fit the other.

use std::collections::BTreeMap;

use super::place::component_of;
use super::policy::POLICY;
use super::verdict::Unexplained;
use crate::fit::objective::{Objective, Part, Residuals, Series, loss};

/// What is wrong where the values of the rig file predict held-out data better than fitted ones by a worthwhile amount:
/// either the bench changed in between, or the fit bent parameters to what the model lacks.
pub(super) fn inconstant(
    objective: &Objective,
    stated: &Residuals,
    fitted: &Residuals,
) -> Option<Unexplained> {
    let [kept, moved] = [stated, fitted].map(|residuals| objective.mean_loss(residuals, Part::HeldOut));
    if !POLICY.worth_naming(moved, kept) {
        return None;
    }
    let mut worse: BTreeMap<Series, f64> = BTreeMap::new();
    for (entry, (stated, fitted)) in objective.entries().zip(stated.values.iter().zip(&fitted.values)) {
        if entry.block.part == Part::HeldOut {
            *worse.entry(entry.series).or_insert(0.0) += loss(*fitted) - loss(*stated);
        }
    }
    let (series, _) = worse.into_iter().max_by(|a, b| a.1.total_cmp(&b.1))?;
    let sentence = format!(
        "Parameters fitted to the recordings predict held-out data worse than those of the rig file (loss {moved:.2} \
         instead of {kept:.2}), most in {}: the bench changed in between, or the model lacks something that they made up for.",
        series.name()
    );
    Some(Unexplained {
        component: component_of(series).name().to_owned(),
        channel: series.name().to_owned(),
        depends_on: vec!["recording".to_owned()],
        period_rad: None,
        frequency_hz: None,
        free_form: None,
        modelled: false,
        law: None,
        sentence,
    })
}
