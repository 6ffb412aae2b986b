//! A lead of the motor that is open: named while the joint is a little off, and not where nothing is open.
//!
//! By hand, default joint: the position loop asks for `J (k_p e + k_d (ω_d − ω) + k_i ∫e dt)`, 11.4 N·m/rad, 0.452 N·m·s/rad and 113.7
//! N·m/(rad·s), beside what the tendons hold. 4.57 V are 2.06 N·m, 6 V, where the current is limited, 2.7 N·m.

mod bench;

use bench::{Bench, joint};
use bowden_control::parameters::Parameters;
use bowden_link::message::{Goal, Mode, Reference, Shape};
use bowden_link::{Fault, FaultRecord, State};

/// A stop: time since the lead opened, record, and largest error of the joint's angle until then.
#[derive(Debug)]
struct Stop {
    after_s: f64,
    record: FaultRecord,
    error_rad: f64,
}

/// Opens the lead and waits for the stop. Where `mode` is one of torque there is no angle to be off from.
fn opened(bench: &mut Bench, limit_s: f64) -> Option<Stop> {
    bench.lead_open = true;
    let ticks = (limit_s * 1e4) as u32;
    let mut error_rad = 0.0_f64;
    for n in 1..=ticks {
        let output = bench.tick();
        if let Some(record) = output.tripped {
            assert!(!output.bridge_on && output.duty_raw == 0, "{record}");
            bench.run(0.1);
            assert_eq!((bench.controller.state(), bench.controller.fault()), (State::Fault, Some(record)));
            let stop = Stop { after_s: f64::from(n) * 1e-4, record, error_rad };
            println!("{stop:.4?}: {record}");
            return Some(stop);
        }
        let wanted_rad = f64::from(output.sample.reference_raw) / f64::from(1 << 20);
        error_rad = error_rad.max((bench.plant.theta_out_rad() - wanted_rad).abs());
    }
    println!("nothing in {limit_s} s, {error_rad:.4} rad");
    None
}

fn generated(shape: Shape, amplitude: f32, frequency_hz: f32) -> Reference {
    Reference::Generated { shape, amplitude, offset: 0.0, frequency_hz }
}

/// A joint that has followed `reference` for this long.
fn following(mut bench: Bench, reference: Reference, mode: Mode, seconds: f64) -> Bench {
    bench.refer(reference);
    bench.order(Goal::Run(mode));
    bench.run(seconds);
    assert_eq!(bench.controller.state(), State::Run, "{:?}", bench.controller.fault());
    bench
}

fn named(bench: &mut Bench, limit_s: f64) -> Stop {
    let stop = opened(bench, limit_s).expect("a stop");
    assert_eq!((stop.record.fault, stop.record.channel), (Fault::MotorOpen, 0), "{}", stop.record);
    // Nothing but the sensor's noise; more than the 0.4067 A that may be there unseen.
    assert!(stop.record.got < 0.01 && stop.record.limit > 0.4067, "{}", stop.record);
    stop
}

/// 0.15 rad/s: 0.068 + 1.7 t + 8.5 t² N·m are 2.06 N·m less up to 0.5 N·m of the tendons after 0.31 to 0.40 s; 20 to 40 ms for the looks.
#[test]
fn an_open_lead_is_named_in_a_slow_motion() {
    let reference = generated(Shape::Triangle, 0.3, 0.125);
    let mut bench = following(Bench::ready(Parameters::default(), joint()), reference, Mode::Position, 0.7);
    let stop = named(&mut bench, 1.0);
    assert!((0.30..0.45).contains(&stop.after_s) && stop.error_rad < 0.15 * stop.after_s + 0.01, "{stop:?}");
}

