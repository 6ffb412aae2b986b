//! What every stop has in common: the bridge opens in the tick of the detection, and the board can tell afterwards.

use bowden_board::{Injection, Pin};
use bowden_link::message::{Goal, Reference, Shape};
use bowden_link::{Fault, FaultRecord, State, ToBoard};
use bowden_on_board_tests::host::Host;
use bowden_on_board_tests::{Outcome, fail};

use crate::ready;

/// Enable pin of the bridge.
const ENABLE: Pin = Pin::new('C', 6);
/// Control period \[s\].
pub const PERIOD_S: f64 = 1e-4;
/// Board time between two looks at the bridge \[s\].
const LOOK_S: f64 = 20e-6;
/// Samples of a snapshot.
const SNAPSHOT: usize = 64;

/// Moves at up to 0.94 rad/s.
pub const LIVELY: Reference =
    Reference::Generated { shape: Shape::Sine, amplitude: 0.3, offset: 0.0, frequency_hz: 0.5 };

/// A joint that moves at full speed.
pub fn moving() -> Outcome<Host> {
    let mut host = ready(1)?;
    host.follow(LIVELY)?;
    // The reference crosses zero, and its ramp of 0.5 s is over.
    host.run(1.0)?;
    assert!(host.board.pwm().duty.is_some());
    Ok(host)
}

/// Opening of the bridge.
#[derive(Debug, Clone, Copy)]
pub struct Opening {
    /// Since the call of [`until_open`] \[s\].
    pub after_s: f64,
    /// Board time \[s\].
    pub at_s: f64,
    /// Ticks of that run of the firmware that had begun.
    pub ticks: u32,
}

/// Lets time pass until the bridge is open, at most `limit_s`.
pub fn until_open(host: &mut Host, limit_s: f64) -> Outcome<Opening> {
    host.board.watch(ENABLE);
    host.board.take_edges(ENABLE);
    let start_s = host.board.time_s();
    let mut ticks = host.ticks.begun;
    while host.board.pwm().duty.is_some() {
        // A reset would begin the count anew.
        ticks = host.ticks.begun;
        if host.board.time_s() > start_s + limit_s {
            return fail(format!("the bridge is not open {limit_s} s later"));
        }
        host.pass(LOOK_S)?;
    }
    let edge = host.board.take_edges(ENABLE).into_iter().find(|edge| !edge.high);
    // Hardware may have opened it before the firmware lowers the pin.
    let at_s = edge.map_or(host.board.time_s(), |edge| edge.at_s);
    Ok(Opening { after_s: at_s - start_s, at_s, ticks: ticks.max(host.ticks.begun) })
}

/// Stops the moving joint by `injection` within `limit_s`; checks what holds for every stop.
pub fn stop_by(host: &mut Host, injection: Injection, limit_s: f64) -> Outcome<(FaultRecord, Opening)> {
    host.board.inject(injection);
    stopped(host, limit_s)
}

/// Waits at most `limit_s` for the stop of the moving joint; checks what holds for every stop.
pub fn stopped(host: &mut Host, limit_s: f64) -> Outcome<(FaultRecord, Opening)> {
    let opening = until_open(host, limit_s)?;
    let record = host.await_fault(0.2)?;
    let detected_s = host.ticks.beginning_s(record.tick).expect("a tick of this run");
    let behind_s = opening.at_s - detected_s;
    assert!(behind_s <= PERIOD_S, "{record}: open {behind_s} s behind the beginning of its tick");
    checked(host, record)?;
    Ok((record, opening))
}

/// Checks what holds behind every stop: words, snapshot, bridge open until the host clears the fault.
pub fn checked(host: &mut Host, record: FaultRecord) -> Outcome {
    let words = record.to_string();
    assert!(words.contains(record.fault.title()) && words.contains(record.fault.next_step()), "{words}");
    println!("{words}");
    let snapshot = host.snapshot()?;
    assert_eq!(snapshot.len(), SNAPSHOT, "{record}");
    let (last, sample) = snapshot[SNAPSHOT - 1];
    // A warning of the gate driver is told up to a millisecond behind its stop, with which the snapshot ends.
    let behind = if record.fault == Fault::DriverWarning { 0..=10 } else { 0..=0 };
    assert!(behind.contains(&(record.tick - last)), "{record}: {last}");
    assert_eq!((sample.state, sample.duty_raw), (State::Fault, 0), "{record}");
    for (index, (tick, _)) in snapshot.iter().enumerate() {
        assert_eq!(*tick, last - (SNAPSHOT - 1 - index) as u32, "{record}");
    }
    host.run(0.01)?;
    assert_eq!(host.board.pwm().duty, None, "{record}");
    // It is kept until it is cleared on purpose.
    assert_eq!(host.status()?.fault, Some(record));
    assert!(host.order(&ToBoard::Enter(Goal::Ready)).is_err(), "{record}");
    host.order(&ToBoard::Enter(Goal::ClearFault))?;
    host.reach(State::Off, 0.01)?;
    Ok(())
}
