//! Recalibration of a rig: its nominal parameters fitted to all samples of recordings, and what stays unknown.

use super::free_run::solve_freely;
use super::identifiability::{Group, Sensitivity};
use super::objective::{Objective, Part, Series};
use super::observed::Use;
use super::recalibrated::{own_of_effect, recalibrated, recalibrated_from};
use super::solver::solve_watched;
use super::variation::Variation;
use crate::joint_model::JointModel;
use crate::outcome::Failure;
use crate::progress::Progress;
use crate::rig::{RigDocument, RigParameter};
use crate::study::Study;

/// Evaluations that the optimiser may spend, times the number of parameters.
const PATIENCE: usize = 10;

/// Significant digits that a fitted value is written with, far beyond what any recording determines.
const DIGITS: i32 = 6;

/// One parameter, before and after.
#[derive(Clone, Debug, PartialEq)]
pub struct FittedParameter {
    /// The parameter.
    pub parameter: RigParameter,
    /// Bench that has it for itself; `None` for one that all benches share.
    pub bench: Option<usize>,
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
    /// What was not compared, one line for each recording that has such a part.
    pub notes: Vec<String>,
    /// Every bench as fitted.
    joints: Vec<JointModel>,
}

impl Recalibration {
    /// Writes the fitted values of a bench into its rig file.
    ///
    /// # Errors
    /// Exit status 1, if the file cannot take one.
    pub fn write_to(&self, bench: usize, document: &mut RigDocument) -> Result<(), Failure> {
        let Some(joint) = self.joints.get(bench) else { return Ok(()) };
        for fitted in self.parameters.iter().filter(|fitted| fitted.bench.is_none_or(|own| own == bench)) {
            match (fitted.parameter, joint.value(&fitted.parameter)) {
                (RigParameter::Nominal(parameter), Some(value)) => {
                    let value = rounded(value).clamp(parameter.spec.lower, parameter.spec.upper);
                    document.set_nominal(parameter.section, parameter.spec.name, value)?;
                }
                (RigParameter::Effect { descriptor, .. }, Some(_)) => {
                    let stated = joint.effects.iter();
                    stated
                        .filter(|effect| effect.descriptor().id == descriptor.id)
                        .try_for_each(|effect| document.add_effect(effect))?;
                }
                _ => {}
            }
        }
        Ok(())
    }
}

