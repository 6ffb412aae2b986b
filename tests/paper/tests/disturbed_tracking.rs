//! Section 5.2: average torque tracking errors while the sheaths are moved, against the paper's.

use std::f64::consts::PI;

use bowden_paper::disturbed_tracking::{Method, SETUP, TrackingRun, TrackingSetup, track};
use bowden_paper::tracking_methods::{LOADS, PaperLoad, compensated, torque_loop, uncompensated};
use bowden_paper::tracking_prediction::predicted_error_percent;

/// A motion of the sheaths that no constant was fixed on.
const SEED: u64 = 4;
/// Points of per cent by which a single run of 20 s may be off the paper: 3 for the median of long runs.
const BAND_PERCENT: f64 = 3.0;

/// Two of the four periods.
fn shorter() -> TrackingSetup {
    TrackingSetup { measured_s: 20.0, ..SETUP }
}

fn run(load: &PaperLoad, method: &Method) -> TrackingRun {
    track(&shorter(), load.mass_kg, method, SEED).unwrap_or_else(|error| panic!("{}: {error}", method.name))
}

#[test]
fn errors_before_and_after_compensation_are_the_papers() {
    for load in &LOADS {
        let before = run(load, &uncompensated(&SETUP, load)).errors;
        let after = run(load, &compensated(&SETUP, load)).errors;
        println!("{} kg: {before:?} {after:?}", load.mass_kg);
        assert!((before.torque_percent - load.uncompensated_percent).abs() < BAND_PERCENT, "{before:?}");
        assert!((after.torque_percent - load.compensated_percent).abs() < BAND_PERCENT, "{after:?}");
    }
}

#[test]
fn the_equations_predict_the_error_before_compensation() {
    for load in &LOADS {
        let measured = run(load, &uncompensated(&SETUP, load)).errors.torque_percent;
        let predicted = predicted_error_percent(&shorter(), load.mass_kg, None, SEED).expect("in range");
        println!("{} kg: {predicted} % predicted, {measured} %", load.mass_kg);
        // What the equations leave out: fronts that travel while (24) has the joint stand, 4 % of a dead zone of up to 45
        // mrad; and a friction angle up to 3 % smaller, because the bench's sheaths are straight at their ends.
        assert!((predicted - measured).abs() < 2.5, "{predicted} {measured}");
    }
}

/// At mu = 0 the play closes and the lag is `c m g l` in phase: the error is `c m g l/(1 + c m g l)` of the torque.
#[test]
fn without_friction_the_predicted_error_is_that_of_the_stretch() {
    let setup = TrackingSetup { friction_coefficient: 0.0, ..shorter() };
    let predicted = predicted_error_percent(&setup, 2.5, None, SEED).expect("in range");
    let stretch = 3.5 / (2.0 * 72_900.0 * 0.015 * 0.015) * 2.5 * 9.81 * 0.08;
    let expected = 100.0 * stretch / (1.0 + stretch);
    // Inertia takes 0.3 % off the torque that is asked for, the sine of the angle is within 0.2 %.
    assert!((predicted - expected).abs() < 0.5, "{predicted} {expected}");
}

#[test]
fn no_tendon_goes_slack_and_the_motor_can_drive() {
    for load in &LOADS {
        for method in [uncompensated(&SETUP, load), torque_loop(&SETUP, load, true)] {
            let least = run(load, &method).least_tension_n;
            // Both tendons slipping at K = 1.5 pi with the torque at its peak leave the cable that pays out with
            // F4 = F0 a/sinh a - E/(1 + e^-a) and F3 = F4 e^-a, a = 0.94: the lowest that any method may come to.
            let a = 0.2 * 1.5 * PI;
            let peak_n = load.mass_kg * 9.81 * SETUP.arm_m * SETUP.amplitude_rad / 0.015;
            let lowest = (-a).exp() * (30.0 * a / a.sinh() - peak_n / (1.0 + (-a).exp()));
            assert!(least > lowest - 1.0 && least < 30.0, "{}: {least} N, {lowest} N", method.name);
        }
    }
}
