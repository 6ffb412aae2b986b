//! Every fault, provoked at the pins: the bridge is off in the tick of the detection, not before its debounce and not after.

mod bench;

use bench::{Bench, Disturbance, amt22, joint};
use bowden_control::parameters::Parameters;
use bowden_control::tick::Command;
use bowden_link::message::{Goal, Mode, Reference, Shape};
use bowden_link::{Fault, FaultRecord, Limit, State};

/// A joint that follows a sine; its speed is largest and its angle zero at whole and half periods of 4 s.
fn running(parameters: Parameters) -> Bench {
    let mut bench = Bench::ready(parameters, joint());
    bench.refer(Reference::Generated { shape: Shape::Sine, amplitude: 0.4, offset: 0.0, frequency_hz: 0.25 });
    bench.order(Goal::Run(Mode::Position));
    bench.run(4.3);
    assert_eq!(bench.controller.state(), State::Run, "{:?}", bench.controller.fault());
    bench
}

/// Ticks until the fault came, and its record. The motor is off in that very tick and stays off.
fn trip(bench: &mut Bench, ticks: usize) -> (usize, FaultRecord) {
    for n in 1..=ticks {
        let tick = bench.controller.tick_count();
        let output = bench.tick();
        let Some(record) = output.tripped else { continue };
        assert!(!output.bridge_on && output.duty_raw == 0, "{record}");
        assert_eq!((output.sample.state, output.sample.duty_raw), (State::Fault, 0));
        assert_eq!(record.tick, tick);
        assert_eq!(bench.controller.fault(), Some(record));
        for _ in 0..100 {
            let later = bench.tick();
            assert!(!later.bridge_on && later.duty_raw == 0 && later.tripped.is_none());
        }
        return (n, record);
    }
    panic!("no fault in {ticks} ticks; state {:?}", bench.controller.state());
}

struct Case {
    disturbance: Disturbance,
    fault: Fault,
    channel: u8,
    /// Ticks of 0.1 ms from the first wrong input to the stop.
    ticks: usize,
    got: f32,
    limit: f32,
    /// Whether it counts in the self test and in ready.
    at_rest: [bool; 2],
}

/// Numbers by hand from the front end: tension code 620.5 + F/0.035037, 3.3 V over 4095 codes, current code
/// 2047.5 + i/0.0067155, bus 0.0088645 V a code; debounce 1 ms, 0.2 ms and 5 ms are 10, 2 and 50 ticks.
fn cases() -> Vec<Case> {
    let case = |disturbance, fault, channel, ticks, got, limit, at_rest| Case {
        disturbance,
        fault,
        channel,
        ticks,
        got,
        limit,
        at_rest,
    };
    let both = [true; 2];
    vec![
        case(|input| input.encoder[0].frame_raw ^= 0x8000, Fault::EncoderCheck, 0, 4, 4.0, 4.0, both),
        case(|input| input.encoder[1].frame_raw = 0xffff, Fault::EncoderCheck, 1, 4, 4.0, 4.0, both),
        // One bit of the position and the check bit over it, so that the frame is one of the 14-bit type.
        case(|input| input.encoder[1].frame_raw ^= 0x8002, Fault::EncoderStatus, 1, 4, 4.0, 4.0, both),
        case(|input| input.encoder[0].bus_error = true, Fault::EncoderMissing, 0, 4, 4.0, 4.0, both),
        // The first frozen number is a new one.
        case(|input| input.encoder[1].sequence = 255, Fault::EncoderMissing, 1, 5, 4.0, 4.0, both),
        case(|input| input.tension_raw[2] = 123, Fault::TensionRail, 2, 10, 0.0991, 0.1, both),
        case(|input| input.tension_raw[3] = 4095, Fault::TensionRail, 3, 10, 3.3, 3.2, both),
        case(|input| input.tension_raw[1] = 635, Fault::Slack, 1, 10, 0.508, 1.0, [false, true]),
        case(|input| input.tension_raw[0] = 3300, Fault::OverTension, 0, 10, 93.88, 90.0, [false, true]),
        case(|input| input.current_raw = 3389, Fault::OverCurrent, 0, 2, 9.009, 8.0, both),
        case(|input| input.current_raw = 706, Fault::OverCurrent, 0, 2, -9.009, 8.0, both),
        case(|input| input.bus_raw = 1900, Fault::BusUnderVoltage, 0, 50, 16.84, 18.0, both),
        case(|input| input.bus_raw = 3500, Fault::BusOverVoltage, 0, 50, 31.03, 30.0, both),
        case(|input| input.bridge_fault = true, Fault::BridgeFault, 0, 1, 1.0, 0.0, both),
    ]
}

