//! Whether the error of a sensor can be distinguished, in its own channel, from a change of parameters.
//!
//! Missing physics biases parameters, and a spurious sensor error can compensate that bias in its own channel. The current of a motor whose
//! angle is prescribed is `(V - k_t ω) / R`: a gain of the current sensor equals a change of `R` and `k_t`, and only torques, with all their
//! friction, distinguish them. Joint play, for example, biases the resistance by -2 to -8 %, and a gain of 0.91 then compensates the current.

use bowden_model::effect::Component;
use nalgebra::{DMatrix, DVector};

use super::{Fitted, Search};
use crate::diagnose::policy::POLICY;
use crate::fit::objective::{Part, Residuals, Series, soft};
use crate::fit::solver::Solution;
use crate::joint_model::JointModel;
use crate::outcome::Failure;

/// Relative singular value below which a direction of the parameters is treated as without influence.
const SMALLEST: f64 = 1e-9;

impl Search<'_> {
    /// Whether effect `place` of `with` is no mere change of parameters; `without` lacks it. True for an effect that is not of a sensor, for
    /// one that changes its own channel as no parameter does by at least what a name must achieve, and for one that reaches the share of
    /// a law.
    pub(super) fn is_no_parameter(
        &self,
        without: &Fitted,
        with: &Fitted,
        place: usize,
    ) -> Result<bool, Failure> {
        let effect = &with.solution.model.effects[place];
        let told = effect.descriptor().component != Component::Sensors
            || POLICY.worth_naming_in_doubt(without.loss_on(effect.bench), with.loss_on(effect.bench))
            || self.progress.interrupted();
        let loss = without.loss_on(effect.bench);
        let left_by = |own: f64| (loss - own).max(0.0);
        let is_worth_a_name = |own| POLICY.worth_naming(loss, left_by(own));
        Ok(told || self.own_change(with, place)?.is_none_or(is_worth_a_name))
    }

    /// Mean square, in noise scales, of the change that effect `place` of `with` makes in its own channel and no change of parameters can
    /// make; `None` if the channel drives the replay.
    fn own_change(&self, with: &Fitted, place: usize) -> Result<Option<f64>, Failure> {
        let Solution { model, residuals, .. } = &with.solution;
        let jacobian = &with.solution.slopes().jacobian;
        let effect = &model.effects[place];
        let [objective, _] = &self.objective.split();
        let is_of_sensor =
            |series| matches!(series, Series::Channel(channel) if effect.target.includes(channel));
        // Indices among the rows of the sensitivities and among all residuals.
        let own: Vec<(usize, usize)> = objective
            .entries()
            .enumerate()
            .filter(|(_, entry)| entry.block.part == Part::Training)
            .enumerate()
            .filter(|(_, (_, entry))| {
                is_of_sensor(entry.series) && effect.is_on(objective.bench(entry.recording))
            })
            .map(|(row, (place, _))| (row, place))
            .collect();
        if own.is_empty() {
            return Ok(None);
        }
        let mut effects = model.effects.clone();
        effects.remove(place);
        let right = objective.residuals(&JointModel { effects, ..model.clone() })?;
        let softly = |residuals: &Residuals, place: usize| soft(residuals.values[place]);
        let change = own.iter().map(|(_, place)| softly(residuals, *place) - softly(&right, *place));
        let change = DVector::from_iterator(own.len(), change);
        let rows: Vec<usize> = own.iter().map(|(row, _)| *row).collect();
        let parameters = with.layout.calibrated(model).len();
        let slopes = jacobian.columns(0, parameters.min(jacobian.ncols())).select_rows(&rows);
        Ok(Some(left_by(slopes, &change).norm_squared() / own.len() as f64))
    }
}

/// The component of `change` that is orthogonal to all columns of `slopes`.
fn left_by(slopes: DMatrix<f64>, change: &DVector<f64>) -> DVector<f64> {
    if slopes.ncols() == 0 {
        return change.clone();
    }
    let decomposed = slopes.clone().svd(true, true);
    let smallest = SMALLEST * decomposed.singular_values.max();
    decomposed.solve(change, smallest).map_or_else(|_| change.clone(), |steps| change - slopes * steps)
}

#[cfg(test)]
mod tests {
    use bowden_model::channel::Channel;
    use bowden_model::effect::{ActiveEffect, Target};
    use bowden_model::effects::find;

    use super::*;
    use crate::diagnose::hypotheses::Asked;
    use crate::diagnose::layout::Layout;
    use crate::fit::objective::Objective;
    use crate::fit::solver::COARSE_STEP;
    use crate::progress::Quiet;
    use crate::test_bench;

    /// A gain of 1.1 beside a spring, before it and behind it; the spring is no sensor.
    #[test]
    fn what_a_sensor_changes_of_its_own_does_not_depend_on_its_place() {
        let recording = test_bench::swung(3000);
        let model = JointModel::from_rig(&test_bench::rig(), &recording).unwrap();
        let usual = |id| ActiveEffect::with_defaults(find(id).unwrap());
        let spring = usual("joint_spring");
        let gain = ActiveEffect { target: Target::One(Channel::F2), ..usual("sensor_gain_error") };
        let gain = gain.with("gain", 1.1);
        let recording = test_bench::measured(&model, recording, &[spring, gain]);
        let objective = Objective::new(&model, &[recording], &[], true).unwrap();
        let (asked, believed) = (Asked::default(), &model);
        let search = Search { objective: &objective, believed, asked: &asked, progress: &Quiet };
        let own_changes = |effects: [ActiveEffect; 2]| {
            let nothing = (Layout::of(&model), model.clone());
            let (layout, with) =
                effects.into_iter().fold(nothing, |(layout, model), effect| layout.with(&model, effect));
            let fitted = search.fit(layout, &with, &[COARSE_STEP]).unwrap();
            [0, 1].map(|place| search.own_change(&fitted, place).unwrap())
        };
        let [of_gain, of_spring] = own_changes([gain, spring]);
        let [spring_first, gain_behind] = own_changes([spring, gain]);
        assert_eq!([of_spring, spring_first], [None; 2]);
        let [of_gain, gain_behind] = [of_gain, gain_behind].map(Option::unwrap);
        assert!(of_gain > 0.0 && (gain_behind / of_gain - 1.0).abs() < 1e-3, "{of_gain}, {gain_behind}");
    }

    /// By hand: of (3, 4, 12) the first two are a combination of (1, 0, 0) and (1, 1, 0), whichever scale these have.
    #[test]
    fn what_parameters_change_alike_is_nothing_of_its_own() {
        let slopes = DMatrix::from_columns(&[
            DVector::from_vec(vec![1.0, 0.0, 0.0]),
            DVector::from_vec(vec![1e-3, 1e-3, 0.0]),
        ]);
        let change = DVector::from_vec(vec![3.0, 4.0, 12.0]);
        assert!((left_by(slopes.clone(), &change) - DVector::from_vec(vec![0.0, 0.0, 12.0])).norm() < 1e-9);
        let twice_the_same = slopes.select_columns(&[0, 1, 0]);
        assert!((left_by(twice_the_same, &change).norm() - 12.0).abs() < 1e-9);
        assert_eq!(left_by(DMatrix::zeros(3, 0), &change), change);
    }
}
