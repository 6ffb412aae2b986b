//! The host tool talks to the emulated board over a pseudo terminal, as it talks to a board.

use std::fs;
use std::path::PathBuf;

use bowden_board::{Board, Injection, Rail, TensionAt};
use bowden_on_board_tests::tool::{Plugged, Ran};
use bowden_on_board_tests::{Outcome, fail, image};

/// A folder of this test's own, removed at the end.
struct Scratch(PathBuf);

impl Scratch {
    fn new(name: &str) -> Self {
        let path = std::env::temp_dir().join(format!("bowden-on-board-{}-{name}", std::process::id()));
        fs::create_dir_all(&path).expect("a folder");
        Self(path)
    }

    fn file(&self, name: &str) -> String {
        self.0.join(name).to_string_lossy().into_owned()
    }
}

impl Drop for Scratch {
    fn drop(&mut self) {
        // A folder that is left behind does no harm.
        let _ = fs::remove_dir_all(&self.0);
    }
}

fn plugged() -> Outcome<Plugged> {
    Plugged::new(Board::builder(&image::firmware()?).build()?)
}

/// The output of a run that has to succeed.
fn good(ran: Ran) -> Outcome<String> {
    if ran.status == Some(0) { Ok(ran.output) } else { fail(format!("{ran:?}")) }
}

#[test]
fn parameters_are_listed_set_refused_and_stored() -> Outcome {
    let mut board = plugged()?;
    let list = good(board.run("params", &[])?)?;
    assert!(list.lines().count() >= 85 && list.contains("tendon.pretension"), "{list}");
    good(board.run("params", &["set", "tendon.pretension=31.5"])?)?;
    let one = good(board.run("params", &["get", "tendon.pretension"])?)?;
    assert!(one.contains("31.5"), "{one}");
    let refused = board.run("params", &["set", "tendon.pretension=5000"])?;
    assert_eq!(refused.status, Some(2), "{refused:?}");
    assert!(refused.errors.contains("5000") && refused.errors.contains("1000"), "{refused:?}");
    let operations = board.board.flash_operations();
    good(board.run("params", &["store"])?)?;
    assert!(board.board.flash_operations() > operations);
    board.board.power_cycle()?;
    board.board.run_until("device gone", |board| !board.usb_ready(), 0.1)?;
    board.board.run_until("USB port", |board| board.usb_ready(), 1.0)?;
    let one = good(board.run("params", &["get", "tendon.pretension"])?)?;
    assert!(one.contains("31.5"), "{one}");
    Ok(())
}

#[test]
fn a_ripple_table_is_written_stored_saved_and_cleared() -> Outcome {
    let scratch = Scratch::new("table");
    let (file, saved) = (scratch.file("ripple.csv"), scratch.file("saved.csv"));
    let rows = (0..40).map(|row| {
        let angle_rad = 0.011 * f64::from(row);
        format!("{angle_rad},{}", 0.2 * (14.0 * angle_rad).sin())
    });
    let lines: Vec<String> = std::iter::once("angle_rad,torque_nm".to_owned()).chain(rows).collect();
    fs::write(&file, lines.join("\n")).expect("a file");
    let mut board = plugged()?;
    assert_eq!(good(board.run("params", &["table"])?)?, "no ripple table\n");
    let written = good(board.run("params", &["table", &file, "--period", "0.4488"])?)?;
    assert!(
        written.starts_with("ripple table: 256 points over 0.448800 rad, 14.000 periods a turn"),
        "{written}"
    );
    good(board.run("params", &["store"])?)?;
    board.board.power_cycle()?;
    board.board.run_until("device gone", |board| !board.usb_ready(), 0.1)?;
    board.board.run_until("USB port", |board| board.usb_ready(), 1.0)?;
    let shown = good(board.run("params", &["table"])?)?;
    assert!(written.starts_with(&shown), "{shown} behind {written}");
    // What is saved makes the same table again.
    good(board.run("params", &["table", "--save", &saved])?)?;
    let first =
        fs::read_to_string(&saved).expect("the saved file").lines().next().unwrap_or_default().to_owned();
    let period = first.split_whitespace().last().unwrap_or_default().to_owned();
    let again = good(board.run("params", &["table", &saved, "--period", &period, "--dry-run"])?)?;
    assert!(again.starts_with(&shown), "{again} behind {shown}");
    good(board.run("params", &["table", "--clear"])?)?;
    assert_eq!(good(board.run("params", &["table"])?)?, "no ripple table\n");
    Ok(())
}

#[test]
fn a_run_is_recorded_without_a_gap_and_a_fault_is_told_in_words() -> Outcome {
    let scratch = Scratch::new("record");
    let (recording, snapshot) = (scratch.file("run.csv"), scratch.file("snapshot.csv"));
    let mut board = plugged()?;
    good(board.run("send", &["ready"])?)?;
    let course = ["--reference", "sine", "--amplitude", "0.3", "--frequency", "0.5"];
    good(board.run("send", &[&["run"][..], &course, &["--seconds", "0.5"]].concat())?)?;
    assert_eq!(board.board.pwm().duty, None, "off at the end");
    let arguments = [&["--home", "--out", &recording, "--seconds", "1.5"][..], &course].concat();
    good(board.run("record", &arguments)?)?;
    assert_eq!(board.board.pwm().duty, None, "off at the end");

    let text = fs::read_to_string(&recording).expect("a recording");
    let mut lines = text.lines().filter(|line| !line.starts_with('#'));
    let header: Vec<&str> = lines.next().expect("a header").split(',').collect();
    assert!(header.contains(&"encoder_in_count_raw") && header.contains(&"f4_raw"), "{header:?}");
    let column = header.iter().position(|name| *name == "t_s").expect("t_s");
    let times: Vec<f64> =
        lines.map(|line| line.split(',').nth(column).expect("t_s").parse().expect("a number")).collect();
    assert!(times.len() >= 15_000, "{} rows", times.len());
    for pair in times.windows(2) {
        assert!((pair[1] - pair[0] - 1e-4).abs() < 1e-8, "{pair:?}");
    }

    board.board.inject(Injection::TensionWire(TensionAt::F2, Rail::Low));
    let stopped = board.run("send", &["ready"])?;
    assert_eq!(stopped.status, Some(1), "{stopped:?}");
    let told = board.run("faults", &["--snapshot", &snapshot, "--clear"])?;
    assert!(told.output.contains("f2") && told.output.contains("rail"), "{told:?}");
    let rows = fs::read_to_string(&snapshot).expect("a snapshot");
    assert_eq!(rows.lines().filter(|line| !line.starts_with('#')).count(), 65, "header and 64 ticks");
    board.board.clear_all();
    good(board.run("send", &["ready"])?)?;
    Ok(())
}
