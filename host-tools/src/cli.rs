//! The command line: what it accepts, and the one place where a process ends.

use std::ffi::OsString;
use std::io::Write;
use std::panic::PanicHookInfo;

use bowden_core::outcome::{ExitStatus, Failure, Outcome, one_line};
use clap::error::ErrorKind;
use clap::{CommandFactory, Parser, Subcommand};

use crate::commands::{
    check::CheckArguments, convert::ConvertArguments, fit::FitArguments, replay::ReplayArguments,
    simulate::SimulateArguments,
};
use crate::progress::{self, under_way};
use crate::usage;

/// Finds which physics a simulated tendon-driven joint lacks, from recordings of the real one
#[derive(Debug, Parser)]
#[command(name = "bowden", version, subcommand_required = true, arg_required_else_help = false)]
#[command(
    after_help = "Exit status: 0 done, 1 failed, 2 bad usage or unusable input, 3 done but something was lost \
                        or repaired (stderr says what)."
)]
struct Cli {
    #[command(subcommand)]
    command: Command,
    /// Threads to work with [default: one a processor]
    #[arg(long, global = true, value_name = "N", value_parser = clap::value_parser!(u16).range(1..=1024))]
    jobs: Option<u16>,
    /// No progress on stderr
    #[arg(long, global = true)]
    quiet: bool,
}

#[derive(Debug, Subcommand)]
enum Command {
    /// Read recordings and a rig and say what they hold
    Check(CheckArguments),
    /// Find which physics the simulation of a rig lacks
    Diagnose(crate::commands::diagnose::DiagnoseArguments),
    /// Diagnose every recording of a folder and put the benches side by side
    Survey(crate::commands::survey::SurveyArguments),
    /// Write a recording in another format
    Convert(ConvertArguments),
    /// Show what is in recordings: rate, gaps, faults, ranges, who made them, and a curve
    Info(crate::commands::info::InfoArguments),
    /// Take everything whole out of a recording that was cut or damaged
    Recover(crate::commands::recover::RecoverArguments),
    /// Simulate a rig with what went into a recording
    Replay(ReplayArguments),
    /// Compute the control ticks of a raw recording again and compare every output with the board's, bit for bit
    ReplayControl(crate::commands::replay_control::ReplayControlArguments),
    /// Recalibrate the parameters of a rig to recordings
    Fit(FitArguments),
    /// Simulate a rig from a reference: controller, motor, joint and sensors
    Simulate(SimulateArguments),
    /// Make rigs of MuJoCo models and URDFs
    Rig(crate::commands::neighbours::RigArguments),
    /// Write rigs as models of other simulators
    Export(crate::commands::neighbours::ExportArguments),
    /// Make effects of the catalogue from what diagnoses have found
    Effect(crate::commands::effect::EffectArguments),
    /// Run the joint on a driver board along a reference and record every control tick
    Record(crate::commands::record::RecordArguments),
    /// Carry out a plan on a driver board: home, checks, motions, pauses; a recording each and a summary
    Run(crate::commands::run::RunArguments),
    /// Show the joint on a driver board live, let it move by keys, and record meanwhile
    Monitor(crate::commands::monitor::MonitorArguments),
    /// Excite, diagnose, correct and verify the joint on a driver board, all in one
    Investigate(crate::commands::investigate::InvestigateArguments),
    /// Measure zeros, gains, wiring, encoders, pretension and motor of a driver board, one question at a time
    Calibrate(crate::commands::calibrate::CalibrateArguments),
    /// Show, change, load, save and store the parameters of a driver board
    Params(crate::commands::params::ParamsArguments),
    /// Show the fault of a driver board, what led to it, and clear it
    Faults(crate::commands::faults::FaultsArguments),
    /// Write an image into a driver board, verify it, start it, and print its log
    Flash(crate::commands::flash::FlashArguments),
    /// Print the log of a driver board's firmware, with time and level
    Log(crate::commands::log::LogArguments),
    /// Make a recording of a bench run that the firmware logged
    Import(crate::commands::import::ImportArguments),
    /// Say whether this machine and the board are ready for work, and what to do where they are not
    Doctor(crate::commands::doctor::DoctorArguments),
    /// Print what completes this command line in a shell
    Completions(crate::commands::shell::CompletionsArguments),
    /// Print this program's manual page, or write those of all commands
    Man(crate::commands::shell::ManArguments),
    /// Send a driver board from one state to another
    Send(crate::commands::send::SendArguments),
}

