//! Clock tree: 170 MHz from the crystal, or from the internal oscillator where that does not run.

use bowden_board::{Board, Injection, ResetCause};
use bowden_link::message::{Boot, ClockSource};
use bowden_link::{Fault, State};
use bowden_on_board_tests::host::Host;
use bowden_on_board_tests::{Outcome, image};

use crate::stop::{moving, until_open};
use crate::switched_on;

/// Mean time between two ticks over 0.1 s of board time \[s\].
fn period_s(host: &mut Host) -> Outcome<f64> {
    host.run(0.1)?;
    let last = host.ticks.begun - 1;
    let beginning = |tick| host.ticks.beginning_s(tick).expect("a tick of this run");
    Ok((beginning(last) - beginning(last - 900)) / 900.0)
}

#[test]
fn the_control_period_is_that_of_the_crystal() -> Outcome {
    let mut host = switched_on(1)?;
    assert_eq!(host.greet()?.chip.clock, ClockSource::Crystal);
    let period_s = period_s(&mut host)?;
    assert!((period_s - 1e-4).abs() < 1e-8, "{period_s} s");
    Ok(())
}

#[test]
fn a_crystal_that_does_not_start_is_told_and_the_board_works() -> Outcome {
    let mut board = Board::builder(&image::firmware()?).build()?;
    board.inject(Injection::Crystal);
    let mut host = Host::connect(board)?;
    assert!(host.board.time_s() < 0.1, "port and greeting after {} s", host.board.time_s());
    assert_eq!(host.greet()?.chip.clock, ClockSource::Internal);
    assert_eq!(host.status()?.fault, None);
    host.make_ready()?;
    // The internal oscillator of the emulated chip is 0.5 % slow.
    let period_s = period_s(&mut host)?;
    assert!((period_s - 1e-4 / 0.995).abs() < 1e-8, "{period_s} s");
    // A crystal that runs again is used from the next start on.
    host.board.clear(Injection::Crystal);
    assert_eq!(host.reset(ResetCause::Pin)?.chip.clock, ClockSource::Crystal);
    Ok(())
}

#[test]
fn a_crystal_that_stops_opens_the_bridge_at_once_and_is_a_named_fault() -> Outcome {
    let mut host = moving()?;
    host.board.inject(Injection::Crystal);
    // The break input of the timer needs no instruction.
    assert_eq!(host.board.pwm().duty, None);
    let opening = until_open(&mut host, 1e-3)?;
    assert!(opening.after_s < 1e-4, "{opening:?}");
    let greeting = host.await_reset(1, 0.3)?;
    assert_eq!((greeting.boot, greeting.chip.clock), (Boot::Software, ClockSource::Internal));
    let status = host.status()?;
    assert_eq!(
        (status.state, status.fault.map(|record| record.fault)),
        (State::Fault, Some(Fault::ClockFailed))
    );
    Ok(())
}
