//! Raw recordings of the emulated board, computed again by `bowden replay-control`.

use std::fmt::Write;
use std::path::Path;

use bowden_board::{Board, EncoderAt, Injection, Rail, TensionAt};
use bowden_on_board_tests::tool::{Plugged, Ran, run_alone};
use bowden_on_board_tests::{Outcome, image};

/// Runs `bowden replay-control` in `folder`.
fn replay(folder: &Path, recording: &str) -> Outcome<(Option<i32>, String, String)> {
    let Ran { status, output, errors } = run_alone(folder, &["replay-control", recording])?;
    Ok((status, output, errors))
}

/// Every tick from off over self test, homing and run to off, in two modes; then a changed recording.
#[test]
fn the_release_image_computes_what_this_machine_computes() -> Outcome {
    let folder = tempfile::tempdir().expect("a folder");
    let path = |name: &str| folder.path().join(name).to_string_lossy().into_owned();
    let mut board = Plugged::new(Board::builder(&image::firmware()?).seed(5).build()?)?;
    let csv = path("a.csv");
    let run = [
        "--raw",
        "--home",
        "--reference",
        "multisine",
        "--amplitude",
        "0.3",
        "--frequency",
        "0.5",
        "--seconds",
        "0.5",
        "--out",
        &csv,
    ];
    let ran = board.run("record", &run)?;
    assert_eq!((ran.status, ran.errors.as_str()), (Some(0), ""));
    let (status, stdout, stderr) = replay(folder.path(), "a.csv")?;
    assert_eq!((status, stderr.as_str()), (Some(0), ""), "{stdout}");
    assert!(stdout.contains("every output is the board's, bit for bit"), "{stdout}");
    let ticks: u32 = stdout.split(' ').nth(1).and_then(|word| word.parse().ok()).expect("a number");
    // Self test and pretension check of 0.1 s each, homing, and the run.
    assert!(ticks > 7000, "{stdout}");

    // The board goes on with another mode; its encoders have moved since power-on.
    let mcap = path("b.mcap");
    let run = [
        "--raw",
        "--mode",
        "torque",
        "--reference",
        "sine",
        "--amplitude",
        "0.2",
        "--frequency",
        "2",
        "--seconds",
        "0.3",
        "--out",
        &mcap,
    ];
    let ran = board.run("record", &run)?;
    assert_eq!((ran.status, ran.errors.as_str()), (Some(0), ""));
    let (status, stdout, stderr) = replay(folder.path(), "b.mcap")?;
    assert_eq!((status, stderr.as_str()), (Some(0), ""), "{stdout}");

    // 40 codes of one tension, in one tick in the middle of the run.
    let text = std::fs::read_to_string(&csv).expect("the recording");
    let mut lines: Vec<String> = text.lines().map(str::to_owned).collect();
    let column = |name: &str| lines[0].split(',').position(|column| column == name).expect("a column");
    let (code, time) = (column("f1_raw"), column("t_s"));
    let row = lines.len() - 2000;
    let mut cells: Vec<String> = lines[row].split(',').map(str::to_owned).collect();
    let tick = (cells[time].parse::<f64>().expect("a time") * 1e4).round() as u64;
    cells[code] = (cells[code].parse::<i32>().expect("a code") + 40).to_string();
    lines[row] = cells.join(",");
    std::fs::write(&csv, lines.join("\n") + "\n").expect("a file");
    let (status, stdout, stderr) = replay(folder.path(), "a.csv")?;
    assert_eq!((status, stdout.as_str(), stderr.lines().count()), (Some(1), "", 1), "{stderr}");
    let found: u64 = stderr
        .split("tick ")
        .nth(1)
        .and_then(|rest| rest.split(',').next()?.parse().ok())
        .expect("a tick in the message");
    assert!((tick..tick + 20).contains(&found), "changed at tick {tick}: {stderr}");
    Ok(())
}

/// Rows whose cell in `column` is neither empty nor 0, with the cell.
fn marked<'t>(text: &'t str, column: &str) -> Vec<(usize, &'t str)> {
    let names: Vec<&str> = text.lines().next().unwrap_or_default().split(',').collect();
    let place = |wanted| names.iter().position(|name| *name == wanted).expect("a column");
    let from_left = place(column);
    // The orders have commas of their own: what is behind them is counted from the end.
    let cell = |line: &'t str| {
        if from_left < place("order") {
            line.split(',').nth(from_left).unwrap_or_default()
        } else {
            line.rsplit(',').nth(names.len() - 1 - from_left).unwrap_or_default()
        }
    };
    let rows = text.lines().skip(1).map(cell).enumerate();
    rows.filter(|(_, cell)| !matches!(*cell, "" | "0")).collect()
}