#[test]
fn every_fault_stops_the_motor_in_its_tick() {
    for case in cases() {
        let mut bench = running(Parameters::default());
        bench.disturbance = Some(case.disturbance);
        let (ticks, record) = trip(&mut bench, 200);
        assert_eq!((record.fault, record.channel, ticks), (case.fault, case.channel, case.ticks), "{record}");
        assert!((record.got - case.got).abs() <= 2e-3 * case.got.abs(), "{record}: expected {}", case.got);
        assert!((record.limit - case.limit).abs() <= 5e-3 * case.limit.abs(), "{record}");
    }
}

/// 6 A where 2 A are borne, at a time constant of 0.2 s, last `0.2 ln(36/32)`: 23.6 ms from cold, a little less behind a motion.
#[test]
fn a_hot_winding_stops_the_motor() {
    let mut parameters = Parameters::default();
    (parameters.motor.continuous_current, parameters.motor.winding_time) = (2.0, 0.2);
    // What no voltage makes would be a fault of its own, 1 ms behind the change.
    parameters.supervisor.rest_current = 4.0;
    let mut bench = running(parameters);
    bench.disturbance = Some(|input| input.current_raw = 2941);
    let (ticks, record) = trip(&mut bench, 300);
    assert_eq!((record.fault, record.channel, record.limit), (Fault::WindingHot, 0, 2.0), "{record}");
    assert!((180..=237).contains(&ticks) && (record.got - 2.0).abs() < 0.02, "{ticks} ticks, {record}");
}

#[test]
fn faults_count_in_the_states_of_the_table() {
    for case in cases() {
        let mut off = Bench::new(Parameters::default(), joint());
        off.run(0.01);
        off.disturbance = Some(case.disturbance);
        off.run(0.05);
        assert_eq!(off.controller.state(), State::Off, "{:?} counts in off", case.fault);

        let [in_self_test, in_ready] = case.at_rest;
        let mut testing = Bench::new(Parameters::default(), joint());
        testing.run(0.01);
        testing.order(Goal::Ready);
        testing.run(0.02);
        assert_eq!(testing.controller.state(), State::SelfTest);
        testing.disturbance = Some(case.disturbance);
        testing.run(0.01);
        let fault = testing.controller.fault().map(|record| record.fault);
        assert_eq!(fault, in_self_test.then_some(case.fault));

        let mut ready = Bench::ready(Parameters::default(), joint());
        ready.disturbance = Some(case.disturbance);
        ready.run(0.01);
        let fault = ready.controller.fault().map(|record| record.fault);
        assert_eq!(fault, in_ready.then_some(case.fault));
    }
}

#[test]
fn bits_of_an_as5045_are_all_used() {
    let mut parameters = Parameters::default();
    parameters.encoder.input.part = 1.0;
    parameters.encoder.joint.part = 1.0;
    let cases: [(Disturbance, Fault); 4] = [
        (|input| input.encoder[0].frame_raw ^= 1, Fault::EncoderParity),
        // OCF lost, COF and LIN set; the parity follows.
        (|input| input.encoder[0].frame_raw ^= 0x21, Fault::EncoderStatus),
        (|input| input.encoder[0].frame_raw ^= 0x11, Fault::EncoderStatus),
        (|input| input.encoder[0].frame_raw ^= 0x09, Fault::EncoderStatus),
    ];
    for (disturbance, fault) in cases {
        let mut bench = running(parameters.clone());
        bench.disturbance = Some(disturbance);
        let (ticks, record) = trip(&mut bench, 10);
        assert_eq!((record.fault, record.channel, ticks), (fault, 0, 4));
    }
    // Both magnet bits: marginal, told and not a fault.
    let mut bench = running(parameters);
    bench.disturbance = Some(|input| input.encoder[1].frame_raw ^= 0x06);
    bench.run(0.1);
    assert_eq!(bench.controller.state(), State::Run);
    assert!(bench.controller.limits().contains(Limit::MagnetMarginal));
}

