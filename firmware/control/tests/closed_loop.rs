//! The whole controller on the joint of `bowden-model`: boots, tests itself, homes and follows its reference.
//!
//! Errors are of the true joint angle against the reference of the same tick. Bounds are on both sides, 20 % around what
//! was measured when they were written, so that a change for better or worse is noticed.

mod bench;

use bench::{Bench, joint};
use bowden_control::parameters::Parameters;
use bowden_link::State;
use bowden_link::message::{Goal, Mode, Reference, Shape};

/// Errors of the joint over a time, rad, and what the motor did for it.
#[derive(Debug)]
struct Errors {
    rms_rad: f64,
    largest_rad: f64,
    current_rms_a: f64,
}

fn measure(bench: &mut Bench, seconds: f64) -> Errors {
    let ticks = (seconds * f64::from(bench.parameters.tick_rate_hz())) as u32;
    let (mut squares, mut largest, mut current) = (0.0, 0.0_f64, 0.0);
    for _ in 0..ticks {
        let output = bench.tick();
        let error = bench.plant.theta_out_rad() - f64::from(output.sample.reference_raw) / f64::from(1 << 20);
        squares += error * error;
        largest = largest.max(error.abs());
        current += bench.plant.current_a() * bench.plant.current_a();
    }
    assert_eq!(bench.controller.state(), State::Run, "{:?}", bench.controller.fault());
    let mean = |sum: f64| (sum / f64::from(ticks)).sqrt();
    Errors { rms_rad: mean(squares), largest_rad: largest, current_rms_a: mean(current) }
}

fn within_fifth(value: f64, measured: f64) -> bool {
    (value - measured).abs() <= 0.2 * measured
}

/// From power-on: self test, pretension check, homing, then a sine of 0.5 rad at 0.2 Hz for 10 s.
fn sine(source: f32) -> Errors {
    let mut parameters = Parameters::default();
    parameters.compensator.source = source;
    let mut bench = Bench::ready(parameters, joint());
    bench.order(Goal::Home);
    assert!(bench.reaches(State::Homing, 0.01));
    assert!(bench.reaches(State::Ready, 5.0), "{:?}", bench.controller.fault());
    bench.refer(Reference::Generated { shape: Shape::Sine, amplitude: 0.5, offset: 0.0, frequency_hz: 0.2 });
    bench.order(Goal::Run(Mode::Position));
    bench.run(1.25);
    let errors = measure(&mut bench, 10.0);
    println!("source {source}: {errors:?}");
    errors
}

#[test]
fn the_compensator_improves_the_sine() {
    let off = sine(0.0);
    // By hand: lag 0.0301 rad/(N·m)·T_out ± 5.11 mrad, T_out = 0.736 sin θ up to 0.353 N·m: 15.7 mrad at most, and RMS
    // 9.3 mrad: √(5.11² + 7.5² + mean of the product, which is zero).
    assert!((off.rms_rad - 9.3e-3).abs() < 0.5e-3 && (off.largest_rad - 15.7e-3).abs() < 0.5e-3, "{off:?}");
    let torque = sine(1.0);
    assert!(within_fifth(torque.rms_rad, MEASURED[0]) && torque.largest_rad < 4e-3, "{torque:?}");
    let encoders = sine(2.0);
    assert!(within_fifth(encoders.rms_rad, MEASURED[1]) && encoders.largest_rad < 12e-3, "{encoders:?}");
    // Not paid for by a restless motor.
    for errors in [torque, encoders] {
        assert!(errors.current_rms_a < 1.05 * off.current_rms_a, "{errors:?}, off {off:?}");
    }
}

/// RMS errors of the sine with the lag from the torque and from the encoders, rad.
const MEASURED: [f64; 2] = [0.73e-3, 2.72e-3];

#[test]
fn wires_may_be_the_other_way_round() {
    for bits in 1..8_u8 {
        let mut parameters = Parameters::default();
        let sign = |bit: u8| if bits >> bit & 1 == 1 { -1.0 } else { 1.0 };
        parameters.bridge.direction = sign(0);
        parameters.encoder.input.direction = sign(1);
        parameters.encoder.joint.direction = sign(2);
        let mut bench = Bench::ready(parameters, joint());
        bench.refer(Reference::Hold(0.3));
        bench.order(Goal::Run(Mode::Position));
        bench.run(1.5);
        let errors = measure(&mut bench, 0.2);
        assert!(errors.largest_rad < 3e-3, "{bits:#05b}: {errors:?}");
    }
}

