//! `virtual-bench`: writes recordings of a simulated joint with known, concealed physics.

use std::fs::{self, File};
use std::io::{self, BufWriter, Write};
use std::path::{Path, PathBuf};
use std::process::ExitCode;

use clap::error::ErrorKind;
use clap::{Args, Parser, Subcommand};
use thiserror::Error;
use virtual_bench::{BenchError, Case, Component, ConcealedEffect, MotionKind, Parameter};

/// Stand-in for a real double tendon-sheath joint.
///
/// It simulates tendons as masses and springs with bristle contact, motor, pulleys and arm as separate inertias, and
/// writes what a lab's 12-bit sensors would record. What it conceals is written to truth.json.
#[derive(Debug, Parser)]
#[command(name = "virtual-bench", version)]
struct Cli {
    #[command(subcommand)]
    command: Command,
}

#[derive(Debug, Subcommand)]
enum Command {
    /// Record a training and a heldout run: writes rig.toml, train.csv, heldout.csv and truth.json
    #[command(
        after_help = "Example:\n  virtual-bench record --effect joint_backlash:0.8 --seed 3 --out case-3\n\n\
        Exit status: 0 done, 1 a file could not be written, 2 bad usage."
    )]
    Record(RecordArgs),
    /// List the ids of all effects, their component, and those that no diagnosis can name
    Effects,
}

#[derive(Debug, Args)]
struct RecordArgs {
    /// Effect to conceal; strength 0 changes nothing, 1 (default) is a clear fault, 5 the most. May be repeated
    #[arg(long = "effect", value_name = "ID[:STRENGTH]")]
    effects: Vec<String>,
    /// Parameter that is wrong in rig.toml, true over claimed: mu, ea, f0, res, kt or m. May be repeated
    #[arg(long = "off", value_name = "NAME:RATIO")]
    off: Vec<String>,
    /// Seed of motion, noise, effect details and of how far the bench is off its rig file
    #[arg(long, default_value_t = 1)]
    seed: u64,
    /// Length of the training run in seconds
    #[arg(long, default_value_t = 40.0, allow_negative_numbers = true)]
    seconds: f64,
    /// Length of the heldout run in seconds
    #[arg(long, default_value_t = 20.0, allow_negative_numbers = true)]
    heldout_seconds: f64,
    /// Motion: lab, sine, triangle, staircase, multisine or rest. The heldout run uses other seeds, lab also another order
    #[arg(long, default_value = "lab", value_name = "NAME")]
    motion: String,
    /// How far the bench is off its rig file: standard deviation of E*A and F0 in per cent; others in proportion
    #[arg(long, default_value_t = 3.0, value_name = "P", allow_negative_numbers = true)]
    percent: f64,
    /// Folder to write to; it is made if it does not exist
    #[arg(long, value_name = "DIR")]
    out: PathBuf,
}

