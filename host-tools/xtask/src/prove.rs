//! `cargo xtask prove`: the concealed-effects benchmark of the diagnosis, and with `--real` recordings of real
//! benches, with `--direct` joints without tendons, with `--studies` studies of three benches, with `--benches` benches of other sizes.

use std::ffi::OsString;
use std::path::{Path, PathBuf};
use std::process::Command;

use clap::Args;

use crate::process::{self, built, cargo, shared, target_folder, workspace};

/// What is handed on to the benchmark, or to what scores real recordings.
#[derive(Debug, Args)]
#[command(disable_help_flag = true)]
#[expect(clippy::struct_excessive_bools, reason = "flags of a command line")]
pub struct Options {
    /// Score and diagnose recordings of real benches instead, and write real-recordings.md; comes first.
    /// `prove --real --help` lists what else can be given
    #[arg(long)]
    real: bool,
    /// Hide effects in joints without tendons instead, and print what is said of each; comes first. `prove --direct --help` lists what
    /// else can be given
    #[arg(long, conflicts_with = "real")]
    direct: bool,
    /// Hide effects on some of the three benches of a study instead, and print what is said of each; comes first. `prove --studies --help`
    /// lists what else can be given
    #[arg(long, conflicts_with_all = ["real", "direct"])]
    studies: bool,
    /// Hide effects in benches of other sizes and proportions instead, and print what is said of each; comes first. `prove --benches --help`
    /// lists what else can be given
    #[arg(long, conflicts_with_all = ["real", "direct", "studies"])]
    benches: bool,
    /// With --real: folder of the data sets, instead of ../shared/data
    #[arg(long, value_name = "DIR", requires = "real")]
    data: Option<PathBuf>,
    /// Options of the benchmark; --help lists them
    #[arg(trailing_var_arg = true, allow_hyphen_values = true, value_name = "OPTIONS")]
    handed_on: Vec<OsString>,
}

/// Page that a complete run writes, below the workspace.
const PROOF: &str = "host-tools/docs/proof.md";

/// Page that a complete run on real recordings writes, below the workspace.
const REAL: &str = "host-tools/docs/real-recordings.md";

/// Builds the program and what proves it, and runs the latter.
///
/// # Errors
/// When something cannot be built, or the benchmark fails.
pub fn run(options: &Options) -> Result<(), String> {
    if options.real {
        return run_real(options);
    }
    if options.direct {
        return run_program(options, "direct_drives");
    }
    if options.studies {
        return run_program(options, "studies");
    }
    if options.benches {
        return run_program(options, "other_benches");
    }
    for kind in ["--real", "--direct", "--studies", "--benches"] {
        if options.handed_on.iter().any(|option| option == kind) {
            return Err(format!("{kind} comes first: `cargo xtask prove {kind} ...`"));
        }
    }
    let programs = ["--package", "bowden", "--package", "bowden-tests", "--bin", "bowden", "--bin", "prove"];
    process::run(cargo(&["build", "--release"]).args(programs), &[0])?;
    let mut command =
        benchmark(&options.handed_on, &built("release", "prove")?, &built("release", "bowden")?)?;
    let status = command.status().map_err(|error| process::unstarted(&command, &error))?;
    if status.success() {
        Ok(())
    } else {
        Err(format!("prove ended with {status}; what it says above tells why"))
    }
}

/// Runs a program of the tests that hides effects and prints a table.
///
/// # Errors
/// When something cannot be built, or a diagnosis fails.
fn run_program(options: &Options, program: &str) -> Result<(), String> {
    let package = ["--package", "bowden-tests", "--bin", program];
    process::run(cargo(&["build", "--release"]).args(package), &[0])?;
    let mut command = Command::new(built("release", program)?);
    process::run(command.args(&options.handed_on), &[0])
}

/// Scores and diagnoses recordings of real benches.
///
/// # Errors
/// When the data sets are not there, something cannot be built, or a mark is missed.
fn run_real(options: &Options) -> Result<(), String> {
    let data = options.data.clone().unwrap_or_else(|| shared().join("data"));
    let asks_for_help = options.handed_on.iter().any(|option| option == "--help" || option == "-h");
    if !data.is_dir() && !asks_for_help {
        return Err(format!(
            "{}: no such folder, expected the one that holds the data sets; name it with `prove --real --data DIR`",
            data.display()
        ));
    }
    process::run(&mut cargo(&["build", "--release", "--package", "bowden-real-data"]), &[0])?;
    let mut command = real(options, &data, &built("release", "real_recordings")?);
    let status = command.status().map_err(|error| process::unstarted(&command, &error))?;
    match status.code() {
        Some(0) => Ok(()),
        Some(1) => Err("a mark is missed; the last lines above say which".to_owned()),
        _ => Err(format!("real_recordings ended with {status}; what it says above tells why")),
    }
}