#[test]
fn a_limited_compensation_is_told() {
    let mut parameters = Parameters::default();
    parameters.compensator.size_limit = 0.01;
    let mut bench = Bench::ready(parameters, joint());
    bench.refer(Reference::Hold(0.5));
    bench.order(Goal::Run(Mode::Position));
    // On the way to 0.5 rad the lag is 5.1 mrad and 0.0301·T_out: beyond 10 mrad from 0.163 N·m, 0.22 rad, on.
    let mut first_rad = None;
    for _ in 0..10_000 {
        let output = bench.tick();
        if output.sample.limits.contains(bowden_link::Limit::Compensation) {
            first_rad.get_or_insert(bench.plant.theta_out_rad());
        }
    }
    assert!(first_rad.is_some_and(|angle| (0.2..0.4).contains(&angle)), "{first_rad:?}");
}

#[test]
fn a_reference_serves_one_run() {
    let mut bench = Bench::ready(Parameters::default(), joint());
    bench.refer(Reference::Hold(0.3));
    bench.order(Goal::Run(Mode::Position));
    bench.run(1.5);
    assert!((bench.plant.theta_out_rad() - 0.3).abs() < 5e-3);
    bench.order(Goal::Off);
    bench.run(0.2);
    bench.order(Goal::Ready);
    assert!(bench.reaches(State::Ready, 2.0));
    bench.order(Goal::Home);
    assert!(bench.reaches(State::Homing, 0.01) && bench.reaches(State::Ready, 5.0));
    // Without a new reference the joint stays where it is.
    bench.order(Goal::Run(Mode::Position));
    bench.run(1.5);
    assert!(bench.plant.theta_out_rad().abs() < 0.02, "{} rad", bench.plant.theta_out_rad());
}

#[test]
fn torque_does_not_push_the_joint_out_of_its_range() {
    // 0.3 N·m would carry the weight to sin θ = 0.3/0.736, 0.42 rad.
    let mut parameters = Parameters::default();
    parameters.limits.angle_maximum = 0.2;
    let mut bench = Bench::ready(parameters, joint());
    bench.refer(Reference::Hold(0.3));
    bench.order(Goal::Run(Mode::Torque));
    let mut told = false;
    for _ in 0..30_000 {
        told |= bench.tick().sample.limits.contains(bowden_link::Limit::ReferenceRange);
        assert!(bench.plant.theta_out_rad() < 0.27, "{} rad", bench.plant.theta_out_rad());
    }
    assert!(told && bench.controller.state() == State::Run);
}

#[test]
fn a_held_joint_stands_still() {
    for divider in [1.0, 2.0, 10.0] {
        let mut parameters = Parameters::default();
        parameters.control.rate_divider = divider;
        let mut bench = Bench::ready(parameters, joint());
        bench.refer(Reference::Hold(0.4));
        bench.order(Goal::Run(Mode::Position));
        bench.run(2.0);
        let before = bench.plant.theta_out_rad();
        let errors = measure(&mut bench, 2.0);
        // Half a count of the input encoder, 0.8 mrad, and what is left of the lag, 1.5 mrad.
        assert!(errors.largest_rad < 2.3e-3, "divider {divider}: {errors:?}");
        // Less than a count to and fro.
        assert!((bench.plant.theta_out_rad() - before).abs() < 0.5e-3, "divider {divider}");
    }
}