#[derive(Debug, Error)]
enum Failure {
    #[error("{0}")]
    Bench(#[from] BenchError),
    #[error("--{option} {got}: expected {expected}")]
    Option { option: &'static str, got: String, expected: &'static str },
    #[error("cannot write {}: {source}", path.display())]
    Write { path: PathBuf, source: io::Error },
}

impl Failure {
    fn status(&self) -> u8 {
        match self {
            Self::Write { .. } | Self::Bench(BenchError::Diverged { .. }) => 1,
            Self::Bench(_) | Self::Option { .. } => 2,
        }
    }
}

fn main() -> ExitCode {
    let cli = match Cli::try_parse() {
        Ok(cli) => cli,
        Err(error) if error.kind() == ErrorKind::DisplayHelpOnMissingArgumentOrSubcommand => {
            eprintln!("error: a command is missing, expected record or effects; see virtual-bench --help");
            return ExitCode::from(2);
        }
        Err(error) if error.use_stderr() => {
            let text = error.to_string();
            let first = text
                .lines()
                .map(str::trim)
                .filter(|line| !line.is_empty())
                .take_while(|line| !line.starts_with("Usage:"));
            eprintln!("{}; see virtual-bench --help", first.collect::<Vec<_>>().join(" "));
            return ExitCode::from(2);
        }
        Err(help) => {
            // Help and version go to standard output; a closed pipe there is the reader's choice.
            let _ = help.print();
            return ExitCode::SUCCESS;
        }
    };
    let done = match cli.command {
        Command::Record(args) => write_case(&args),
        Command::Effects => list_effects(),
    };
    match done {
        Ok(()) => ExitCode::SUCCESS,
        Err(failure) => {
            eprintln!("error: {failure}");
            ExitCode::from(failure.status())
        }
    }
}

fn write_case(args: &RecordArgs) -> Result<(), Failure> {
    let effects =
        args.effects.iter().map(|text| parse_effect(text, args.seed)).collect::<Result<Vec<_>, _>>()?;
    for (option, got, low, high, expected) in [
        ("seconds", args.seconds, 0.01, 3_600.0, "0.01 to 3600 seconds"),
        ("heldout-seconds", args.heldout_seconds, 0.01, 3_600.0, "0.01 to 3600 seconds"),
        ("percent", args.percent, 0.0, 20.0, "0 to 20"),
    ] {
        if !(low..=high).contains(&got) {
            return Err(Failure::Option { option, got: got.to_string(), expected });
        }
    }
    let kind = MotionKind::from_name(&args.motion)?;
    let name = args.out.file_name().map_or_else(|| "case".into(), |name| name.to_string_lossy());
    let mut case = Case::new(&name, effects, args.seed, args.percent);
    for text in &args.off {
        let (parameter, ratio) = parse_off(text)?;
        case = case.off(parameter, ratio);
    }
    let heldout_kind = if kind == MotionKind::Lab { MotionKind::LabHeldout } else { kind };
    let train = case.train(kind, args.seconds)?;
    let heldout = case.heldout(heldout_kind, args.heldout_seconds, args.seconds)?;

    fs::create_dir_all(&args.out).map_err(|source| Failure::Write { path: args.out.clone(), source })?;
    write_file(&args.out.join("rig.toml"), |out| out.write_all(case.rig_toml().as_bytes()))?;
    write_file(&args.out.join("truth.json"), |out| out.write_all(case.truth_json().as_bytes()))?;
    write_file(&args.out.join("train.csv"), |out| train.write_csv(out))?;
    write_file(&args.out.join("heldout.csv"), |out| heldout.write_csv(out))
}

/// `ID` or `ID:STRENGTH`.
fn parse_effect(text: &str, seed: u64) -> Result<ConcealedEffect, Failure> {
    let (id, strength) = match text.split_once(':') {
        None => (text, 1.0),
        Some((id, strength)) => {
            let strength = strength.parse().map_err(|_| Failure::Option {
                option: "effect",
                got: text.to_owned(),
                expected: "ID or ID:STRENGTH with a number such as joint_backlash:0.5",
            })?;
            (id, strength)
        }
    };
    Ok(ConcealedEffect::drawn(id, strength, seed)?)
}

/// `NAME:RATIO`.
fn parse_off(text: &str) -> Result<(Parameter, f64), Failure> {
    let parsed = text.split_once(':').and_then(|(name, ratio)| {
        let (_, parameter) = Parameter::NAMES.into_iter().find(|(known, _)| *known == name)?;
        let ratio: f64 = ratio.parse().ok()?;
        (ratio > 0.0 && ratio <= 10.0).then_some((parameter, ratio))
    });
    parsed.ok_or_else(|| Failure::Option {
        option: "off",
        got: text.to_owned(),
        expected: "mu, ea, f0, res, kt or m, a colon, and a ratio above 0 and up to 10, such as mu:0.5",
    })
}

fn write_file(
    path: &Path,
    write: impl FnOnce(&mut BufWriter<File>) -> io::Result<()>,
) -> Result<(), Failure> {
    let failed = |source| Failure::Write { path: path.to_path_buf(), source };
    let mut out = BufWriter::new(File::create(path).map_err(failed)?);
    write(&mut out).and_then(|()| out.flush()).map_err(failed)
}

fn list_effects() -> Result<(), Failure> {
    let mut text = String::new();
    for id in ConcealedEffect::IDS {
        let effect = ConcealedEffect::drawn(id, 1.0, 0)?;
        let component: Component = effect.component();
        let note = if effect.is_outside_catalogue() { "outside the catalogue" } else { "" };
        let line = format!("{id:<30}{:<14}{note}", component.as_str());
        text.push_str(line.trim_end());
        text.push('\n');
    }
    match io::stdout().write_all(text.as_bytes()) {
        Err(source) if source.kind() != io::ErrorKind::BrokenPipe => {
            Err(Failure::Write { path: PathBuf::from("standard output"), source })
        }
        _ => Ok(()),
    }
}
