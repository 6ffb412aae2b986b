//! Prints what each correction gains on the emulated board, and writes the page.
//!
//! `on-board-corrections FOLDER [--page FILE] [--provenance TEXT] [--resume] [--undiagnosed] [NAME...]`: recordings, diagnoses and
//! finished rows go to FOLDER. With `--resume` rows that are there are not measured again, whatever build they are of.

use std::path::{Path, PathBuf};
use std::process::ExitCode;

use bowden_on_board_tests::corrections::page::{HEAD, Row, page};
use bowden_on_board_tests::corrections::{Case, cases, write};
use bowden_on_board_tests::parallel::in_parallel;
use bowden_on_board_tests::{Failure, Outcome, fail, image};

/// Cases that are run at the same time; a diagnosis takes all processors by itself.
const AT_ONCE: usize = 2;

/// What was asked for.
#[derive(Default)]
struct Options {
    folder: PathBuf,
    page: Option<PathBuf>,
    provenance: String,
    resume: bool,
    undiagnosed: bool,
    names: Vec<String>,
}

fn options() -> Outcome<Options> {
    let mut options = Options { provenance: "date and commit not given".into(), ..Options::default() };
    let mut arguments = std::env::args().skip(1);
    options.folder = arguments.next().map(PathBuf::from).ok_or(Failure("expected a folder".into()))?;
    while let Some(argument) = arguments.next() {
        let mut value = || arguments.next().ok_or(Failure(format!("{argument}: expected a value")));
        match argument.as_str() {
            "--page" => options.page = Some(value()?.into()),
            "--provenance" => options.provenance = value()?,
            "--resume" => options.resume = true,
            "--undiagnosed" => options.undiagnosed = true,
            name if name.starts_with('-') => return fail(format!("{name}: not an option")),
            _ => options.names.push(argument),
        }
    }
    Ok(options)
}

fn main() -> ExitCode {
    match options().and_then(|options| run(&options)) {
        Ok(()) => ExitCode::SUCCESS,
        Err(failure) => {
            eprintln!("on-board-corrections: {failure}");
            ExitCode::FAILURE
        }
    }
}

fn run(options: &Options) -> Outcome {
    let elf = image::firmware()?;
    let wanted = |case: &Case| {
        options.names.is_empty() || options.names.iter().any(|name| case.name.contains(name.as_str()))
    };
    let cases: Vec<Case> = cases::all().into_iter().filter(wanted).collect();
    if cases.is_empty() {
        return fail(format!("no effect is named {}", options.names.join(", ")));
    }
    println!("{HEAD}");
    let rows = in_parallel(AT_ONCE, &cases, |case| {
        let row = measured(case, &elf, options);
        match &row {
            Ok(row) => println!("{}", row.line()),
            Err(failure) => println!("{}: {failure}", case.name),
        }
        row
    })?;
    let rows: Vec<Row> = rows.into_iter().collect::<Outcome<_>>()?;
    if let Some(path) = &options.page {
        write(path, &page(&rows, &options.provenance))?;
        println!("{}", path.display());
    }
    Ok(())
}

fn measured(case: &Case, elf: &[u8], options: &Options) -> Outcome<Row> {
    let folder: &Path = &options.folder.join(case.name.replace(' ', "-"));
    if let Some(row) = options.resume.then(|| Row::kept(folder)).transpose()?.flatten() {
        return Ok(row);
    }
    let stored = case.stored(elf)?;
    let without = case.without()?;
    let before = case.errors(elf, &stored)?;
    let with_truth = case.errors(elf, &case.truly_corrected(elf, &stored, folder)?)?;
    let diagnosed = if options.undiagnosed {
        Err("not asked for".to_owned())
    } else {
        case.diagnosed(elf, &stored, folder)
            .and_then(|found| {
                let corrected = case.from_rig(elf, &stored, &found.rig)?;
                Ok((case.errors(elf, &corrected)?, found.summary))
            })
            .map_err(|Failure(text)| text)
    };
    let row = Row {
        name: case.name.to_owned(),
        shown: case.shown.to_owned(),
        provenance: options.provenance.clone(),
        without,
        before,
        with_truth,
        diagnosed,
    };
    // A row without a diagnosis is not what a resumed run is to have.
    if !options.undiagnosed {
        row.keep(folder)?;
    }
    Ok(row)
}
