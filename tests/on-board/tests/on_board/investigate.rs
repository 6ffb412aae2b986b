//! `bowden investigate` in a terminal: the whole round on the emulated board, and its plug pulled in the middle.

use std::fs;
use std::path::Path;

use bowden_board::Board;
use bowden_on_board_tests::tool::Plugged;
use bowden_on_board_tests::{Outcome, image};
use serde_json::Value;
use virtual_bench::{BenchConfig, ConcealedEffect, nominal_rig_toml};

use crate::monitor::{await_all, in_terminal};
use crate::screen::Screen;

/// A motor that conceals dry friction, on a board with the port `port` in `place`, where the rig file of a bench without it is.
fn with_friction(place: &Path) -> Outcome<Plugged> {
    fs::write(place.join("rig.toml"), nominal_rig_toml("bench")).expect("a file");
    let friction = ConcealedEffect::drawn("motor_coulomb_friction", 1.0, 3).expect("friction");
    let board =
        Board::builder(&image::firmware()?).bench(&BenchConfig::default(), &[friction]).seed(3).build()?;
    Plugged::linked(board, place.join("port"))
}

/// Starts an investigation that is as short as it may be, up to the question before the joint moves.
fn begun(board: &mut Plugged, place: &Path) -> Outcome<Screen> {
    let line = ["investigate", "--port", "port", "--timeout", "600", "--rig", "rig.toml", "--out", "out"];
    let mut screen = in_terminal(place, &[&line[..], &["--angle", "0.4", "--time", "42"]].concat())?;
    let asked = ["Move the joint along these references? [y/N]", "limits of the references: angle -0.4"];
    await_all(board, &mut screen, &asked);
    assert!(!place.join("out").exists() && board.board.pwm().duty.is_none());
    Ok(screen)
}

fn result(place: &Path) -> Value {
    let text = fs::read_to_string(place.join("out/investigation.json")).expect("a result");
    serde_json::from_str(&text).expect("JSON")
}

#[test]
fn friction_is_found_and_made_up_for_on_the_board() -> Outcome {
    let folder = tempfile::tempdir().expect("a folder");
    let place = folder.path();
    let mut board = with_friction(place)?;
    let mut screen = begun(&mut board, place)?;
    screen.press("y\r");
    await_all(&mut board, &mut screen, &["on the board? [y/N]"]);
    screen.press("y\r");
    board.attend("the end", || screen.has_ended())?;
    let (status, errors) = screen.end();
    assert_eq!((status, board.board.pwm().duty), (0, None), "{errors}{}", screen.text());

    let result = result(place);
    let diagnosis = &result["rounds"][0]["diagnosis"];
    assert_eq!(diagnosis["verdict"], "missing_physics", "{diagnosis}");
    assert_eq!(diagnosis["effects"][0]["id"], "motor_coulomb_friction", "{diagnosis}");
    let verification = &result["verification"];
    let [before, after] =
        ["before_rms_rad", "after_rms_rad"].map(|key| verification[key].as_f64().unwrap_or(f64::NAN));
    assert!(after < 0.6 * before, "{verification}");
    assert_eq!(result["parameters"]["state"], "set", "{}", result["parameters"]);
    // What it says it has set is what the board has.
    for change in result["parameters"]["changes"].as_array().expect("changes") {
        let name = change["parameter"].as_str().expect("a name");
        let shown = board.run_in(place, &["params", "--port", "port", "--timeout", "600", "get", name])?;
        let value = format!("{}", change["new"].as_f64().expect("a number") as f32);
        assert!(shown.output.contains(&value), "{name}: {value}, {}", shown.output);
    }
    Ok(())
}

#[test]
fn a_pulled_plug_ends_an_investigation_with_what_was_recorded_kept() -> Outcome {
    let folder = tempfile::tempdir().expect("a folder");
    let place = folder.path();
    let mut board = with_friction(place)?;
    let mut screen = begun(&mut board, place)?;
    screen.press("y\r");
    let path = place.join("out/train-1-multisine.csv");
    let long = || fs::metadata(&path).is_ok_and(|file| file.len() > 50_000);
    board.attend("rows", || long() || screen.has_ended())?;
    assert!(board.board.pwm().duty.is_some(), "it moves");
    board.unplug();
    board.board.run_for(0.7)?;
    assert_eq!(board.board.pwm().duty, None, "nobody is there");
    board.attend("the end", || screen.has_ended())?;
    let (status, errors) = screen.end();
    assert_eq!((status, errors.lines().count()), (1, 1), "{errors}");
    assert!(errors.starts_with("bowden: port: ") && errors.contains("check cable and supply"), "{errors}");
    assert!(errors.ends_with("what was recorded is kept in out\n"), "{errors}");
    let result = result(place);
    assert_eq!(result["recordings"][0]["file"], "train-1-multisine.csv", "{}", result["recordings"]);
    assert_eq!(result["recordings"][0]["complete"], false);
    assert!(result["stopped"].as_str().is_some_and(|why| why.contains("check cable and supply")), "{result}");
    assert!(place.join("out/investigate.html").exists());
    Ok(())
}
