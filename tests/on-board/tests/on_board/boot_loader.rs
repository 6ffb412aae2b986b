//! The way from the firmware into the processor's boot loader.

use bowden_board::{Board, ResetCause};
use bowden_link::message::{Goal, Refusal};
use bowden_link::{FromBoard, State, ToBoard};
use bowden_on_board_tests::tool::Plugged;
use bowden_on_board_tests::{Outcome, image};

use crate::stop::moving;
use crate::switched_on;

/// The bridge has no timer that runs and no output, the gate driver sleeps.
pub fn assert_bridge_locked(board: &Board) {
    let pwm = board.pwm();
    assert_eq!((pwm.duty, pwm.main_output, pwm.enabled), (None, false, false));
}

#[test]
fn the_boot_loader_is_entered_with_the_bridge_locked_from_request_to_reset() -> Outcome {
    let mut host = switched_on(1)?;
    host.make_ready()?;
    host.order(&ToBoard::Enter(Goal::Off))?;
    host.reach(State::Off, 0.01)?;
    assert_eq!(host.ask(&ToBoard::EnterBootLoader)?, FromBoard::Done);
    let board = &mut host.board;
    let end_s = board.time_s() + 0.05;
    while !board.is_in_boot_loader() {
        assert_eq!(board.pwm().duty, None);
        assert!(board.time_s() < end_s, "still in the firmware");
        board.run_for(20e-6)?;
    }
    assert_bridge_locked(board);
    // It stays there: no interrupt is on, and the watchdog of the run before does not bite.
    board.run_for(0.5)?;
    assert!(board.is_in_boot_loader() && !board.usb_ready());
    assert_bridge_locked(board);
    assert_eq!(board.counters().boots, 2);
    // The word that led there is forgotten: the next reset starts the firmware, with no fault and no restart counted.
    let greeting = host.reset(ResetCause::Pin)?;
    assert_eq!((greeting.chip.restarts, host.status()?.fault), (0, None));
    host.make_ready()
}

#[test]
fn a_joint_that_moves_keeps_its_firmware() -> Outcome {
    let mut host = moving()?;
    assert_eq!(host.ask(&ToBoard::EnterBootLoader)?, FromBoard::Refused(Refusal::WrongState(State::Run)));
    host.run(0.1)?;
    assert_eq!((host.status()?.state, host.board.counters().boots), (State::Run, 1));
    Ok(())
}

#[test]
fn the_tool_sends_a_board_there() -> Outcome {
    let mut board = Plugged::new(Board::builder(&image::firmware()?).build()?)?;
    let ran = board.run("send", &["boot-loader"])?;
    assert_eq!((ran.status, ran.errors.as_str()), (Some(0), ""));
    assert!(ran.output.starts_with("the board is in its boot loader"), "{}", ran.output);
    board.board.run_for(0.05)?;
    assert!(board.board.is_in_boot_loader());
    assert_bridge_locked(&board.board);
    Ok(())
}
