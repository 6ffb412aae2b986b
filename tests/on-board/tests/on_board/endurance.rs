//! Samples of the long runs (`cargo xtask endure`), with the same checks.

use bowden_on_board_tests::endurance::check::{Check, failed};
use bowden_on_board_tests::endurance::native::{Counters, Plan};
use bowden_on_board_tests::endurance::{emulated, native};
use bowden_on_board_tests::{Outcome, image};

fn assert_all_hold(checks: &[Check]) {
    assert_eq!(failed(checks), [""; 0]);
}

#[test]
fn two_minutes_natively_lose_nothing_and_do_not_drift() -> Outcome {
    let plan = Plan { spans: 2, parts: 2, start: Counters::default() };
    let run = native::run(&plan, &mut |_, _| ())?;
    assert_eq!((run.ticks, run.spans.len()), (1_000_000, 2));
    // Two encoders, two borders each, once up and once down a period, in five periods; and one way home.
    assert!((40..=44).contains(&run.borders), "{} borders", run.borders);
    assert_all_hold(&run.checks);
    Ok(())
}

#[test]
fn every_counter_passes_its_end_while_the_joint_is_driven() -> Outcome {
    let run = native::run(&Plan::WRAP, &mut |_, _| ())?;
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
