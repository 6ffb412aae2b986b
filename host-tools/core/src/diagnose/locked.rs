//! Torques that repeat with an angle: where to start, and whether the recordings show enough of one to be told from a curve.

use std::f64::consts::TAU;

use bowden_model::channel::Channel;
use bowden_model::effect::ActiveEffect;
use bowden_model::search::Starts;

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

/// Amplitude, period and phase of a torque locked to an angle, by least squares over whole numbers of periods a turn.
///
/// `samples` gives, for one recording, angle and torque sample by sample.
fn strongest_pattern(
    base: ActiveEffect,
    predictions: &[Prediction],
    samples: impl Fn(usize, &Prediction) -> Option<Vec<(f64, f64)>>,
) -> Option<ActiveEffect> {
    let samples: Option<Vec<_>> = predictions
        .iter()
        .enumerate()
        .map(|(recording, prediction)| samples(recording, prediction))
        .collect();
    let samples: Vec<(f64, f64)> = samples?.into_iter().flatten().collect();
    let fewest = FEWEST_PERIODS * TAU / travel_rad(samples.iter().map(|(angle_rad, _)| *angle_rad))?;
    let mut best: Option<(f64, ActiveEffect)> = None;
    for n in PERIODS_A_TURN.map(f64::from).filter(|n| *n >= fewest) {
        let (mut ss, mut cc, mut sc, mut st, mut ct) = (0.0, 0.0, 0.0, 0.0, 0.0);
        for (angle_rad, torque_nm) in &samples {
            let (sin, cos) = (n * angle_rad).sin_cos();
            ss += sin * sin;
            cc += cos * cos;
            sc += sin * cos;
            st += sin * torque_nm;
            ct += cos * torque_nm;
        }
        let determinant = ss * cc - sc * sc;
        if determinant <= 1e-9 * ss * cc {
            continue;
        }
        let (a, b) = ((st * cc - ct * sc) / determinant, (ct * ss - st * sc) / determinant);
        let gain = a * st + b * ct;
        if best.as_ref().is_none_or(|(most, _)| gain > *most) {
            let start = base
                .with("amplitude_nm", a.hypot(b))
                .with("cycles_per_turn", n)
                .with("phase_rad", b.atan2(a));
            best = Some((gain, start));
        }
    }
    best.map(|(_, start)| start)
}

/// The pattern along an angle of the input or of the joint that is left there.
pub(super) fn locked_start(
    base: ActiveEffect,
    angle: Channel,
    model: &JointModel,
    objective: &Objective,
    predictions: &[Prediction],
) -> Option<ActiveEffect> {
    match angle {
        Channel::ThetaOut => ripple_start(base, model, objective, predictions),
        _ => cogging_start(base, objective, predictions),
    }
}

/// What the motor's model lacks is the torque that guided it, or that a spindle without motor took beyond what was
/// predicted.
fn cogging_start(
    base: ActiveEffect,
    objective: &Objective,
    predictions: &[Prediction],
) -> Option<ActiveEffect> {
    strongest_pattern(base, predictions, |recording, prediction| {
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
fn ripple_start(
    base: ActiveEffect,
    model: &JointModel,
    objective: &Objective,
    predictions: &[Prediction],
) -> Option<ActiveEffect> {
    let radius_m = model.parameters.pulleys?.output_radius_m;
    strongest_pattern(base, predictions, |recording, prediction| {
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
    use crate::simulation::Prediction;
    use crate::test_bench;

    fn effect(id: &str) -> ActiveEffect {
        ActiveEffect::with_defaults(find(id).unwrap())
    }

    #[test]
    fn a_wave_starts_at_its_own_period_and_a_slope_at_none_that_the_travel_does_not_show() {
        let started = |travel_rad: f64, torque_nm: fn(f64) -> f64| {
            let angles_rad = (0..=400).map(|k| travel_rad * f64::from(k) / 400.0);
            let samples: Vec<(f64, f64)> = angles_rad.map(|angle| (angle, torque_nm(angle))).collect();
            let one = [Prediction::default()];
            strongest_pattern(effect("motor_cogging"), &one, |_, _| Some(samples.clone())).unwrap().parameters
        };
        let wave = started(20.0, |angle| 0.3 * (7.0 * angle + 0.4).sin());
        for (value, expected) in wave.iter().zip([0.3, 7.0, 0.4]) {
            assert!((value - expected).abs() < 1e-9, "{wave:?}");
        }
        assert_eq!(started(0.8, |angle| angle)[1], 12.0, "one and a half periods of 11.8 a turn are 0.8 rad");
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
