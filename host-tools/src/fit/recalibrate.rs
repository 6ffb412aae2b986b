//! Recalibration of a rig: its nominal parameters fitted to all samples of recordings, and what stays unknown.

use super::free::{Place, recalibrated};
use super::identifiability::{Group, Sensitivity};
use super::objective::{Objective, Part, Series};
use super::solver::solve;
use crate::joint_model::JointModel;
use crate::outcome::Failure;
use crate::progress::Progress;
use crate::recording::Recording;
use crate::rig::{Rig, RigDocument};

/// Evaluations that the optimiser may spend, times the number of parameters.
const PATIENCE: usize = 10;

/// Significant digits that a fitted value is written with, far beyond what any recording determines.
const DIGITS: i32 = 6;

/// One parameter, before and after.
#[derive(Clone, Debug, PartialEq)]
pub struct FittedParameter {
    /// Section of the rig file.
    pub section: &'static str,
    /// Name in the section.
    pub name: &'static str,
    /// Unit; `1` for a ratio.
    pub unit: &'static str,
    /// Value in the rig file.
    pub nominal: f64,
    /// Value that fits.
    pub fitted: f64,
    /// Standard deviation; `None` where the data leave it open or the value lies at a bound.
    pub std: Option<f64>,
    /// Whether the value lies at an end of its accepted range.
    pub at_bound: bool,
}

/// Differences between recordings and replays in one channel.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ChannelError {
    /// Channel.
    pub series: Series,
    /// Root mean square with the nominal parameters, in the unit of the channel.
    pub before: f64,
    /// The same with the fitted ones.
    pub after: f64,
}

/// Result of a recalibration.
#[derive(Clone, Debug)]
pub struct Recalibration {
    /// Parameters that were fitted.
    pub parameters: Vec<FittedParameter>,
    /// Differences channel by channel.
    pub channels: Vec<ChannelError>,
    /// Parameters that the recordings cannot tell apart.
    pub groups: Vec<Group>,
    /// Parameters on which the recordings say nothing.
    pub unseen: Vec<String>,
}

impl Recalibration {
    /// Writes the fitted values into a rig file.
    ///
    /// # Errors
    /// Exit status 1, if the file cannot take one.
    pub fn write_to(&self, document: &mut RigDocument) -> Result<(), Failure> {
        self.parameters.iter().try_for_each(|p| document.set_nominal(p.section, p.name, p.fitted))
    }
}

/// Fits the nominal parameters of `rig` to all samples of `recordings`.
///
/// Of parameters that only a product is known of, one is fitted and the others stay as they are. Effects that the rig
/// names stay as they are too. Accuracy: on a recording of a forward run of the same model, friction, stiffness,
/// pretension and mass come back within 3 % (test `a_fit_recovers_what_was_simulated`).
///
/// # Errors
/// When a recording lacks an input, or the joint cannot be simulated.
pub fn recalibrate(
    rig: &Rig,
    recordings: &[Recording],
    progress: &dyn Progress,
) -> Result<Recalibration, Failure> {
    let Some(first) = recordings.first() else {
        return Err(Failure::bad_input("no recording to fit to; name one"));
    };
    let model = JointModel::from_rig(rig, first)?;
    let objective = Objective::new(&model, recordings, &[], false)?;
    let free = recalibrated(&model);
    progress.stage("recalibrating", 0);
    let before = objective.predict(&model)?;
    let solution = solve(&objective, &model, &free, PATIENCE)?;
    let after = objective.predict(&solution.model)?;
    progress.stage("what the recordings can tell apart", 0);
    let sensitivity = Sensitivity::of(&objective, &solution.model)?;

    let parameters = free
        .iter()
        .zip(solution.values.iter().zip(&solution.stds))
        .filter_map(|(free, (value, std))| match free.place() {
            Place::Nominal(parameter) => {
                let fitted = rounded(*value).clamp(free.spec().lower, free.spec().upper);
                Some(FittedParameter {
                    section: parameter.section,
                    name: parameter.spec.name,
                    unit: parameter.spec.unit,
                    nominal: free.start(),
                    fitted,
                    std: *std,
                    at_bound: free.at_bound(fitted),
                })
            }
            Place::Effect { .. } => None,
        })
        .collect();
    let channels = objective
        .scales()
        .iter()
        .map(|(series, _)| ChannelError {
            series: *series,
            before: objective.rmse(&before, *series, Part::Training),
            after: objective.rmse(&after, *series, Part::Training),
        })
        .collect();
    Ok(Recalibration { parameters, channels, groups: sensitivity.groups(), unseen: sensitivity.unseen() })
}

/// The value with [`DIGITS`] significant digits.
fn rounded(value: f64) -> f64 {
    format!("{value:.*e}", (DIGITS - 1) as usize).parse().unwrap_or(value)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn values_keep_six_digits_whatever_their_size() {
        for (value, expected) in
            [(0.123_456_789, 0.123_457), (72_912.345_6, 72_912.3), (-1.0e-12, -1.0e-12), (0.0, 0.0)]
        {
            assert_eq!(rounded(value), expected);
        }
    }
}