#[test]
fn wrong_parameters_cost_accuracy_not_stability() {
    // Friction a third up or down, pretension and stiffness off, another weight, a warm winding.
    for (friction_coefficient, pretension_n, stiffness_n, mass_kg) in [
        (0.16, 30.0, 72_900.0, 2.5),
        (0.08, 30.0, 72_900.0, 2.5),
        (0.12, 34.0, 60_000.0, 2.5),
        (0.12, 27.0, 90_000.0, 1.0),
    ] {
        for source in [1.0, 2.0] {
            let mut other = joint();
            if let (Some(sheath), Some(tendon), Some(load), Some(motor)) =
                (&mut other.sheath, &mut other.tendon, &mut other.load, &mut other.motor)
            {
                sheath.friction_coefficient = friction_coefficient;
                tendon.pretension_n = pretension_n;
                tendon.axial_stiffness_n = stiffness_n;
                load.mass_kg = mass_kg;
                motor.resistance_ohm = 2.3;
            }
            let mut parameters = Parameters::default();
            parameters.compensator.source = source;
            let mut bench = Bench::ready(parameters, other);
            bench.refer(Reference::Generated {
                shape: Shape::Sine,
                amplitude: 0.5,
                offset: 0.0,
                frequency_hz: 0.2,
            });
            bench.order(Goal::Run(Mode::Position));
            bench.run(2.0);
            let errors = measure(&mut bench, 10.0);
            // Half of what it is without compensation, and two thirds.
            let limit_rad = if source == 1.0 { 4.5e-3 } else { 6e-3 };
            assert!(errors.rms_rad < limit_rad, "source {source}, mu {friction_coefficient}: {errors:?}");
        }
    }
}

#[test]
fn every_form_runs_without_a_fault() {
    let mut bench = Bench::ready(Parameters::default(), joint());
    bench.order(Goal::Run(Mode::Position));
    for (shape, frequency_hz, rms_rad) in [
        (Shape::Triangle, 0.25, 2.5e-3),
        (Shape::Multisine, 0.1, 6e-3),
        (Shape::Staircase, 0.1, 5e-3),
        (Shape::Sine, 1.0, 4e-3),
    ] {
        bench.refer(Reference::Generated { shape, amplitude: 0.5, offset: 0.0, frequency_hz });
        bench.run(2.0);
        let errors = measure(&mut bench, 10.0);
        assert!(errors.rms_rad < rms_rad, "{shape:?}: {errors:?}");
    }
}

#[test]
fn a_streamed_reference_is_followed() {
    let mut parameters = Parameters::default();
    parameters.reference.stream_rate = 250.0;
    let mut bench = Bench::ready(parameters, joint());
    // 0.3 (1 - cos 2π 0.25 t): starts at rest.
    let points = (0..2000).map(|n| {
        let angle_rad = 0.3 * (1.0 - (std::f64::consts::TAU * 0.25 * f64::from(n) / 250.0).cos());
        (angle_rad * f64::from(1 << 20)) as i32
    });
    bench.queues.points.extend(points);
    bench.refer(Reference::Stream);
    bench.order(Goal::Run(Mode::Position));
    bench.run(0.6);
    let errors = measure(&mut bench, 7.0);
    assert!(errors.rms_rad < 1.5e-3, "{errors:?}");
    // After 8 s the stream is empty and the last point, at angle zero, is held.
    bench.run(0.5);
    assert!(bench.controller.limits().contains(bowden_link::Limit::StreamEmpty));
    assert!(bench.plant.theta_out_rad().abs() < 3e-3, "{}", bench.plant.theta_out_rad());
}

#[test]
fn torque_follows_its_reference() {
    let mut bench = Bench::ready(Parameters::default(), joint());
    bench.refer(Reference::Generated { shape: Shape::Sine, amplitude: 0.3, offset: 0.0, frequency_hz: 0.5 });
    bench.order(Goal::Run(Mode::Torque));
    bench.run(2.0);
    let (mut squares, mut ticks) = (0.0, 0);
    for _ in 0..40_000 {
        let output = bench.tick();
        let tension = |channel: usize| (f64::from(output.sample.tension_raw[channel]) - 620.5) * 0.035_037;
        let torque_nm = (tension(1) - tension(3)) * 0.015;
        let error = torque_nm - f64::from(output.sample.reference_raw) / f64::from(1 << 20);
        squares += error * error;
        ticks += 1;
    }
    assert_eq!(bench.controller.state(), State::Run, "{:?}", bench.controller.fault());
    let rms_nm = (squares / f64::from(ticks)).sqrt();
    println!("torque: {rms_nm} N·m RMS");
    // Friction of the sheaths alone is 0.339 N·m.
    assert!(within_fifth(rms_nm, 0.0186), "{rms_nm} N·m");
}
