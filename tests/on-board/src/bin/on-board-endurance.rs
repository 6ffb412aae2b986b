//! Drives the joint for a day natively and for ten minutes on the emulated board, prints a line a span and the checks, and writes the page.

use std::path::{Path, PathBuf};
use std::process::ExitCode;
use std::time::Instant;

use bowden_on_board_tests::corrections::write;
use bowden_on_board_tests::endurance::check::{Check, failed};
use bowden_on_board_tests::endurance::drift::Span;
use bowden_on_board_tests::endurance::page::{self, Sections};
use bowden_on_board_tests::endurance::{emulated, native};
use bowden_on_board_tests::program::{Program, value};
use bowden_on_board_tests::{Outcome, fail, image};

const PROGRAM: Program = Program {
    name: "on-board-endurance",
    help: "cargo xtask endure [--native-hours H] [--emulated-seconds S]

  --native-hours H      hours of board time natively; 24 unless given, 0 for none. A run in which all counters wrap goes before
  --emulated-seconds S  seconds of board time on the emulated board; 600 unless given, 0 for none

A run that is left out keeps its section of the page.",
    options: &["--native-hours", "--emulated-seconds", "--page", "--provenance"],
};

/// What was asked for.
struct Options {
    native_hours: f64,
    emulated_seconds: usize,
    page: Option<PathBuf>,
    provenance: String,
}

fn take(options: &mut Options, option: &str, given: String) -> Outcome {
    match option {
        "--native-hours" => {
            let is_allowed = |hours: &f64| (0.0..=1000.0).contains(hours);
            options.native_hours = value(option, &given, "hours from 0 to 1000", is_allowed)?;
        }
        "--emulated-seconds" => {
            let expected = "a whole number of seconds up to 86400";
            options.emulated_seconds = value(option, &given, expected, |seconds| *seconds <= 86_400)?;
        }
        "--page" => options.page = Some(given.into()),
        _ => options.provenance = given,
    }
    Ok(())
}

fn main() -> ExitCode {
    let options = Options {
        native_hours: 24.0,
        emulated_seconds: 600,
        page: None,
        provenance: "date and commit not given".into(),
    };
    PROGRAM.run(options, take, endure)
}

fn error_line(kind: &str, number: usize, span: &Span) -> String {
    format!(
        "{kind} {number:>3}: RMS {:.4} mrad, mean {:+.4}, largest {:.3}",
        1e3 * span.rms_rad,
        1e3 * span.mean_rad,
        1e3 * span.largest_rad
    )
}

/// Prints the checks and keeps those that do not hold.
fn print(name: &str, checks: &[Check], begun: Instant, all_failed: &mut Vec<String>) {
    println!("\n{name}, {:.0} s:", begun.elapsed().as_secs_f64());
    for Check { what, value, allowed, holds } in checks {
        println!("  {} {what}: {value} (allowed: {allowed})", if *holds { "ok " } else { "NOT" });
    }
    println!();
    all_failed.extend(failed(checks).into_iter().map(|check| format!("{name}: {check}")));
}

/// Puts sections into the page; the others stay.
fn put(page: Option<&Path>, change: impl FnOnce(&mut Sections)) -> Outcome {
    let Some(path) = page else { return Ok(()) };
    let mut sections = Sections::of(&std::fs::read_to_string(path).unwrap_or_default());
    change(&mut sections);
    write(path, &sections.page())?;
    println!("{}", path.display());
    Ok(())
}

fn endure(options: &Options) -> Outcome {
    let Options { native_hours, emulated_seconds, page, provenance, .. } = options;
    let mut failed = Vec::new();
    if *native_hours > 0.0 {
        let begun = Instant::now();
        let run = native::run(&native::Plan::WRAP, &mut |number, span| {
            println!("{}", error_line("40 s", number, span));
        })?;
        print("counters at their ends, natively", &run.all_checks(), begun, &mut failed);
        let wrap = page::native(&run, "40 s", provenance);
        put(page.as_deref(), |sections| sections.wrap = Some(wrap))?;

        let plan = native::Plan::hours(*native_hours);
        let name = if plan.parts == native::PARTS_AN_HOUR { "hour" } else { "quarter" };
        let begun = Instant::now();
        let run = native::run(&plan, &mut |number, span| {
            println!("{}", error_line(name, number, span));
        })?;
        print(&format!("{native_hours} h natively"), &run.all_checks(), begun, &mut failed);
        let native = page::native(&run, name, provenance);
        put(page.as_deref(), |sections| sections.native = Some(native))?;
    }
    if *emulated_seconds > 0 {
        let plan = emulated::Plan::seconds(*emulated_seconds);
        let name = if plan.parts == 60 { "minute" } else { "quarter" };
        let begun = Instant::now();
        let run = emulated::run(&image::firmware()?, &plan, &mut |number, span, upkeep| {
            println!(
                "{}, longest tick {} cycles, stack {} bytes, {} KiB here",
                error_line(name, number, span),
                upkeep.busy.max,
                upkeep.stack_bytes,
                upkeep.memory_kib
            );
        })?;
        print(&format!("{emulated_seconds} s on the emulated board"), &run.all_checks(), begun, &mut failed);
        let emulated = page::emulated(&run, name, provenance);
        put(page.as_deref(), |sections| sections.emulated = Some(emulated))?;
    }
    if failed.is_empty() { Ok(()) } else { fail(failed.join("; ")) }
}
