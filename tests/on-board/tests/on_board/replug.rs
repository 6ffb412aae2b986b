//! The plug of the board is pulled while the tool works with it, and put in again.

use std::fs;
use std::path::Path;

use bowden_board::Board;
use bowden_on_board_tests::tool::Plugged;
use bowden_on_board_tests::{Outcome, image};

use crate::monitor::{await_all, in_terminal, times_and_states};

/// Some thousand rows of a CSV file.
const THOUSANDS_OF_ROWS: u64 = 1_000_000;

/// Longer than a host may be silent \[s\].
const AWAY_S: f64 = 0.7;

/// A board in `place`, under a name that stays.
fn linked(place: &Path) -> Outcome<Plugged> {
    Plugged::linked(Board::builder(&image::firmware()?).build()?, place.join("port"))
}

/// Bytes of a file.
fn bytes(path: &Path) -> u64 {
    fs::metadata(path).map_or(0, |file| file.len())
}

/// Pulls the plug of a joint that moves: it is stopped soon, by the board alone.
fn pull(board: &mut Plugged) -> Outcome {
    assert!(board.board.pwm().duty.is_some(), "it moves");
    board.unplug();
    board.board.run_for(AWAY_S)?;
    assert_eq!(board.board.pwm().duty, None, "nobody is there");
    Ok(())
}

#[test]
fn a_recording_goes_on_with_the_joint_stopped_and_the_gap_marked() -> Outcome {
    for loses_supply in [false, true] {
        let folder = tempfile::tempdir().expect("a folder");
        let place = folder.path();
        let path = place.join("a.csv");
        let mut board = linked(place)?;
        let record = ["record", "--quiet", "--port", "port", "--timeout", "600", "--out", "a.csv"];
        let running = board.start(place, &[&record[..], &["--reference", "sine"]].concat())?;
        let long = || bytes(&path) > THOUSANDS_OF_ROWS || running.has_ended();
        board.attend("rows", long)?;
        pull(&mut board)?;
        if loses_supply {
            board.board.power_cycle()?;
        }
        board.replug()?;
        let before = bytes(&path);
        let longer = || bytes(&path) > before + THOUSANDS_OF_ROWS || running.has_ended();
        board.attend("rows behind the gap", longer)?;
        running.interrupt()?;
        let ran = board.finish(running)?;
        assert_eq!(ran.status, Some(3), "{ran:?}");

        let rows = times_and_states(&path);
        let apart = |pair: &[(f64, u32)]| (pair[1].0 - pair[0].0 - 1e-4).abs() > 1e-7;
        let gaps: Vec<usize> =
            (0..).zip(rows.windows(2)).filter(|(_, pair)| apart(pair)).map(|(row, _)| row).collect();
        let [gap] = gaps[..] else { panic!("{gaps:?}") };
        // Run; behind the gap fault, or off after the start of a board that lost its supply.
        let behind = if loses_supply { 0 } else { 6 };
        assert!(rows[..=gap].iter().all(|(_, state)| *state == 5) && gap > 1000, "{gap}");
        assert!(rows[gap + 1..].iter().all(|(_, state)| *state == behind) && rows.len() > gap + 1000);
        let mark = format!("{:?}", rows[gap].0);
        let expected = format!(
            "bowden: a.csv: the board was unplugged once, first after t_s = {mark}; the joint was stopped and is at rest \
             behind the gap\n"
        );
        assert!(
            ran.errors.starts_with(&expected) && ran.errors.contains(" samples lost in 1 gap"),
            "{ran:?}"
        );
        let marked = fs::read_to_string(place.join("a.recording.toml")).expect("metadata");
        assert!(marked.contains("bowden.unplugged") && marked.contains(&mark), "{marked}");
    }
    Ok(())
}

#[test]
fn a_plan_that_a_pulled_plug_stopped_goes_on_once_the_fault_is_cleared() -> Outcome {
    let folder = tempfile::tempdir().expect("a folder");
    let place = folder.path();
    let follow = |seconds: f64| {
        format!(
            "[[step]]\nkind = \"follow\"\nreference = \"sine\"\namplitude = 0.2\nfrequency_hz = 1.0\nseconds = {seconds:?}\n"
        )
    };
    let plan = ["schema = \"bowden-plan/1\"\n".to_owned(), follow(0.1), follow(1.0)].concat();
    fs::write(place.join("plan.toml"), plan).expect("a file");
    let mut board = linked(place)?;
    let run = ["run", "--quiet", "plan.toml", "--port", "port", "--timeout", "600", "--out", "out"];
    let run = [&run[..], &["--format", "csv"]].concat();
    let running = board.start(place, &run)?;
    let path = place.join("out/02-sine.csv");
    board.attend("rows", || bytes(&path) > THOUSANDS_OF_ROWS / 2 || running.has_ended())?;
    pull(&mut board)?;
    let ran = board.finish(running)?;
    assert_eq!((ran.status, ran.errors.lines().count()), (Some(1), 1), "{ran:?}");
    assert!(ran.errors.contains("check cable and supply"), "{}", ran.errors);
    let end = "1 of 2 steps are done; the same command goes on with 02-sine\n";
    assert!(ran.errors.ends_with(end), "{}", ran.errors);
    let kept = times_and_states(&place.join("out/02-sine.stopped-1.csv")).len();
    assert!((1000..10_000).contains(&kept), "{kept} rows");

    board.replug()?;
    let refused = board.run_in(place, &run)?;
    assert_eq!((refused.status, refused.errors.lines().count()), (Some(1), 1), "{refused:?}");
    assert!(refused.errors.starts_with("bowden: fault 31"), "{refused:?}");
    let cleared = board.run_in(place, &["faults", "--port", "port", "--timeout", "600", "--clear"])?;
    assert!(cleared.status == Some(0) && cleared.output.contains("31"), "{cleared:?}");
    let ran = board.run_in(place, &run)?;
    assert_eq!((ran.status, ran.errors.as_str()), (Some(0), ""));
    assert!(ran.output.starts_with("unnamed: 2 steps done, 1 of them before this start\n"), "{}", ran.output);
    let rows = times_and_states(&path);
    assert!(rows.len() == 10_000 && rows.iter().all(|(_, state)| *state == 5), "{} rows", rows.len());
    Ok(())
}

#[test]
fn the_monitor_shows_an_absence_and_what_it_left() -> Outcome {
    let folder = tempfile::tempdir().expect("a folder");
    let place = folder.path();
    let mut board = linked(place)?;
    let line = ["monitor", "--port", "port", "--timeout", "600", "--reference", "sine"];
    let mut screen = in_terminal(place, &line)?;
    for (awaited, keys) in [("nucleo-g474re", "a"), ("ready to move", "r"), ("run  ARMED", "")] {
        await_all(&mut board, &mut screen, &[awaited]);
        screen.press(keys);
    }
    pull(&mut board)?;
    screen.wait_for("waiting for the board; q quits");
    board.replug()?;
    await_all(&mut board, &mut screen, &["the board is back after ", "fault 31", "not armed"]);
    screen.press("c");
    await_all(&mut board, &mut screen, &["cleared", "no fault"]);
    screen.press("a");
    await_all(&mut board, &mut screen, &["ready to move", "ARMED"]);
    screen.press("q");
    board.attend("the end", || screen.has_ended())?;
    let (status, _) = screen.end();
    assert_eq!((status, board.board.pwm().duty), (0, None), "off at the end");
    Ok(())
}
