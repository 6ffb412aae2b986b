//! The numbers that `docs/derivation.md` states for the paper's bench: right side from the integrated loop, printed side
//! by typing the printed form. Tolerance: half a unit of the last digit in the document.

use crate::bench::{Bench, PAPER, near};
use crate::chain::Chain;
use crate::oracle::{slipping, slipping_from_output};
use bowden_model::paper::SheathPath;
use std::f64::consts::PI;

const A: f64 = 0.12 * PI;
/// `T_in` = 0.6 N·m in + motion, the document's example.
const T_IN: f64 = 0.6;

fn even(_: f64) -> f64 {
    PI
}

#[test]
fn example_state() {
    let s = slipping(&PAPER, &even, 1.0, T_IN);
    for (got, want) in s.f.into_iter().zip([53.03, 36.37, 13.03, 18.99]) {
        near("F", got, want, 5e-3);
    }
    near("T_out", s.torque_out_nm(&PAPER), 0.2607, 5e-5);
    near("dL_a, mm", 1e3 * s.elongation_a_m, 0.1945, 5e-5);
    near("phi_s", s.lag_rad(&PAPER), 0.012_97, 5e-6);
    near("phi_n", slipping(&PAPER, &even, -1.0, T_IN).lag_rad(&PAPER), 0.023_19, 5e-6);
}

#[test]
fn printed_psi_r_fits_every_equation_but_9() {
    let psi_p = (1.0 - (-A).exp()) / A;
    let psi_r_printed = (1.0 - A.exp()) / A;
    near("psi_r as printed", psi_r_printed, -1.2146, 5e-5);
    let s = slipping(&PAPER, &even, 1.0, T_IN);
    let (f0_l, r) = (30.0, 0.015);
    let f1_of = |psi_r: f64| (psi_r * T_IN - 2.0 * f0_l * r) / (r * (psi_r - psi_p));
    near("(11) as printed", f1_of(psi_r_printed), s.f[0], 1e-9);
    near("(11) with psi_r > 0", f1_of(-psi_r_printed), -29.93, 5e-3);
    near("(10) as printed", (s.f[2] * psi_r_printed + 60.0) / psi_p, s.f[0], 1e-9);
    near("(10) with psi_r > 0", (s.f[2] * -psi_r_printed + 60.0) / psi_p, 91.01, 5e-3);
    let elongation_b = |psi_r: f64| 1e3 * (s.f[2] * psi_r - f0_l) / 72_900.0;
    near("(9) as printed, mm", elongation_b(psi_r_printed), -0.6286, 5e-5);
    near("(9) with psi_r > 0, mm", elongation_b(-psi_r_printed), 1e3 * s.elongation_b_m, 1e-9);
    let phi_s = |psi_r: f64| {
        (T_IN * psi_r * psi_p - f0_l * r * (psi_r + psi_p)) / (72_900.0 * r * r * (psi_r - psi_p))
    };
    near("(18) as printed", phi_s(psi_r_printed), s.lag_rad(&PAPER), 1e-12);
    near("(18) with psi_r > 0", phi_s(-psi_r_printed), -0.050_24, 5e-6);
}

#[test]
fn printed_13_and_14_lose_mu() {
    let psi_p = (1.0 - (-A).exp()) / A;
    let psi_r_printed = (1.0 - A.exp()) / A;
    let s = slipping(&PAPER, &even, 1.0, T_IN);
    let (f2, f4) = (s.f[0] * (1.0 - psi_p * PI), s.f[2] * (1.0 - psi_r_printed * PI));
    near("(13)", f2, -85.76, 5e-3);
    near("(14)", f4, 62.73, 5e-3);
    near("T_out of them", (f2 - f4) * 0.015, -2.227, 5e-4);
    near("(13) with mu", s.f[0] * (1.0 - psi_p * A), s.f[1], 1e-9);
    near("(14) with mu", s.f[2] * (1.0 - psi_r_printed * A), s.f[3], 1e-9);
}

