//! Motor and encoders that are mounted the other way round: told to the board, the joint works; not told, it stops.

use bowden_board::{Board, EncoderAt, EncoderMounting, EncoderPart};
use bowden_link::message::{Goal, Mode};
use bowden_link::{Fault, State, ToBoard};
use bowden_on_board_tests::host::Host;
use bowden_on_board_tests::trial::{Trial, angle_error, error_of, sine};
use bowden_on_board_tests::{Outcome, fail, image};

/// What is the other way round: motor, encoder at the input pulley, encoder at the joint.
type Reversed = [bool; 3];

/// All ways to mount them, the usual one first.
fn all() -> impl Iterator<Item = Reversed> {
    (0..8).map(|bits| [bits & 1 != 0, bits & 2 != 0, bits & 4 != 0])
}

fn board(reversed: Reversed) -> Outcome<Board> {
    let [motor, input, joint] = reversed;
    let mounting =
        |count_at_zero, reversed| EncoderMounting { part: EncoderPart::Amt22, count_at_zero, reversed };
    let elf = image::firmware()?;
    Ok(Board::builder(&elf)
        .motor_reversed(motor)
        .encoder(EncoderAt::Input, mounting(1000, input))
        .encoder(EncoderAt::Joint, mounting(2000, joint))
        .build()?)
}

/// The run of every board here, with these directions in its parameters.
fn trial(told: Reversed) -> Trial {
    let mut trial = Trial::new(Mode::Position, sine(0.3, 1.0), 1.0);
    trial.settle_s = 0.6;
    let sign = |reversed: bool| if reversed { -1.0 } else { 1.0 };
    trial.parameters.bridge.direction = sign(told[0]);
    trial.parameters.encoder.input.direction = sign(told[1]);
    trial.parameters.encoder.joint.direction = sign(told[2]);
    trial
}

#[test]
fn a_joint_that_knows_its_directions_homes_and_follows() -> Outcome {
    let natively = error_of(&trial([false; 3]).natively()?, angle_error);
    for reversed in [
        [true, false, false],
        [false, true, false],
        [false, false, true],
        [false, true, true],
        [true, true, true],
    ] {
        let trial = trial(reversed);
        let mut host = trial.make_ready(Host::connect(board(reversed)?)?)?;
        let angle_rad = host.board.bench().theta_out_rad();
        assert!(angle_rad.abs() < 0.03, "{reversed:?}: {angle_rad} rad after homing");
        let on_image = error_of(&trial.follow(&mut host)?, angle_error);
        println!("{reversed:?}: natively {natively:.5?}, on the image {on_image:.5?} rad");
        assert!((on_image.rms - natively.rms).abs() < 0.2 * natively.rms, "{reversed:?}: {on_image:?}");
    }
    Ok(())
}

/// What stopped a joint whose wiring contradicts its parameters.
#[derive(Debug)]
struct Stopped {
    fault: Fault,
    after_s: f64,
    /// How far the arm came \[rad\].
    farthest_rad: f64,
}

/// Lets a board with these directions, which knows nothing of them, follow the reference until it is stopped.
fn contradicted(reversed: Reversed) -> Outcome<Stopped> {
    let mut host = Host::connect(board(reversed)?)?;
    host.make_ready()?;
    host.order(&ToBoard::SetReference(sine(0.3, 0.5)))?;
    host.order(&ToBoard::Enter(Goal::Run(Mode::Position)))?;
    let start_s = host.board.time_s();
    let mut farthest_rad = 0.0_f64;
    while host.status()?.state != State::Fault {
        if host.board.time_s() > start_s + 2.0 {
            return fail(format!("{reversed:?}: no fault within 2 s"));
        }
        host.run(1e-3)?;
        farthest_rad = farthest_rad.max(host.board.bench().theta_out_rad().abs());
    }
    let after_s = host.board.time_s() - start_s;
    let record = host.await_fault(0.1)?;
    assert_eq!(host.board.pwm().duty, None, "{reversed:?}: motor off");
    println!("{reversed:?}: {record}, {after_s:.3} s, {farthest_rad:.3} rad");
    Ok(Stopped { fault: record.fault, after_s, farthest_rad })
}

/// The range of the joint is 0.87 rad; the reference goes to 0.3 rad.
#[test]
fn wiring_that_contradicts_the_parameters_stops_the_joint_before_it_runs_away() -> Outcome {
    for reversed in all().skip(1) {
        let stopped = contradicted(reversed)?;
        assert!(
            matches!(stopped.fault, Fault::Slack | Fault::StretchInconsistent),
            "{reversed:?}: {stopped:?}"
        );
        assert!(stopped.farthest_rad < 0.5 && stopped.after_s < 0.7, "{reversed:?}: {stopped:?}");
    }
    Ok(())
}
