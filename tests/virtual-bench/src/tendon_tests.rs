//! A single tendon between two moved ends, against results derived by hand.

use super::*;
use crate::config::Bend;

const NO_LAW: Material<'static> =
    Material { pretension_n: 30.0, creep_m: 0.0, stiffening: None, slack: None };

fn contact(config: &BenchConfig) -> Contact<'static> {
    Contact {
        friction_coefficient: config.friction_coefficient,
        bristle_stiffness_per_m: config.bristle_stiffness_per_m,
        stribeck: None,
        viscous: None,
        preload_n: &[],
        spot: None,
    }
}

/// Drags both ends: input end at `v_in`, output end at `v_out`, for `seconds` from `start` (input, output).
fn drag(
    tendon: &mut Tendon,
    config: &BenchConfig,
    material: &Material,
    start: (f64, f64),
    speed: (f64, f64),
    seconds: f64,
) -> (f64, f64) {
    let steps = (seconds / config.step_s).round() as usize;
    let contact = contact(config);
    for step in 0..=steps {
        let t = step as f64 * config.step_s;
        tendon.set_ends((start.0 + speed.0 * t, speed.0), (start.1 + speed.1 * t, speed.1));
        tendon.update_tensions(material);
        tendon.advance(&contact, config.step_s);
    }
    (start.0 + speed.0 * seconds, start.1 + speed.1 * seconds)
}

#[test]
fn full_slip_ratio_is_the_capstan_ratio() {
    // Both ends move towards the motor at 5 mm/s for 0.5 s: the whole tendon slips. Euler and Eytelwein:
    // T_in/T_out = e^{mu K}. Error budget: mesh K³mu³/(12 n²) < 1e-4, sigma2·v/mu = 4e-4 of mu·K, bristles not yet
    // saturated e^-(2.5 mm / 7.5 µm) = 0. Measured 2e-4 at K = pi.
    for (mu, wrap) in [(0.12, std::f64::consts::PI), (0.2, 2.0), (0.06, 5.0)] {
        let config = BenchConfig { friction_coefficient: mu, wrap_angle_rad: wrap, ..BenchConfig::default() };
        let mut tendon = Tendon::new(&config);
        drag(&mut tendon, &config, &NO_LAW, (0.0, 0.0), (-5e-3, -5e-3), 0.5);
        let ratio = tendon.input_n() / tendon.output_n();
        let capstan = (mu * wrap).exp();
        assert!((ratio / capstan - 1.0).abs() < 1e-3, "mu {mu}, K {wrap}: {ratio} against {capstan}");
    }
}

#[test]
fn where_the_sheath_bends_does_not_matter_in_full_slip() {
    let mut config = BenchConfig { friction_coefficient: 0.15, ..BenchConfig::default() };
    config.bends = vec![Bend { from: 0.05, to: 0.95, share: 1.0 }];
    let mut tendon = Tendon::new(&config);
    drag(&mut tendon, &config, &NO_LAW, (0.0, 0.0), (5e-3, 5e-3), 0.5);
    // Towards the joint the output end is the tight one.
    let ratio = tendon.output_n() / tendon.input_n();
    assert!((ratio / (0.15 * std::f64::consts::PI).exp() - 1.0).abs() < 1e-3, "{ratio}");
}

#[test]
fn without_friction_the_tendon_is_a_spring_of_stiffness_ea_over_length() {
    let config = BenchConfig { friction_coefficient: 0.0, ..BenchConfig::default() };
    let mut tendon = Tendon::new(&config);
    let end = drag(&mut tendon, &config, &NO_LAW, (0.0, 0.0), (-1e-3, 0.0), 0.2);
    drag(&mut tendon, &config, &NO_LAW, end, (0.0, 0.0), 0.5);
    // 0.2 mm over 1 m at 72.9 kN: 14.58 N on top of 30 N, the same at both ends.
    for tension in [tendon.input_n(), tendon.output_n()] {
        assert!((tension - 44.58).abs() < 0.01, "{tension} N");
    }
}

