//! The firmware closes the loop around the virtual bench.

use bowden_link::State;
use bowden_link::ToBoard;
use bowden_on_board_tests::Outcome;
use bowden_on_board_tests::course::{LoopError, follow_truth};

use crate::{SINE, ready};

/// From power-on: self test, pretension check, homing, 1.25 s to settle, then 10 s of a sine with every tick's sample.
fn sine(source: f32) -> Outcome<LoopError> {
    let mut host = ready(1)?;
    host.set("compensator.source", source)?;
    host.home()?;
    assert!(host.board.bench().theta_out_rad().abs() < 0.03, "{} rad", host.board.bench().theta_out_rad());
    host.order(&ToBoard::Telemetry(true))?;
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

fn within_fifth(value: f64, measured: f64) -> bool {
    (value - measured).abs() <= 0.2 * measured
}

#[test]
fn without_compensation_the_joint_lags_as_the_theory_says() -> Outcome {
    let errors = sine(0.0)?;
    // By hand: 0.0301 rad/(N·m)·T_out ± 5.11 mrad, T_out = 0.736 sin θ up to 0.353 N·m: 15.7 mrad at most, RMS 9.3 mrad.
    assert!((errors.rms_rad - 9.3e-3).abs() < 0.5e-3, "{errors:?}");
    assert!((errors.largest_rad - 15.7e-3).abs() < 0.5e-3, "{errors:?}");
    Ok(())
}

/// As measured, 20 % up or down, so that a change for better or worse is noticed.
#[test]
fn the_lag_from_the_torque_is_compensated() -> Outcome {
    let errors = sine(1.0)?;
    assert!(within_fifth(errors.rms_rad, 0.71e-3) && errors.largest_rad < 4.5e-3, "{errors:?}");
    Ok(())
}

#[test]
fn the_lag_from_the_encoders_is_compensated() -> Outcome {
    let errors = sine(2.0)?;
    assert!(within_fifth(errors.rms_rad, 2.72e-3) && errors.largest_rad < 11e-3, "{errors:?}");
    Ok(())
}
