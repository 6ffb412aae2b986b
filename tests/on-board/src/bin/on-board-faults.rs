//! Runs a campaign of faults on the emulated board, prints a line a case and the table, and writes the page.

use std::path::PathBuf;
use std::process::ExitCode;
use std::time::{Duration, Instant};

use bowden_on_board_tests::campaign::case::{Case, drawn};
use bowden_on_board_tests::campaign::healthy::Healthy;
use bowden_on_board_tests::campaign::judgement::{Judged, judge};
use bowden_on_board_tests::campaign::page;
use bowden_on_board_tests::campaign::phase::Phase;
use bowden_on_board_tests::campaign::run::{run, stored};
use bowden_on_board_tests::corrections::write;
use bowden_on_board_tests::parallel::in_parallel;
use bowden_on_board_tests::program::{Program, value};
use bowden_on_board_tests::{Failure, Outcome, image};

const PROGRAM: Program = Program {
    name: "on-board-faults",
    help: "cargo xtask faults [--seed N] [--cases N] [--only PATTERN] [--jobs N] [--minutes N]

  --seed N        draws another campaign; 1 unless given
  --cases N       number of cases; 520 unless given
  --only PATTERN  only cases whose names contain it, or the one case of this name; no page is written then
  --jobs N        boards at a time; 2 unless given
  --minutes N     begin no case later than this",
    options: &["--seed", "--cases", "--only", "--jobs", "--minutes", "--page", "--provenance"],
};

/// What was asked for.
struct Options {
    seed: u64,
    cases: usize,
    only: Option<String>,
    jobs: usize,
    minutes: Option<u64>,
    page: Option<PathBuf>,
    provenance: String,
}

fn take(options: &mut Options, option: &str, given: String) -> Outcome {
    let number = || {
        let is_allowed = |number: &u64| (1..=1_000_000).contains(number);
        value(option, &given, "a whole number from 1 to 1000000", is_allowed)
    };
    match option {
        "--seed" => options.seed = number()?,
        "--cases" => options.cases = number()? as usize,
        "--jobs" => options.jobs = number()? as usize,
        "--minutes" => options.minutes = Some(number()?),
        "--only" => options.only = Some(given),
        "--page" => options.page = Some(given.into()),
        _ => options.provenance = given,
    }
    Ok(())
}

fn main() -> ExitCode {
    let options = Options {
        seed: 1,
        cases: 520,
        only: None,
        jobs: 2,
        minutes: None,
        page: None,
        provenance: "date and commit not given".into(),
    };
    PROGRAM.run(options, take, campaign)
}

/// The cases that were asked for.
fn wanted(options: &Options) -> Outcome<Vec<Case>> {
    let all = drawn(options.seed, options.cases);
    let Some(only) = &options.only else { return Ok(all) };
    let found: Vec<Case> = all.into_iter().filter(|case| case.name().contains(only.as_str())).collect();
    if found.is_empty() { Ok(vec![Case::named(only)?]) } else { Ok(found) }
}

fn campaign(options: &Options) -> Outcome {
    let cases = wanted(options)?;
    let elf = image::firmware()?;
    let flash = stored(&elf)?;
    let phases: Vec<Phase> =
        Phase::ALL.into_iter().filter(|phase| cases.iter().any(|case| case.phase == *phase)).collect();
    let healthy = Healthy::measure(&elf, &flash, &phases, options.jobs)?;
    let begun = Instant::now();
    let limit = options.minutes.map(Duration::from_mins);
    let judged: Vec<Judged> = in_parallel(options.jobs, &cases, |case| {
        if limit.is_some_and(|limit| begun.elapsed() > limit) {
            return None;
        }
        let judged = match run(&elf, &flash, case, &healthy) {
            Ok(run) => judge(case, &run, &healthy),
            Err(Failure(reason)) => Judged::broken(case, &reason),
        };
        println!("{}", judged.line());
        Some(judged)
    })?
    .into_iter()
    .flatten()
    .collect();
    println!("\n{}\n\n{}\n\n{}", page::table(&judged), page::sums(&judged), page::wrong(&judged));
    println!("{:.1} s for {} cases", begun.elapsed().as_secs_f64(), judged.len());
    if let (Some(path), None) = (&options.page, &options.only) {
        let found = page::written_by_hand(&std::fs::read_to_string(path).unwrap_or_default());
        write(path, &page::page(&judged, &healthy, cases.len(), &options.provenance, &found))?;
        println!("{}", path.display());
    }
    Ok(())
}
