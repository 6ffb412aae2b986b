//! A ratio of the pulleys that an encoder off its centre would show as well.
//!
//! A disc off its centre by `A` shows `θ + A (sin(θ + φ) - sin φ)`. At phase 0 and over a short travel that is `(1 + A) θ`: what a
//! wrong radius of a pulley shows. The two are told apart by what a straight line leaves of `A sin θ` over the recorded
//! angles. An encoder of the input is told by the angles of the input, which are those of the joint in the ratio of the radii.

use bowden_model::channel::Channel;
use bowden_model::effect::{ActiveEffect, Target};

use super::verdict::Recalibrated;
use crate::fit::objective::{Objective, Series};
use crate::joint_model::JointModel;
use crate::rig::Undecided;

/// Parameters that set the ratio of both angles.
const RADII: [&str; 2] = ["pulleys.input_radius_m", "pulleys.output_radius_m"];

/// Effect of an encoder that is off its centre.
const OFF_CENTRE: &str = "encoder_eccentricity";

/// What else would fit of a bench: wrong radii for which a disc off its centre, of the joint's or the input's encoder, would stand as well, as far as
/// the recordings tell, and all of `stated` that the recordings do not settle. `joint` has the radii that fit.
pub(super) fn undecided(
    objective: &Objective,
    joint: &JointModel,
    recalibrated: &[&Recalibrated],
    named: &[ActiveEffect],
    stated: &[Undecided],
) -> Vec<Undecided> {
    let is_named = named.iter().any(|effect| effect.descriptor().id == OFF_CENTRE);
    let is_radius = |name: &str| RADII.contains(&name);
    let is_fitted = |name: &str| recalibrated.iter().any(|fitted| fitted.parameter == name);
    let is_judged = |undecided: &&Undecided| {
        undecided.effect == OFF_CENTRE
            && is_radius(&undecided.parameter)
            && (is_named || is_fitted(&undecided.parameter))
    };
    let (judged, left): (Vec<&Undecided>, Vec<&Undecided>) = stated.iter().partition(is_judged);
    // Angles of the joint for one of the disc.
    let of_input = joint.parameters.pulleys.map(|pulleys| pulleys.input_radius_m / pulleys.output_radius_m);
    let discs = [(Channel::ThetaOut, Some(1.0)), (Channel::ThetaIn, of_input)];
    let of_radius = |radius: &&Recalibrated| {
        let stated = judged.iter().find(|undecided| undecided.parameter == radius.parameter);
        let before = stated.map_or(radius.nominal, |undecided| undecided.before);
        let radius = Recalibrated { nominal: before, ..(*radius).clone() };
        let cannot_be_told = |ratio: f64| cannot_be_told(objective, radius.change().abs(), ratio);
        let rival = |(channel, ratio): (Channel, Option<f64>)| {
            ratio.is_some_and(|ratio| radius.is_wrong() && cannot_be_told(ratio)).then(|| Undecided {
                parameter: radius.parameter.clone(),
                before,
                effect: OFF_CENTRE,
                target: Target::One(channel),
            })
        };
        discs.into_iter().filter_map(rival).collect::<Vec<Undecided>>()
    };
    let radii = recalibrated.iter().filter(|fitted| !is_named && is_radius(&fitted.parameter));
    radii.flat_map(of_radius).chain(left.into_iter().cloned()).collect()
}

/// Whether a disc that is off by `amplitude_rad` leaves less than the scale of the joint's angle beside a straight line; the joint turns by `ratio` of
/// what the disc turns.
fn cannot_be_told(objective: &Objective, amplitude_rad: f64, ratio: f64) -> bool {
    let series = Series::Channel(Channel::ThetaOut);
    let Some((_, scale_rad)) = objective.scales().iter().find(|(other, _)| *other == series) else {
        return false;
    };
    let angles = (0..objective.recordings()).filter_map(|recording| objective.measured(recording, series));
    let of_disc = angles.flatten().map(|rad| rad / ratio);
    let left_rad = ratio * amplitude_rad * bend_of_a_sine(of_disc);
    left_rad < *scale_rad
}

/// Root of the mean square that the best straight line leaves of `sin θ` \[1\]; angles that are not finite are left out.
fn bend_of_a_sine(angles_rad: impl Iterator<Item = f64>) -> f64 {
    let (mut n, mut x, mut y, mut xx, mut xy, mut yy) = (0.0_f64, 0.0, 0.0, 0.0, 0.0, 0.0);
    for theta_rad in angles_rad.filter(|theta_rad| theta_rad.is_finite()) {
        let sine = theta_rad.sin();
        n += 1.0;
        x += theta_rad;
        y += sine;
        xx += theta_rad * theta_rad;
        xy += theta_rad * sine;
        yy += sine * sine;
    }
    let [xx, xy, yy] = [xx - x * x / n, xy - x * y / n, yy - y * y / n];
    if n > 0.0 && xx > 0.0 { ((yy - xy * xy / xx).max(0.0) / n).sqrt() } else { 0.0 }
}

#[cfg(test)]
mod tests {
    use bowden_model::effects::find;

    use super::*;
    use crate::test_bench;