/// 1 Hz, 0.3 rad, 1.9 rad/s at zero: the rotor coasts until 0.34 N·m of friction have stopped it after 25 ms at most; then 0.86 N·m at once, `21.7 t +
/// 108 t²` N·m behind it, 2.06 N·m less up to 0.5 N·m 25 to 50 ms after the break or up to 25 ms later; and the looks.
#[test]
fn an_open_lead_is_named_in_a_fast_motion_and_at_its_turn() {
    let reference = generated(Shape::Sine, 0.3, 1.0);
    let bench = || Bench::ready(Parameters::default(), joint());
    let mut at_zero = following(bench(), reference, Mode::Position, 1.0);
    let stop = named(&mut at_zero, 0.3);
    assert!((0.045..0.115).contains(&stop.after_s) && stop.error_rad < 0.15, "{stop:?}");
    // From the turn 0.3 (1 − cos 2πt) rad: 5.9 t² rad, 67 t² + 225 t³ N·m and 5.4 t N·m of damping; 1.5 to 2.5 N·m after 0.10 to 0.14 s.
    let mut at_the_turn = following(bench(), reference, Mode::Position, 0.75);
    let stop = named(&mut at_the_turn, 0.4);
    assert!((0.1..0.19).contains(&stop.after_s) && stop.error_rad < 0.2, "{stop:?}");
}

/// While the reference stands where the friction of the sheaths holds the joint, nothing is wrong and nothing is named. The next stair of
/// 0.1 rad takes 0.25 s: named before the joint is off by as much.
#[test]
fn an_open_lead_is_named_when_a_joint_that_is_held_is_to_move_on() {
    let mut held =
        following(Bench::ready(Parameters::default(), joint()), Reference::Hold(0.1), Mode::Position, 2.0);
    assert!(opened(&mut held, 1.0).is_none());
    let angle_rad = held.plant.theta_out_rad();
    assert!((angle_rad - 0.1).abs() < 0.01, "{angle_rad} rad");
    held.refer(Reference::Hold(0.2));
    let stop = named(&mut held, 1.0);
    assert!(stop.error_rad < 0.1, "{stop:?}");
}

/// A lead that was open before the board was switched on: the self test has no voltage to tell by, the first motion names it.
#[test]
fn a_lead_that_was_open_from_the_start_is_named_in_the_first_motion() {
    let begun = |goal: Goal, reference: Reference| {
        let mut bench = Bench::new(Parameters::default(), joint());
        bench.lead_open = true;
        bench.run(0.01);
        bench.order(Goal::Ready);
        assert!(bench.reaches(State::Ready, 1.0), "{:?}", bench.controller.fault());
        bench.refer(reference);
        bench.order(goal);
        bench
    };
    // The ramp of 0.5 s carries the sine in.
    let mut run = begun(Goal::Run(Mode::Position), generated(Shape::Sine, 0.3, 1.0));
    let stop = named(&mut run, 1.0);
    assert!((0.1..0.4).contains(&stop.after_s) && stop.error_rad < 0.2, "{stop:?}");
    // Torque and impedance mode integrate their error, too. Where the joint is to do what it does anyway there is nothing to find.
    let mut torque = begun(Goal::Run(Mode::Torque), generated(Shape::Sine, 0.3, 0.5));
    named(&mut torque, 1.0);
    let mut impedance = begun(Goal::Run(Mode::Impedance), generated(Shape::Sine, 0.3, 0.5));
    named(&mut impedance, 1.5);
    let mut hybrid = begun(Goal::Run(Mode::Hybrid), generated(Shape::Sine, 0.3, 0.5));
    named(&mut hybrid, 1.5);
}

/// From 0.2 rad, at 0.4 rad/s: 0.18 N·m at once, `4.5 t + 22.7 t²` N·m: 1.5 to 2 N·m after 0.16 to 0.21 s.
#[test]
fn an_open_lead_is_named_on_the_way_home() {
    let mut bench =
        following(Bench::ready(Parameters::default(), joint()), Reference::Hold(0.2), Mode::Position, 1.5);
    bench.order(Goal::Off);
    bench.run(0.3);
    bench.order(Goal::Ready);
    assert!(bench.reaches(State::Ready, 1.0));
    bench.order(Goal::Home);
    assert!(bench.reaches(State::Homing, 0.1));
    bench.run(0.1);
    let stop = named(&mut bench, 0.5);
    assert!((0.12..0.3).contains(&stop.after_s), "{stop:?}");
}