/// Fits the nominal parameters of the benches of a study to all samples of its recordings that are not held out; parameters that
/// a bench has for itself are fitted to its recordings alone.
///
/// Of parameters that only a product is known of, one is fitted and the others stay as they are. Effects that the rig
/// names stay as they are too. A joint without tendons that its motor drives is held to its recorded angle first, and fitted once more in a free
/// run from there. Accuracy: on a recording of a forward run of the same model, friction, stiffness,
/// pretension and mass come back within 3 % (test `a_fit_recovers_what_was_simulated`).
///
/// # Errors
/// When there is no recording to learn from, one lacks an input, or a joint cannot be simulated; exit status 1 when `progress` asks for an
/// early end of the fit.
pub fn recalibrate(study: &Study, progress: &dyn Progress) -> Result<Recalibration, Failure> {
    let model = &study.joint()?;
    let mut observed = study.observed(model)?;
    observed.retain(|observed| observed.used_for != Use::HeldOut);
    for observed in &mut observed {
        observed.used_for = Use::Training;
    }
    let objective = &Objective::of(model, observed)?;
    let benches: Result<Vec<Variation>, Failure> =
        (0..study.benches.len()).map(|bench| study.variation_of_bench(bench, model)).collect();
    let benches = benches?;
    let mut free = recalibrated(model);
    free.extend((0..model.effects.len()).flat_map(|effect| own_of_effect(model, effect)));
    progress.stage("recalibrating", 0);
    let shown = |model: &JointModel| {
        let mut predictions = objective.predict(model)?;
        objective.run_freely(model, &mut predictions)?;
        Ok::<_, Failure>(predictions)
    };
    let before = shown(model)?;
    let mut solution = solve_watched(objective, model, &free, PATIENCE, progress)?;
    if let Some(free_runs) = objective.freely(model) {
        let stds = &solution.slopes().stds;
        let found = solution.model.clone();
        let mut free = recalibrated_from(model, &found);
        free.extend((0..found.effects.len()).flat_map(|effect| own_of_effect(&found, effect)));
        solution = solve_freely(&free_runs, &found, &free, stds, PATIENCE, progress)?;
    }
    let after = shown(&solution.model)?;
    progress.stage("what the recordings can tell apart", 0);
    let sensitivity = Sensitivity::of(objective, &solution.model)?;

    let parameters = free
        .iter()
        .zip(solution.values.iter().zip(&solution.slopes().stds))
        .filter_map(|(free, (value, std))| {
            let fitted = rounded(*value).clamp(free.spec().lower, free.spec().upper);
            Some(FittedParameter {
                parameter: free.parameter(model)?,
                bench: free.bench(model),
                unit: free.spec().unit,
                nominal: free.start(),
                fitted,
                std: *std,
                at_bound: free.at_bound(fitted),
            })
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
    Ok(Recalibration {
        parameters,
        channels,
        groups: sensitivity.groups(),
        unseen: sensitivity.unseen(),
        notes: objective.notes().map(str::to_owned).collect(),
        joints: benches.iter().map(|bench| bench.apply(&solution.model)).collect(),
    })
}

/// The value with [`DIGITS`] significant digits.
fn rounded(value: f64) -> f64 {
    format!("{value:.*e}", (DIGITS - 1) as usize).parse().unwrap_or(value)
}

#[cfg(test)]
mod tests {
    use bowden_model::channel::Channel;
    use rand_distr::{Distribution, StandardNormal};
    use rand_pcg::Pcg64;

    use super::*;
    use crate::progress::Quiet;
    use crate::simulation::{ReplayInput, replay};
    use crate::test_bench;

    /// Torque that was recorded and never reached the joint, spikes of 0.04 N·m of either sign in every twentieth sample, five times by chance. What
    /// makes the torque small that holds a joint to its angle is not what predicts the angle best: a fit ends in a free run.
    #[test]
    fn a_joint_that_was_held_is_fitted_once_more_in_a_free_run() {
        let angle = Series::Channel(Channel::ThetaOut);
        let errors_rad = |seed: u64| {
            let mut recording = test_bench::turned(6000, &[]);
            let mut random = Pcg64::new(seed.into(), 11);
            let mut duty = recording.channel(Channel::Duty).unwrap().to_vec();
            for duty in duty.iter_mut().step_by(20) {
                let sign: f64 = StandardNormal.sample(&mut random);
                *duty += 0.002 * sign.signum();
            }
            recording.set(Channel::Duty, duty);
            let study = Study::of_bench(test_bench::direct_rig(), vec![recording.clone()], Vec::new());
            let model = study.joint().unwrap();
            let objective = Objective::new(&model, &[recording], &[], false).unwrap();
            let held = solve_watched(&objective, &model, &recalibrated(&model), PATIENCE, &Quiet).unwrap();
            let mut shown = objective.predict(&held.model).unwrap();
            objective.run_freely(&held.model, &mut shown).unwrap();
            let fitted = recalibrate(&study, &Quiet).unwrap();
            let free = fitted.channels.iter().find(|error| error.series == angle).unwrap().after;
            [objective.rmse(&shown, angle, Part::Training), free]
        };
        let [held, free] =
            (1..=5).map(errors_rad).fold([0.0; 2], |sum, one| [sum[0] + one[0], sum[1] + one[1]]);
        assert!(free < 0.01 * held, "{free} instead of {held} rad");
    }

    /// The errors of a joint that a fit holds to its angle are those of a replay that begins where the recording does.
    #[test]
    fn errors_of_a_joint_that_is_held_are_of_a_free_run() {
        let recording = test_bench::turned(3000, &[]);
        let mut rig = test_bench::direct_rig();
        rig.joint.load.as_mut().unwrap().inertia_kg_m2 *= 1.1;
        let free = JointModel::from_rig(&rig, &recording).unwrap();
        let study = Study::of_bench(rig, vec![recording.clone()], Vec::new());
        let fitted = recalibrate(&study, &Quiet).unwrap();
        let of_angle = |error: &&ChannelError| error.series == Series::Channel(Channel::ThetaOut);
        let error = fitted.channels.iter().find(of_angle).unwrap();
        let mut input = ReplayInput::new(&free, &recording).unwrap();
        let theta_rad = recording.channel(Channel::ThetaOut).unwrap();
        input.start_at(theta_rad[0], 0.0);
        let replayed = replay(&free, &input).unwrap();
        // What is before the first block is not compared.
        let pairs = replayed.channel(Channel::ThetaOut).unwrap().iter().zip(theta_rad).skip(150);
        let squares: Vec<f64> = pairs.map(|(a, b)| (a - b).powi(2)).collect();
        let expected = (squares.iter().sum::<f64>() / squares.len() as f64).sqrt();
        assert!((error.before / expected - 1.0).abs() < 0.05, "{} for {expected} rad", error.before);
        assert!(error.after < 0.1 * error.before, "{error:?}");
    }

    #[test]
    fn values_keep_six_digits_whatever_their_size() {
        for (value, expected) in
            [(0.123_456_789, 0.123_457), (72_912.345_6, 72_912.3), (-1.0e-12, -1.0e-12), (0.0, 0.0)]
        {
            assert_eq!(rounded(value), expected);
        }
    }
}
