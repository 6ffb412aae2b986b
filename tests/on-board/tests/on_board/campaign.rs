//! A sample of the campaign of faults (`cargo xtask faults`), and its judgement against faults that it must tell from each other.

use bowden_on_board_tests::campaign::case::{Case, drawn};
use bowden_on_board_tests::campaign::healthy::Healthy;
use bowden_on_board_tests::campaign::judgement::{Judged, Verdict, judge};
use bowden_on_board_tests::campaign::page::sums;
use bowden_on_board_tests::campaign::phase::Phase;
use bowden_on_board_tests::campaign::run::{run, stored};
use bowden_on_board_tests::parallel::in_parallel;
use bowden_on_board_tests::{Outcome, image};

/// Runs these cases beside the healthy runs of their phases.
fn judged(cases: &[Case]) -> Outcome<Vec<Judged>> {
    let elf = image::firmware()?;
    let flash = stored(&elf)?;
    let phases: Vec<Phase> =
        Phase::ALL.into_iter().filter(|phase| cases.iter().any(|case| case.phase == *phase)).collect();
    let healthy = Healthy::measure(&elf, &flash, &phases, 2)?;
    in_parallel(2, cases, |case| Ok(judge(case, &run(&elf, &flash, case, &healthy)?, &healthy)))?
        .into_iter()
        .collect()
}

/// Faults for which the board has no answer yet, each with its line in `tests/docs/faults.md`.
fn is_known_gap(case: &Case) -> bool {
    case.kinds.iter().any(|kind| kind.name == "bridge-leg")
}

#[test]
fn a_sample_of_the_campaign_is_named_or_harmless() -> Outcome {
    let fast = |case: &Case| matches!(case.phase, Phase::Fast | Phase::SelfTest);
    let cases: Vec<Case> =
        drawn(7, 60).into_iter().filter(|case| fast(case) && !is_known_gap(case)).take(12).collect();
    let judged = judged(&cases)?;
    println!("{}", sums(&judged));
    for case in &judged {
        println!("{}", case.line());
    }
    assert!(judged.len() == 12 && judged.iter().all(Judged::is_good));
    assert!(judged.iter().any(|case| matches!(case.verdict, Verdict::Named(_))));
    assert!(judged.iter().any(|case| case.verdict == Verdict::Harmless));
    Ok(())
}

/// What the judgement has to tell apart: a fault that is found, one that does nothing, one that nobody finds, and one that is not there.
#[test]
fn the_judgement_tells_found_harmless_silent_and_absent_faults_apart() -> Outcome {
    let mut cases: Vec<Case> = [
        "encoder-silent/fast/1",
        "host-not-reading/fast/1",
        "bus-reading/start/1001",
        "reset/fast/1",
        "motor-lead/fast/3",
    ]
    .iter()
    .map(|name| Case::named(name))
    .collect::<Outcome<_>>()?;
    // For good, whatever was drawn.
    for case in &mut cases {
        case.troubles[0].lasts_s = None;
    }
    // A fault in a place where nothing looks.
    let mut absent = Case::named("encoder-silent/fast/1")?;
    absent.troubles[0].act = bowden_on_board_tests::campaign::trouble::Act::Rubbish;
    cases.push(absent);
    let judged = judged(&cases)?;
    for case in &judged {
        println!("{}", case.line());
    }
    assert!(matches!(&judged[0].verdict, Verdict::Named(words) if words.contains("check bits")));
    assert_eq!(judged[1].verdict, Verdict::Harmless);
    assert!(matches!(&judged[2].verdict, Verdict::Silent(words) if words.contains("angle off")));
    assert!(matches!(&judged[3].verdict, Verdict::Named(words) if words.contains("started anew: Pin")));
    assert!(matches!(&judged[4].verdict, Verdict::Named(words) if words.contains("no current flows")));
    assert_eq!(judged[5].verdict, Verdict::Unproved);
    Ok(())
}