#[test]
fn bends_at_one_end() {
    // All of K within the last or first 0.1 % of the sheath, as samples.
    let at_output =
        SheathPath::from_samples(&[0.0, 0.999, 0.999_000_1, 1.0], &[0.0, 0.0, 1e3 * PI, 1e3 * PI], 0.12)
            .unwrap();
    let at_input =
        SheathPath::from_samples(&[0.0, 0.000_999_9, 0.001, 1.0], &[1e3 * PI, 1e3 * PI, 0.0, 0.0], 0.12)
            .unwrap();
    // The end bend has a length of 1e-3, which the limits do not know.
    near("gain, output", at_output.torque_gain(), 1.0719, 1e-3);
    near("loss, output", at_output.loss_exponent(), 0.386, 1e-3);
    near("gain, input", at_input.torque_gain(), 0.9329, 1e-3);
    near("loss, input", at_input.loss_exponent(), 0.360, 1e-3);
}

#[test]
fn dead_zone_grows_as_the_pulley_shrinks() {
    let zone = |r: f64| {
        let bench = Bench { r1_m: r, r2_m: r, ..PAPER };
        let lag = |direction| slipping_from_output(&bench, &even, direction, 0.0).lag_rad(&bench);
        1e3 * (lag(1.0) - lag(-1.0))
    };
    near("15 mm, mrad", zone(0.015), 10.222, 5e-4);
    near("20 mm, mrad", zone(0.020), 7.666, 5e-4);
}

#[test]
fn slackest_end_under_the_papers_load() {
    let at = |t_out: f64| slipping_from_output(&PAPER, &even, 1.0, t_out).min_n();
    assert!(at(0.740) > 0.0 && at(0.742) < 0.0, "limit is not 0.741 N·m");
    // 2.5 kg: 24.5 N on 30.2 mm.
    near("arm, mm", 1e3 * 0.740_99 / (2.5 * 9.81), 30.2, 0.05);
}

#[test]
fn tensions_at_rest_after_a_slip() {
    let s = slipping_from_output(&PAPER, &even, 1.0, 0.0);
    for (got, want) in s.f.into_iter().zip([42.72, 29.30, 20.10, 29.30]) {
        near("F", got, want, 5e-3);
    }
    near("mean of the ends", s.f.into_iter().sum::<f64>() / 4.0, 30.35, 1e-2);
}

#[test]
fn joint_starts_when_the_slacker_tendon_has_turned() {
    // T_out = 0.5 N·m, turn from + to -: documented start after 3.3 of 10.2 mrad.
    let load = |theta: f64| 0.5 + 1e-3 * theta;
    let mut chain = Chain::at_rest(&PAPER);
    chain.turn_input(0.3, &load);
    let top = chain.theta_out_rad();
    near("F4", chain.end_tensions()[3], 9.53, 2e-2);
    let mut travel = 0.0;
    while (chain.theta_out_rad() - top).abs() < 2e-6 {
        travel += 1e-4;
        chain.turn_input(0.3 - travel, &load);
    }
    near("start, mrad", 1e3 * travel, 3.3, 0.3);
}

#[test]
fn printed_condition_of_24_has_the_sign_reversed_into_positive_motion() {
    // T_out = 0.2607 N·m held; T_in rises from T_out - M to T_out + M before the pair slips in + direction.
    let lag = |direction, t_in| 1e3 * slipping(&PAPER, &even, direction, t_in).lag_rad(&PAPER);
    let (m, t_out) = (2.0 * 30.0 * 0.015 * A, 0.260_7);
    let printed_into_plus = |t_in| lag(1.0, t_in) - lag(-1.0, t_out - m);
    near("just after the turn, mrad", printed_into_plus(t_out - m), -10.222, 5e-4);
    near("half way", printed_into_plus(t_out), 0.0, 5e-4);
    near("at the onset of slip", printed_into_plus(t_out + m), 10.222, 5e-4);
    let printed_into_minus = |t_in| lag(-1.0, t_in) - lag(1.0, t_out + m);
    near("just after the turn, mrad", printed_into_minus(t_out + m), 10.222, 5e-4);
    near("half way", printed_into_minus(t_out), 0.0, 5e-4);
    near("at the onset of slip", printed_into_minus(t_out - m), -10.222, 5e-4);
}
