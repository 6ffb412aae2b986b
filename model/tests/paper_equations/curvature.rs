//! Eq. (1).

use crate::bench::near;
use bowden_model::paper::curvature::{
    wrap_angle_of_mean_curvature_rad, wrap_angle_of_profile_rad, wrap_angle_of_samples_rad,
};
use std::f64::consts::PI;

/// Angle through which a curve y(x) turns, from its tangents: no curvature formula involved.
fn turning_of_curve_rad(x0: f64, x1: f64, slope: impl Fn(f64) -> f64) -> f64 {
    let n = 200_000;
    let tangent = |i: usize| slope(x0 + (x1 - x0) * i as f64 / f64::from(n)).atan();
    (1..=n as usize).map(|i| (tangent(i) - tangent(i - 1)).abs()).sum()
}

#[test]
fn opposite_bends_add_up() {
    // S of two arcs, each a quarter turn of radius 0.2 m: pi in sum, though the ends are parallel.
    let quarter_m = 0.2 * PI / 2.0;
    let curvature = |s: f64| if s < quarter_m { 5.0 } else { -5.0 };
    let got = wrap_angle_of_profile_rad(2.0 * quarter_m, 4, curvature).unwrap();
    near("S bend", got, PI, 1e-12);
}

#[test]
fn half_sine_profile() {
    // ∫ 7 sin(pi s / 1.3) ds over 1.3 m = 7 * 1.3 * 2 / pi. Tolerance: the documented 1e-9 relative.
    let got = wrap_angle_of_profile_rad(1.3, 200, |s| 7.0 * (PI * s / 1.3).sin()).unwrap();
    let want = 7.0 * 1.3 * 2.0 / PI;
    near("half sine", got, want, 1e-9 * want);
}

#[test]
fn samples_of_a_parabola_turn_by_the_change_of_its_tangent() {
    // y = x²/2 from 0 to 1: kappa = 1/(1+x²)^1.5, arc length sampled by its closed form; turning atan(1) - atan(0).
    let arc = |x: f64| 0.5 * (x * (1.0 + x * x).sqrt() + x.asinh());
    let n = 2000;
    let x = |i: usize| i as f64 / f64::from(n);
    let position: Vec<f64> = (0..=n as usize).map(|i| arc(x(i))).collect();
    let curvature: Vec<f64> = (0..=n as usize).map(|i| (1.0 + x(i) * x(i)).powf(-1.5)).collect();
    let got = wrap_angle_of_samples_rad(&position, &curvature).unwrap();
    // Trapezoid error: h² |kappa''| L / 12 < (1/2000)² * 3 / 12 < 1e-7.
    near("parabola", got, turning_of_curve_rad(0.0, 1.0, |x| x), 1e-7);
}

#[test]
fn mean_curvature_counts_by_magnitude() {
    near("mean", wrap_angle_of_mean_curvature_rad(-2.5, 0.8).unwrap(), 2.0, 1e-15);
}
