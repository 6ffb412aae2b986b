//! A ratio of the pulleys that an encoder off its centre would show as well.
//!
//! A disc off its centre by `A` shows `θ + A (sin(θ + φ) - sin φ)`. At phase 0 and over a short travel that is `(1 + A) θ`: what a
//! wrong radius of a pulley shows. The two are told apart by what a straight line leaves of `A sin θ` over the recorded
//! angles.

use bowden_model::channel::Channel;
use bowden_model::effect::ActiveEffect;

use super::verdict::Recalibrated;
use crate::fit::objective::{Objective, Series};

/// Parameters that set the ratio of both angles.
const RADII: [&str; 2] = ["pulleys.input_radius_m", "pulleys.output_radius_m"];

/// Groups of a wrong radius and the encoder whose disc would show the same, as far as the recordings tell.
pub(super) fn groups(
    objective: &Objective,
    recalibrated: &[Recalibrated],
    named: &[ActiveEffect],
) -> Vec<Vec<String>> {
    let is_wrong_radius =
        |parameter: &&Recalibrated| RADII.contains(&parameter.parameter.as_str()) && parameter.is_wrong();
    let off_centre = named.iter().any(|effect| effect.descriptor().id == "encoder_eccentricity");
    let wrong = recalibrated.iter().filter(is_wrong_radius).filter(|_| !off_centre);
    wrong
        .filter(|radius| cannot_be_told(objective, radius.change().abs()))
        .map(|radius| vec![radius.name(), "effects.encoder_eccentricity (theta_out_rad)".to_owned()])
        .collect()
}

/// Whether a disc of the joint that is off by `amplitude_rad` leaves less than the angle's scale beside a straight line.
fn cannot_be_told(objective: &Objective, amplitude_rad: f64) -> bool {
    let series = Series::Channel(Channel::ThetaOut);
    let Some((_, scale_rad)) = objective.scales().iter().find(|(other, _)| *other == series) else {
        return false;
    };
    let angles = (0..objective.recordings()).filter_map(|recording| objective.measured(recording, series));
    let left_rad = amplitude_rad * bend_of_a_sine(angles.flatten().copied());
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
    use super::*;

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