/// As sharp as it can be set: no dead zone is allowed for, and an offset of three codes.
fn sharp() -> Parameters {
    let mut parameters = Parameters::default();
    parameters.correction.dead_zone.limit = 0.0;
    parameters.supervisor.rest_current = 0.02;
    parameters
}

/// `2.5 · 2 Ω · (2 · 0.02 + 0.0067) A` and 0.138 V: 0.37 V, 0.17 N·m.
#[test]
fn a_bench_that_knows_its_dead_zone_and_offset_names_it_sooner() {
    let reference = generated(Shape::Triangle, 0.3, 0.125);
    let mut slow = following(Bench::ready(sharp(), joint()), reference, Mode::Position, 0.7);
    let stop = opened(&mut slow, 1.0).expect("a stop");
    assert!(
        stop.record.fault == Fault::MotorOpen && stop.after_s < 0.15 && stop.error_rad < 0.03,
        "{stop:?}"
    );
}

/// Healthy joints at what is hardest for the watch, set as sharp as it can be: never named in 6 s.
#[test]
fn a_healthy_joint_is_never_named() {
    // Constants of the motor as it is, over those of the parameters; offset of the current sensor, codes; supply, V.
    let cases: [(&str, f64, f64, i32, f64); 8] = [
        ("as it is", 1.0, 1.0, 0, 24.0),
        ("winding with twice the resistance", 2.0, 1.0, 0, 24.0),
        ("the same, and the sensor's offset", 2.0, 1.0, -3, 24.0),
        ("the same the other way", 2.0, 1.0, 3, 24.0),
        ("winding with two thirds of the resistance", 0.67, 1.0, 3, 29.0),
        ("weak magnets", 1.0, 0.8, -3, 24.0),
        ("strong magnets, low supply", 1.0, 1.2, 3, 18.3),
        ("everything at once", 2.0, 0.8, -3, 18.3),
    ];
    for (what, resistance, constant, offset_raw, bus_v) in cases {
        for (shape, amplitude, frequency_hz) in [
            (Shape::Sine, 0.3, 1.0),
            (Shape::Sine, 0.2, 2.0),
            (Shape::Triangle, 0.3, 0.125),
            (Shape::Staircase, 0.3, 0.125),
        ] {
            let mut physics = joint();
            if let Some(motor) = &mut physics.motor {
                motor.resistance_ohm *= resistance;
                motor.torque_constant_nm_per_a *= constant;
            }
            let mut bench = Bench::ready(sharp(), physics);
            bench.bus_v = bus_v;
            bench.current_offset_raw = offset_raw;
            bench.run(0.1);
            let bench = following(bench, generated(shape, amplitude, frequency_hz), Mode::Position, 6.0);
            assert_eq!(bench.controller.fault(), None, "{what}: {shape:?}");
        }
    }
}

/// A motor of 5.4 V·s/rad at the pulley, whose back-EMF at up to 2.6 rad/s takes nearly all of a supply of 18 V.
#[test]
fn a_motion_whose_back_emf_takes_nearly_all_of_a_low_supply_is_no_open_lead() {
    for (constant, offset_raw) in [(1.0, 0), (1.1, -3), (0.9, 3)] {
        let mut parameters = sharp();
        (parameters.motor.torque_constant, parameters.limits.current) = (0.18, 1.0);
        (parameters.supervisor.bus_minimum, parameters.load.mass) = (17.0, 0.5);
        let mut physics = joint();
        if let (Some(motor), Some(load)) = (&mut physics.motor, &mut physics.load) {
            motor.torque_constant_nm_per_a = 0.18 * constant;
            load.mass_kg = 0.5;
        }
        let mut bench = Bench::ready(parameters, physics);
        bench.bus_v = 18.0;
        bench.current_offset_raw = offset_raw;
        bench.refer(generated(Shape::Triangle, 0.8, 0.8));
        bench.order(Goal::Run(Mode::Position));
        let mut largest = 0.0_f64;
        for _ in 0..60_000 {
            let output = bench.tick();
            largest = largest.max(f64::from(output.duty_raw.abs()) / 32_767.0);
        }
        assert_eq!((bench.controller.state(), bench.controller.fault()), (State::Run, None), "{constant}");
        assert!(largest > 0.75, "duty {largest}");
    }
}