#[test]
fn single_bad_frames_are_repaired() {
    let mut bench = running(Parameters::default());
    let mut repaired = 0;
    for n in 0..20_000 {
        // Three bad frames in a row, one less than a fault.
        bench.disturbance = (n % 10 < 3).then_some(|input| input.encoder[0].frame_raw ^= 0x0010);
        let output = bench.tick();
        repaired += usize::from(output.sample.limits.contains(Limit::FrameRepaired));
        let wanted = f64::from(output.sample.reference_raw) / f64::from(1 << 20);
        let error = bench.plant.theta_out_rad() - wanted;
        assert!(error.abs() < 6e-3, "error {error} rad");
    }
    assert_eq!((bench.controller.state(), repaired), (State::Run, 6000));
}

#[test]
fn a_jump_is_told_in_its_speed() {
    // A loose magnet: 300 counts off from now on. 300 counts in a tick of 0.1 ms are 4602 rad/s. The limit is 60 rad/s,
    // 3.91 counts a tick, rounded up to 4, and 2 for grid and noise: 92 rad/s.
    let mut bench = running(Parameters::default());
    bench.disturbance = Some(|input| {
        let count = (input.encoder[0].frame_raw >> 2 & 0xfff) + 300;
        input.encoder[0].frame_raw = amt22(count);
    });
    let (ticks, record) = trip(&mut bench, 10);
    assert_eq!((record.fault, record.channel, ticks), (Fault::EncoderJump, 0, 4));
    assert!((record.got - 4602.0).abs() < 20.0 && (record.limit - 92.04).abs() < 0.1, "{record}");
}

/// A joint that is told to move on from angle zero.
fn setting_out() -> Bench {
    let mut bench = Bench::ready(Parameters::default(), joint());
    bench.refer(Reference::Hold(0.6));
    bench.order(Goal::Run(Mode::Position));
    bench
}

#[test]
fn an_encoder_that_stands_is_found() {
    // The joint's encoder: the input pulley moves away from it by 0.15 rad within the ramp of 0.5 s.
    let mut bench = setting_out();
    bench.disturbance = Some(|input| input.encoder[1].frame_raw = amt22(2000));
    let (ticks, record) = trip(&mut bench, 10_000);
    assert_eq!((record.fault, record.channel), (Fault::EncoderStuck, 1));
    assert!(ticks < 5000 && record.got > 0.15 && record.got < 0.3, "{record} after {ticks} ticks");
    // The input's encoder, on which the loop closes: the motor runs away, and is stopped before the joint is at 0.4 rad.
    let mut bench = setting_out();
    bench.disturbance = Some(|input| input.encoder[0].frame_raw = amt22(1000));
    let (_, record) = trip(&mut bench, 10_000);
    assert_eq!((record.fault, record.channel), (Fault::EncoderStuck, 0));
    assert!(bench.plant.theta_out_rad().abs() < 0.4, "{} rad", bench.plant.theta_out_rad());
}

#[test]
fn tensions_that_do_not_fit_the_friction_are_found() {
    // f1 reads 5 N. f2 is 30 N, and e^(1.2 + 0.15)·5 + 4 = 23.3 N is allowed, whatever the sheath does.
    let mut bench = Bench::ready(Parameters::default(), joint());
    bench.disturbance = Some(|input| input.tension_raw[0] = 763);
    let (ticks, record) = trip(&mut bench, 2000);
    assert_eq!((record.fault, record.channel), (Fault::TensionInconsistent, 0));
    // 50 ms, and what the low-pass of 5 ms needs from 30 N down to 6.75 N: 5 ms ln(25/1.75) = 13 ms.
    assert!((600..=660).contains(&ticks), "{ticks} ticks");
    assert!(record.got > record.limit && (22.0..31.0).contains(&record.limit), "{record}");
}

#[test]
fn tensions_that_contradict_the_stretch_are_found() {
    // f1 reads 36 N too much: both ends of cable a are 96 N, at rest 60 N, and 30 N apart are allowed.
    let mut bench = Bench::ready(Parameters::default(), joint());
    bench.disturbance = Some(|input| input.tension_raw[0] += 1027);
    let (ticks, record) = trip(&mut bench, 5000);
    assert_eq!((record.fault, record.channel), (Fault::StretchInconsistent, 0));
    // 6 times 50 ms, and what the low-pass of 5 ms needs to 30 of 36 N: 5 ms ln(36/6) = 9 ms.
    assert!((3050..=3150).contains(&ticks), "{ticks} ticks");
    assert!((35.0..37.0).contains(&record.got) && record.limit == 30.0, "{record}");
}

