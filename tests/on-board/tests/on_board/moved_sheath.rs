//! Sheaths that are moved while the joint runs: followed without a fault, and no cover for a channel that lies.

use std::f64::consts::{PI, TAU};

use bowden_board::{Injection, TensionAt};
use bowden_link::Fault;
use bowden_link::message::Mode;
use bowden_on_board_tests::host::Host;
use bowden_on_board_tests::trial::{SheathCourse, Trial, error_of, sine, torque_error};
use bowden_on_board_tests::{Outcome, fail, image};

/// Time of the motion from pi to 2 pi and back \[s\].
const MOTION_S: f64 = 4.0;

/// Wrap angles of both sheaths: from pi to 2 pi and back, smoothly, again and again.
fn moved(t_s: f64) -> [f64; 2] {
    [PI + 0.5 * PI * (1.0 - (TAU * t_s / MOTION_S).cos()); 2]
}

fn trial() -> Trial {
    let mut trial = Trial::new(Mode::Torque, sine(0.3, 0.5), MOTION_S);
    trial.sheaths = Some(SheathCourse::Along(moved));
    trial
}

#[test]
fn the_torque_is_held_while_the_sheaths_go_from_pi_to_two_pi_and_back() -> Outcome {
    let trial = trial();
    let natively = error_of(&trial.natively()?, torque_error);
    let on_image = error_of(&trial.on_image(&image::firmware()?)?, torque_error);
    println!("natively {natively:.4?}, on the image {on_image:.4?} N·m");
    assert!((on_image.rms - natively.rms).abs() < 0.2 * natively.rms, "{on_image:?}, natively {natively:?}");
    assert!(on_image.largest < 1.3 * natively.largest, "{on_image:?}, natively {natively:?}");
    Ok(())
}

/// Runs half a motion, so that the sheaths are at 2 pi, then breaks a channel; the fault within `limit_s`.
fn broken(injection: Injection, limit_s: f64) -> Outcome<(Fault, f64)> {
    let mut trial = trial();
    (trial.settle_s, trial.measured_s) = (0.1, 0.5 * MOTION_S);
    let mut host: Host = trial.prepared(&image::firmware()?)?;
    trial.follow(&mut host)?;
    host.board.inject(injection);
    let broken_s = host.board.time_s();
    // The sheaths go on.
    while host.board.pwm().duty.is_some() {
        let t_s = host.board.time_s() - broken_s;
        if t_s > limit_s {
            return fail(format!("{injection:?}: the bridge is on after {limit_s} s"));
        }
        host.board.set_wrap_angle_rad(moved(0.5 * MOTION_S + t_s))?;
        host.run(1e-3)?;
    }
    let after_s = host.board.time_s() - broken_s;
    let record = host.await_fault(0.2)?;
    println!("{injection:?}: {record}, {after_s:.3} s");
    Ok((record.fault, after_s))
}

#[test]
fn channels_that_are_swapped_or_stuck_are_found_while_the_sheaths_move() -> Outcome {
    for injection in [
        Injection::TensionSwapped(TensionAt::F1, TensionAt::F3),
        Injection::TensionSwapped(TensionAt::F2, TensionAt::F4),
        Injection::TensionStuck(TensionAt::F1),
        Injection::TensionStuck(TensionAt::F2),
    ] {
        let (fault, _) = broken(injection, 3.0)?;
        assert!(
            matches!(
                fault,
                Fault::TensionInconsistent
                    | Fault::StretchInconsistent
                    | Fault::Slack
                    | Fault::OverTension
                    | Fault::TensionStuck
                    | Fault::TensionSwapped
            ),
            "{injection:?}: {fault:?}"
        );
    }
    Ok(())
}