#[test]
fn a_stuck_tendon_is_as_stiff_as_its_free_part() {
    // mu = 50: nothing slips. Bends begin at 0.14; the first mass with contact is node 1 (cell 0.136..0.227) at 2/11.
    // Free length 2/11 m, behind it the bristles of node 1: 9.4e-2·0.55/0.3·K·30 N·16000/m = 256 kN/m at least.
    let config = BenchConfig { friction_coefficient: 50.0, ..BenchConfig::default() };
    let mut tendon = Tendon::new(&config);
    let end = drag(&mut tendon, &config, &NO_LAW, (0.0, 0.0), (-1e-4, 0.0), 0.05);
    drag(&mut tendon, &config, &NO_LAW, end, (0.0, 0.0), 0.1);
    let stiffness = (tendon.input_n() - 30.0) / 5e-6;
    let rigid_contact = 72_900.0 * 11.0 / 2.0;
    // Bristle and second element behind node 1 in series soften it: at least half of the rigid figure, never more.
    assert!(stiffness < rigid_contact && stiffness > 0.5 * rigid_contact, "{stiffness} N/m");
    // The bristles are springs too, so some of it leaks past them: less than 5 % reaches the joint.
    let leak = (tendon.output_n() - 30.0) / (tendon.input_n() - 30.0);
    assert!((0.0..0.05).contains(&leak), "the joint end feels {leak} of it");
}

#[test]
fn stiffening_changes_the_slope_far_from_pretension() {
    let law = TendonStiffening { excess: 0.4, knee_n: 8.0 };
    let material = Material { stiffening: Some(&law), ..NO_LAW };
    let config = BenchConfig { friction_coefficient: 0.0, ..BenchConfig::default() };
    let tension_at = |stretch_m: f64| {
        let mut tendon = Tendon::new(&config);
        let end = drag(&mut tendon, &config, &material, (0.0, 0.0), (-stretch_m / 0.2, 0.0), 0.2);
        drag(&mut tendon, &config, &material, end, (0.0, 0.0), 0.5);
        tendon.output_n()
    };
    let slope = |stretch_m: f64| (tension_at(stretch_m + 2e-5) - tension_at(stretch_m - 2e-5)) / 4e-5;
    // s·e/hypot(e, e0) at 60 N of stretch and a knee of 8 N: 0.9912·0.4.
    assert!(
        (slope(60.0 / 72_900.0) / 72_900.0 - 1.3965).abs() < 0.005,
        "{}",
        slope(60.0 / 72_900.0) / 72_900.0
    );
    assert!((slope(0.0) / 72_900.0 - 1.0).abs() < 0.005, "{}", slope(0.0) / 72_900.0);
    assert!((slope(-20.0 / 72_900.0) / 72_900.0 - (1.0 - 0.4 * 0.9285)).abs() < 0.005);
}

#[test]
fn slack_never_pushes_and_leaves_a_tight_tendon_alone() {
    let law = TendonSlack { softness_n: 0.5, nominal_pretension_n: 30.0 };
    let material = Material { slack: Some(&law), ..NO_LAW };
    let config = BenchConfig { friction_coefficient: 0.0, ..BenchConfig::default() };
    let mut tendon = Tendon::new(&config);
    let end = drag(&mut tendon, &config, &material, (0.0, 0.0), (5e-3, 0.0), 0.2);
    drag(&mut tendon, &config, &material, end, (0.0, 0.0), 0.3);
    // 1 mm too long: a spring would push with 43 N.
    assert_eq!(tendon.output_n(), 0.0);
    assert_eq!(law.tension_n(20.0), 20.0);
    assert!((law.tension_n(0.0) - 0.125).abs() < 1e-12);
}

#[test]
fn stribeck_friction_follows_its_curve_in_steady_sliding() {
    // A gentle curve: a steep one makes the rope stick and slip, and the mean ratio falls below the curve.
    let law = SheathStribeckFriction { static_ratio: 1.2, stribeck_m_per_s: 4e-3 };
    let config = BenchConfig { contact_viscosity_s_per_m: 0.0, ..BenchConfig::default() };
    let contact = Contact { stribeck: Some(&law), ..contact(&config) };
    for (speed, factor) in [(1e-3, 1.188_24), (4e-3, 1.1), (12e-3, 1.02)] {
        let mut tendon = Tendon::new(&config);
        let mut logarithm = 0.0;
        let steps = 60_000;
        for step in 0..steps {
            let u = -speed * f64::from(step) * config.step_s;
            tendon.set_ends((u, -speed), (u, -speed));
            tendon.update_tensions(&NO_LAW);
            tendon.advance(&contact, config.step_s);
            if step >= steps / 2 {
                logarithm += (tendon.input_n() / tendon.output_n()).ln() / f64::from(steps / 2);
            }
        }
        let mu_wrap = 0.12 * std::f64::consts::PI;
        assert!(
            (logarithm / mu_wrap - factor).abs() < 2e-3,
            "{speed} m/s: {} for {factor}",
            logarithm / mu_wrap
        );
    }
}