/// Channels that belong to other places than the parameters say: found while the joint turns, before it has turned far.
#[test]
fn swapped_tension_channels_are_found() {
    let swaps: [(bench::Disturbance, u8); 4] = [
        (|input| input.tension_raw.swap(0, 1), 2),
        (|input| input.tension_raw.swap(2, 3), 3),
        (|input| input.tension_raw.swap(0, 2), 0),
        (|input| input.tension_raw.swap(1, 3), 1),
    ];
    for (swap, end) in swaps {
        for (shape, frequency_hz) in [(Shape::Sine, 1.0), (Shape::Sine, 0.25), (Shape::Triangle, 0.125)] {
            let mut bench = Bench::ready(Parameters::default(), joint());
            bench.refer(Reference::Generated { shape, amplitude: 0.3, offset: 0.0, frequency_hz });
            bench.order(Goal::Run(Mode::Position));
            bench.disturbance = Some(swap);
            // Behind the second turn: 6 s into the triangle of 8 s.
            let (ticks, record) = trip(&mut bench, 80_000);
            println!("{shape:?}, {frequency_hz} Hz: {record}, {ticks} ticks");
            let is_stretch = record.fault == Fault::StretchInconsistent;
            assert!(is_stretch || (record.fault, record.channel) == (Fault::TensionSwapped, end), "{record}");
            assert!(bench.plant.theta_out_rad().abs() < 0.4, "{} rad", bench.plant.theta_out_rad());
        }
    }
}

/// 120 codes to and fro from tick to tick, of which `4 √2 · 0.5 N` allow 80.7. Six looks, 40 ms apart.
#[test]
fn a_tension_channel_that_jumps_about_is_found() {
    let mut bench = running(Parameters::default());
    bench.disturbance = Some(|input| {
        if input.encoder[0].sequence & 1 == 1 {
            input.tension_raw[1] += 120;
        }
    });
    let (ticks, record) = trip(&mut bench, 4000);
    assert_eq!((record.fault, record.channel), (Fault::TensionRestless, 1), "{record}");
    assert!((2000..=2400).contains(&ticks), "{ticks} ticks");
    assert!((record.got - 120.0).abs() < 25.0 && (record.limit - 80.7).abs() < 0.5, "{record}");
    // Twice the noise that is allowed at rest, ±1 N in the mean, is none.
    let mut bench = running(Parameters::default());
    bench.disturbance = Some(|input| {
        input.tension_raw[1] += if input.encoder[0].sequence & 1 == 1 { 28 } else { 0 };
    });
    bench.run(2.0);
    assert_eq!(bench.controller.state(), State::Run, "{:?}", bench.controller.fault());
}

/// Four or five jumps of the six that are a fault, and two or three in the next run: each run begins its counts anew.
#[test]
fn what_was_watched_in_a_run_does_not_count_in_the_next_one() {
    let jumping: Disturbance = |input| {
        if input.encoder[0].sequence & 1 == 1 {
            input.tension_raw[1] += 120;
        }
    };
    let mut bench = running(Parameters::default());
    bench.disturbance = Some(jumping);
    bench.run(0.18);
    assert_eq!(bench.controller.state(), State::Run, "{:?}", bench.controller.fault());
    bench.disturbance = None;
    bench.order(Goal::Off);
    bench.run(0.1);
    bench.order(Goal::Ready);
    assert!(bench.reaches(State::Ready, 1.0), "{:?}", bench.controller.fault());
    bench.disturbance = Some(jumping);
    bench.order(Goal::Run(Mode::Position));
    bench.run(0.1);
    assert_eq!(bench.controller.state(), State::Run, "{:?}", bench.controller.fault());
}

/// A leg at ground puts 12 V less on the motor, or 12 V more, 6 A in the end. The motor is off 0.8 to 2.4 ms later, and no tension is beyond its limit
/// of 90 N behind it.
#[test]
fn a_leg_of_the_bridge_at_ground_is_named_before_a_tendon_is_overloaded() {
    for leg in [0, 1] {
        for begins in 0..10 {
            let mut bench = running(Parameters::default());
            for _ in 0..11 * begins {
                bench.tick();
            }
            bench.leg_at_ground = Some(leg);
            let mut after = None;
            let mut largest_n = 0.0_f64;
            for n in 1..=1000 {
                if let Some(record) = bench.tick().tripped {
                    assert_eq!((record.fault, record.channel), (Fault::MotorCurrent, 0), "{record}");
                    after = Some(n);
                }
                let tensions = bench.plant.end_tensions_n(&bench.config);
                largest_n = tensions.into_iter().fold(largest_n, f64::max);
            }
            let after = after.expect("a stop");
            println!("leg {leg}, {begins}: {after} ticks, {largest_n:.1} N");
            assert!((8..=26).contains(&after) && largest_n < 90.0, "{after} ticks, {largest_n} N");
        }
    }
}

