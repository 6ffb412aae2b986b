//! Raw recordings of the emulated board, computed again by `bowden replay-control`.

use std::path::Path;
use std::process::Command;

use bowden_board::Board;
use bowden_on_board_tests::tool::{Plugged, tool};
use bowden_on_board_tests::{Outcome, image};

/// Runs `bowden replay-control` in `folder`.
fn replay(folder: &Path, recording: &str) -> Outcome<(Option<i32>, String, String)> {
    let arguments = ["replay-control", recording];
    let output = Command::new(tool()?).args(arguments).current_dir(folder).output().expect("the tool starts");
    let text = |bytes: &[u8]| String::from_utf8_lossy(bytes).into_owned();
    Ok((output.status.code(), text(&output.stdout), text(&output.stderr)))
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

    // One step of one code of one tension, in the middle of the run.
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
