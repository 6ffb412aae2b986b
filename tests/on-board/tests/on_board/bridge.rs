//! The bridge's fault line acts in hardware: no instruction of the firmware is needed.

use bowden_board::{Injection, TICK_MARKER};
use bowden_link::message::Goal;
use bowden_link::{Fault, State, ToBoard};
use bowden_on_board_tests::Outcome;
use bowden_on_board_tests::host::Host;

use crate::stop::{checked, moving, until_open};
use crate::{ready, switched_on};

/// Lets the marker of the tick fall: a tick that is held half done is a late one.
fn between_ticks(host: &mut Host) -> Outcome {
    while host.board.output(TICK_MARKER) == Some(true) {
        host.pass(1e-6)?;
    }
    Ok(())
}

#[test]
fn the_break_input_opens_the_bridge_while_the_core_stands() -> Outcome {
    let mut host = moving()?;
    between_ticks(&mut host)?;
    host.board.stall_core(true);
    host.board.run_for(1e-3)?;
    assert!(host.board.pwm().duty.is_some(), "without a core the bridge goes on with its last duty");
    let instructions = host.board.counters().instructions;
    host.board.inject(Injection::BridgeFault);
    host.board.run_for(1e-6)?;
    let pwm = host.board.pwm();
    assert_eq!((pwm.duty, pwm.legs, pwm.main_output), (None, [None, None], false));
    assert_eq!(pwm.driven, [true, true], "the gates are held low");
    assert_eq!(host.board.counters().instructions, instructions);
    // The line's recovery does not switch the bridge on again.
    host.board.clear(Injection::BridgeFault);
    host.board.run_for(5e-3)?;
    assert!(!host.board.pwm().main_output);
    // The core finds it when it goes on, and that the line is high again.
    host.board.stall_core(false);
    host.run(2e-3)?;
    let record = host.await_fault(0.1)?;
    assert_eq!(record.fault, Fault::DriverWarning, "{record}");
    checked(&mut host, record)
}

/// The line of a driver that warns is low and high in turn; that of a fault stays low until the driver was asleep.
#[test]
fn a_warning_of_the_gate_driver_is_told_from_its_fault() -> Outcome {
    for half_s in [20e-6, 56e-6, 300e-6] {
        let mut host = moving()?;
        let began_s = host.board.time_s();
        host.board.inject(Injection::DriverWarning(half_s));
        let opening = until_open(&mut host, 1e-3)?;
        host.run(2e-3)?;
        let record = host.await_fault(0.1)?;
        assert_eq!(record.fault, Fault::DriverWarning, "{half_s} s: {record}");
        assert!(record.limit == 1.0 && f64::from(record.got) <= 1e3 * half_s + 0.2, "{half_s} s: {record}");
        // Hardware opened it in the first low phase, 0.38 us behind its beginning.
        assert!(host.board.bridge_events().opened_s - began_s < 1e-6, "{half_s} s: {opening:?}");
        assert!(!host.board.pwm().enabled, "{half_s} s: the driver is asleep");
        checked(&mut host, record)?;
    }
    // A fault lasts: it keeps its name, and the driver goes to sleep a millisecond later.
    let mut host = moving()?;
    host.board.inject(Injection::BridgeFault);
    host.run(0.8e-3)?;
    assert!(
        host.board.pwm().enabled && host.board.pwm().duty.is_none(),
        "the driver is awake, the bridge open"
    );
    host.run(0.5e-3)?;
    assert!(!host.board.pwm().enabled, "asleep behind a fault");
    let record = host.await_fault(0.1)?;
    assert_eq!(record.fault, Fault::BridgeFault, "{record}");
    // What comes later is not its warning.
    host.board.clear(Injection::BridgeFault);
    host.run(5e-3)?;
    assert_eq!(host.status()?.fault, Some(record));
    checked(&mut host, record)
}

#[test]
fn dead_time_and_rate_are_as_set() -> Outcome {
    let host = moving()?;
    let pwm = host.board.pwm();
    // 2 · 4250 cycles of 170 MHz are 20 kHz; 60 cycles of dead time are 353 ns.
    assert_eq!((pwm.reload, pwm.dead_time_raw), (4250, 60));
    assert!(pwm.enabled && pwm.main_output && pwm.legs.iter().all(Option::is_some), "{pwm:?}");
    Ok(())
}

