//! Eq. (18)-(24).

use crate::bench::{PAPER, UNEQUAL, near};
use crate::chain::Chain;
use crate::oracle::{slipping, slipping_from_output};
use bowden_model::paper::displacement_transmission::{
    dead_zone_input_rad, lag_angle_rad, measured_lag_angle_rad, slip_output_angle_rad,
};
use bowden_model::paper::{Direction, DisplacementState, LoopTorque, Regime, TendonPair};

/// Curvature, 1/m over m.
type Curvature = Box<dyn Fn(f64) -> f64>;

const DIRECTIONS: [Direction; 2] = [Direction::Positive, Direction::Negative];

#[test]
fn lag_is_the_integrated_stretch() {
    // Oracle: 1e-10 N of tension over EA r2 = 1000 N·m gives 1e-12 rad with room for the bisection.
    let bent: fn(f64) -> f64 = |s| 6.0 * (-2.0 * s).exp();
    for bench in [PAPER, UNEQUAL] {
        let even = bench.wrap_rad / bench.length_m;
        let cases: [(TendonPair, Curvature, f64); 2] =
            [(bench.pair(), Box::new(move |_| even), 1e-12), (bench.pair_with(bent), Box::new(bent), 1e-9)];
        for (pair, curvature, tolerance) in &cases {
            for direction in DIRECTIONS {
                for torque in [-0.9, 0.0, 0.25, 1.3] {
                    let want = slipping(&bench, curvature.as_ref(), direction.sign(), torque);
                    let got = lag_angle_rad(pair, direction, LoopTorque::Input(torque));
                    near("phi of T_in", got, want.lag_rad(&bench), *tolerance);
                    let want = slipping_from_output(&bench, curvature.as_ref(), direction.sign(), torque);
                    let got = lag_angle_rad(pair, direction, LoopTorque::Output(torque));
                    near("phi of T_out", got, want.lag_rad(&bench), 20.0 * tolerance);
                }
            }
        }
    }
}

#[test]
fn without_friction_the_pair_is_two_springs() {
    // mu = 0: both tendons are springs EA/L on r2, torsional stiffness 2 EA r2² / L = 2 * 72900 * 0.000225 = 32.805.
    let pair = crate::bench::Bench { mu: 0.0, ..PAPER }.pair();
    for direction in DIRECTIONS {
        let got = lag_angle_rad(&pair, direction, LoopTorque::Output(0.5));
        near("phi", got, 0.5 / 32.805, 1e-15);
    }
}

#[test]
fn small_friction_does_not_cancel() {
    // phi_s - phi_n at one T_out = 2 F0 L tanh(a/2) / (EA r2) = F0 L a / (EA r2) to a²/12; a = 1e-10 * pi.
    // phi itself is of order F0 L a, its terms of order T_out: choose T_out = 0 to see the difference alone.
    let pair = crate::bench::Bench { mu: 1e-10, ..PAPER }.pair();
    let zero = LoopTorque::Output(0.0);
    let want = 30.0 * 1e-10 * std::f64::consts::PI / (72_900.0 * 0.015);
    let got =
        lag_angle_rad(&pair, Direction::Positive, zero) - lag_angle_rad(&pair, Direction::Negative, zero);
    near("dead zone", got, want, 1e-13 * want);
}

#[test]
fn angles_and_lag_close_on_each_other() {
    let pair = UNEQUAL.pair();
    let torque = LoopTorque::Output(0.4);
    let out = slip_output_angle_rad(&pair, Direction::Negative, 0.7, torque);
    // 12 mm on 20 mm: 0.7 rad in is 0.42 rad out before the lag.
    near("theta_out", out, 0.42 - lag_angle_rad(&pair, Direction::Negative, torque), 1e-15);
    near("measured", measured_lag_angle_rad(&pair, 0.7, out), 0.42 - out, 1e-15);
}

