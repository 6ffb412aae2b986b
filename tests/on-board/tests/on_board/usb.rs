//! A host that does not read, sleeps, is unplugged, or sends rubbish: the tick goes on, losses are counted, the link comes back.

use bowden_board::Injection;
use bowden_link::frame::FRAME_LENGTH;
use bowden_link::{Fault, Request, State, ToBoard, encode};
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

/// What a flood did.
#[derive(Debug)]
struct Flood {
    /// Bytes that the board took.
    bytes: usize,
    /// Most ticks by which telemetry was behind the board.
    behind: u32,
}

/// Bytes that wait for the bus, so that no packet is short and none is missing.
const WAITING: usize = 4096;

/// Sends what `next` makes as fast as the bus takes it.
fn flood(host: &mut Host, seconds: f64, mut next: impl FnMut(u16) -> Vec<u8>) -> Outcome<Flood> {
    let end_s = host.board.time_s() + seconds;
    let (mut flood, mut number) = (Flood { bytes: 0, behind: 0 }, 0);
    while host.board.time_s() < end_s {
        while host.board.usb_unsent() < WAITING {
            let bytes = next(number);
            number = number.wrapping_add(1);
            flood.bytes += bytes.len();
            host.board.usb_write(&bytes);
        }
        host.pass(1e-3)?;
        let received = host.telemetry.next_tick().expect("telemetry is on");
        flood.behind = flood.behind.max(host.ticks.begun.saturating_sub(received));
        host.telemetry.take();
    }
    println!("{flood:?}, {:.0} kB/s", flood.bytes as f64 / seconds * 1e-3);
    Ok(flood)
}

/// What holds during a flood: the watchdog is fed, the joint runs, the tick is on time.
fn assert_running(host: &mut Host) -> Outcome {
    assert!(host.ticks.period.spread() <= JITTER, "{:?}", host.ticks.period);
    assert_eq!((host.board.counters().boots, host.status()?.state), (1, State::Run));
    Ok(())
}

fn frame(number: u16, message: ToBoard) -> Vec<u8> {
    let mut buffer = [0; FRAME_LENGTH];
    encode(&Request { sequence: number, message }, &mut buffer).expect("it fits").to_vec()
}

/// Answers share the bus with telemetry, which loses samples then, counts them, and is whole again behind the flood.
#[test]
fn ten_seconds_of_requests_as_fast_as_they_are_taken_leave_the_joint_running() -> Outcome {
    let mut host = streaming()?;
    flood(&mut host, 10.0, |number| {
        let message =
            if number % 2 == 0 { ToBoard::ReadStatus } else { ToBoard::ReadParameter(number % 100) };
        frame(number, message)
    })?;
    host.run(0.3)?;
    assert_running(&mut host)?;
    let telemetry = &host.telemetry;
    assert_eq!((telemetry.missing, telemetry.disordered), (u64::from(telemetry.lost), 0));
    let behind = host.ticks.begun.saturating_sub(telemetry.next_tick().expect("telemetry is on"));
    assert!(behind <= 100, "{behind}");
    Ok(())
}

/// Frames with a wrong byte, runs without an end, and a sign of life among 2000 of them, 10 ms apart or so.
#[test]
fn ten_seconds_of_rubbish_at_the_rate_of_the_bus_disturb_nothing() -> Outcome {
    let mut host = streaming()?;
    let before = host.status()?.bad_frames;
    let flood = flood(&mut host, 10.0, |number| {
        let mut bytes = frame(number, ToBoard::ReadStatus);
        match number % 500 {
            0 => return frame(number, ToBoard::Alive),
            1 => bytes = vec![0x55; 3000],
            _ => bytes[1] ^= 0x55,
        }
        bytes
    })?;
    // Of a frame that the flood left without an end the next request would be a part.
    host.board.usb_write(&[0]);
    assert!(host.status()?.bad_frames - before > 10_000);
    // 12 ms: a batch is 24 samples, and the host looks every millisecond.
    assert!(flood.behind <= 120, "{flood:?}");
    let telemetry = &host.telemetry;
    assert_eq!((telemetry.missing, telemetry.disordered, telemetry.lost), (0, 0, 0));
    assert_running(&mut host)
}

/// Rubbish is no sign of life: the joint stops as with a host that says nothing.
#[test]
fn a_host_that_sends_nothing_but_rubbish_is_silent() -> Outcome {
    let mut host = streaming()?;
    let begun_s = host.board.time_s();
    flood(&mut host, 0.7, |number| {
        let mut bytes = frame(number, ToBoard::Alive);
        bytes[1] ^= 0x55;
        bytes
    })?;
    let record = host.await_fault(0.1)?;
    assert_eq!(record.fault, Fault::HostSilent, "{record}");
    let stopped_s = host.ticks.beginning_s(record.tick).expect("a tick of this run");
    assert!((0.4..0.6).contains(&(stopped_s - begun_s)), "{record}: {} s", stopped_s - begun_s);
    Ok(())
}
