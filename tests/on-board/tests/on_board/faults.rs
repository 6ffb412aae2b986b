//! Every fault of sensors, supply and motion, provoked at the pins of the running board.

use bowden_board::{Board, Cable, EncoderAt, EncoderMounting, EncoderPart, Injection, Rail, TensionAt};
use bowden_link::message::{Goal, Mode, Reference, Shape};
use bowden_link::{Fault, FaultRecord, State, ToBoard};
use bowden_on_board_tests::host::Host;
use bowden_on_board_tests::{Outcome, image};

use crate::stop::{LIVELY, checked, moving, stop_by, stopped, until_open};
use crate::{ready, switched_on};

/// Stops the moving joint by `injection` within `limit_s`; fault and channel are as expected.
fn injected(injection: Injection, fault: Fault, channel: u8, limit_s: f64) -> Outcome<FaultRecord> {
    let mut host = moving()?;
    let (record, opening) = stop_by(&mut host, injection, 2.0 * limit_s)?;
    assert_eq!((record.fault, record.channel), (fault, channel), "{record}");
    assert!(opening.after_s <= limit_s, "{record}: {opening:?}");
    Ok(record)
}

/// Four bad frames in a row, read a tick ahead: six ticks at most, one of them to begin with.
const FRAMES_S: f64 = 0.7e-3;

#[test]
fn an_open_encoder_line_fails_its_check() -> Outcome {
    injected(Injection::EncoderSilent(EncoderAt::Input), Fault::EncoderCheck, 0, FRAMES_S)?;
    injected(Injection::EncoderSilent(EncoderAt::Joint), Fault::EncoderCheck, 1, FRAMES_S).map(|_| ())
}

#[test]
fn a_frame_of_another_type_of_encoder_does_not_pass() -> Outcome {
    // The AMT22 has no parity of its own: the wrong bit breaks its check.
    injected(Injection::EncoderLastBit(EncoderAt::Joint), Fault::EncoderCheck, 1, FRAMES_S).map(|_| ())
}

#[test]
fn an_encoder_bus_that_stands_is_a_missing_encoder() -> Outcome {
    injected(Injection::EncoderBus(EncoderAt::Input), Fault::EncoderMissing, 0, FRAMES_S)?;
    injected(Injection::EncoderBus(EncoderAt::Joint), Fault::EncoderMissing, 1, FRAMES_S).map(|_| ())
}

#[test]
fn a_loose_magnet_is_a_jump() -> Outcome {
    injected(Injection::EncoderJump(EncoderAt::Input, 300), Fault::EncoderJump, 0, FRAMES_S).map(|_| ())
}

#[test]
fn an_encoder_that_stands_is_found() -> Outcome {
    // 0.15 rad at about 0.9 rad/s, and 20 ms.
    injected(Injection::EncoderStuck(EncoderAt::Joint), Fault::EncoderStuck, 1, 0.35).map(|_| ())
}

/// What finds a joint encoder or a tension that stands before the motion of the joint does, switched off.
fn without_comparisons(host: &mut Host) -> Outcome {
    host.set("encoder.stuck_travel", 6.0)?;
    host.set("tension.consistency_time", 10.0)
}

/// The joint's encoder stands while the reference goes on at up to 0.94 rad/s: 0.1 rad in 0.11 s at least, and 0.1 s.
#[test]
fn a_joint_that_does_not_follow_is_found() -> Outcome {
    let mut host = ready(1)?;
    without_comparisons(&mut host)?;
    host.set("supervisor.tracking_error", 0.1)?;
    host.set("supervisor.tracking_time", 0.1)?;
    host.follow(LIVELY)?;
    host.run(1.0)?;
    let (record, opening) = stop_by(&mut host, Injection::EncoderStuck(EncoderAt::Joint), 1.0)?;
    assert_eq!((record.fault, record.channel), (Fault::TrackingError, 0), "{record}");
    assert!(record.got > 0.1 && (0.1..0.5).contains(&opening.after_s), "{record}: {opening:?}");
    Ok(())
}