/// What scores real recordings, with the places of this workspace; what the user gives comes later.
fn real(options: &Options, data: &Path, program: &Path) -> Command {
    let mut command = Command::new(program);
    command.arg("--page").arg(workspace().join(REAL));
    command.arg("--provenance").arg(provenance());
    command.arg(data).args(&options.handed_on);
    command
}

/// Date and commit of what is run.
pub fn provenance() -> String {
    let said = |program: &str, arguments: &[&str]| {
        let mut command = Command::new(program);
        process::output(command.current_dir(workspace()).args(arguments))
            .ok()
            .map(|text| text.trim().to_owned())
    };
    let date = said("date", &["-u", "+%Y-%m-%d"]).unwrap_or_else(|| "date not known".to_owned());
    let commit = said("git", &["rev-parse", "--short=12", "HEAD"]).map_or_else(
        || "commit not known".to_owned(),
        |commit| {
            let changes = said("git", &["status", "--porcelain", "--untracked-files=no"]);
            let with = if changes.is_some_and(|changes| changes.is_empty()) { "" } else { " with changes" };
            format!("commit {commit}{with}")
        },
    );
    format!("{date}, {commit}")
}

/// The benchmark with the places of this workspace; what the user gives comes later and wins.
fn benchmark(options: &[OsString], prove: &Path, bowden: &Path) -> Result<Command, String> {
    let mut command = Command::new(prove);
    command.arg("--bowden").arg(bowden);
    command.arg("--results").arg(target_folder()?.join("prove"));
    command.arg("--proof").arg(workspace().join(PROOF));
    command.args(options);
    Ok(command)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The options as the command line gives them.
    #[derive(clap::Parser)]
    struct Line {
        #[command(flatten)]
        options: Options,
    }

    fn parsed(words: &[&str]) -> Options {
        use clap::Parser;
        let line = ["prove"].iter().chain(words);
        Line::try_parse_from(line).map(|line| line.options).unwrap()
    }

    #[test]
    fn real_recordings_are_told_from_the_benchmark() {
        let options = parsed(&["--real", "--data", "there", "--only", "odrive-cogging"]);
        assert!(options.real);
        let command = real(&options, options.data.as_deref().unwrap(), Path::new("scores"));
        let arguments: Vec<_> = command.get_args().collect();
        assert_eq!(arguments[arguments.len() - 3..], ["there", "--only", "odrive-cogging"]);
        assert!(arguments.iter().any(|argument| Path::new(argument).ends_with(REAL)));

        let options = parsed(&["--quick", "--seed", "3"]);
        assert!(!options.real);
        assert_eq!(options.handed_on, ["--quick", "--seed", "3"].map(OsString::from));
    }

    #[test]
    fn a_folder_that_is_not_there_is_named_in_one_line() {
        let reason = run(&parsed(&["--real", "--data", "/nowhere/at-all"])).unwrap_err();
        assert!(reason.starts_with("/nowhere/at-all: no such folder"), "{reason}");
        assert!(!reason.contains('\n'));
        let reason = run(&parsed(&["--quick", "--real"])).unwrap_err();
        assert!(reason.starts_with("--real comes first"), "{reason}");
        assert!(parsed(&["--direct", "--seed", "3"]).direct);
        assert!(parsed(&["--studies", "--seed", "3"]).studies);
        assert!(parsed(&["--benches", "--seed", "3"]).benches);
        let reason = run(&parsed(&["--quick", "--direct"])).unwrap_err();
        assert!(reason.starts_with("--direct comes first"), "{reason}");
    }

    #[test]
    fn what_the_user_gives_comes_after_the_places_of_the_workspace() {
        let given = ["--quick", "--proof", "elsewhere.md"].map(OsString::from);
        let command = benchmark(&given, Path::new("prove"), Path::new("the-binary")).unwrap();
        let arguments: Vec<_> = command.get_args().collect();
        assert_eq!(arguments[..2], ["--bowden", "the-binary"]);
        assert_eq!(arguments[arguments.len() - 3..], given.each_ref().map(OsString::as_os_str));
        assert!(arguments.iter().any(|argument| Path::new(argument).ends_with(PROOF)));
    }
}
