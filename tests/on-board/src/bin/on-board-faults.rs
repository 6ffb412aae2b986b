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
use bowden_on_board_tests::{Failure, Outcome, fail, image};

const HELP: &str = "cargo xtask faults [--seed N] [--cases N] [--only PATTERN] [--jobs N] [--minutes N]

  --seed N        draws another campaign; 1 unless given
  --cases N       number of cases; 520 unless given
  --only PATTERN  only cases whose names contain it, or the one case of this name; no page is written then
  --jobs N        boards at a time; 2 unless given
  --minutes N     begin no case later than this";

/// What was asked for.
struct Options {
    seed: u64,
    cases: usize,
    only: Option<String>,
    jobs: usize,
    minutes: Option<u64>,
    page: Option<PathBuf>,
    provenance: String,
    help: bool,
}

fn options() -> Outcome<Options> {
    let mut options = Options {
        seed: 1,
        cases: 520,
        only: None,
        jobs: 2,
        minutes: None,
        page: None,
        provenance: "date and commit not given".into(),
        help: false,
    };
    let mut arguments = std::env::args().skip(1);
    while let Some(argument) = arguments.next() {
        if matches!(argument.as_str(), "--help" | "-h") {
            return Ok(Options { help: true, ..options });
        }
        let known = ["--seed", "--cases", "--only", "--jobs", "--minutes", "--page", "--provenance"];
        if !known.contains(&argument.as_str()) {
            return fail(format!("{argument}: not an option; --help lists them"));
        }
        let value = arguments.next().ok_or_else(|| Failure(format!("{argument}: expected a value")))?;
        let number = || {
            let parsed = value.parse::<u64>().ok().filter(|number| (1..=1_000_000).contains(number));
            parsed.ok_or_else(|| {
                Failure(format!("{argument} {value}: expected a whole number from 1 to 1000000"))
            })
        };
        match argument.as_str() {
            "--seed" => options.seed = number()?,
            "--cases" => options.cases = number()? as usize,
            "--jobs" => options.jobs = number()? as usize,
            "--minutes" => options.minutes = Some(number()?),
            "--only" => options.only = Some(value),
            "--page" => options.page = Some(value.into()),
            _ => options.provenance = value,
        }
    }
    Ok(options)
}

fn main() -> ExitCode {
    match options().and_then(|options| if options.help { help() } else { campaign(&options) }) {
        Ok(()) => ExitCode::SUCCESS,
        Err(failure) => {
            eprintln!("on-board-faults: {failure}");
            ExitCode::FAILURE
        }
    }
}

#[expect(clippy::unnecessary_wraps, reason = "the other way through the program has an outcome")]
fn help() -> Outcome {
    println!("{HELP}");
    Ok(())
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