#[test]
fn a_warning_of_the_gate_driver_takes_the_place_of_its_fault_and_of_nothing_else() {
    let warning = || Command::Trip(Fault::DriverWarning, 0, 0.1, 1.0);
    let mut bench = running(Parameters::default());
    bench.queues.commands.push_back(warning());
    bench.run(0.01);
    assert_eq!(bench.controller.state(), State::Run, "nothing stopped");
    bench.disturbance = Some(|input| input.bridge_fault = true);
    let (_, record) = trip(&mut bench, 1);
    assert_eq!(record.fault, Fault::BridgeFault);
    bench.queues.commands.push_back(warning());
    let told = bench.tick().tripped.expect("a record");
    assert_eq!((told.fault, told.got, bench.controller.fault()), (Fault::DriverWarning, 0.1, Some(told)));
    // Once.
    bench.queues.commands.push_back(Command::Trip(Fault::BridgeFault, 0, 1.0, 0.0));
    bench.queues.commands.push_back(warning());
    bench.run(0.01);
    assert_eq!(bench.controller.fault(), Some(told));
    let mut late = running(Parameters::default());
    late.queues.commands.push_back(Command::Trip(Fault::HostSilent, 0, 0.7, 0.5));
    late.queues.commands.push_back(warning());
    late.run(0.01);
    assert_eq!(late.controller.fault().map(|record| record.fault), Some(Fault::HostSilent));
}

/// The joint's encoder stands while the reference moves at up to 0.63 rad/s from zero: 0.1 rad off after 0.16 s at least, found 0.1 s later.
/// What finds a standing encoder sooner is switched off.
#[test]
fn a_joint_that_does_not_follow_is_found() {
    let mut parameters = Parameters::default();
    (parameters.encoder.stuck_travel, parameters.tension.stretch_margin) = (6.0, 1000.0);
    (parameters.tension.margin, parameters.tension.exponent_margin) = (1000.0, 3.0);
    (parameters.supervisor.tracking_error, parameters.supervisor.tracking_time) = (0.1, 0.1);
    let mut bench = Bench::ready(parameters, joint());
    bench.refer(Reference::Generated { shape: Shape::Sine, amplitude: 0.4, offset: 0.0, frequency_hz: 0.25 });
    bench.order(Goal::Run(Mode::Position));
    bench.disturbance = Some(|input| input.encoder[1].frame_raw = amt22(2000));
    let (ticks, record) = trip(&mut bench, 10_000);
    assert_eq!((record.fault, record.channel), (Fault::TrackingError, 0), "{record}");
    assert!((record.limit - 0.1).abs() < 1e-5 && (0.1..0.25).contains(&record.got), "{record}");
    // The ramp takes 0.5 s of the way.
    assert!((2600..6000).contains(&ticks), "{ticks}");
}

/// A weight that swings under a torque of 0.5 N·m turns faster than 0.6 rad/s.
#[test]
fn a_joint_that_turns_too_fast_is_found() {
    let mut parameters = Parameters::default();
    (parameters.limits.speed, parameters.supervisor.joint_speed) = (0.5, 0.6);
    let mut bench = Bench::ready(parameters, joint());
    bench.refer(Reference::Generated { shape: Shape::Sine, amplitude: 0.3, offset: 0.0, frequency_hz: 1.0 });
    bench.order(Goal::Run(Mode::Torque));
    let (_, record) = trip(&mut bench, 20_000);
    assert_eq!((record.fault, record.channel), (Fault::JointSpeed, 0), "{record}");
    assert!((record.limit - 0.6).abs() < 1e-3 && (0.6..1.6).contains(&record.got), "{record}");
}

/// f4 always reads 30 N, which the others leave by more than 5 N.
#[test]
fn a_tension_channel_that_stands_is_found() {
    let mut parameters = Parameters::default();
    (parameters.tension.stretch_margin, parameters.tension.consistency_time) = (1000.0, 10.0);
    let mut bench = running(parameters);
    bench.disturbance = Some(|input| input.tension_raw[3] = 1477);
    let (ticks, record) = trip(&mut bench, 20_000);
    assert_eq!((record.fault, record.channel, record.limit), (Fault::TensionStuck, 3, 5.0), "{record}");
    // 0.3 s at least.
    assert!(record.got > 5.0 && ticks >= 3000, "{ticks} ticks, {record}");
}

