//! Eq. (2)-(14): end tensions and elongations of a slipping pair.

use crate::bench::{Bench, PAPER, Profile, UNEQUAL, near};
use crate::oracle::{integrate, slipping, slipping_from_output};
use bowden_model::paper::capstan::{self, Direction, SlipToward};
use bowden_model::paper::elongation::{cable_a_from_angles_m, cable_b_from_angles_m, from_input_tension_m};
use bowden_model::paper::end_tension::{end_tensions, f1_from_f3_n};
use bowden_model::paper::{EndTensions, LoopTorque, SheathPath};

const DIRECTIONS: [Direction; 2] = [Direction::Positive, Direction::Negative];

/// Profiles over 0..1.7 m that are not symmetric: bent near the input, near the output, and an S with a straight middle.
const PROFILES: [(&str, Profile); 3] = [
    ("input side", |s| 6.0 * (-2.0 * s).exp()),
    ("output side", |s| 3.0 * s * s),
    ("S", |s| 4.0 * (3.0 * s + 0.3).cos()),
];

fn array(t: EndTensions) -> [f64; 4] {
    [t.f1_n, t.f2_n, t.f3_n, t.f4_n]
}

fn compare(
    bench: &Bench,
    curvature: &dyn Fn(f64) -> f64,
    pair: &bowden_model::paper::TendonPair,
    tolerance_n: f64,
) {
    for direction in DIRECTIONS {
        for torque_nm in [-0.8, 0.0, 0.35, 1.1] {
            let want = slipping(bench, curvature, direction.sign(), torque_nm);
            let got = end_tensions(pair, direction, LoopTorque::Input(torque_nm));
            for i in 0..4 {
                let what = format!("F{} {direction:?} T_in {torque_nm}", i + 1);
                near(&what, array(got)[i], want.f[i], tolerance_n);
            }
            near("T_in", got.input_torque_nm(pair), torque_nm, 1e-12);
            near(
                "T_out",
                got.output_torque_nm(pair),
                want.torque_out_nm(bench),
                tolerance_n * bench.r2_m * 2.0,
            );
            near("F1 of F3", f1_from_f3_n(pair, direction, want.f[2]), want.f[0], 4.0 * tolerance_n);

            let want = slipping_from_output(bench, curvature, direction.sign(), torque_nm);
            let got = end_tensions(pair, direction, LoopTorque::Output(torque_nm));
            for i in 0..4 {
                let what = format!("F{} {direction:?} T_out {torque_nm}", i + 1);
                near(&what, array(got)[i], want.f[i], 20.0 * tolerance_n);
            }
        }
    }
}

#[test]
fn even_curvature_meets_the_ode() {
    // RK4 with 1000 steps is good to 1e-13 relative, bisection to rounding of 1e4 N: 1e-11 N. From T_out the oracle
    // adds an extrapolation over 1 N·m, allowed 20 times that.
    for bench in [PAPER, UNEQUAL] {
        let curvature = bench.wrap_rad / bench.length_m;
        compare(&bench, &|_| curvature, &bench.pair(), 1e-10);
    }
}

#[test]
fn uneven_curvature_meets_the_ode() {
    // Smooth profiles: Simpson at 200 intervals, 1e-8 of 100 N. The S profile has two kinks of |kappa| at its zeros, the
    // slope changing by 24: each costs up to 24 h² / 24 = 7e-5 rad, times mu and 100 N 1.4e-3 N.
    for (name, profile) in PROFILES {
        let tolerance_n = if name == "S" { 3e-3 } else { 1e-6 };
        compare(&UNEQUAL, &profile, &UNEQUAL.pair_with(profile), tolerance_n);
    }
}

