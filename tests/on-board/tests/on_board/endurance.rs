//! Samples of the long runs (`cargo xtask endure`), with the same checks.

use std::process::Command;

use bowden_on_board_tests::endurance::check::{Check, failed};
use bowden_on_board_tests::endurance::native::Plan;
use bowden_on_board_tests::endurance::{emulated, native};
use bowden_on_board_tests::{Outcome, image};

fn assert_all_hold(checks: &[Check]) {
    assert_eq!(failed(checks), [""; 0]);
}

/// In a process of its own, whose memory is its own.
#[test]
fn two_minutes_natively_lose_nothing_and_neither_drift_nor_grow() {
    let program = env!("CARGO_BIN_EXE_on-board-endurance");
    let folder = tempfile::tempdir().expect("a folder");
    let page = folder.path().join("endurance.md");
    let mut run = Command::new(program);
    run.args(["--native-hours", "0.03", "--emulated-seconds", "0", "--page"]).arg(&page);
    let done = run.output().expect("the program runs");
    let said = String::from_utf8_lossy(&done.stdout);
    assert!(done.status.success(), "{said}{}", String::from_utf8_lossy(&done.stderr));
    assert!(said.contains("ok  ticks received: 1200000 "), "{said}");
    let page = std::fs::read_to_string(page).expect("a page");
    assert!(page.contains("1200000 ticks were driven") && page.contains("| quarter |"), "{page}");
}

#[test]
fn every_counter_passes_its_end_while_the_joint_is_driven() -> Outcome {
    let run = native::run(&Plan::WRAP, &mut |_, _| ())?;
    // Two encoders, two borders each, once up and once down a period, in five periods; and one way home.
    assert!((40..=44).contains(&run.borders), "{} borders", run.borders);
    let passes = run.checks.iter().filter(|check| check.what.contains("passes of the end"));
    assert!(passes.filter(|check| check.value == "1").count() == 4, "{:?}", run.checks);
    assert_all_hold(&run.checks);
    Ok(())
}

#[test]
fn two_seconds_of_the_image_lose_nothing_and_do_not_drift() -> Outcome {
    let plan = emulated::Plan { spans: 2, parts: 1 };
    let run = emulated::run(&image::firmware()?, &plan, &mut |_, _, _| ())?;
    assert!(run.samples >= 40_000, "{} samples", run.samples);
    assert_all_hold(&run.checks);
    Ok(())
}
