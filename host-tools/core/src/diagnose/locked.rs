//! Torques that repeat with an angle: where to start, and whether the recordings show enough of one to be told from a curve.

use std::f64::consts::TAU;

use bowden_model::channel::Channel;
use bowden_model::effect::ActiveEffect;
use bowden_model::search::Starts;
use nalgebra::{DMatrix, DVector};

use crate::fit::objective::{Objective, Series};
use crate::joint_model::JointModel;
use crate::simulation::Prediction;

/// Fewest periods that a position-locked pattern must show in the travel.
pub(super) const FEWEST_PERIODS: f64 = 1.5;

/// Periods per turn at which a torque is looked for.
const PERIODS_A_TURN: std::ops::RangeInclusive<u32> = 2..=240;

/// Of so many samples one is looked at for it.
const STRIDE: usize = 5;

/// Whether `effect` is locked to an angle that the recordings turn through fewer than [`FEWEST_PERIODS`] of its periods.
pub(super) fn too_little_travel(objective: &Objective, effect: &ActiveEffect) -> bool {
    let Starts::LockedTo(angle) = effect.effect.starts() else { return false };
    let angle_rad = |recording| match angle {
        Channel::ThetaIn => objective.input(recording).motion().map(|motion| motion.theta_rad.as_slice()),
        _ => objective.measured(recording, Series::Channel(angle)),
    };
    let angles_rad = (0..objective.recordings()).filter_map(angle_rad).flatten().copied();
    travel_rad(angles_rad).is_some_and(|travel_rad| effect.parameters[1] / TAU * travel_rad < FEWEST_PERIODS)
}

/// `None` where there is no angle.
fn travel_rad(angles_rad: impl Iterator<Item = f64>) -> Option<f64> {
    let (low, high) = angles_rad
        .fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), angle| (low.min(angle), high.max(angle)));
    (low <= high).then_some(high - low)
}

/// Angle and torque of one recording, sample by sample.
type Samples = Vec<(f64, f64)>;

/// A torque locked to an angle, and what those that were there before are beside it.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Pattern {
    /// The one that is new.
    pub new: ActiveEffect,
    /// The others, in their order.
    pub beside: Vec<ActiveEffect>,
}

/// Amplitude, period and phase of a torque locked to an angle, by least squares over whole numbers of periods a turn other than
/// those that are `there`, whose amplitudes and phases are found anew beside it.
fn strongest_pattern(base: ActiveEffect, there: &[ActiveEffect], samples: &Samples) -> Option<Pattern> {
    let fewest = FEWEST_PERIODS * TAU / travel_rad(samples.iter().map(|(angle_rad, _)| *angle_rad))?;
    let cycles = |effect: &ActiveEffect| effect.parameters[1];
    let mut all: Vec<f64> = there.iter().map(cycles).collect();
    let left = left_by(samples, &all, &Waves::of(samples, &all)?.factors);
    let mut best: Option<(f64, f64)> = None;
    for n in PERIODS_A_TURN.map(f64::from).filter(|n| *n >= fewest) {
        let start = base.with("cycles_per_turn", n);
        if there.iter().any(|other| start.excludes(other)) {
            continue;
        }
        let Some(Waves { gain, .. }) = Waves::of(&left, &[n]) else { continue };
        if best.is_none_or(|(most, _)| gain > most) {
            best = Some((gain, n));
        }
    }
    let (_, n) = best?;
    all.push(n);
    let mut found = Waves::of(samples, &all)?.factors;
    let (a, b) = found.pop()?;
    let new = base.with("cycles_per_turn", n).with("amplitude_nm", a.hypot(b)).with("phase_rad", b.atan2(a));
    let beside = there.iter().zip(found).map(|(effect, (da, db))| {
        let [amplitude_nm, _, phase_rad, ..] = effect.parameters;
        let (a, b) = (amplitude_nm * phase_rad.cos() + da, amplitude_nm * phase_rad.sin() + db);
        effect.with("amplitude_nm", a.hypot(b)).with("phase_rad", b.atan2(a))
    });
    Some(Pattern { new, beside: beside.collect() })
}

/// Waves along an angle by least squares.
struct Waves {
    /// Factors of sine and cosine for each number of periods a turn.
    factors: Vec<(f64, f64)>,
    /// What they take off the sum of the squared torques.
    gain: f64,
}

