//! The bridge's fault line acts in hardware: no instruction of the firmware is needed.

use bowden_board::{Injection, TICK_MARKER};
use bowden_link::Fault;
use bowden_on_board_tests::Outcome;

use crate::stop::{checked, moving};

#[test]
fn the_break_input_opens_the_bridge_while_the_core_stands() -> Outcome {
    let mut host = moving()?;
    // Between two ticks: a tick that is held half done is a late one.
    while host.board.output(TICK_MARKER) == Some(true) {
        host.pass(1e-6)?;
    }
    host.board.halt_core(true);
    host.board.run_for(1e-3)?;
    assert!(host.board.pwm().duty.is_some(), "without a core the bridge goes on with its last duty");
    let instructions = host.board.counters().instructions;
    host.board.inject(Injection::BridgeFault);
    host.board.run_for(1e-6)?;
    let pwm = host.board.pwm();
    assert_eq!((pwm.duty, pwm.legs, pwm.main_output), (None, [None, None], false));
    assert_eq!(host.board.counters().instructions, instructions);
    // The line's recovery does not switch the bridge on again.
    host.board.clear(Injection::BridgeFault);
    host.board.run_for(5e-3)?;
    assert!(!host.board.pwm().main_output);
    // The core finds it when it goes on.
    host.board.halt_core(false);
    let record = host.await_fault(0.1)?;
    assert_eq!(record.fault, Fault::BridgeFault, "{record}");
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
