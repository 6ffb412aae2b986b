//! `bowden run` against the release image: a plan is carried out, and not again.

use std::fs;

use bowden_board::Board;
use bowden_core::recording::{ReadOptions, Recording};
use bowden_on_board_tests::tool::Plugged;
use bowden_on_board_tests::{Outcome, image};
use serde_json::Value;
use virtual_bench::nominal_rig_toml;

const PLAN: &str = r#"schema = "bowden-plan/1"
name = "weekly"

[limits]
angle_rad = 0.4

[[step]]
kind = "home"

[[step]]
kind = "pause"
seconds = 0.2

[[step]]
kind = "follow"
reference = "sine"
amplitude = 0.2
frequency_hz = 1.0
seconds = 1.0
repeat = 2
"#;

#[test]
fn a_plan_is_carried_out_on_the_board_once() -> Outcome {
    let folder = tempfile::tempdir().expect("a folder");
    let place = folder.path();
    fs::write(place.join("plan.toml"), PLAN).expect("a file");
    let mut board = Plugged::new(Board::builder(&image::firmware()?).build()?)?;
    let port = board.port();
    let line = ["run", "--quiet", "plan.toml", "--out", "out", "--note", "new tendon", "--load", "2.5,0.03"];
    let line = [&line[..], &["--port", &port, "--timeout", "600"]].concat();
    let first = board.run_in(place, &line)?;
    assert_eq!((first.status, first.errors.as_str()), (Some(0), ""), "{}", first.output);
    assert_eq!(board.board.pwm().duty, None, "off at the end");

    let read = |name: &str| fs::read_to_string(place.join("out").join(name)).expect("a file");
    let ledger: Value = serde_json::from_str(&read("run.json")).expect("JSON");
    let done: Vec<(&str, u64)> = ledger["done"]
        .as_array()
        .expect("steps")
        .iter()
        .map(|done| (done["name"].as_str().unwrap_or_default(), done["rows"].as_u64().unwrap_or_default()))
        .collect();
    let steps = ["01-home", "02-pause", "03-sine-1", "04-sine-2"];
    assert_eq!(done, [(steps[0], 0), (steps[1], 0), (steps[2], 10_000), (steps[3], 10_000)]);
    assert!(ledger["board"].as_str().is_some_and(|board| board.starts_with("nucleo-g474re")), "{ledger}");
    assert_eq!(read("summary.txt"), first.output);
    assert!(first.output.starts_with("weekly: 4 steps done\n"), "{}", first.output);
    let files: Vec<Vec<u8>> = steps[2..]
        .iter()
        .map(|step| {
            let path = place.join(format!("out/{step}.mcap"));
            let recording = Recording::load(&path, &ReadOptions::default()).expect("a recording");
            let said = |name| recording.metadata().entry("bowden.recording", name);
            assert_eq!(
                (said("plan"), said("plan_step"), said("note")),
                (Some(PLAN), Some(*step), Some("new tendon"))
            );
            assert!(said("rig").is_some_and(|rig| rig.contains("\nmass_kg = 2.5\n")), "{:?}", said("rig"));
            assert!(recording.t_s().windows(2).all(|pair| (pair[1] - pair[0] - 1e-4).abs() < 1e-8), "{step}");
            // A period of the sine from rest; the board limits the acceleration of its first quarter.
            let joint = recording.channels().find(|channel| channel.role() == "theta_out_rad");
            let angles = joint.and_then(|joint| recording.channel(joint)).expect("the joint");
            let (low, high) = angles
                .iter()
                .fold((0.0_f64, 0.0_f64), |(low, high), angle| (low.min(*angle), high.max(*angle)));
            assert!(
                (-0.24..-0.16).contains(&low) && (0.1..0.24).contains(&high),
                "{step}: {low} to {high} rad"
            );
            fs::read(path).expect("a file")
        })
        .collect();

    // Nothing is left to do: the bridge is never on.
    let mut driven = 0;
    let second =
        board.run_in_beside(place, &line, |board| driven += usize::from(board.pwm().duty.is_some()))?;
    assert_eq!((second.status, second.errors.as_str(), driven), (Some(0), "", 0), "{}", second.output);
    assert!(
        second.output.starts_with("weekly: 4 steps done, 4 of them before this start\n"),
        "{}",
        second.output
    );
    for (step, file) in steps[2..].iter().zip(&files) {
        assert!(fs::read(place.join(format!("out/{step}.mcap"))).expect("a file") == *file, "{step}");
    }
    Ok(())
}

#[test]
fn an_excitation_for_the_rig_is_carried_out_on_the_board() -> Outcome {
    let folder = tempfile::tempdir().expect("a folder");
    let place = folder.path();
    let plan = "schema = \"bowden-plan/1\"\n[limits]\nangle_rad = 0.3\n[[step]]\nkind = \"home\"\n";
    // The shortest: three motions of two seconds.
    let excite = "[[step]]\nkind = \"excite\"\nrig = \"rig.toml\"\nseconds = 6.0\n";
    fs::write(place.join("plan.toml"), [plan, excite].concat()).expect("a file");
    fs::write(place.join("rig.toml"), nominal_rig_toml("bench")).expect("a file");
    let mut board = Plugged::new(Board::builder(&image::firmware()?).build()?)?;
    let port = board.port();
    let line = ["run", "--quiet", "plan.toml", "--out", "out", "--port", &port, "--timeout", "600", "--json"];
    let listed = board.run_in(place, &[&line[..], &["--dry-run"]].concat())?;
    assert_eq!((listed.status, listed.errors.as_str()), (Some(0), ""));
    let mut largest = 0.0_f64;
    let ran = board.run_in_beside(place, &line, |board| {
        largest = largest.max(board.bench().theta_out_rad().abs());
    })?;
    assert_eq!((ran.status, ran.errors.as_str()), (Some(0), ""), "{}", ran.output);
    assert_eq!(board.board.pwm().duty, None, "off at the end");
    // The joint has moved, and stayed where the plan allows it to be, by the bench's own angle.
    assert!((0.15..0.33).contains(&largest), "{largest} rad");

    let [listed, ran] =
        [listed.output, ran.output].map(|text| serde_json::from_str::<Value>(&text).expect("JSON"));
    let names = |told: &Value| -> Vec<String> {
        let steps = told["steps"].as_array().expect("steps");
        steps.iter().map(|step| step["name"].as_str().expect("a name").to_owned()).collect()
    };
    assert_eq!((names(&listed), names(&ran).len()), (names(&ran), 4), "{ran}");
    for step in ran["steps"].as_array().expect("steps").iter().skip(1) {
        let file = step["file"].as_str().expect("a file");
        assert!(file.contains("-excite-") && step["loss"].is_null(), "{step}");
        let recording =
            Recording::load(&place.join("out").join(file), &ReadOptions::default()).expect("a recording");
        assert_eq!((step["rows"].as_u64(), recording.len()), (Some(20_000), 20_000), "{step}");
    }
    Ok(())
}