#[test]
fn faults_from_outside_count_everywhere_and_the_first_one_stays() {
    let mut bench = Bench::new(Parameters::default(), joint());
    bench.queues.commands.push_back(Command::Trip(Fault::Watchdog, 0, 0.0, 0.0));
    let (ticks, record) = trip(&mut bench, 1);
    assert_eq!((record.fault, ticks), (Fault::Watchdog, 1));
    bench.queues.commands.push_back(Command::Trip(Fault::Panic, 0, 0.0, 0.0));
    bench.order(Goal::Ready);
    bench.run(0.01);
    assert_eq!(bench.controller.fault().map(|record| record.fault), Some(Fault::Watchdog));
    bench.order(Goal::ClearFault);
    bench.run(0.01);
    assert_eq!((bench.controller.state(), bench.controller.fault()), (State::Off, None));

    let mut bench = running(Parameters::default());
    bench.queues.commands.push_back(Command::Trip(Fault::HostSilent, 0, 0.7, 0.5));
    let (ticks, record) = trip(&mut bench, 1);
    assert_eq!((record.fault, record.got, record.limit, ticks), (Fault::HostSilent, 0.7, 0.5, 1));
}

#[test]
fn the_self_test_wants_sensors_alive_and_at_rest() {
    let cases: [(Disturbance, u8); 3] = [
        // A dead channel: always the same code.
        (|input| input.tension_raw[2] = 1480, 2),
        // 0.8 A with the bridge off.
        (|input| input.current_raw = 2167, 6),
        // A joint that somebody turns: three counts to and fro.
        (
            |input| {
                if input.encoder[1].sequence & 64 == 0 {
                    input.encoder[1].frame_raw = amt22(2003);
                }
            },
            5,
        ),
    ];
    for (disturbance, channel) in cases {
        let mut bench = Bench::new(Parameters::default(), joint());
        bench.disturbance = Some(disturbance);
        bench.run(0.01);
        bench.order(Goal::Ready);
        let (ticks, record) = trip(&mut bench, 30_000);
        assert_eq!((record.fault, record.channel), (Fault::SelfTestTimeout, channel));
        // At the end of the first look of 0.1 s that ends at or beyond 2 s.
        assert!((20_000..21_002).contains(&ticks), "{ticks} ticks");
        assert_eq!(record.limit, 2.0);
    }
    // It passes when they come to rest in time.
    let mut bench = Bench::new(Parameters::default(), joint());
    bench.disturbance = Some(|input| input.current_raw = 2167);
    bench.order(Goal::Ready);
    bench.run(0.95);
    assert_eq!(bench.controller.state(), State::SelfTest);
    bench.disturbance = None;
    assert!(bench.reaches(State::Ready, 0.4));
}

#[test]
fn a_lost_pretension_is_found_before_the_bridge_is_on() {
    let mut slack = joint();
    if let Some(tendon) = &mut slack.tendon {
        tendon.pretension_n = 20.0;
    }
    let mut bench = Bench::new(Parameters::default(), slack);
    // f3 reads 57 codes, 2 N, less than the others.
    bench.disturbance = Some(|input| input.tension_raw[2] -= 57);
    bench.order(Goal::Ready);
    let (_, record) = trip(&mut bench, 10_000);
    assert_eq!((record.fault, record.channel), (Fault::PretensionOff, 2));
    // Mean of the four ends at rest, nothing slipped yet: F0 itself, less a quarter of 2 N.
    assert!((record.got - 19.5).abs() < 0.1 && (record.limit - 24.0).abs() < 1e-3, "{record}");
}

#[test]
fn homing_that_does_not_arrive_ends() {
    let mut parameters = Parameters::default();
    parameters.supervisor.homing_timeout = 0.2;
    let mut bench = Bench::ready(parameters, joint());
    bench.refer(Reference::Hold(0.5));
    bench.order(Goal::Run(Mode::Position));
    bench.run(2.0);
    bench.order(Goal::Off);
    bench.run(0.5);
    // Friction holds the arm up to sin θ = 0.339/0.735.
    assert!(bench.plant.theta_out_rad() > 0.3);
    bench.order(Goal::Ready);
    assert!(bench.reaches(State::Ready, 1.0));
    bench.order(Goal::Home);
    let (ticks, record) = trip(&mut bench, 3000);
    assert!(record.fault == Fault::HomingTimeout && (record.limit - 0.2).abs() < 1e-6, "{record}");
    // One tick for the order.
    assert!((2000..=2001).contains(&ticks), "{ticks} ticks");
}
