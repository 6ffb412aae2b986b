//! What the tool states for programs, as JSON, against what the board does.

use std::path::Path;

use bowden_board::{Board, Injection, Rail, TensionAt};
use bowden_core::recording::{ReadOptions, Recording};
use bowden_link::Fault;
use bowden_on_board_tests::tool::{Plugged, Ran, run_alone};
use bowden_on_board_tests::{Outcome, image};
use serde_json::{Value, json};

/// What a command stated, which has to succeed with nothing to say on standard error.
fn stated(ran: &Ran) -> Value {
    assert_eq!((ran.status, ran.errors.as_str()), (Some(0), ""), "{ran:?}");
    serde_json::from_str(&ran.output).expect("JSON")
}

/// The same of a command that needs no board.
fn stated_of(folder: &Path, line: &[&str]) -> Outcome<Value> {
    Ok(stated(&run_alone(folder, line)?))
}

#[test]
fn parameters_and_states_are_those_of_the_board() -> Outcome {
    let mut board = Plugged::new(Board::builder(&image::firmware()?).build()?)?;
    let all = stated(&board.run("params", &["--json"])?);
    let all = all.as_array().expect("a list");
    assert!(all.len() >= 85, "{}", all.len());
    for (index, parameter) in all.iter().enumerate() {
        assert_eq!(parameter["index"], index, "{parameter}");
        assert_eq!(parameter["value"], parameter["default"], "a new board: {parameter}");
    }
    let set = board.run("params", &["set", "tendon.pretension=31.5"])?;
    assert_eq!(set.status, Some(0), "{set:?}");
    let one = stated(&board.run("params", &["get", "tendon.pretension", "--json"])?);
    let expected = json!({ "name": "tendon.pretension", "unit": "N", "value": 31.5, "default": 30.0 });
    for (key, value) in expected.as_object().expect("an object") {
        assert_eq!(one[0][key], *value, "{one}");
    }

    assert_eq!(stated(&board.run("send", &["ready", "--json"])?), json!({ "state": "ready" }));
    let asked_s = board.board.time_s();
    let ready = stated(&board.run("faults", &["--json"])?);
    let answered_s = board.board.time_s();
    assert_eq!((&ready["state"], &ready["fault"]), (&json!("ready"), &json!(null)), "{ready}");
    assert_eq!((&ready["clock"], &ready["period_ns"]), (&json!("crystal"), &json!(100_000)), "{ready}");
    // Ticks are counted from the supply on; the first of them is 13 ms behind it. How long the tool takes is for the host to say.
    let told_s = ready["tick"].as_f64().expect("a number") * 1e-4;
    assert!(
        told_s > asked_s - 0.02 && told_s < answered_s,
        "{told_s} s, asked at {asked_s} s, answered by {answered_s} s"
    );

    board.board.inject(Injection::TensionWire(TensionAt::F2, Rail::Low));
    board.board.run_for(0.05)?;
    let stopped = stated(&board.run("faults", &["--json"])?);
    assert_eq!(stopped["state"], "fault", "{stopped}");
    let fault = &stopped["fault"];
    // The second tension of four; its input lies at 20 mV.
    let place = (&json!(Fault::TensionRail as u8), &json!(1));
    assert_eq!((&fault["number"], &fault["channel"]), place, "{fault}");
    assert!(fault["got"].as_f64().is_some_and(|got_v| (got_v - 0.02).abs() < 2e-3), "{fault}");
    assert_eq!(board.board.pwm().duty, None);
    Ok(())
}

#[test]
fn a_recording_and_what_is_computed_of_it_have_the_same_rows() -> Outcome {
    let folder = tempfile::tempdir().expect("a folder");
    let place = folder.path();
    let mut board = Plugged::new(Board::builder(&image::firmware()?).build()?)?;
    let record = board.arguments("record");
    let record: Vec<&str> = record.iter().map(String::as_str).collect();
    let how = ["--raw", "--home", "--json", "--out", "a.mcap"];
    let run = ["--reference", "sine", "--amplitude", "0.2", "--frequency", "1", "--seconds", "1"];
    let mut largest_rad = 0.0_f64;
    let recorded = board.run_in_beside(place, &[&record[..], &how, &run].concat(), |board| {
        largest_rad = largest_rad.max(board.bench().theta_out_rad());
    })?;
    let recorded = stated(&recorded);

    let recording = Recording::load(&place.join("a.mcap"), &ReadOptions::default()).expect("a recording");
    let rows = recording.len();
    let [start_s, end_s] = [0, rows - 1].map(|row| recording.t_s()[row]);
    assert!(rows > 10_000, "{rows} rows");
    let expected = json!({ "out": "a.mcap", "rows": rows, "tick_us": 100.0 });
    for (key, value) in expected.as_object().expect("an object") {
        assert_eq!(recorded[key], *value, "{recorded}");
    }
    let info = stated_of(place, &["info", "a.mcap", "--json"])?;
    let near = |value: &Value, expected: f64| (value.as_f64().expect("a number") - expected).abs() < 1e-9;
    assert!(info[0]["rows"] == rows && near(&info[0]["start_s"], start_s), "{}", info[0]["rows"]);
    assert_eq!((&info[0]["gaps"]["count"], &info[0]["findings"]), (&json!(0), &json!([])));
    let joint = info[0]["columns"]
        .as_array()
        .expect("columns")
        .iter()
        .find(|column| column["name"] == "theta_out_rad");
    let told_rad = joint.and_then(|column| column["range"][2].as_f64()).expect("the joint's range");
    // Two counts of the encoder; the bench's own angle is looked at every few milliseconds.
    assert!(largest_rad > 0.1 && (told_rad - largest_rad).abs() < 0.003, "{told_rad} rad, {largest_rad} rad");
    assert_eq!(stated_of(place, &["check", "a.mcap", "--json"])?[0]["rows"], rows);

    let computed = stated_of(place, &["replay-control", "a.mcap", "--json"])?;
    assert_eq!((&computed["difference"], &computed["gap_after_tick"]), (&json!(null), &json!(null)));
    // Ticks before the first whole set of raw inputs are not computed.
    let ticks = computed["ticks"].as_u64().expect("a number") as usize;
    assert!(ticks <= rows && ticks + 200 > rows, "{ticks} of {rows}");

    let recovered = stated_of(place, &["recover", "a.mcap", "--out", "b.mcap", "--json"])?;
    assert_eq!((&recovered["rows"], &recovered["missing"]), (&json!(rows), &json!([])));
    assert!(near(&recovered["span_s"][0], start_s) && near(&recovered["span_s"][1], end_s), "{recovered}");
    Ok(())
}