/// From now on a panic, which is a defect of this program, says one line and ends the process with exit status 1.
pub fn exit_on_panic() {
    std::panic::set_hook(Box::new(|panic| {
        say(&panic_line(panic));
        std::process::exit(ExitStatus::Failed as i32);
    }));
}

/// Runs a command line, says on stderr what there is to say, and returns the exit status.
pub fn run(arguments: impl IntoIterator<Item = OsString>) -> ExitStatus {
    let arguments: Vec<OsString> = arguments.into_iter().collect();
    let result = match Cli::try_parse_from(&arguments) {
        Ok(cli) => dispatch(&cli),
        Err(error) => not_understood(&error, &arguments),
    };
    match &result {
        Ok(outcome) => outcome.notes().iter().for_each(|note| say(note)),
        Err(failure) => say(failure.message()),
    }
    ExitStatus::from(&result)
}

fn dispatch(cli: &Cli) -> Result<Outcome, Failure> {
    if let Some(jobs) = cli.jobs {
        rayon::ThreadPoolBuilder::new()
            .num_threads(jobs.into())
            .build_global()
            .map_err(|error| Failure::failed(format!("--jobs {jobs}: {error}")))?;
    }
    match &cli.command {
        Command::Check(arguments) => arguments.run(cli.quiet),
        Command::Diagnose(arguments) => arguments.run(progress::for_stderr(cli.quiet).as_ref()),
        Command::Survey(arguments) => arguments.run(progress::for_stderr(cli.quiet).as_ref()),
        Command::Convert(arguments) => under_way(cli.quiet, "converting", || arguments.run()),
        Command::Info(arguments) => arguments.run(cli.quiet),
        Command::Recover(arguments) => arguments.run(cli.quiet),
        Command::Replay(arguments) => under_way(cli.quiet, "replaying", || arguments.run()),
        Command::ReplayControl(arguments) => under_way(cli.quiet, "replaying", || arguments.run()),
        Command::Fit(arguments) => arguments.run(progress::for_stderr(cli.quiet).as_ref()),
        Command::Simulate(arguments) => under_way(cli.quiet, "simulating", || arguments.run()),
        Command::Rig(arguments) => arguments.run(),
        Command::Export(arguments) => arguments.run(),
        Command::Effect(arguments) => arguments.run(),
        Command::Record(arguments) => arguments.run(progress::for_stderr(cli.quiet).as_ref()),
        Command::Run(arguments) => arguments.run(progress::for_stderr(cli.quiet).as_ref()),
        Command::Monitor(arguments) => arguments.run(),
        Command::Investigate(arguments) => arguments.run(progress::for_stderr(cli.quiet).as_ref()),
        Command::Calibrate(arguments) => arguments.run(),
        Command::Params(arguments) => arguments.run(),
        Command::Faults(arguments) => arguments.run(),
        Command::Flash(arguments) => arguments.run(progress::for_stderr(cli.quiet).as_ref()),
        Command::Log(arguments) => arguments.run(),
        Command::Import(arguments) => arguments.run(cli.quiet),
        Command::Doctor(arguments) => arguments.run(),
        Command::Completions(arguments) => arguments.run(Cli::command()),
        Command::Man(arguments) => arguments.run(Cli::command()),
        Command::Send(arguments) => arguments.run(),
    }
}

/// One line on stderr; a closed stderr is no reason to stop.
pub(crate) fn say(line: &str) {
    let _ = writeln!(std::io::stderr(), "bowden: {line}");
}

/// Help and version are results; anything else is bad usage, in one line.
fn not_understood(error: &clap::Error, arguments: &[OsString]) -> Result<Outcome, Failure> {
    if matches!(error.kind(), ErrorKind::DisplayHelp | ErrorKind::DisplayVersion) {
        crate::commands::print(&error.render().to_string())?;
        return Ok(Outcome::done());
    }
    Err(Failure::bad_input(usage::line(error, &Cli::command(), arguments)))
}

/// What panicked and where, in one line.
fn panic_line(panic: &PanicHookInfo) -> String {
    let what = panic.payload_as_str().unwrap_or("no message");
    let place = panic.location().map_or_else(String::new, |place| format!(" at {place}"));
    one_line(&format!("internal error{place}: {what}; please report this with the command line"))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_command_line_is_consistent() {
        Cli::command().debug_assert();
    }
}
