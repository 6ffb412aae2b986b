//! A host that does not read, sleeps, is unplugged, or sends rubbish: the tick goes on, losses are counted, the link comes back.

use bowden_board::Injection;
use bowden_link::{State, ToBoard};
use bowden_on_board_tests::Outcome;
use bowden_on_board_tests::host::Host;

use crate::stop::moving;
use crate::switched_on;

/// Cycles by which the beginning of a tick may move: 1.5 us.
const JITTER: u64 = 255;

fn streaming() -> Outcome<Host> {
    let mut host = moving()?;
    host.order(&ToBoard::Telemetry(true))?;
    host.run(0.1)?;
    assert_eq!((host.telemetry.missing, host.telemetry.lost), (0, 0));
    host.ticks.measure_anew();
    Ok(host)
}

#[test]
fn what_a_host_does_not_read_is_lost_and_counted() -> Outcome {
    let mut host = streaming()?;
    let begun = host.ticks.begun;
    host.board.inject(Injection::HostNotReading);
    // It writes on, so it is not silent.
    host.run(0.3)?;
    assert_eq!(host.ticks.begun - begun, 3000);
    host.board.clear_all();
    host.run(0.2)?;
    let (telemetry, status) = (&host.telemetry, host.telemetry.lost);
    // 0.3 s are 3000 samples; buffers hold some 600 of them.
    assert!((2000..3000).contains(&telemetry.missing), "{telemetry:?}");
    assert_eq!((telemetry.missing, telemetry.disordered), (u64::from(status), 0));
    assert_eq!(host.bad_frames, 0);
    assert!(host.ticks.period.spread() <= JITTER, "{:?}", host.ticks.period);
    assert_eq!(host.status()?.state, State::Run);
    Ok(())
}

#[test]
fn a_plug_that_is_pulled_stops_the_joint_and_the_link_comes_back() -> Outcome {
    let mut host = streaming()?;
    host.board.set_usb_plugged(false);
    host.run(0.3)?;
    // Not yet half a second.
    assert!(host.board.pwm().duty.is_some());
    host.board.set_usb_plugged(true);
    host.run(0.02)?;
    host.reconnect()?;
    assert_eq!(host.status()?.state, State::Run);
    // The board forgot that telemetry was wanted.
    host.order(&ToBoard::Telemetry(true))?;
    host.run(0.1)?;
    let received = host.telemetry.received;
    host.run(0.1)?;
    assert!(host.telemetry.received - received >= 900, "{}", host.telemetry.received - received);
    assert!(host.ticks.period.spread() <= JITTER, "{:?}", host.ticks.period);
    host.board.set_usb_plugged(false);
    host.run(0.7)?;
    assert_eq!(host.board.pwm().duty, None, "nobody is there");
    host.board.set_usb_plugged(true);
    host.run(0.02)?;
    host.reconnect()?;
    let fault = host.status()?.fault.map(|record| record.fault);
    assert_eq!(fault, Some(bowden_link::Fault::HostSilent));
    Ok(())
}

/// A computer that sleeps suspends the bus: the device stays configured and the port open, so that all goes on where it was.
#[test]
fn a_host_that_sleeps_is_a_silent_one_and_all_goes_on_when_it_wakes() -> Outcome {
    let mut host = streaming()?;
    host.board.set_usb_suspended(true);
    host.run(0.3)?;
    // Not yet half a second.
    assert!(host.board.pwm().duty.is_some());
    host.board.set_usb_suspended(false);
    let received = host.telemetry.received;
    host.run(0.2)?;
    // What the queue holds of the 0.3 s, the 20 ms of the resume signal, and 180 ms.
    assert!(host.telemetry.received - received >= 1800, "{}", host.telemetry.received - received);
    assert_eq!(host.telemetry.missing, u64::from(host.telemetry.lost));
    assert_eq!((host.bad_frames, host.status()?.state), (0, State::Run));
    assert!(host.ticks.period.spread() <= JITTER, "{:?}", host.ticks.period);
    host.board.set_usb_suspended(true);
    host.run(0.7)?;
    assert_eq!(host.board.pwm().duty, None, "nobody is there");
    host.board.set_usb_suspended(false);
    host.run(0.03)?;
    let fault = host.status()?.fault.map(|record| record.fault);
    assert_eq!(fault, Some(bowden_link::Fault::HostSilent));
    Ok(())
}

#[test]
fn a_port_that_is_closed_ends_telemetry() -> Outcome {
    let mut host = switched_on(1)?;
    host.order(&ToBoard::Telemetry(true))?;
    host.run(0.05)?;
    host.board.set_usb_line_state(false);
    host.run(0.05)?;
    host.board.set_usb_line_state(true);
    host.run(0.05)?;
    host.reconnect()?;
    let received = host.telemetry.received;
    host.run(0.1)?;
    assert_eq!(host.telemetry.received, received);
    Ok(())
}

#[test]
fn rubbish_is_counted_and_the_next_request_answered() -> Outcome {
    let mut host = switched_on(1)?;
    let rubbish: Vec<u8> = (0..2000_u32).map(|n| (n.wrapping_mul(2_654_435_761) >> 24) as u8).collect();
    host.board.usb_write(&rubbish);
    host.board.usb_write(&[0]);
    host.run(0.05)?;
    let status = host.status()?;
    assert!(status.bad_frames >= 2, "{status:?}");
    assert_eq!(status.fault, None);
    Ok(())
}
