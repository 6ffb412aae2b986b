//! `bowden calibrate` against the release image: somebody at the bench does what it asks for.

use bowden_board::{Board, EncoderAt, EncoderMounting, EncoderPart, Injection, TensionAt};
use bowden_on_board_tests::tool::{Plugged, Ran};
use bowden_on_board_tests::{Outcome, fail, image};

/// Mass of the weight that is hung on f2 \[kg\], and what it weighs on the virtual bench \[N\].
const MASS: &str = "4";
const WEIGHT_N: f64 = 4.0 * 9.81;

/// Does what a question asks for, at the bench, and answers it.
fn person(question: &str, board: &mut Board, weighed: &mut bool) -> Option<String> {
    let bench = board.by_hand();
    let cell = |text: &str| {
        text.chars().next().and_then(|digit| digit.to_digit(10)).map_or(0, |cell| cell as usize - 1)
    };
    let cell = question.split("load cell f").nth(1).map_or(0, cell);
    let load = |load_n: f64| {
        let mut loads_n = [0.0; 4];
        loads_n[cell] = load_n;
        loads_n
    };
    let answer = if question.starts_with("Take both tendons off") {
        bench.set_tendons_fitted(false);
        ""
    } else if question.starts_with("Fit both tendons") {
        bench.set_tendons_fitted(true);
        ""
    } else if question.contains("pull at load cell") {
        bench.set_cell_load_n(load(12.0));
        ""
    } else if question.starts_with("Let go") || question.starts_with("Take the weight off") {
        bench.set_cell_load_n([0.0; 4]);
        bench.hold_input(None);
        bench.hold_arm(Some(0.0));
        ""
    } else if question.starts_with("Which load cell") {
        if std::mem::replace(weighed, true) { "done" } else { "f2" }
    } else if question.starts_with("Mass of the weight") {
        MASS
    } else if question.starts_with("Hang") {
        bench.set_cell_load_n(load(WEIGHT_N));
        ""
    } else if question.contains("turn the input pulley alone") {
        bench.hold_input(Some(0.5));
        ""
    } else if question.contains("turn the joint alone") {
        bench.hold_arm(Some(0.5));
        ""
    } else if question.starts_with("Set these") || question.starts_with("Store") {
        "yes"
    } else if question.starts_with("Signed off") {
        "Ada"
    } else if question.starts_with("Switch the supply") {
        ""
    } else {
        return None;
    };
    Some(answer.to_owned())
}

fn calibrate(board: &mut Plugged, file: &str) -> Outcome<Ran> {
    let mut weighed = false;
    board.converse("calibrate", &["--out", file], |question, board| person(question, board, &mut weighed))
}

#[test]
fn a_board_that_knows_nothing_of_its_wires_is_calibrated() -> Outcome {
    let folder = tempfile::tempdir().expect("a folder");
    let file = folder.path().join("calibration.toml").to_string_lossy().into_owned();
    let mounting =
        |count_at_zero, reversed| EncoderMounting { part: EncoderPart::Amt22, count_at_zero, reversed };
    let board = Board::builder(&image::firmware()?)
        .motor_reversed(true)
        .encoder(EncoderAt::Input, mounting(300, true))
        .encoder(EncoderAt::Joint, mounting(3500, false))
        .build()?;
    let mut board = Plugged::new(board)?;
    let ran = calibrate(&mut board, &file)?;
    if ran.status != Some(0) {
        return fail(format!("{ran:?}"));
    }
    assert_eq!(board.board.pwm().duty, None, "off at the end");
    // It is stored: the board has it after a power cut.
    board.board.power_cycle()?;
    board.board.run_until("device gone", |board| !board.usb_ready(), 0.1)?;
    board.board.run_until("USB port", |board| board.usb_ready(), 1.0)?;
    let list = board.run("params", &[])?.output;
    let value = |name: &str| {
        let line = list.lines().find(|line| line.starts_with(&format!("{name} "))).unwrap_or_default();
        line.split_whitespace().nth(1).and_then(|value| value.parse::<f64>().ok()).unwrap_or(f64::NAN)
    };
    let found = ["bridge.direction", "encoder.input.direction", "encoder.joint.direction"].map(value);
    assert_eq!(found, [-1.0, -1.0, 1.0], "{list}");
    assert_eq!(["encoder.input.zero", "encoder.joint.zero"].map(value), [300.0, 3500.0], "{list}");
    // 23 mV/N behind 3.3 V in 4095 steps; 9.80665 of the tool against 9.81 of the bench are 3.4e-4.
    let gain = 3.3 / 4095.0 / 0.023;
    assert!((value("tension.f2.gain") / gain - 1.0).abs() < 1.5e-3, "{list}");
    // 2 ohm, and what one amplifier's 12-bit steps leave over 0.1 A.
    assert!((value("motor.resistance") - 2.0).abs() < 0.2, "{list}");
    Ok(())
}

#[test]
fn exchanged_load_cells_are_named() -> Outcome {
    let folder = tempfile::tempdir().expect("a folder");
    let file = folder.path().join("calibration.toml").to_string_lossy().into_owned();
    let mut board = Plugged::new(Board::builder(&image::firmware()?).build()?)?;
    board.board.inject(Injection::TensionSwapped(TensionAt::F2, TensionAt::F4));
    let ran = calibrate(&mut board, &file)?;
    assert_eq!(ran.status, Some(1), "{ran:?}");
    let expected = "load cell f2 is plugged into input f4, load cell f4 is plugged into input f2; correct the wires at the board";
    assert!(ran.errors.contains(expected), "{ran:?}");
    Ok(())
}
