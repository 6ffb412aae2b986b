//! The log of the release image, read by `bowden log` and made a recording by `bowden import`.

use std::path::Path;

use bowden_link::ToBoard;
use bowden_link::message::Provocation;
use bowden_on_board_tests::host::Host;
use bowden_on_board_tests::tool::{Ran, run_alone};
use bowden_on_board_tests::{Outcome, image};

use crate::stop::moving;

/// Runs the tool in `folder`.
fn bowden(folder: &Path, arguments: &[&str]) -> Outcome<(Option<i32>, String, String)> {
    let Ran { status, output, errors } = run_alone(folder, arguments)?;
    Ok((status, output, errors))
}

/// Board time between two looks of a probe that looks at every moment: two cycles of the core before its clock is set.
const EVERY_MOMENT_S: f64 = 1.25e-7;

/// Behind a panic's reset the block of the log still says how far the run before had written, and start-up gives it one word after
/// the other.
#[test]
fn a_probe_that_looks_at_every_moment_of_a_start_reads_what_was_written() -> Outcome {
    let mut host = moving()?;
    host.set("supervisor.allow_provoke", 1.0)?;
    host.board.deliver_faults(true);
    host.board.take_log_bytes();
    let begun = host.log().len();
    host.order(&ToBoard::Provoke(Provocation::Panic))?;
    let started = |host: &Host| host.log()[begun..].iter().any(|line| line.text.starts_with("bowden "));
    let end_s = host.board.time_s() + 0.3;
    while !started(&host) {
        assert!(host.board.time_s() < end_s, "no start in {:?}", &host.log()[begun..]);
        // The panic takes its time; the start is looked at closely.
        let step_s = if host.board.counters().boots == 1 { 2e-5 } else { EVERY_MOMENT_S };
        host.pass(step_s)?;
    }
    let malformed = host.log()[begun..].iter().filter(|line| line.text.contains("cannot be decoded")).count();
    assert_eq!(malformed, 0, "{:?}", &host.log()[begun..]);
    let bytes = host.board.take_log_bytes();
    assert!(bytes.len() < 256, "{} bytes of {} lines", bytes.len(), host.log().len() - begun);
    Ok(())
}

/// Two runs of the firmware: a joint that moves, a panic, and a second of rest behind the reset.
#[test]
fn the_tool_reads_the_log_and_makes_a_recording_of_it() -> Outcome {
    let mut host = moving()?;
    host.set("supervisor.allow_provoke", 1.0)?;
    host.run(2.2)?;
    host.board.deliver_faults(true);
    host.order(&ToBoard::Provoke(Provocation::Panic))?;
    host.await_reset(1, 0.3)?;
    host.run(1.2)?;
    let expected = host.log().to_vec();
    let folder = tempfile::tempdir().expect("a folder");
    let write = |name: &str, bytes: &[u8]| std::fs::write(folder.path().join(name), bytes).expect("a file");
    write("board.elf", &image::firmware()?);
    write("other.elf", &image::measure()?);
    write("run.rtt", &host.board.take_log_bytes());

    let (status, stdout, stderr) = bowden(folder.path(), &["log", "board.elf", "run.rtt"])?;
    assert_eq!((status, stderr.as_str()), (Some(0), ""));
    let lines: Vec<&str> = stdout.lines().collect();
    assert_eq!(lines.len(), expected.len(), "{stdout}");
    let mut offset_s: Option<f64> = None;
    let mut restarts = 0;
    for (line, expected) in lines.iter().zip(&expected) {
        let mut words = line.split_whitespace();
        let time_s: f64 = words.next().expect("a time").parse().expect("a number");
        assert_eq!(words.next(), Some(expected.level.as_str()), "{line}");
        assert!(line.ends_with(&expected.text), "{line}: {expected}");
        if expected.text.starts_with("bowden ") {
            restarts += 1;
            offset_s = None;
        }
        // The firmware's clock is the board's but for its beginning; the probe looks every 0.5 ms.
        let late_s = expected.at_s - time_s - *offset_s.get_or_insert(expected.at_s - time_s);
        assert!(late_s.abs() < 1.1e-3, "{line}: {expected}, {late_s} s off");
    }
    assert_eq!(restarts, 2);
    let ended = lines.iter().position(|line| line.contains("ended by Panic: ")).expect("the last words");
    assert!(
        lines[ended].contains(" error ") && lines[ended].contains("provoked by the host (host.rs:"),
        "{}",
        lines[ended]
    );
    assert!(lines[ended + 1].contains("boot by Software"), "{}", lines[ended + 1]);

    let (status, stdout, stderr) =
        bowden(folder.path(), &["log", "board.elf", "run.rtt", "--level", "warn", "--json"])?;
    assert_eq!((status, stderr.as_str()), (Some(0), ""));
    assert!(
        stdout.lines().all(|line| line.contains(r#""level":"warn""#) || line.contains(r#""level":"error""#))
    );
    assert!(stdout.contains(r#""level":"error","text":"ended by Panic"#), "{stdout}");

    let (status, stdout, stderr) =
        bowden(folder.path(), &["import", "--defmt", "board.elf", "run.rtt", "--out", "run.csv"])?;
    assert_eq!(stderr, "bowden: run.rtt: the board started again 1 times; times go on behind those before\n");
    assert_eq!(status, Some(3));
    assert_eq!(stdout, "run.csv: 4 rows of tick, limits, longest, lost, events before 2 of them\n");
    let again = ["import", "--defmt", "board.elf", "run.rtt", "--out", "again.csv", "--json"];
    let (status, stdout, _) = bowden(folder.path(), &again)?;
    assert_eq!(status, Some(3));
    let facts: serde_json::Value = serde_json::from_str(&stdout).expect("JSON");
    let columns = serde_json::json!(["tick", "limits", "longest", "lost"]);
    let expected =
        serde_json::json!({ "out": "again.csv", "rows": 4, "columns": columns, "rows_with_events": 2 });
    assert_eq!(facts, expected);
    let table = std::fs::read_to_string(folder.path().join("run.csv")).expect("the recording");
    let rows: Vec<Vec<&str>> = table.lines().skip(1).map(|line| line.splitn(6, ',').collect()).collect();
    let number = |row: usize, column: usize| rows[row][column].parse::<f64>().expect("a number");
    assert_eq!(table.lines().next(), Some("t_s,tick,limits,longest,lost,event"));
    // 10 000 ticks a second, counted by another timer than the times.
    let (elapsed_s, ticks) = (number(1, 0) - number(0, 0), number(1, 1) - number(0, 1));
    assert!((elapsed_s - ticks * 1e-4).abs() < 2e-4, "{elapsed_s} s, {ticks} ticks");
    assert!(rows[0][5].contains("info PretensionCheck -> Run"), "{:?}", rows[0]);
    assert!(
        rows[3][5].contains("error ended by Panic") && rows[3][5].contains("the board started again"),
        "{:?}",
        rows[3]
    );
    assert!(number(3, 0) > number(2, 0) + 1.0 && number(3, 1) < number(2, 1), "{rows:?}");

    for command in [
        &["log", "other.elf", "run.rtt"][..],
        &["import", "--defmt", "other.elf", "run.rtt", "--out", "x.csv"],
    ] {
        let (status, stdout, stderr) = bowden(folder.path(), command)?;
        assert_eq!((status, stdout.as_str(), stderr.lines().count()), (Some(2), "", 1), "{stderr}");
        assert!(stderr.starts_with("bowden: other.elf: ") && stderr.contains("give the "), "{stderr}");
    }
    assert!(!folder.path().join("x.csv").exists());
    Ok(())
}