/// The correction of the joint's encoder is set to what no encoder has: the measured angle jumps by up to 0.2 rad, out of a range that ends
/// where the reference turns.
#[test]
fn a_joint_beyond_its_range_is_found() -> Outcome {
    let mut host = ready(1)?;
    host.set("limits.angle_maximum", 0.3)?;
    host.set("supervisor.angle_margin", 0.03)?;
    host.set("correction.joint_encoder.amplitude", 0.2)?;
    host.set("correction.joint_encoder.limit", 0.2)?;
    host.set("correction.joint_encoder.phase", 3.0)?;
    host.follow(Reference::Hold(0.29))?;
    host.run(2.0)?;
    assert_eq!(host.status()?.fault, None);
    host.set("correction.joint_encoder.enable", 1.0)?;
    let (record, _) = stopped(&mut host, 0.05)?;
    assert_eq!((record.fault, record.channel), (Fault::JointRange, 0), "{record}");
    assert!((record.limit - 0.33).abs() < 1e-4 && (0.33..0.51).contains(&record.got), "{record}");
    Ok(())
}

/// In torque mode a weight swings as fast as its torque lets it.
#[test]
fn a_joint_that_turns_too_fast_is_found() -> Outcome {
    let mut host = ready(1)?;
    host.set("limits.speed", 0.5)?;
    host.set("supervisor.joint_speed", 0.6)?;
    let swing = Reference::Generated { shape: Shape::Sine, amplitude: 0.3, offset: 0.0, frequency_hz: 1.0 };
    host.order(&ToBoard::SetReference(swing))?;
    host.order(&ToBoard::Enter(Goal::Run(Mode::Torque)))?;
    host.reach(State::Run, 0.1)?;
    host.run(0.02)?;
    let (record, _) = stopped(&mut host, 3.0)?;
    assert_eq!((record.fault, record.channel), (Fault::JointSpeed, 0), "{record}");
    assert!((record.limit - 0.6).abs() < 1e-3 && (0.6..1.6).contains(&record.got), "{record}");
    Ok(())
}

/// 30 looks in 0.3 s with one code, while the others swing by more than 5 N. By chance it may have had that code for a look or three before it stands.
#[test]
fn a_tension_channel_that_stands_is_found() -> Outcome {
    let mut host = ready(1)?;
    without_comparisons(&mut host)?;
    host.follow(LIVELY)?;
    host.run(1.0)?;
    let (record, opening) = stop_by(&mut host, Injection::TensionStuck(TensionAt::F4), 2.5)?;
    assert_eq!((record.fault, record.channel, record.limit), (Fault::TensionStuck, 3, 5.0), "{record}");
    assert!(record.got > 5.0 && opening.after_s >= 0.265, "{record}: {opening:?}");
    Ok(())
}

/// From the start on, in a motion at up to 0.94 rad/s: with the second or third turn of 2 s.
#[test]
fn exchanged_tension_channels_are_found() -> Outcome {
    use TensionAt::{F1, F2, F3, F4};
    let pairs = [([F1, F3], 0), ([F2, F4], 1), ([F1, F2], 2), ([F3, F4], 3)];
    for (swapped, end) in pairs {
        let mut host = switched_on(1)?;
        host.board.inject(Injection::TensionSwapped(swapped[0], swapped[1]));
        host.make_ready()?;
        host.follow(LIVELY)?;
        let begun_s = host.board.time_s();
        while host.board.pwm().duty.is_some() {
            host.run(1e-3)?;
            assert!(host.board.time_s() < begun_s + 4.0, "{swapped:?}: never named");
        }
        println!(
            "{swapped:?}: {:.3} s, {:.3} rad",
            host.board.time_s() - begun_s,
            host.board.bench().theta_out_rad()
        );
        let record = host.await_fault(0.1)?;
        // f1 and f3 contradict the stretch too, 30 N of it, at about the same time.
        if (record.fault, end) != (Fault::StretchInconsistent, 0) {
            assert_eq!((record.fault, record.channel), (Fault::TensionSwapped, end), "{swapped:?}: {record}");
            assert!(record.got > record.limit && record.limit == 7.5, "{record}");
        }
        checked(&mut host, record)?;
    }
    Ok(())
}

