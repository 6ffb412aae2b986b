//! The firmware closes the loop around the virtual bench.

use bowden_link::State;
use bowden_on_board_tests::Outcome;
use bowden_on_board_tests::course::{LoopError, follow_truth};
use bowden_link::ToBoard;

use crate::{SINE, ready};

/// From power-on: self test, pretension check, homing, 1.25 s to settle, then 10 s of a sine with every tick's sample.
fn sine(source: f32) -> Outcome<LoopError> {
    let mut host = ready(1)?;
    host.set("compensator.source", source)?;
    host.home()?;
    assert!(host.board.bench().theta_out_rad().abs() < 0.03, "{} rad", host.board.bench().theta_out_rad());
    host.order(ToBoard::Telemetry(true))?;
    host.follow(SINE)?;
    host.run(1.25)?;
    host.telemetry.take();
    let before = host.telemetry.received;
    let errors = follow_truth(&mut host, 10.0)?;
    println!("source {source}: {errors:?}");
    assert_eq!(host.status()?.state, State::Run);
    let telemetry = &host.telemetry;
    assert_eq!((telemetry.missing, telemetry.disordered, telemetry.lost), (0, 0, 0));
    assert!(telemetry.received - before >= 100_000, "{} samples", telemetry.received - before);
    assert_eq!((host.bad_frames, host.lost_frames), (0, 0));
    assert!(errors.looks >= 9_990, "{errors:?}");
    Ok(errors)
}

#[test]
fn ten_seconds_without_compensation() -> Outcome {
    sine(0.0).map(|_| ())
}

#[test]
fn ten_seconds_with_the_lag_from_the_torque() -> Outcome {
    sine(1.0).map(|_| ())
}

#[test]
fn ten_seconds_with_the_lag_from_the_encoders() -> Outcome {
    sine(2.0).map(|_| ())
}