#[test]
fn dead_zone_loop_runs_through_the_corner_points() {
    // r1 = 12 mm, r2 = 20 mm, T_out = 0. By hand: half width at the output h = F0 L tanh(a/2) / (EA r2) with a = 0.3 pi,
    // so the output holds within ± (20/12) h of input travel from the middle.
    let pair = UNEQUAL.pair();
    let a = 0.3 * std::f64::consts::PI;
    let h = 45.0 * 1.7 * ((a.exp() - 1.0) / (a.exp() + 1.0)) / (50_000.0 * 0.02);
    let (gain, inverse) = (0.6, 20.0 / 12.0);
    let mut state = DisplacementState::at_rest(0.0).unwrap();
    let corners = [
        (0.99 * inverse * h, 0.0, Regime::Hold),
        (0.5, gain * 0.5 - h, Regime::Slip(Direction::Positive)),
        (0.5 - 1.99 * inverse * h, gain * 0.5 - h, Regime::Hold),
        (-0.5, -gain * 0.5 + h, Regime::Slip(Direction::Negative)),
        (-0.5 + 1.99 * inverse * h, -gain * 0.5 + h, Regime::Hold),
        (-0.5, -gain * 0.5 + h, Regime::Hold),
        (0.1, gain * 0.1 - h, Regime::Slip(Direction::Positive)),
    ];
    let mut theta_in = 0.0;
    for (target, want, regime) in corners {
        let mut last = Regime::Hold;
        for i in 1..=2000 {
            let at = theta_in + (target - theta_in) * f64::from(i) / 2000.0;
            last = state.step(&pair, at, 0.0).unwrap().regime;
        }
        theta_in = target;
        near(&format!("theta_out at {target}"), state.theta_out_rad(), want, 1e-12);
        assert_eq!(last, regime, "at theta_in {target}");
    }
    let left = |direction| state.input_travel_left_rad(&pair, direction, 0.1, 0.0).unwrap();
    near("left, ahead", left(Direction::Positive), 0.0, 1e-12);
    near("left, back", left(Direction::Negative), -2.0 * inverse * h, 1e-12);
}

#[test]
fn dead_zone_is_the_travel_between_the_two_slip_states() {
    for bench in [PAPER, UNEQUAL] {
        let (pair, curvature) = (bench.pair(), bench.wrap_rad / bench.length_m);
        // Same joint angle before and after: the input makes up the difference of the stretches of cable a.
        for torque in [0.0, 0.5] {
            let forward = slipping_from_output(&bench, &|_| curvature, 1.0, torque).elongation_a_m;
            let backward = slipping_from_output(&bench, &|_| curvature, -1.0, torque).elongation_a_m;
            let want = (forward - backward) / bench.r1_m;
            let same = LoopTorque::Output(torque);
            near("to +", dead_zone_input_rad(&pair, Direction::Positive, same, same), want, 1e-10);
            near("to -", dead_zone_input_rad(&pair, Direction::Negative, same, same), -want, 1e-10);
        }
    }
}

#[test]
fn chain_of_nodes_shows_the_same_dead_zone() {
    // T_out = 0: nothing may move at the joint until the input has made the travel, then both tendons follow at once.
    // Discretisation of the stretch: (mu K / 40)² / 24 = 4e-6 of it; small against the 1e-6 rad allowed.
    let pair = PAPER.pair();
    let free = |theta: f64| 1e-6 * theta;
    let mut chain = Chain::at_rest(&PAPER);
    chain.turn_input(0.3, &free);
    let top = chain.theta_out_rad();
    let phi = lag_angle_rad(&pair, Direction::Positive, LoopTorque::Output(0.0));
    near("phi_s", 0.3 - top, phi, 1e-6);
    let same = LoopTorque::Output(0.0);
    let travel = dead_zone_input_rad(&pair, Direction::Negative, same, same);
    chain.turn_input(0.3 + 0.95 * travel, &free);
    near("holds at 95 %", chain.theta_out_rad(), top, 1e-6);
    chain.turn_input(0.3 + travel - 0.002, &free);
    near("follows 2 mrad later", chain.theta_out_rad(), top - 0.002, 1e-5);
}

#[test]
fn chain_of_nodes_follows_the_lumped_form_under_load() {
    // T_out = 0.5 N·m: the slacker tendon turns first and the joint creeps inside the dead zone. The lumped form puts all
    // motion at its end; over the whole loop it is off by at most 0.06 of the dead zone (measured 0.041), and by 1e-5 rad
    // once the pair slips.
    let pair = PAPER.pair();
    let load = |theta: f64| 0.5 + 1e-3 * theta;
    let mut chain = Chain::at_rest(&PAPER);
    chain.turn_input(0.3, &load);
    let mut state = DisplacementState::at_rest(chain.theta_out_rad()).unwrap();
    let mut worst: f64 = 0.0;
    let mut turn = |from: f64, to: f64, chain: &mut Chain| {
        for i in 1..=40 {
            let theta_in = from + (to - from) * f64::from(i) / 40.0;
            chain.turn_input(theta_in, &load);
            let got = state.step(&pair, theta_in, load(chain.theta_out_rad())).unwrap();
            worst = worst.max((got.theta_out_rad - chain.theta_out_rad()).abs());
        }
        near("after the turn", state.theta_out_rad(), chain.theta_out_rad(), 1e-5);
    };
    turn(0.3, 0.28, &mut chain);
    turn(0.28, 0.30, &mut chain);
    let same = LoopTorque::Output(0.5);
    let zone = dead_zone_input_rad(&pair, Direction::Positive, same, same);
    let share = worst / zone;
    assert!(share < 0.06, "lumped form off by {share} of the dead zone");
    assert!(share > 0.01, "no creep seen: share {share}; the load did not unbalance the tendons");
}