/// 8 N of noise, sixteen times what may be there at rest: four of five looks see a jump, and six of them take 0.2 s at least.
#[test]
fn a_tension_channel_that_jumps_about_is_found() -> Outcome {
    let mut host = ready(1)?;
    without_comparisons(&mut host)?;
    host.follow(LIVELY)?;
    host.run(1.0)?;
    let (record, opening) = stop_by(&mut host, Injection::TensionNoise(TensionAt::F3, 8.0), 0.8)?;
    assert_eq!((record.fault, record.channel), (Fault::TensionRestless, 2), "{record}");
    assert!((0.2..0.7).contains(&opening.after_s), "{record}: {opening:?}");
    Ok(())
}

/// Half the bus voltage is on the motor: 6 A in the end, and 90 N at a tendon 7 ms later if nothing stops it.
#[test]
fn a_leg_at_ground_stops_before_a_tendon_is_overloaded() -> Outcome {
    for leg in [0, 1] {
        let mut host = moving()?;
        host.board.take_peaks();
        let (record, opening) = stop_by(&mut host, Injection::LegLow(leg), 0.01)?;
        assert_eq!((record.fault, record.channel), (Fault::MotorCurrent, 0), "{record}");
        assert!(opening.after_s < 2.6e-3, "{record}: {opening:?}");
        let peaks = host.board.take_peaks();
        println!("leg {leg}: {opening:?}, {peaks:?}");
        assert!(peaks.tensions_n.into_iter().all(|tension_n| tension_n < 90.0), "{peaks:?}");
    }
    Ok(())
}

/// A board with two AS5045, told so over the link, and its joint moving.
fn moving_with_as5045() -> Outcome<Host> {
    let mounting =
        |count_at_zero| EncoderMounting { part: EncoderPart::As5045, count_at_zero, reversed: false };
    let elf = image::firmware()?;
    let board = Board::builder(&elf)
        .encoder(EncoderAt::Input, mounting(1000))
        .encoder(EncoderAt::Joint, mounting(2000));
    // The parameters are stored by a board whose encoders are not read: a part is not to be clocked in the other's mode.
    let mut first = switched_on(1)?;
    first.board.inject(Injection::EncoderBus(EncoderAt::Input));
    first.board.inject(Injection::EncoderBus(EncoderAt::Joint));
    first.set("encoder.input.part", 1.0)?;
    first.set("encoder.joint.part", 1.0)?;
    first.order(&ToBoard::StoreParameters)?;
    let mut host = Host::connect(board.flash_image(first.board.flash_image()).build()?)?;
    host.make_ready()?;
    host.follow(LIVELY)?;
    host.run(1.0)?;
    Ok(host)
}

#[test]
fn a_wrong_bit_of_an_as5045_fails_its_parity() -> Outcome {
    let mut host = moving_with_as5045()?;
    let bit = Injection::EncoderLastBit(EncoderAt::Input);
    let (record, opening) = stop_by(&mut host, bit, 0.01)?;
    assert_eq!((record.fault, record.channel), (Fault::EncoderParity, 0), "{record}");
    assert!(opening.after_s <= FRAMES_S, "{opening:?}");
    Ok(())
}

#[test]
fn a_lost_magnet_of_an_as5045_says_so() -> Outcome {
    let mut host = moving_with_as5045()?;
    let lost = Injection::EncoderMagnetLost(EncoderAt::Joint);
    let (record, opening) = stop_by(&mut host, lost, 0.01)?;
    assert_eq!((record.fault, record.channel), (Fault::EncoderStatus, 1), "{record}");
    assert!(opening.after_s <= FRAMES_S, "{opening:?}");
    Ok(())
}

/// 1 ms, and a tick at either end.
const TENSION_S: f64 = 1.2e-3;

#[test]
fn a_broken_tension_wire_is_at_a_rail() -> Outcome {
    let low = injected(Injection::TensionWire(TensionAt::F2, Rail::Low), Fault::TensionRail, 1, TENSION_S)?;
    assert!((low.got - 0.02).abs() < 2e-3 && (low.limit - 0.1).abs() < 2e-3, "{low}");
    let high = injected(Injection::TensionWire(TensionAt::F3, Rail::High), Fault::TensionRail, 2, TENSION_S)?;
    assert!((high.got - 3.28).abs() < 2e-3 && (high.limit - 3.2).abs() < 2e-3, "{high}");
    Ok(())
}