/// A recording in which the ripple table acts, a transfer of an encoder fails, and a broken wire ends the run.
#[test]
fn a_fault_a_bus_error_and_the_ripple_table_are_computed_again() -> Outcome {
    let folder = tempfile::tempdir().expect("a folder");
    let path = |name: &str| folder.path().join(name).to_string_lossy().into_owned();
    let mut board = Plugged::new(Board::builder(&image::firmware()?).seed(6).build()?)?;
    let mut table = "angle_rad,torque_nm\n".to_owned();
    for row in 0..64 {
        let angle_rad = std::f64::consts::TAU * f64::from(row) / 64.0;
        let torque_nm = 0.1 * (7.0 * angle_rad).sin() + 0.05;
        writeln!(table, "{angle_rad},{torque_nm}").expect("text");
    }
    let file = path("table.csv");
    std::fs::write(&file, table).expect("a file");
    for arguments in [&["set", "correction.ripple_table.enable=1"][..], &["table", &file]] {
        let ran = board.run("params", arguments)?;
        assert_eq!((ran.status, ran.errors.as_str()), (Some(0), ""), "{arguments:?}");
    }
    let csv = path("a.csv");
    let run = ["--raw", "--reference", "sine", "--amplitude", "0.3", "--seconds", "2", "--out", &csv];
    // Counted from when the motor is driven: until then board time passes with how long the tool takes to start.
    let mut driven_s: Option<f64> = None;
    let mut steps = [
        (0.15, Injection::EncoderDmaError(EncoderAt::Input)),
        (0.25, Injection::EncoderDmaError(EncoderAt::Joint)),
        (0.4, Injection::TensionWire(TensionAt::F2, Rail::High)),
    ]
    .into_iter()
    .peekable();
    let ran = board.run_beside("record", &run, |board| {
        if driven_s.is_none() && board.pwm().duty.is_some() {
            driven_s = Some(board.time_s());
        }
        let is_due = |after_s: f64| driven_s.is_some_and(|driven_s| board.time_s() > driven_s + after_s);
        if let Some((_, injection)) = steps.next_if(|(after_s, _)| is_due(*after_s)) {
            board.inject(injection);
        }
    })?;
    assert_eq!((ran.status, ran.errors.lines().count()), (Some(1), 1), "{}", ran.errors);
    let text = std::fs::read_to_string(&csv).expect("the recording");
    let errors = ["in", "out"].map(|at| marked(&text, &format!("encoder_{at}_bus_error")));
    let tripped = marked(&text, "tripped");
    assert!(errors.iter().all(|errors| !errors.is_empty()), "{errors:?}");
    assert_eq!(tripped.len(), 1, "{tripped:?}");
    assert!(errors.iter().flatten().all(|(row, _)| *row < tripped[0].0), "{errors:?} {tripped:?}");
    let (status, stdout, stderr) = replay(folder.path(), "a.csv")?;
    assert_eq!((status, stderr.as_str()), (Some(0), ""), "{stdout}");
    let ticks: usize = stdout.split(' ').nth(1).and_then(|word| word.parse().ok()).expect("a number");
    // Also those behind the fault; it begins behind the first rows, with the first state that is known.
    let first =
        stdout.split("from tick ").nth(1).and_then(|rest| rest.split(' ').next()?.parse::<usize>().ok());
    let first = first.expect("the first tick");
    let times = marked(&text, "t_s");
    let (_, time_s) = times.iter().find(|(row, _)| *row == tripped[0].0).expect("the fault's row");
    let fault = (time_s.parse::<f64>().expect("a time") * 1e4).round() as usize;
    let rows = text.lines().count() - 1;
    let covered = ticks <= rows && first + ticks > fault && ticks + 500 > rows;
    assert!(covered, "{ticks} of {rows}, from tick {first} on, fault in tick {fault}: {stdout}");

    // Each of the three counts: with another one the replay parts from the board.
    let changed = |column: &str, row: usize, cell: &str| -> Outcome<String> {
        let mut lines: Vec<String> = text.lines().map(str::to_owned).collect();
        let place = lines[0].split(',').position(|name| name == column).expect("a column");
        let mut cells: Vec<&str> = lines[row + 1].split(',').collect();
        cells[place] = cell;
        lines[row + 1] = cells.join(",");
        std::fs::write(&csv, lines.join("\n") + "\n").expect("a file");
        let (status, _, stderr) = replay(folder.path(), "a.csv")?;
        assert_eq!((status, stderr.lines().count()), (Some(1), 1), "{column}: {stderr}");
        Ok(stderr)
    };
    let said = changed("tripped", tripped[0].0, "")?;
    assert!(said.contains(&format!("a.csv:{}: ", tripped[0].0 + 2)), "{said}");
    // A failed transfer leaves the frame before it, which counts once, with the mark and without; one more mark drops a fresh frame.
    changed("encoder_in_bus_error", errors[0][0].0 + 500, "1")?;
    std::fs::write(&csv, &text).expect("a file");
    let beside = path("a.recording.toml");
    let known = std::fs::read_to_string(&beside).expect("what is beside it");
    let group = known.find("[bowden.ripple_table]").or_else(|| known.find("[\"bowden.ripple_table\"]"));
    let group = group.unwrap_or_else(|| panic!("no table: {known}"));
    let end = known[group + 1..].find("\n[").map_or(known.len(), |end| group + 1 + end);
    std::fs::write(&beside, known[..group].to_owned() + &known[end..]).expect("a file");
    let (status, _, stderr) = replay(folder.path(), "a.csv")?;
    assert_eq!((status, stderr.lines().count()), (Some(1), 1), "{stderr}");
    assert!(stderr.contains("command_raw is") || stderr.contains("duty_raw is"), "{stderr}");
    Ok(())
}