#[test]
fn the_gates_are_driven_from_the_start_whether_the_bridge_is_on_or_off() -> Outcome {
    let mut host = switched_on(1)?;
    assert_eq!((host.board.pwm().duty, host.board.pwm().driven), (None, [true, true]));
    host.make_ready()?;
    assert_eq!((host.board.pwm().duty, host.board.pwm().driven), (None, [true, true]));
    Ok(())
}

#[test]
fn a_short_pulse_on_the_fault_line_is_no_fault() -> Outcome {
    let mut host = moving()?;
    between_ticks(&mut host)?;
    // The core is stalled, so that time is not counted in whole blocks of its code.
    host.board.stall_core(true);
    host.board.inject(Injection::BridgeFault);
    host.board.run_for(0.3e-6)?;
    host.board.clear(Injection::BridgeFault);
    host.board.run_for(10e-6)?;
    host.board.stall_core(false);
    host.run(0.01)?;
    assert_eq!((host.status()?.state, host.status()?.fault), (State::Run, None));
    // The filter is what kept it away: 0.1 us longer, and it is one.
    between_ticks(&mut host)?;
    host.board.stall_core(true);
    host.board.inject(Injection::BridgeFault);
    host.board.run_for(0.4e-6)?;
    host.board.clear(Injection::BridgeFault);
    host.board.stall_core(false);
    host.run(2e-3)?;
    assert_eq!(host.await_fault(0.1)?.fault, Fault::DriverWarning);
    Ok(())
}

#[test]
fn a_debugger_that_holds_the_core_stops_the_motor() -> Outcome {
    let mut host = moving()?;
    between_ticks(&mut host)?;
    host.board.halt_core(true);
    let pwm = host.board.pwm();
    assert_eq!((pwm.duty, pwm.driven), (None, [true, true]));
    host.board.run_for(1e-3)?;
    assert_eq!(host.board.pwm().duty, None);
    Ok(())
}

/// `TIM1_BDTR`, by which a program gone wild could let the bridge short the bus.
#[test]
fn protection_of_the_bridge_is_locked() -> Outcome {
    let host = ready(1)?;
    let pwm = host.board.pwm();
    // Level 3 protects dead time, polarities, off states, break and output modes until the next reset.
    assert_eq!(pwm.lock_level, 3);
    Ok(())
}

#[test]
fn the_gate_driver_is_awake_before_the_bridge_goes_on_and_its_fault_line_counts_from_then_on() -> Outcome {
    let mut host = switched_on(1)?;
    // Off: asleep.
    assert!(!host.board.pwm().enabled);
    host.order(&ToBoard::Enter(Goal::Ready))?;
    // Its fault line is low while it wakes, for 10 ms.
    host.run(5e-3)?;
    assert!(host.board.pwm().enabled && !host.board.pwm().main_output);
    assert_eq!(host.status()?.state, State::SelfTest);
    host.reach(State::Ready, 3.0)?;
    host.board.inject(Injection::BridgeFault);
    let record = host.await_fault(0.1)?;
    assert_eq!(record.fault, Fault::BridgeFault, "{record}");
    assert!(!host.board.pwm().enabled, "asleep behind a fault");
    Ok(())
}

#[test]
fn a_gate_driver_that_takes_longer_than_its_parameter_says_is_a_fault() -> Outcome {
    let mut host = switched_on(1)?;
    host.set("bridge.wake_time", 0.005)?;
    host.order(&ToBoard::Enter(Goal::Ready))?;
    assert_eq!(host.await_fault(0.1)?.fault, Fault::BridgeFault);
    host.order(&ToBoard::Enter(Goal::ClearFault))?;
    host.reach(State::Off, 0.01)?;
    // Longer than a look of the self test: the test waits for it.
    host.set("bridge.wake_time", 0.3)?;
    host.order(&ToBoard::Enter(Goal::Ready))?;
    host.run(0.25)?;
    assert_eq!(host.status()?.state, State::SelfTest);
    host.reach(State::Ready, 1.0).map(|_| ())
}