#[test]
fn slack_and_overload_are_found() -> Outcome {
    let slack = injected(Injection::TensionOffset(TensionAt::F4, -34.0), Fault::Slack, 3, TENSION_S)?;
    assert!(slack.got < 1.0 && slack.limit == 1.0, "{slack}");
    let mut host = moving()?;
    // The reading becomes 100 N.
    let offset_n = 100.0 - host.board.bench().tensions_n()[0];
    let overload = Injection::TensionOffset(TensionAt::F1, offset_n);
    let (over, opening) = stop_by(&mut host, overload, 0.01)?;
    assert_eq!((over.fault, over.channel), (Fault::OverTension, 0), "{over}");
    assert!((over.got - 100.0).abs() < 2.0 && over.limit == 90.0, "{over}");
    assert!(opening.after_s <= TENSION_S, "{opening:?}");
    Ok(())
}

#[test]
fn tensions_that_do_not_fit_the_friction_are_found() -> Outcome {
    // 50 ms, and the low-pass of 5 ms: a sixth of what the other end has.
    injected(Injection::TensionGain(TensionAt::F1, 0.17), Fault::TensionInconsistent, 0, 0.08).map(|_| ())
}

#[test]
fn tensions_that_contradict_the_stretch_are_found() -> Outcome {
    // 300 ms, and the low-pass of 5 ms: 36 N more than what the stretch tells, of which 30 N are allowed.
    injected(Injection::TensionOffset(TensionAt::F1, 36.0), Fault::StretchInconsistent, 0, 0.34).map(|_| ())
}

#[test]
fn over_current_stops_in_three_ticks() -> Outcome {
    let record = injected(Injection::CurrentOffset(9.5), Fault::OverCurrent, 0, 0.4e-3)?;
    assert!(record.got > 8.0 && record.limit == 8.0, "{record}");
    Ok(())
}

/// By the closed form 0.1 s · ln(5² / (5² - 1.5²)) = 9.4 ms at 5 A from cold; the joint's own current shifts it.
#[test]
fn a_hot_winding_stops() -> Outcome {
    let mut host = moving()?;
    host.set("motor.winding_time", 0.1)?;
    host.set("motor.continuous_current", 1.5)?;
    // What no voltage makes would be a fault of its own, 1 ms behind the change.
    host.set("supervisor.rest_current", 4.0)?;
    let (record, opening) = stop_by(&mut host, Injection::CurrentOffset(5.0), 0.03)?;
    assert_eq!((record.fault, record.channel, record.limit), (Fault::WindingHot, 0, 1.5), "{record}");
    assert!((5e-3..15e-3).contains(&opening.after_s), "{record}: {opening:?}");
    Ok(())
}

#[test]
fn a_bus_voltage_out_of_range_stops() -> Outcome {
    // 5 ms of debounce.
    let low = injected(Injection::BusVoltage(15.0), Fault::BusUnderVoltage, 0, 5.3e-3)?;
    assert!((low.got - 15.0).abs() < 0.1 && low.limit == 18.0, "{low}");
    let high = injected(Injection::BusVoltage(32.0), Fault::BusOverVoltage, 0, 5.3e-3)?;
    assert!((high.got - 32.0).abs() < 0.1 && high.limit == 30.0, "{high}");
    Ok(())
}

#[test]
fn a_fault_of_the_bridge_stops_at_once() -> Outcome {
    injected(Injection::BridgeFault, Fault::BridgeFault, 0, 40e-6).map(|_| ())
}

