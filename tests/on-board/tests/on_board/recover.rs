//! `bowden recover`: what is left of a recording of the release image whose program was killed.

use bowden_board::Board;
use bowden_core::recording::{ReadOptions, Recording};
use bowden_on_board_tests::tool::{Plugged, run_alone};
use bowden_on_board_tests::{Outcome, image};

#[test]
fn a_recording_of_a_killed_program_is_recovered_and_computed_again() -> Outcome {
    let folder = tempfile::tempdir().expect("a folder");
    let place = folder.path();
    let mut board = Plugged::new(Board::builder(&image::firmware()?).build()?)?;
    let record = board.arguments("record");
    let record: Vec<&str> = record.iter().map(String::as_str).collect();
    let run = ["--raw", "--home", "--out", "a.mcap", "--reference", "sine"];
    let running = board.start(place, &[&record[..], &run].concat())?;
    let path = place.join("a.mcap");
    let long = || std::fs::metadata(&path).is_ok_and(|file| file.len() > 300_000);
    board.attend("rows", || long() || running.has_ended())?;
    assert!(board.board.pwm().duty.is_some(), "it moves");
    running.kill()?;
    let ran = board.finish(running)?;
    assert_eq!((ran.status, ran.output.as_str()), (None, ""), "{ran:?}");
    // Nobody asks the board any more.
    board.board.run_for(0.7)?;
    assert_eq!(board.board.pwm().duty, None);

    let recovered = run_alone(place, &["recover", "a.mcap", "--out", "b.mcap"])?;
    assert!(recovered.status == Some(3) && recovered.errors.contains("the file ends early"), "{recovered:?}");
    let whole = Recording::load(&place.join("b.mcap"), &ReadOptions::default()).expect("a recording");
    assert!(whole.len() > 3000, "{} rows", whole.len());
    assert!(whole.t_s().windows(2).all(|pair| (pair[1] - pair[0] - 1e-4).abs() < 1e-8));
    // The board's own inputs and outputs stand in each row: one that is wrong or missing cannot be computed again.
    let computed = run_alone(place, &["replay-control", "b.mcap"])?;
    assert_eq!((computed.status, computed.errors.as_str()), (Some(0), ""), "{computed:?}");
    assert!(computed.output.contains("every output is the board's, bit for bit"), "{computed:?}");
    Ok(())
}