impl Waves {
    /// `None` where the samples do not tell the waves apart.
    fn of(samples: &Samples, cycles: &[f64]) -> Option<Self> {
        if cycles.is_empty() {
            return Some(Self { factors: Vec::new(), gain: 0.0 });
        }
        let count = 2 * cycles.len();
        let (mut normal, mut right) = (DMatrix::zeros(count, count), DVector::zeros(count));
        let mut row = DVector::zeros(count);
        for (angle_rad, torque_nm) in samples {
            for (place, n) in cycles.iter().enumerate() {
                (row[2 * place], row[2 * place + 1]) = (n * angle_rad).sin_cos();
            }
            normal.syger(1.0, &row, &row, 1.0);
            right.axpy(*torque_nm, &row, 1.0);
        }
        let largest = normal.diagonal().amax();
        // Only the lower triangle is read.
        let normal = normal.cholesky()?;
        if normal.l_dirty().diagonal().amin().powi(2) <= 1e-9 * largest {
            return None;
        }
        let solved = normal.solve(&right);
        let factors = solved.as_slice().chunks_exact(2).map(|pair| (pair[0], pair[1])).collect();
        Some(Self { factors, gain: solved.dot(&right) })
    }
}

/// `samples` without these waves.
fn left_by(samples: &Samples, cycles: &[f64], waves: &[(f64, f64)]) -> Samples {
    let wave = |angle_rad: f64| -> f64 {
        let each = cycles.iter().zip(waves);
        each.map(|(n, (a, b))| a * (n * angle_rad).sin() + b * (n * angle_rad).cos()).sum()
    };
    samples.iter().map(|(angle_rad, torque_nm)| (*angle_rad, torque_nm - wave(*angle_rad))).collect()
}

/// The samples of all recordings, where each has them.
fn of_all(
    predictions: &[Prediction],
    samples: impl Fn(usize, &Prediction) -> Option<Samples>,
) -> Option<Samples> {
    let all: Option<Vec<_>> = predictions
        .iter()
        .enumerate()
        .map(|(recording, prediction)| samples(recording, prediction))
        .collect();
    Some(all?.into_iter().flatten().collect())
}

/// The pattern along an angle of the input or of the joint that is left there.
pub(super) fn locked_start(
    base: ActiveEffect,
    angle: Channel,
    model: &JointModel,
    objective: &Objective,
    predictions: &[Prediction],
) -> Option<ActiveEffect> {
    further_pattern(base, &[], angle, model, objective, predictions).map(|pattern| pattern.new)
}

/// The pattern along such an angle that is left beside those that are `there` in `model`.
pub(super) fn further_pattern(
    base: ActiveEffect,
    there: &[ActiveEffect],
    angle: Channel,
    model: &JointModel,
    objective: &Objective,
    predictions: &[Prediction],
) -> Option<Pattern> {
    let samples = match angle {
        Channel::ThetaOut => at_the_joint(model, objective, predictions),
        _ => at_the_input(objective, predictions),
    };
    strongest_pattern(base, there, &samples?)
}

/// What the motor's model lacks is the torque that guided it, or that a spindle without motor took beyond what was
/// predicted.
fn at_the_input(objective: &Objective, predictions: &[Prediction]) -> Option<Samples> {
    of_all(predictions, |recording, prediction| {
        let motion = objective.input(recording).motion()?;
        let lacking = lacking_nm(objective, recording, prediction)?;
        let lacking = lacking.into_iter().enumerate().step_by(STRIDE);
        // A motor that stands tells nothing about the position lock.
        let moving = lacking.filter(|(k, _)| motion.omega_rad_s[*k].abs() >= 0.02);
        Some(moving.map(|(k, torque_nm)| (motion.theta_rad[k], torque_nm)).collect())
    })
}

/// Torque that helps the input round beyond what the model gives it.
fn lacking_nm(objective: &Objective, recording: usize, prediction: &Prediction) -> Option<Vec<f64>> {
    if !prediction.guide_nm.is_empty() {
        return Some(prediction.guide_nm.clone());
    }
    let measured = objective.measured(recording, Series::Channel(Channel::TorqueIn))?;
    let predicted = prediction.channel(Channel::TorqueIn)?;
    let less = || predicted.iter().zip(measured).map(|(predicted, measured)| predicted - measured);
    let mean = less().sum::<f64>() / measured.len().max(1) as f64;
    Some(less().map(|torque_nm| torque_nm - mean).collect())
}