    /// A joint that swings by this angle, and what a fit says of its pulley of 15 mm, which is that of a rig file before it.
    fn of_a_swing(travel_rad: f64, fitted: f64, nominal: f64, before: Option<f64>) -> Vec<Undecided> {
        of_a_geared_swing(1.0, travel_rad, fitted, nominal, before)
    }

    /// The same where the joint turns by `ratio` of what the input turns.
    fn of_a_geared_swing(
        ratio: f64,
        travel_rad: f64,
        fitted: f64,
        nominal: f64,
        before: Option<f64>,
    ) -> Vec<Undecided> {
        let mut recording = test_bench::swung(4000);
        let wave = recording.channel(Channel::ThetaIn).unwrap().iter().map(|rad| rad / 0.4 * travel_rad);
        let wave = wave.collect();
        recording.set(Channel::ThetaOut, wave);
        let model = JointModel::from_rig(&test_bench::rig(), &recording).unwrap();
        let objective = Objective::new(&model, &[recording], &[], true).unwrap();
        let radius = Recalibrated {
            parameter: "pulleys.output_radius_m".into(),
            bench: None,
            nominal,
            fitted,
            std: Some(1e-6),
            unit: "m".into(),
            at_bound: false,
        };
        let stated = before.map(|before| of_output_radius(before, OFF_CENTRE));
        let mut joint = model.clone();
        let pulleys = joint.parameters.pulleys.as_mut().unwrap();
        pulleys.input_radius_m = ratio * pulleys.output_radius_m;
        undecided(&objective, &joint, &[&radius], &[], &Vec::from_iter(stated))
    }

    fn of_output_radius(before: f64, effect: &'static str) -> Undecided {
        let target = Target::One(Channel::ThetaOut);
        Undecided { parameter: "pulleys.output_radius_m".into(), before, effect, target }
    }

    /// Recordings that tell nothing of the radius, and another explanation than this one.
    #[test]
    fn what_recordings_do_not_touch_stays_undecided() {
        let recording = test_bench::swung(4000);
        let model = JointModel::from_rig(&test_bench::rig(), &recording).unwrap();
        let objective = Objective::new(&model, &[recording], &[], true).unwrap();
        let stated = [OFF_CENTRE, "sensor_offset"].map(|effect| of_output_radius(0.015, effect));
        assert_eq!(undecided(&objective, &model, &[], &[], &stated), stated);
        let found = find(OFF_CENTRE).map(ActiveEffect::with_defaults).unwrap();
        assert_eq!(undecided(&objective, &model, &[], &[found], &stated), stated[1..]);
    }

    /// 3 % of a sine leave 0.1 mrad of a straight line over ±0.5 rad and 6 mrad over ±2 rad, by the formula below.
    #[test]
    fn a_wrong_radius_is_undecided_until_the_travel_is_long_enough() {
        assert_eq!(of_a_swing(0.5, 0.01455, 0.015, None)[0].before, 0.015);
        assert_eq!(of_a_swing(2.0, 0.01455, 0.015, None), []);
        // No more than radii are off anyway.
        assert_eq!(of_a_swing(0.5, 0.01499, 0.015, None), []);
    }

    /// At a fifth of the input's angle, ±0.5 rad of the joint are ±2.5 rad of a disc at the input.
    #[test]
    fn a_disc_of_the_input_is_told_by_the_angles_of_the_input() {
        let channels = |ratio| -> Vec<Target> {
            let all = of_a_geared_swing(ratio, 0.5, 0.01455, 0.015, None);
            all.into_iter().map(|undecided| undecided.target).collect()
        };
        let [of_joint, of_input] = [Channel::ThetaOut, Channel::ThetaIn].map(Target::One);
        assert_eq!(channels(1.0), [of_joint, of_input]);
        assert_eq!(channels(0.2), [of_joint]);
    }

    #[test]
    fn what_was_undecided_before_is_settled_by_a_long_travel_alone() {
        assert_eq!(of_a_swing(0.5, 0.01455, 0.01455, None), []);
        assert_eq!(of_a_swing(0.5, 0.01455, 0.01455, Some(0.015))[0].before, 0.015);
        assert_eq!(of_a_swing(2.0, 0.01455, 0.01455, Some(0.015)), []);
    }

    /// By hand: over angles spread evenly in ±a, `sin θ ≈ θ - θ³/6`, and the best line through a cube leaves `a³ sqrt(4/175)`.
    #[test]
    fn a_short_travel_hardly_bends_a_sine() {
        for travel_rad in [0.1, 0.3, 0.5] {
            let even = (-1000..=1000).map(|k| travel_rad * f64::from(k) / 1000.0);
            let expected = travel_rad * travel_rad * travel_rad / 6.0 * (4.0_f64 / 175.0).sqrt();
            let bend = bend_of_a_sine(even);
            assert!((bend / expected - 1.0).abs() < 0.02, "{travel_rad} rad: {bend}, not {expected}");
        }
        assert_eq!(bend_of_a_sine([0.3; 4].into_iter()), 0.0);
        assert_eq!(bend_of_a_sine(std::iter::empty()), 0.0);
    }
}