#[test]
fn samples_and_profile_agree_where_the_profile_is_piecewise_linear() {
    // Triangle of curvature, corner on a sample: both readings are the same function, integrals good to 1e-9.
    let triangle = |s: f64| if s < 0.5 { 8.0 * s } else { 8.0 * (1.0 - s) };
    let positions: Vec<f64> = (0..=200).map(|i| f64::from(i) / 200.0).collect();
    let curvatures: Vec<f64> = positions.iter().map(|&s| triangle(s)).collect();
    let sampled = SheathPath::from_samples(&positions, &curvatures, 0.3).unwrap();
    let bench = Bench { mu: 0.3, ..PAPER };
    let (_, falling) = integrate(&bench, &triangle, 1.0, -1.0);
    let (_, rising) = integrate(&bench, &triangle, 1.0, 1.0);
    near("psi_p", sampled.from_input().falling_m, falling, 1e-9);
    near("psi_r", sampled.from_input().rising_m, rising, 1e-9);
    near("K", sampled.wrap_angle_rad(), 2.0, 1e-12);
    // The triangle is symmetric, so the integrals are the same from both ends and the gain is 1.
    near("psi_r from output", sampled.from_output().rising_m, rising, 1e-9);
    near("gain", sampled.torque_gain(), 1.0, 1e-12);
}

#[test]
fn capstan_ratio_is_the_same_for_any_profile() {
    for (name, profile) in PROFILES {
        let pair = UNEQUAL.pair_with(profile);
        let (out_falling, _) = integrate(&UNEQUAL, &profile, 20.0, -1.0);
        let (out_rising, _) = integrate(&UNEQUAL, &profile, 20.0, 1.0);
        let a = pair.path().friction_exponent();
        let tolerance = if name == "S" { 3e-3 } else { 1e-6 };
        near(name, capstan::output_tension_n(20.0, a, SlipToward::Input), out_falling, tolerance);
        near(name, capstan::output_tension_n(20.0, a, SlipToward::Output), out_rising, tolerance);
        near(name, capstan::input_tension_n(out_rising, a, SlipToward::Output), 20.0, tolerance);
    }
}

#[test]
fn elongation_from_tension_is_the_integral_of_the_strain() {
    let pair = UNEQUAL.pair();
    let curvature = UNEQUAL.wrap_rad / UNEQUAL.length_m;
    for (slip, sign) in [(SlipToward::Input, -1.0), (SlipToward::Output, 1.0)] {
        let (_, integral) = integrate(&UNEQUAL, &|_| curvature, 41.0, sign);
        let want = (integral - 45.0 * 1.7) / 50_000.0;
        near("elongation", from_input_tension_m(&pair, 41.0, slip), want, 1e-14);
    }
}

#[test]
fn elongation_from_angles_has_the_signs_of_the_geometry() {
    // Winding the input towards + by 0.1 rad on 12 mm takes in 1.2 mm of a; the joint giving 0.05 rad on 20 mm returns 1.
    let pair = UNEQUAL.pair();
    near("a", cable_a_from_angles_m(&pair, 0.1, 0.05), 0.2e-3, 1e-15);
    near("b", cable_b_from_angles_m(&pair, 0.1, 0.05), -0.2e-3, 1e-15);
}

#[test]
fn stretch_lengths_at_small_friction_follow_their_series() {
    // psi = L (1 ∓ a/2 + a²/6 ∓ a³/24), difference = L (a + a³/12): next terms below 1e-16 relative for a ≤ 1e-4.
    for a in [0.0, 1e-300, 1e-15, 1e-9, 1e-4] {
        let path = SheathPath::uniform(2.0, a, 1.0).unwrap();
        let lengths = path.from_input();
        let odd = a / 2.0 + a.powi(3) / 24.0;
        let even = 1.0 + a * a / 6.0;
        near("psi_p", lengths.falling_m, 2.0 * (even - odd), 1e-15);
        near("psi_r", lengths.rising_m, 2.0 * (even + odd), 1e-15);
        let difference = 2.0 * (a + a.powi(3) / 12.0);
        near("difference", lengths.difference_m, difference, 1e-15 * difference);

        let profile = SheathPath::from_profile(2.0, a, 10, |_| 0.5).unwrap();
        near("difference", profile.from_input().difference_m, difference, 1e-12 * difference);
    }
}