#[test]
fn a_host_that_falls_silent_stops_the_joint() -> Outcome {
    let mut host = moving()?;
    host.keeps_alive = false;
    let silent_s = host.board.time_s();
    host.board.inject(Injection::HostSilent);
    let opening = until_open(&mut host, 1.0)?;
    // Half a second of silence, looked for every 5 ms; the last word was at most 0.1 s ago.
    assert!((0.4..0.51).contains(&(opening.at_s - silent_s)), "{opening:?}");
    host.board.clear_all();
    let record = host.await_fault(0.2)?;
    assert_eq!(record.fault, Fault::HostSilent, "{record}");
    let behind_s = opening.at_s - host.ticks.beginning_s(record.tick).expect("a tick of this run");
    assert!((0.0..=1e-4).contains(&behind_s), "{behind_s} s");
    checked(&mut host, record)
}

#[test]
fn a_restless_sensor_ends_the_self_test() -> Outcome {
    let mut host = switched_on(1)?;
    host.board.inject(Injection::CurrentOffset(0.8));
    host.order(&ToBoard::Enter(Goal::Ready))?;
    let record = host.await_fault(2.5)?;
    assert_eq!((record.fault, record.channel), (Fault::SelfTestTimeout, 6), "{record}");
    assert_eq!(record.limit, 2.0);
    checked(&mut host, record)
}

#[test]
fn lost_pretension_is_found_before_the_bridge_is_on() -> Outcome {
    let mut host = switched_on(1)?;
    host.board.inject(Injection::Pretension(Cable::A, 0.4));
    host.run(0.2)?;
    host.order(&ToBoard::Enter(Goal::Ready))?;
    let record = host.await_fault(2.5)?;
    assert_eq!(record.fault, Fault::PretensionOff, "{record}");
    // Mean of the four ends: twice 0.4 of 30 N and twice 30 N; 6 N less than 30 N are allowed.
    assert!((record.got - 21.0).abs() < 0.3 && record.limit == 24.0 && record.channel < 2, "{record}");
    assert_eq!(host.board.pwm().duty, None);
    checked(&mut host, record)
}

#[test]
fn homing_that_does_not_arrive_ends() -> Outcome {
    let mut host = ready(1)?;
    host.set("supervisor.homing_timeout", 0.2)?;
    host.follow(Reference::Hold(0.5))?;
    host.run(1.5)?;
    host.order(&ToBoard::Enter(Goal::Off))?;
    host.run(0.3)?;
    // Friction holds the arm where it is, about.
    assert!(host.board.bench().theta_out_rad() > 0.2, "{} rad", host.board.bench().theta_out_rad());
    host.make_ready()?;
    host.order(&ToBoard::Enter(Goal::Home))?;
    host.reach(State::Homing, 0.01)?;
    let (record, _) = stopped(&mut host, 0.5)?;
    assert_eq!(record.fault, Fault::HomingTimeout, "{record}");
    Ok(())
}

/// The receiving channel is off behind the error, and the byte stays in the FIFO, where it would shift every frame behind it.
#[test]
fn an_error_of_the_encoders_dma_costs_a_frame_and_is_counted() -> Outcome {
    let mut host = moving()?;
    for errors in 1..=4 {
        let at = if errors % 2 == 0 { EncoderAt::Input } else { EncoderAt::Joint };
        host.board.inject(Injection::EncoderDmaError(at));
        host.run(0.02)?;
        let status = host.status()?;
        assert_eq!((status.state, status.fault), (State::Run, None), "{at:?}");
        assert!(!status.limits.contains(bowden_link::Limit::FrameRepaired), "{at:?}: over by now");
        // An AMT22 has two exchanges a frame, and the second one may meet what the first one left.
        assert!((errors..=2 * errors).contains(&status.bus_errors), "{status:?}");
    }
    Ok(())
}

#[test]
fn a_supply_of_the_processor_that_falls_opens_the_bridge_in_hardware() -> Outcome {
    let mut host = moving()?;
    host.board.stall_core(true);
    host.board.inject(Injection::ProcessorSupply);
    host.board.run_for(1e-6)?;
    let pwm = host.board.pwm();
    assert_eq!((pwm.duty, pwm.driven), (None, [true, true]), "no instruction was needed");
    host.board.stall_core(false);
    let record = host.await_fault(0.1)?;
    assert_eq!(record.fault, Fault::ProcessorSupply, "{record}");
    host.board.clear_all();
    checked(&mut host, record)
}
