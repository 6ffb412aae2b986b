//! Least pretension that keeps the loop taut.

use crate::bench::{Bench, PAPER, UNEQUAL, near};
use crate::chain::Chain;
use crate::oracle::{bisect, slipping, slipping_from_output};
use bowden_model::paper::pretension::{
    InputTorqueUse, minimum_pretension_for_input_torque_n, minimum_pretension_for_output_torque_n,
    taut_output_torque_nm,
};

/// Least F0 at which `slackest(bench)` reaches `margin_n`, by bisection over F0 of the integrated loop.
fn scan(bench: &Bench, margin_n: f64, slackest: impl Fn(&Bench) -> f64) -> f64 {
    bisect(0.0, 1000.0, |pretension_n| slackest(&Bench { pretension_n, ..*bench }) - margin_n)
}

/// Torques from `-peak` to `peak`, coarse: the minimum lies at an end since tensions are affine in the torque.
fn grid(low: f64, high: f64) -> [f64; 3] {
    [low, 0.5 * (low + high), high]
}

type Profiles = [(Option<fn(f64) -> f64>, f64); 2];
/// Even curvature, and bent towards the output; tolerance in N.
const PROFILES: Profiles = [(None, 1e-6), (Some(|s| 3.0 * s * s), 1e-4)];

#[test]
fn output_torque_limit_is_where_the_integrated_loop_goes_slack() {
    for bench in [PAPER, UNEQUAL] {
        for (profile, tolerance_n) in PROFILES {
            let even = bench.wrap_rad / bench.length_m;
            let curvature = move |s: f64| profile.map_or(even, |p| p(s));
            let pair = profile.map_or(bench.pair(), |p| bench.pair_with(p));
            for margin_n in [0.0, 4.0] {
                let want = scan(&bench, margin_n, |b| {
                    let mut least = f64::INFINITY;
                    for direction in [1.0, -1.0] {
                        for torque in grid(-0.9, 0.9) {
                            let s = slipping_from_output(b, &curvature, direction, torque);
                            least = least.min(s.min_n());
                        }
                    }
                    least
                });
                let got =
                    minimum_pretension_for_output_torque_n(pair.path(), bench.r2_m, 0.9, margin_n).unwrap();
                near("F0 for T_out", got, want, tolerance_n);
            }
        }
    }
}

#[test]
fn input_torque_limit_depends_on_who_drives() {
    for bench in [PAPER, UNEQUAL] {
        for (profile, tolerance_n) in PROFILES {
            let even = bench.wrap_rad / bench.length_m;
            let curvature = move |s: f64| profile.map_or(even, |p| p(s));
            let pair = profile.map_or(bench.pair(), |p| bench.pair_with(p));
            for (torque_use, low) in [(InputTorqueUse::Driving, 0.0), (InputTorqueUse::AnySign, -1.2)] {
                for margin_n in [0.0, 3.0, 60.0] {
                    let want = scan(&bench, margin_n, |b| {
                        let mut least = f64::INFINITY;
                        for direction in [1.0, -1.0] {
                            for torque in grid(low, 1.2) {
                                let s = slipping(b, &curvature, direction, direction * torque);
                                least = least.min(s.min_n());
                            }
                        }
                        least
                    });
                    let got = minimum_pretension_for_input_torque_n(
                        pair.path(),
                        bench.r1_m,
                        1.2,
                        torque_use,
                        margin_n,
                    )
                    .unwrap();
                    near(&format!("F0 for T_in, {torque_use:?}, margin {margin_n}"), got, want, tolerance_n);
                }
            }
        }
    }
}

#[test]
fn partly_sticking_states_stay_taut_at_the_limit() {
    // Loop traced with many turns at the limit load: no end of the chain may fall below zero by more than its
    // discretisation, (mu K / 40)² / 24 = 4e-6 of 70 N.
    let pair = PAPER.pair();
    let limit = taut_output_torque_nm(&pair);
    // By hand: 60 N * 15 mm * a / (e^a - 1), a = 0.12 pi.
    let a = 0.12 * std::f64::consts::PI;
    near("limit", limit, 0.9 * a / (a.exp() - 1.0), 1e-12);
    let load = |theta: f64| limit * (20.0 * theta).tanh();
    let mut chain = Chain::at_rest(&PAPER);
    let mut least = f64::INFINITY;
    for theta_in in [0.6, 0.597, 0.6, 0.593, 0.58, 0.588, 0.57, -0.6, -0.592, -0.6, -0.58, 0.6] {
        chain.turn_input(theta_in, &load);
        least = chain.end_tensions().into_iter().fold(least, f64::min);
    }
    assert!(least > -1e-3, "slack at the limit: {least} N");
    assert!(least < 0.5, "the limit was never approached: {least} N");
}