/// What the joint's model lacks is what the cables carried less than predicted.
fn at_the_joint(model: &JointModel, objective: &Objective, predictions: &[Prediction]) -> Option<Samples> {
    let radius_m = model.parameters.pulleys?.output_radius_m;
    of_all(predictions, |recording, prediction| {
        let of = |channel| {
            let measured = objective.measured(recording, Series::Channel(channel))?;
            Some((measured, prediction.channel(channel)?))
        };
        let ((a, a_predicted), (b, b_predicted)) = (of(Channel::F2)?, of(Channel::F4)?);
        let theta = objective.measured(recording, Series::Channel(Channel::ThetaOut))?;
        let less = |k: usize| radius_m * ((a_predicted[k] - b_predicted[k]) - (a[k] - b[k]));
        Some((0..theta.len()).step_by(STRIDE).map(|k| (theta[k], less(k))).collect())
    })
}

#[cfg(test)]
mod tests {
    use bowden_model::effect::ActiveEffect;
    use bowden_model::effects::find;

    use super::{strongest_pattern, too_little_travel};
    use crate::fit::objective::Objective;
    use crate::joint_model::JointModel;
    use crate::test_bench;

    fn effect(id: &str) -> ActiveEffect {
        ActiveEffect::with_defaults(find(id).unwrap())
    }

    #[test]
    fn a_wave_starts_at_its_own_period_and_a_slope_at_none_that_the_travel_does_not_show() {
        let started = |travel_rad: f64, torque_nm: fn(f64) -> f64, there: &[ActiveEffect]| {
            let angles_rad = (0..=400).map(|k| travel_rad * f64::from(k) / 400.0);
            let samples: Vec<(f64, f64)> = angles_rad.map(|angle| (angle, torque_nm(angle))).collect();
            strongest_pattern(effect("motor_cogging"), there, &samples).unwrap()
        };
        let waves = |angle: f64| 0.3 * (7.0 * angle + 0.4).sin() + 0.1 * (12.0 * angle).sin();
        let travel_rad = std::f64::consts::TAU * 3.0;
        let wave = started(travel_rad, waves, &[]);
        for (value, expected) in wave.new.parameters.iter().zip([0.3, 7.0, 0.4]) {
            assert!((value - expected).abs() < 1e-3, "{wave:?}");
        }
        assert_eq!(
            started(0.8, |angle| angle, &[]).new.parameters[1],
            12.0,
            "one and a half periods of 11.8 a turn are 0.8 rad"
        );
    }

    /// Over a part of a turn the two are not orthogonal, and the first alone comes out wrong.
    #[test]
    fn a_further_wave_is_found_beside_those_that_are_there() {
        let waves = |angle: f64| 0.3 * (7.0 * angle + 0.4).sin() + 0.1 * (12.0 * angle).sin();
        let first = effect("motor_cogging")
            .with("cycles_per_turn", 7.0)
            .with("amplitude_nm", 0.32)
            .with("phase_rad", 0.5);
        let left = (0..=400).map(|k| 8.0 * f64::from(k) / 400.0);
        let left: Vec<(f64, f64)> =
            left.map(|angle| (angle, waves(angle) - 0.32 * (7.0 * angle + 0.5).sin())).collect();
        let found = strongest_pattern(effect("motor_cogging"), &[first], &left).unwrap();
        for (found, expected) in [(found.new, [0.1, 12.0, 0.0]), (found.beside[0], [0.3, 7.0, 0.4])] {
            for (value, expected) in found.parameters.iter().zip(expected) {
                assert!((value - expected).abs() < 1e-9, "{found:?}");
            }
        }
    }

    /// 0.8 rad are one and a half periods of 11.8 a turn.
    #[test]
    fn what_repeats_less_than_one_and_a_half_times_in_the_travel_is_not_told_from_a_curve() {
        let recording = test_bench::swung(2000);
        let model = JointModel::from_rig(&test_bench::rig(), &recording).unwrap();
        let objective = Objective::new(&model, &[recording], &[], true).unwrap();
        for (cycles_per_turn, too_little) in [(1.5, true), (11.0, true), (13.0, false)] {
            let cogging = effect("motor_cogging").with("cycles_per_turn", cycles_per_turn);
            assert_eq!(too_little_travel(&objective, &cogging), too_little, "{cycles_per_turn} a turn");
        }
        assert!(too_little_travel(&objective, &effect("joint_torque_ripple")), "the joint stands still");
        assert!(!too_little_travel(&objective, &effect("joint_spring")), "is not locked to an angle");
    }
}
